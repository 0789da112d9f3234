// Which dataset a stream shows: the first view of a session, the answers to `open`, and what is
// left of refused views. The plain opener shows the dataset that its view names, or the first one;
// the server's page has another one.
import type { ViewModel } from "../view/view_model";
import type { Outgoing, Patch } from "../view/view_state";
import type {
  ClientMessage,
  Dataset,
  ErrorMessage,
  HelloMessage,
  OpenedMessage,
  Problem,
  View,
} from "../wire/protocol";
import { problemText, ProblemError } from "../wire/requests";

export interface Opener {
  begin(hello: HelloMessage): void; // a new session has no state: sends the whole view
  replace(view: View): void; // sends another view, perhaps of another dataset
  opened(message: OpenedMessage): void;
  refused(message: ErrorMessage): void;
}

export interface OpenerHost {
  readonly model: ViewModel;
  readonly wanted: View; // as it was asked for last, also if it was refused since
  send(message: ClientMessage): boolean;
  transmit(outgoing: Outgoing[]): void;
  withdraw(rev: number): void;
}

export interface OpenerEvents {
  opened(dataset: Dataset): void;
  refused(error: ProblemError): void;
  reverted(): void; // the view is the one before the refusal
}

export class PlainOpener implements Opener {
  private opening: string | undefined; // the dataset of the last `open` of this session
  private opens = 1; // number of the last `open`, which its answer repeats
  private plainRev = 0; // rev of the last view without the keys of a refused one
  private refusedOpen = ""; // detail of the last refusal, which the answer to `open` repeats

  constructor(
    private readonly host: OpenerHost,
    private readonly events: OpenerEvents,
  ) {}

  begin(hello: HelloMessage): void {
    const { wanted, model } = this.host;
    const { state } = model;
    this.opening = undefined;
    if (state.document.dataset === undefined) {
      const dataset = wanted.dataset ?? hello.datasets[0]?.id;
      if (dataset !== undefined) state.change({ ...wanted, dataset });
    }
    if (state.document.dataset === undefined) {
      this.events.refused(new ProblemError("the server has no dataset", 404));
      return;
    }
    this.host.transmit([state.restate()]);
    this.open();
  }

  // The size of the picture is kept if the view has none.
  replace(view: View): void {
    const { model } = this.host;
    const { dataset, image } = model.state.document;
    const next = { ...view };
    const named = view.dataset ?? dataset;
    if (named !== undefined) next.dataset = named;
    if (image?.width !== undefined && image.height !== undefined) {
      next.image = { width: image.width, height: image.height, ...view.image };
    }
    if (named !== model.open?.id) model.open = null;
    this.host.transmit(model.state.replace(next));
    if (named !== this.opening) this.open();
  }

  opened({ id, dataset }: OpenedMessage): void {
    const { model } = this.host;
    if (id !== this.opens || dataset.id !== model.state.document.dataset) return;
    const again = model.open?.id === dataset.id;
    model.open = dataset;
    if (again) model.fitDrawn(dataset);
    this.events.opened(dataset);
  }

  // Both the view with an unknown dataset and the `open` of it are refused; one is told.
  refused({ id, rev, problem }: ErrorMessage): void {
    if (rev === undefined && id !== undefined && id !== this.opens) return; // of an earlier `open`
    if (id === this.opens) this.opening = undefined;
    const repeated = id === this.opens && problem.detail === this.refusedOpen;
    this.refusedOpen = problem.detail;
    const error = problemError(problem);
    if (rev !== undefined) this.withdraw(rev, error);
    if (!repeated) this.events.refused(error);
    if (rev !== undefined) this.events.reverted();
  }

  // The view is sent before, so that the first picture already shows it; `open` then only asks for
  // the dataset's description.
  private open(): void {
    const { dataset } = this.host.model.state.document;
    if (dataset === undefined) return;
    this.opens += 1;
    const sent = this.host.send({ type: "open", id: this.opens, dataset });
    this.opening = sent ? dataset : undefined;
  }

  // If the first view of a session is refused, nothing is left to go back to: its dataset is shown
  // by default, so that what is drawn and described belongs to the view.
  private withdraw(rev: number, error: ProblemError): void {
    const { state } = this.host.model;
    const { dataset, image } = state.document;
    this.host.withdraw(rev);
    const left = state.document.dataset !== undefined || dataset === undefined;
    if (left || rev === this.plainRev || isOfDataset(error)) return;
    const { width, height } = image ?? {};
    const sized = width !== undefined && height !== undefined && !names(error, "/image");
    const plain = state.change({
      dataset,
      ...(sized ? { image: { width, height } } : {}),
    } as Patch);
    this.plainRev = plain.rev;
    this.host.transmit([plain]);
  }
}

const names = ({ problem }: ProblemError, place: string): boolean =>
  problem?.errors?.some(({ pointer }) => pointer.startsWith(place)) ?? false;

/** Whether a dataset is refused, not what a view says of it. */
export const isOfDataset = (error: ProblemError): boolean =>
  error.status === 404 || names(error, "/dataset");

const problemError = (problem: Problem): ProblemError =>
  new ProblemError(problemText(problem), problem.status, problem);
