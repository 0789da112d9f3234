// Which dataset is shown: the user's choice, a link or the server's list -> `open` and the view
// that goes with it; `opened` and refusals -> what is open, or what takes its place.
import { failureNote, type DatasetList } from "./dataset_list";
import { fitView, shapeOf } from "../view/fit_view";
import type {
  ClientMessage,
  Dataset,
  DatasetSummary,
  ErrorMessage,
  OpenedMessage,
  View,
} from "../wire/protocol";
import type { Status } from "./status";
import type { ViewModel } from "../view/view_model";
import type { Outgoing, Patch } from "../view/view_state";

export interface DatasetOpenerHost {
  sendMessage(message: ClientMessage): void;
  send(outgoing: Outgoing[]): void;
  firstView(explicit: View): View; // in the window's size
  halt(): void; // stops playback and line motion
  describe(dataset: Dataset): void; // it is open, though the view may still be of another
  opened(anew: boolean, changed: boolean): void; // anew: of another shape; changed: its files
  refresh(): void;
  mark(): void; // another view was requested
  empty(): void; // nothing to show: the user must choose or add a dataset
}

const busyCodes = [429, 503]; // the server is busy: says nothing about the dataset

export class DatasetOpener {
  private openId = 0;
  private shownId = 0; // of the `open` whose dataset is shown
  private openingId = ""; // the dataset of the newest `open`
  private before: View | undefined; // of what was shown when another was asked for
  private abandonedId = 0; // of the newest `open` that was cancelled
  private waits = false; // `opened` has not come yet
  private abandonedRev = 0; // the last rev of a view whose dataset could not be opened
  private restored = new Set<number>(); // revs of the view that took a refused one's place

  constructor(
    private readonly host: DatasetOpenerHost,
    private readonly model: ViewModel,
    private readonly status: Status,
    readonly list: DatasetList,
  ) {}

  get waiting(): boolean {
    return this.waits;
  }

  choose(id: string): void {
    if (id === "") return;
    if (id === this.model.open?.id) {
      if (this.awaitsOther()) this.cancel(this.model.state.settled);
      return;
    }
    this.status.clearError();
    this.request(id, this.model.state.replace(this.host.firstView({ dataset: id })));
  }

  // A whole view that may be of another dataset; true if that is asked for.
  follow(view: View): boolean {
    const id = view.dataset ?? this.model.open?.id ?? this.list.best();
    if (id === undefined) return false;
    if (id === this.model.open?.id) {
      if (this.awaitsOther()) this.abandon();
      return false;
    }
    this.request(id, this.model.state.replace({ ...view, dataset: id }));
    return true;
  }

  // Cancels the last request: back to the view before. `settled` is the
  // newest that was drawn. False: it is of what is open already.
  cancel(settled: View): boolean {
    const { model, status } = this;
    status.loaded();
    const id = model.open?.id;
    if (this.waits) {
      this.abandon();
      if (id !== undefined) {
        this.host.send(model.state.replace(this.viewBefore(id)));
        this.host.refresh();
        return true;
      }
    } else if (settled.dataset !== undefined) {
      return this.follow(settled);
    }
    this.host.empty();
    return true;
  }

  // Another dataset than the one that is shown is being opened.
  private awaitsOther(): boolean {
    return this.waits && this.openingId !== this.model.open?.id;
  }

  // The open request is abandoned.
  private abandon(): void {
    const { model, status } = this;
    status.loaded();
    this.waits = false;
    this.abandonedId = this.openId;
    this.abandonedRev = model.state.rev;
    this.list.show(model.open?.id ?? "");
    status.announce("live");
  }

  // Of what is shown, as it was when another was asked for.
  private viewBefore(id: string): View {
    return this.host.firstView(this.before ?? { dataset: id });
  }

  // Whether to show progress of this request.
  awaits(id: number | null): boolean {
    return id === null || (this.waits && id === this.openId);
  }

  // A new session has no state: it is sent the dataset and the whole view.
  begin(datasets: DatasetSummary[]): boolean {
    const { model, list } = this;
    list.set(datasets);
    // A server that came back with other datasets does not have what was shown.
    if (model.open !== null && !list.has(model.open.id)) model.open = null;
    const wanted = model.state.document.dataset;
    const id = wanted ?? list.first();
    list.show(id ?? "");
    if (id === undefined) {
      this.status.announce("live, without a dataset");
      this.host.empty();
      return false;
    }
    // As large as this server draws and the window is by now.
    model.state.change(this.host.firstView({ dataset: id }) as Patch);
    this.request(id, [model.state.restate()]);
    return true;
  }

