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
  Frame,
  FrameHeader,
  HelloMessage,
  ProgressMessage,
  ServerMessage,
  StatsMessage,
  View,
} from "../wire/protocol";
import type { Reach } from "../wire/reach";
import { ProblemError } from "../wire/requests";
import { PlainOpener, type Opener } from "./opener";

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
  /** Chooses the dataset instead of the plain opener; the stream begins at connection.start(). */
  opener?: Opener;
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
  private readonly opener: Opener;
  private asked: View; // stated again after a restart, also if it was refused
  private last: Frame | null = null;
  private answered = 0; // rev of the newest view that the last frame shows
  private waiting: Waiting[] = [];
  private hidden = false;

  // url: of the server. view: explicit keys only; without a dataset the first one of the server.
  constructor(
    url: string,
    view: View,
    private readonly events: StreamEvents = {},
    { acknowledge = "auto", clock = systemClock, opener, ...link }: StreamOptions = {},
  ) {
    this.asked = view;
    this.opener = opener ?? this.plainOpener();
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
    if (opener === undefined) this.connection.start();
  }

  private plainOpener(): Opener {
    return new PlainOpener(this, {
      opened: (dataset) => this.events.opened?.(dataset),
      refused: (error) => {
        this.fail(error);
        this.events.refused?.(error);
      },
      reverted: () => this.events.changed?.(this.explicit),
    });
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

  /** As it was asked for last, also if it was refused since. */
  get wanted(): View {
    return this.asked;
  }

  /** Changes the view by a merge patch (RFC 7396). */
  change(patch: Patch): void {
    this.connection.wake();
    this.transmit([this.model.state.change(patch)]);
    this.changed();
  }

  /**
   * Shows another view, perhaps of another dataset. The size of the picture is kept if the view has
   * none.
   */
  replace(view: View): void {
    this.connection.wake();
    this.opener.replace(view);
    this.changed();
  }

  /** Sends changes that have been made to `model.state`. */
  transmit(outgoing: Outgoing[]): void {
    const t = performance.now();
    for (const { rev, patch } of outgoing) this.send({ type: "patch", rev, t, patch });
  }

  /** The server refused this change: the view is again what it was without it. */
  withdraw(rev: number): void {
    this.answers.refuse(rev);
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

  /**
   * A frame is shown; returns how it was drawn, if that is known. playing: its step is followed
   * also if a newer view has been asked for.
   */
  show(header: FrameHeader, playing = false): ChosenMessage | null {
    const chosen = this.answers.drawn(header);
    if (chosen !== null) this.model.drew(chosen, header.final);
    this.answered = Math.max(header.rev, this.answered);
    if (playing || this.isNewest(header.rev)) this.followStep(header.step);
    this.settleUnchanged();
    this.events.shown?.(header, chosen);
    if (this.last?.header.seq === header.seq) this.answerFinal();
    return chosen;
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

  private onHello(hello: HelloMessage): void {
    this.answers.newSession();
    this.last = null;
    this.answered = 0;
    if (this.hidden) this.send({ type: "visibility", hidden: true });
    this.opener.begin(hello);
    this.events.hello?.(hello);
  }

  private onMessage(message: ServerMessage): void {
    switch (message.type) {
      case "opened":
        this.opener.opened(message);
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
        this.opener.refused(message);
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
  private followStep(step: number): void {
    const { state } = this.model;
    if (step === (state.document.step ?? 0)) return;
    state.follow(step);
    this.events.changed?.(this.explicit);
  }

  private changed(): void {
    this.asked = this.explicit;
    this.events.changed?.(this.explicit);
  }
}
