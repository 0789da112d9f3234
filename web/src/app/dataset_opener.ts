// Selects the displayed dataset: the user's choice, a link or the server's list -> an `open`
// message and the matching view; `opened` and refusals -> the open dataset or its replacement.
import { failureNote, type DatasetList } from "./dataset_list";
import { entryOf, entryText, type Entry } from "./entries";
import {
  fitView,
  shapeOf,
  type ViewModel,
  type Outgoing,
  type Patch,
} from "@windsplat/client/parts";
import {
  type ClientMessage,
  type Dataset,
  type DatasetSummary,
  type ErrorMessage,
  type OpenedMessage,
  type View,
  ProblemError,
} from "@windsplat/client";
import { failureText } from "../base/problem_text";
import type { Status } from "./status";

export interface DatasetOpenerHost {
  sendMessage(message: ClientMessage): void;
  send(outgoing: Outgoing[]): void;
  firstView(explicit: View): View; // sized for the window
  halt(): void; // stops playback and line motion
  // the dataset is open, though the view may still refer to another one
  describe(dataset: Dataset): void;
  // anew: its shape differs; changed: its files changed
  opened(anew: boolean, changed: boolean): void;
  refresh(): void;
  mark(): void; // another view was requested
  // nothing to show: the user must choose or add a dataset; `why`: if one was asked for
  empty(why?: string): void;
  // null: no longer wanted
  openEntry(entry: Entry, wanted: () => boolean): Promise<Dataset | null>;
  // how to run a change that follows the present user action later
  later(): (run: () => void) => void;
  // shows the entries of the open dataset; `refusal`: why no other may be chosen
  showEntries(refusal?: string): void;
}

const forbidden = 403; // the server does not let clients open other entries
const notFound = 404;
const busyCodes = [429, 503]; // the server is busy; the dataset itself may be readable

export class DatasetOpener {
  private openId = 0;
  private shownId = 0; // id of the `open` whose dataset is displayed
  private openingId = ""; // dataset of the newest `open`
  private before: View | undefined; // view of the displayed dataset when another was requested
  private abandonedId = 0; // id of the newest cancelled `open`
  private waits = false; // `opened` has not arrived yet
  private entryId = 0; // number of the newest opening of other entries, before its `open`
  private named: string | undefined; // the dataset that the page's address named
  private abandonedRev = 0; // last rev of a view whose dataset could not be opened
  private restored = new Set<number>(); // revs of the view that replaced a refused one

  constructor(
    private readonly host: DatasetOpenerHost,
    private readonly model: ViewModel,
    private readonly status: Status,
    readonly list: DatasetList,
  ) {}

  get waiting(): boolean {
    return this.waits;
  }

  // Whether the view asked for last is not yet that of the model, as its entries are being opened.
  get opensEntry(): boolean {
    return this.waits && this.openId === this.entryId;
  }

  choose(id: string): void {
    if (id === "") return;
    if (id === this.model.open?.id) {
      if (this.awaitsOther()) this.cancel(this.model.state.settled);
      return;
    }
    this.status.clearError();
    this.turnTo(this.host.firstView({ dataset: id }), id);
  }

  // Shows the present view at another entry of a dimension.
  chooseEntry(dimension: string, value: string): void {
    const { open, state } = this.model;
    if (open === null) return;
    this.status.clearError();
    this.openEntry({ from: open.id, selection: { [dimension]: value } }, () => state.document);
  }

  // Applies a whole view, which may name another dataset. Returns true if that dataset is
  // requested.
  follow(view: View): boolean {
    const id = view.dataset ?? this.model.open?.id ?? this.list.best();
    if (id === undefined) return false;
    if (id === this.model.open?.id) {
      if (this.awaitsOther()) this.abandon();
      return false;
    }
    this.turnTo({ ...view, dataset: id }, id);
    return true;
  }

  // A dataset that shows an entry of another one's files may have been closed: it is opened first.
  private turnTo(view: View, id: string): void {
    const entry = entryOf(id, this.list.all);
    if (entry === null) this.request(id, this.model.state.replace(view));
    else this.openEntry(entry, () => view);
  }

  // Cancels the last request and restores the previous view. `settled` is the newest view that was
  // drawn. Returns false if that view belongs to the dataset that is already open.
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

  // Whether a dataset other than the displayed one is being opened.
  private awaitsOther(): boolean {
    return this.waits && this.openingId !== this.model.open?.id;
  }

  // Abandons the open request.
  private abandon(): void {
    const { model, status } = this;
    status.loaded();
    this.waits = false;
    this.abandonedId = this.openId;
    this.abandonedRev = model.state.rev;
    this.showOpen();
    status.announce("live");
  }

  private showOpen(): void {
    this.list.show(this.model.open?.id ?? "");
    this.host.showEntries();
  }

  // The view of the displayed dataset at the time when another one was requested.
  private viewBefore(id: string): View {
    return this.host.firstView(this.before ?? { dataset: id });
  }

