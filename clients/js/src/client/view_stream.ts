// One view of a server over a stream: a view document and its changes in, frames out. Lost
// connections are opened again, and the view is stated anew. Without DOM, for programs and pages.
import type { Camera } from "../view/camera";
import { PatchAnswers } from "../view/patch_answers";
import type { Outgoing, Patch } from "../view/view_state";
import { ViewModel } from "../view/view_model";
import { openConnection, type LinkOptions } from "../wire/browser_link";
import type { Clock, Connection, ConnectionState } from "../wire/connection";
import type {
  ChosenMessage,
  ClientMessage,
  Dataset,
  ErrorMessage,
  Frame,
  FrameHeader,
  HelloMessage,
  OpenedMessage,
  ProgressMessage,
  Problem,
  ServerMessage,
  StatsMessage,
  View,
} from "../wire/protocol";
import type { Reach } from "../wire/reach";
import { problemText, ProblemError } from "../wire/requests";

export interface StreamEvents {
  /**
   * A frame, before it is acknowledged; with `acknowledge: "auto"` the stream waits for the
   * promise.
   */
  frame?(frame: Frame): void | Promise<void>;
  /** The frame counts as shown; `chosen` tells how it was drawn. */
  shown?(header: FrameHeader, chosen: ChosenMessage | null): void;
  state?(state: ConnectionState): void;
  /** After the connection was lost for this reason: what the server answers otherwise. */
  reached?(reach: Reach, reason: string): void;
  hello?(hello: HelloMessage): void; // the view has been sent
  /** The picture shown before is the answer to this patch, which changed nothing visible. */
  settled?(rev: number): void;
  opened?(dataset: Dataset): void; // also after the dataset's files have changed
  refused?(error: ProblemError): void; // of the dataset or a change of the view
  changed?(view: View): void; // by change(), or during playback
  progress?(progress: ProgressMessage): void;
  stats?(stats: StatsMessage): void;
}

export interface StreamOptions extends LinkOptions {
  /**
   * auto: a frame is acknowledged, and counts as shown, after the event `frame`; manual: by
   * acknowledge() and show().
   */
  acknowledge?: "auto" | "manual";
  clock?: Clock;
}

const systemClock: Clock = {
  /** Browsers number timers; Node has objects, which clearTimeout takes as well. */
  setTimeout: (run, ms) => setTimeout(run, ms) as unknown as number,
  clearTimeout: (timer) => clearTimeout(timer),
  random: () => Math.random(),
};

interface Waiting {
  resolve(frame: Frame): void;
  reject(reason: unknown): void;
}

export class ViewStream {
  readonly connection: Connection;
  readonly model = new ViewModel();
  private readonly answers = new PatchAnswers(this.model.state);
  private readonly auto: boolean;
  private wanted: View; // stated again after a restart, also if it was refused
  private opening: string | undefined; // the dataset of the last `open` of this session
  private opens = 1; // number of the last `open`, which its answer repeats
  private plainRev = 0; // rev of the last view without the keys of a refused one
  private refusedOpen = ""; // detail of the last refusal, which the answer to `open` repeats
  private last: Frame | null = null;
  private answered = 0; // rev of the newest view that the last frame shows
  private waiting: Waiting[] = [];
  private hidden = false;

  // url: of the server. view: explicit keys only; without a dataset the first one of the server.
  constructor(
    url: string,
    view: View,
    private readonly events: StreamEvents = {},
    { acknowledge = "auto", clock = systemClock, ...link }: StreamOptions = {},
  ) {
    this.wanted = view;
    this.auto = acknowledge === "auto";
    this.model.state.change(view as Patch);
    this.connection = openConnection(
      url,
      clock,
      {
        state: (state) => this.onState(state),
        reached: (reach, reason) => this.events.reached?.(reach, reason),
        hello: (hello) => this.onHello(hello),
        message: (message) => this.onMessage(message),
        frame: (frame) => this.onFrame(frame),
      },
      link,
    );
    this.connection.start();
  }

  // --- the view --------------------------------------------------------------------------

  /** Its explicit keys. Callers must not modify it. */
  get explicit(): View {
    return this.model.state.document;
  }

  /** With all known defaults. */
  get view(): View {
    return this.model.view();
  }

  /** null: not opened yet. */
  get dataset(): Dataset | null {
    return this.model.open;
  }