  // Comes unasked too, when the files of what is shown have changed.
  onOpened({ id, dataset }: OpenedMessage): void {
    const { model, status } = this;
    const changed = !this.waits && dataset.id === model.open?.id;
    if (!changed && !(this.waits && id === this.openId)) return;
    const anew = changed || model.open === null || shapeOf(model.open) !== shapeOf(dataset);
    model.open = dataset;
    if (!changed) this.shownId = id;
    this.waits = false;
    status.clearError("open");
    status.loaded();
    status.announce("live");
    this.list.learn(dataset);
    this.list.show(dataset.id);
    this.host.describe(dataset);
    this.restore();
    if (changed) this.followFiles(dataset);
    if (dataset.state === "failed") status.error("file", failureNote(dataset));
    else status.clearError("file");
    this.host.opened(anew, changed);
  }

  // Whether the error was of a dataset; then all is done.
  onError(message: ErrorMessage, text: string): boolean {
    if (message.id !== undefined && message.id === this.abandonedId) return true;
    if (this.waits && message.id === this.openId) {
      this.failed(text, message.problem.status);
    } else if (message.rev !== undefined && message.rev <= this.abandonedRev) {
      this.model.state.refuse(message.rev); // reported already: the dataset could not be opened
    } else if (message.rev === undefined && this.asked(message.id)) {
      this.status.error("file", text); // its new files cannot be read; the old picture stays
      if (this.model.open !== null) this.list.failed(this.model.open.id, text);
    } else {
      return false;
    }
    return true;
  }

  private asked(id: number | undefined): boolean {
    return id !== undefined && (id === this.openId || id === this.shownId);
  }

  // A patch of this rev was refused. If that was a whole view (a link with a value of another
  // release, say), its dataset with the defaults is better than nothing; but if those were refused,
  // to ask for them again would never end.
  onRefused(rev: number): void {
    if (!this.waits && !this.restored.has(rev)) this.restore();
  }

  private restore(): void {
    const { model, host } = this;
    if (model.open === null || model.state.document.dataset === model.open.id) return;
    this.takePlace(host.firstView({ dataset: model.open.id }));
  }

  private takePlace(view: View): void {
    const { model, host } = this;
    this.status.holdError();
    const outgoing = model.state.replace(view);
    this.restored = new Set(outgoing.map(({ rev }) => rev));
    host.send(outgoing);
    host.refresh();
  }

  // The view goes first, so that the first picture already shows it; `open` only requests what
  // the dataset holds.
  private request(id: string, outgoing: Outgoing[]): void {
    const { settled, document } = this.model.state;
    const shown = this.model.open?.id;
    this.before = [settled, document, this.before].find((view) => view?.dataset === shown);
    this.openId += 1;
    this.openingId = id;
    this.waits = true;
    this.host.halt();
    this.status.startLoading(`opening ${id}…`);
    this.host.send(outgoing);
    this.host.sendMessage({ type: "open", id: this.openId, dataset: id });
    this.host.mark();
  }

  // What the old files were asked for is asked of the new ones, as far as they have it.
  private followFiles(dataset: Dataset): void {
    for (const topic of ["view", "server"]) this.status.clearError(topic);
    this.model.fitDrawn(dataset);
    const explicit = this.model.state.document;
    const fitted = fitView(explicit, dataset);
    if (JSON.stringify(fitted) !== JSON.stringify(explicit)) {
      this.host.send(this.model.state.replace(fitted));
    }
  }

  private failed(text: string, code: number): void {
    const { model, status } = this;
    this.waits = false;
    status.loaded();
    status.error("dataset", text);
    const failed = this.openingId;
    this.abandonedRev = model.state.rev;
    if (!busyCodes.includes(code)) this.list.failed(failed, text);
    const fallback = model.open?.id ?? this.list.best();
    this.list.show(fallback ?? "");
    if (fallback === undefined || fallback === failed) {
      if (model.open === null) this.host.empty();
      return;
    }
    if (model.open !== null) {
      status.announce("live");
      this.takePlace(this.viewBefore(model.open.id));
    } else {
      this.request(fallback, model.state.replace(this.host.firstView({ dataset: fallback })));
    }
  }
}