  // Whether to show progress of this request.
  awaits(id: number | null): boolean {
    return id === null || (this.waits && id === this.openId);
  }

  // A new session has no state, so the dataset and the whole view are sent.
  begin(datasets: DatasetSummary[]): void {
    const { model, list } = this;
    list.set(datasets);
    // A restarted server may no longer have the displayed dataset.
    if (model.open !== null && !list.has(model.open.id)) model.open = null;
    const wanted = model.state.document.dataset;
    if (this.openId === 0) this.named = wanted;
    const id = wanted ?? list.first();
    list.show(id ?? "");
    if (id === undefined) {
      this.status.announce("live, without a dataset");
      this.host.empty();
      return;
    }
    const entry = list.has(id) ? null : entryOf(id, datasets);
    if (entry !== null) {
      this.openEntry(entry, () => model.state.document, true);
      return;
    }
    // The limits of the server and the size of the window may have changed.
    model.state.change(this.host.firstView({ dataset: id }) as Patch);
    this.request(id, [model.state.restate()]);
  }

  // The server also sends `opened` unsolicited when the files of the displayed dataset change.
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

  // Returns whether the error concerned a dataset and has been handled completely.
  onError(message: ErrorMessage, text: string): boolean {
    if (message.id !== undefined && message.id === this.abandonedId) return true;
    if (this.waits && message.id === this.openId) {
      this.failed(text, message.problem.status);
    } else if (message.rev !== undefined && message.rev <= this.abandonedRev) {
      this.model.state.refuse(message.rev); // already reported: the dataset could not be opened
    } else if (message.rev === undefined && this.asked(message.id)) {
      this.status.error("file", text); // the new files cannot be read; the old picture remains
      if (this.model.open !== null) this.list.failed(this.model.open.id, text);
    } else {
      return false;
    }
    return true;
  }

  private asked(id: number | undefined): boolean {
    return id !== undefined && (id === this.openId || id === this.shownId);
  }

  // A patch of this rev was refused. If the patch was a whole view (such as a link from another
  // release), the view of its dataset is replaced by the defaults. If the defaults themselves were
  // refused, they are not requested again, as that would loop forever.
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

  // The view is sent before `open`, so that the first picture already shows it; `open` then only
  // requests the dataset's description.
  private request(id: string, outgoing: Outgoing[]): void {
    this.startWaiting(id);
    this.host.halt();
    this.host.send(outgoing);
    this.host.sendMessage({ type: "open", id: this.openId, dataset: id });
    this.host.mark();
  }

  private startWaiting(what: string): void {
    const { settled, document } = this.model.state;
    const shown = this.model.open?.id;
    this.before = [settled, document, this.before].find((view) => view?.dataset === shown);
    this.openId += 1;
    this.openingId = what;
    this.waits = true;
    this.status.startLoading(`opening ${what}…`);
  }

  // Opens a dataset of other entries, then requests it in the view as it is then. `afresh`: the
  // session has no view yet.
  private openEntry(entry: Entry, view: () => View, afresh = false): void {
    const { model, host, list } = this;
    const run = host.later();
    this.startWaiting(entryText(entry));
    const openId = this.openId;
    this.entryId = openId;
    const wanted = (): boolean => this.waits && this.openId === openId;
    host.openEntry(entry, wanted).then(
      (dataset) => {
        if (dataset === null || !wanted()) return;
        const { id } = dataset;
        list.add(dataset);
        const next = host.firstView(fitView({ ...view(), dataset: id }, dataset));
        run(() => {
          const outgoing = model.state.replace(next);
          this.request(id, afresh ? [model.state.restate()] : outgoing);
        });
      },
      (failure) => {
        if (wanted()) this.notOpened(failure, view());
      },
    );
  }

  private notOpened(failure: unknown, view: View): void {
    const { model, status, list } = this;
    const { open } = model;
    const id = view.dataset ?? "";
    const code = failure instanceof ProblemError ? failure.status : 0;
    if (id !== open?.id && list.has(id)) {
      this.request(id, model.state.replace(view)); // it is listed under this very name
    } else if (open === null) {
      this.failed(failureText(failure), code);
    } else {
      this.waits = false;
      status.loaded();
      status.error("dataset", failureText(failure));
      status.announce("live");
      list.show(open.id);
      this.host.showEntries(code === forbidden ? failureText(failure) : undefined);
    }
  }

  // Applies the present view to the new files, as far as they support it.
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
    if (model.open === null && this.named !== undefined) {
      // Another dataset would be taken for the one that was asked for.
      const missing = `there is no dataset “${failed}” on this server`;
      const isMissing = code === notFound && failed === this.named;
      const why = isMissing ? missing : text.replace(/\.$/, "");
      status.error("dataset", `${why.charAt(0).toUpperCase()}${why.slice(1)}.`);
      status.announce("live, without a dataset");
      this.list.show("");
      this.host.empty(why);
      return;
    }
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