  /** null: not known yet. */
  get camera(): Camera | null {
    return this.model.camera();
  }

  /** Changes the view by a merge patch (RFC 7396). */
  change(patch: Patch): void {
    this.connection.wake();
    const outgoing = [this.model.state.change(patch)];
    this.changed(outgoing);
  }

  /**
   * Shows another view, perhaps of another dataset. The size of the picture is kept if the view has
   * none.
   */
  replace(view: View): void {
    this.connection.wake();
    const { dataset, image } = this.explicit;
    const next = { ...view };
    const named = view.dataset ?? dataset;
    if (named !== undefined) next.dataset = named;
    if (image?.width !== undefined && image.height !== undefined) {
      next.image = { width: image.width, height: image.height, ...view.image };
    }
    if (named !== this.model.open?.id) this.model.open = null;
    this.changed(this.model.state.replace(next));
    if (named !== this.opening) this.open();
  }

  /** Plays the time steps from `from` to `to`; the steps of the frames tell how far it is. */
  play(
    from: number,
    to: number,
    settings: { fps?: number; loop?: boolean; drop?: boolean } = {},
  ): boolean {
    this.connection.wake();
    return this.send({ type: "play", from, to, ...settings } as ClientMessage);
  }

  pause(): void {
    this.send({ type: "pause" });
  }

  // --- frames ----------------------------------------------------------------------------

  /**
   * The final frame of the present view. Fails with a ProblemError if the view is refused, and if
   * the connection is lost before; the stream itself goes on.
   */
  final(): Promise<Frame> {
    const { last } = this;
    if (last?.header.final === true && this.isNewest(this.answered)) return Promise.resolve(last);
    return new Promise((resolve, reject) => this.waiting.push({ resolve, reject }));
  }

  /** A frame was decoded, so that the server may send the next one. */
  acknowledge(seq: number, decodeMs = 0): void {
    this.send({ type: "ack", seq, decodeMs });
  }

  /** A frame is shown. */
  show(header: FrameHeader): void {
    const chosen = this.answers.drawn(header);
    if (chosen !== null) this.model.drew(chosen, header.final);
    this.answered = Math.max(header.rev, this.answered);
    this.followStep(header);
    this.settleUnchanged();
    this.events.shown?.(header, chosen);
    if (this.last?.header.seq === header.seq) this.answerFinal();
  }

  /** Whether a frame or an answer of this rev is newer than the last refusal. */
  isAfterRefusal(rev: number): boolean {
    return this.answers.isAfterRefusal(rev);
  }

  // --- the connection --------------------------------------------------------------------

  /** A hidden client is sent no frames. */
  setHidden(hidden: boolean): void {
    this.hidden = hidden;
    if (!hidden) this.connection.wake();
    this.send({ type: "visibility", hidden });
  }

  send(message: ClientMessage): boolean {
    return this.connection.send(message);
  }

  close(): void {
    this.connection.stop();
    this.fail(new Error("the stream was closed"));
  }

  private onState(state: ConnectionState): void {
    if (state.name === "waiting" || state.name === "asleep") this.fail(new Error(state.reason));
    if (state.name === "locked") this.fail(new ProblemError("the server asks for a token", 401));
    this.events.state?.(state);
  }

  // A new session has no state, so the whole view is sent.
  private onHello(hello: HelloMessage): void {
    const { state } = this.model;
    this.answers.newSession();
    this.last = null;
    this.answered = 0;
    this.opening = undefined;
    if (state.document.dataset === undefined) {
      const dataset = this.wanted.dataset ?? hello.datasets[0]?.id;
      if (dataset !== undefined) state.change({ ...this.wanted, dataset });
    }
    if (this.hidden) this.send({ type: "visibility", hidden: true });
    if (state.document.dataset === undefined) {
      this.refuse(new ProblemError("the server has no dataset", 404));
    } else {
      this.sendAll([state.restate()]);
      this.open();
    }
    this.events.hello?.(hello);
  }

  // The view is sent before, so that the first picture already shows it; `open` then only asks for
  // the dataset's description.
  private open(): void {
    const { dataset } = this.explicit;
    if (dataset === undefined) return;
    this.opens += 1;
    const sent = this.send({ type: "open", id: this.opens, dataset });
    this.opening = sent ? dataset : undefined;
  }

  private onMessage(message: ServerMessage): void {
    switch (message.type) {
      case "opened":
        this.onOpened(message);
        break;
      case "chosen":
        this.answers.onChosen(message);
        break;
      case "unchanged":
        this.answers.onUnchanged(message);
        this.settleUnchanged();
        this.answerFinal();
        break;
      case "error":
        this.onError(message);
        break;
      case "progress":
        this.events.progress?.(message);
        break;
      case "stats":
        this.events.stats?.(message);
        break;
      case "hello": // taken by the connection
        break;
    }
  }

  private onOpened({ id, dataset }: OpenedMessage): void {
    if (id !== this.opens || dataset.id !== this.explicit.dataset) return;
    const again = this.model.open?.id === dataset.id;
    this.model.open = dataset;
    if (again) this.model.fitDrawn(dataset);
    this.events.opened?.(dataset);
  }

  private onFrame(frame: Frame): void {
    this.last = frame;
    if (!this.auto) {
      void this.events.frame?.(frame);
      return;
    }
    const began = performance.now();
    void Promise.resolve()
      .then(() => this.events.frame?.(frame))
      .finally(() => {
        this.acknowledge(frame.header.seq, performance.now() - began);
        this.show(frame.header);
      });
  }

  // Both the view with an unknown dataset and the `open` of it are refused; one is told.
  private onError({ id, rev, problem }: ErrorMessage): void {
    if (rev === undefined && id !== undefined && id !== this.opens) return; // of an earlier `open`
    if (id === this.opens) this.opening = undefined;
    const repeated = id === this.opens && problem.detail === this.refusedOpen;
    this.refusedOpen = problem.detail;
    const error = problemError(problem);
    if (rev !== undefined) this.withdraw(rev, error);
    if (!repeated) this.refuse(error);
    if (rev !== undefined) this.events.changed?.(this.explicit); // back to the view before
  }

  // If the first view of a session is refused, nothing is left to go back to: its dataset is shown
  // by default, so that what is drawn and described belongs to the view.
  private withdraw(rev: number, error: ProblemError): void {
    const { dataset, image } = this.explicit;
    this.answers.refuse(rev);
    const left = this.explicit.dataset !== undefined || dataset === undefined;
    if (left || rev === this.plainRev || isOfDataset(error)) return;
    const { width, height } = image ?? {};
    const sized = width !== undefined && height !== undefined && !names(error, "/image");
    const plain = this.model.state.change({
      dataset,
      ...(sized ? { image: { width, height } } : {}),
    });
    this.plainRev = plain.rev;
    this.sendAll([plain]);
  }

  private refuse(error: ProblemError): void {
    this.fail(error);
    this.events.refused?.(error);
  }

  // --- answers ---------------------------------------------------------------------------

  private isNewest(rev: number): boolean {
    return rev === this.model.state.rev;
  }

  // The patch that changed nothing visible is answered by the frame shown before.
  private settleUnchanged(): void {
    const rev = this.answers.settleUnchanged();
    if (rev === null) return;
    this.answered = Math.max(rev, this.answered);
    this.events.settled?.(rev);
  }

  private answerFinal(): void {
    const { last } = this;
    if (last?.header.final !== true || !this.isNewest(this.answered)) return;
    for (const { resolve } of this.waiting.splice(0)) resolve(last);
  }

  private fail(reason: Error): void {
    for (const { reject } of this.waiting.splice(0)) reject(reason);
  }

  // Playback changes the step; nothing is sent back.
  private followStep({ rev, step }: FrameHeader): void {
    const { state } = this.model;
    if (!this.isNewest(rev) || step === (state.document.step ?? 0)) return;
    state.follow(step);
    this.events.changed?.(this.explicit);
  }

  private changed(outgoing: Outgoing[]): void {
    this.wanted = this.explicit;
    this.sendAll(outgoing);
    this.events.changed?.(this.explicit);
  }

  private sendAll(outgoing: Outgoing[]): void {
    const t = performance.now();
    for (const { rev, patch } of outgoing) this.send({ type: "patch", rev, t, patch });
  }
}

const names = ({ problem }: ProblemError, place: string): boolean =>
  problem?.errors?.some(({ pointer }) => pointer.startsWith(place)) ?? false;

/** Whether a dataset is refused, not what a view says of it. */
export const isOfDataset = (error: ProblemError): boolean =>
  error.status === 404 || names(error, "/dataset");

const problemError = (problem: Problem): ProblemError =>
  new ProblemError(problemText(problem), problem.status, problem);
