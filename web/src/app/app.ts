// Application controller: user input -> view document -> outgoing patches; incoming messages and
// frames -> picture, legend, panels, time bar and status text. The parts depend only on this class,
// not on each other.
import { Address } from "./address";
import type { AppParts } from "./app_parts";
import {
  PatchAnswers,
  CameraControl,
  ColorMaps,
  type Clock,
  type Connection,
  type ConnectionState,
  type FrameState,
  openConnection,
  watchPresence,
  type VideoOffer,
  ViewModel,
  type Outgoing,
  type Patch,
  type DrawnFrame,
} from "@windsplat/client/parts";
import {
  Api,
  type Dataset,
  type ErrorMessage,
  type HelloMessage,
  type ServerMessage,
  type View,
} from "@windsplat/client";
import { Flow } from "../view/flow";
import { scaleText } from "../viewport/frame_text";
import { loadHelpTexts } from "../panels/help_texts";
import { leaveRoom } from "../viewport/annotation_room";
import { markCamera } from "../viewport/camera_marks";
import { legendEntries } from "../view/legend_entries";
import { DatasetOpener } from "./dataset_opener";
import { openEntry } from "./entries";
import { Playback } from "./playback";
import { problemText } from "../base/problem_text";
import { UndoControl } from "./undo_control";
import { offerVideo } from "../view/video_setting";
import { nightText } from "../view/sun_at";

export class App {
  readonly maps = new ColorMaps();
  readonly api: Api;
  readonly cameras: CameraControl;
  readonly playback: Playback;
  readonly undoControl: UndoControl;
  readonly video: VideoOffer;
  private readonly model = new ViewModel();
  private readonly answers = new PatchAnswers(this.model.state);
  private readonly connection: Connection;
  private readonly flowing: Flow;
  private parts!: AppParts;
  private opener!: DatasetOpener;
  private address!: Address;

  constructor(
    private readonly clock: Clock,
    private readonly baseUri: string,
  ) {
    this.api = new Api(baseUri, (url, init) => fetch(url, init));
    this.cameras = new CameraControl(this.model, {
      change: (patch) => this.change(patch),
      size: () => this.parts.viewport.size(),
      ready: () => this.connection.ready,
    });
    this.connection = openConnection(baseUri, clock, {
      state: (state) => this.onState(state),
      hello: (hello) => this.onHello(hello),
      message: (message) => this.onMessage(message),
      frame: (frame) => {
        // A frame that cannot be shown must still return its credit to the server.
        this.parts.viewport.show(frame).catch(() => this.onBroken(frame.header.seq));
      },
    });
    this.video = offerVideo(clock, {
      send: (message) => void this.connection.send(message),
      note: (text) => this.parts.status.note(text),
    });
    this.undoControl = new UndoControl({
      document: () => this.model.state.document,
      busy: () => this.model.open === null || this.opener.waiting,
      show: (view) => {
        if (view.step !== this.model.state.document.step) this.playback.pause();
        this.restore(view);
      },
      edited: () => this.address.edited(),
      announce: (text) => this.parts.status.note(text),
    });
    this.playback = new Playback({
      send: (message) => this.connection.send(message),
      settings: () => this.parts.timeBar,
      seek: (step) => this.seek(step),
      changed: () => {
        this.showTime();
        this.address.save();
      },
    });
    this.flowing = new Flow({
      now: () => performance.now(),
      setTimeout: clock.setTimeout,
      clearTimeout: clock.clearTimeout,
      hidden: () => document.hidden,
      wanted: () => this.linesMove(),
      time: () => this.view().vector?.motion?.time ?? 0,
      send: (time) => {
        const outgoing = this.model.state.change({ vector: { motion: { time } } });
        this.send(outgoing);
        return outgoing.rev;
      },
      ended: () => {
        this.address.save();
        this.refresh();
      },
    });
  }

  start(parts: AppParts): void {
    this.parts = parts;
    this.address = new Address(
      {
        document: () => this.model.state.document,
        runs: () => this.playback.running || this.flowing.running,
        restore: (view) => this.undoControl.edit(() => this.restore(view)),
        beside: parts.beside,
      },
      parts.status,
      this.baseUri,
    );
    this.opener = this.makeOpener(parts);
    parts.picker.addEventListener("change", () => this.open(parts.picker.value));
    this.loadMaps();
    this.address.first((view) => {
      this.model.state.change(this.firstView(view ?? {}) as Patch);
      this.connection.start();
    });
    watchPresence(this.connection, () => this.sendVisibility());
  }

  private makeOpener({ status, list, cards, entries }: AppParts): DatasetOpener {
    return new DatasetOpener(
      {
        sendMessage: (message) => void this.connection.send(message),
        send: (outgoing) => outgoing.forEach((one) => this.send(one)),
        firstView: (explicit) => this.firstView(explicit),
        halt: () => {
          this.playback.halt();
          this.flowing.stop();
        },
        describe: (dataset) => this.describe(dataset),
        opened: (anew, changed) => this.onOpened(anew, changed),
        refresh: () => this.refresh(),
        mark: () => this.showMark(),
        empty: (why) => cards.show(why),
        openEntry: (entry, wanted) =>
          openEntry(
            this.api,
            entry,
            wanted,
            (ms) => new Promise((done) => this.clock.setTimeout(done, ms)),
          ),
        later: () => this.undoControl.later(),
        showEntries: (refusal) => {
          if (refusal !== undefined) entries.refuse(refusal);
          entries.show(this.model.open?.choices ?? []);
        },
      },
      this.model,
      status,
      list,
    );
  }

  // --- user input --------------------------------------------------------------

  // The view with all known defaults.
  view(): View {
    return this.model.view();
  }

  // The view with its explicit keys only.
  explicitView(): View {
    return this.model.state.document;
  }

  // Whether the view refers to the dataset that is open.
  isOpen(): boolean {
    return this.model.open !== null && this.model.open.id === this.explicitView().dataset;
  }

  dataset(): Dataset {
    return this.model.dataset();
  }

  change(patch: Patch): void {
    this.connection.wake();
    this.undoControl.edit(() => this.send(this.model.state.change(patch)));
    this.refresh();
  }

  open(id: string): void {
    this.undoControl.edit(() => this.opener.choose(id));
  }

  chooseEntry(dimension: string, value: string): void {
    this.opener.chooseEntry(dimension, value);
  }

  // Returns to the view that was drawn last and cancels the one that is still loading.
  cancelLoading(): void {
    const before = this.model.state.settled;
    if (!this.opener.cancel(before)) this.replace(before);
  }

  connectNow(): void {
    this.connection.retryNow();
  }

  resetAll(): void {
    this.undoControl.edit(() => this.replace(this.firstView({ dataset: this.dataset().id })));
  }

  resize(width: number, height: number): void {
    const image = this.model.state.document.image;
    if (image?.width === width && image.height === height) return;
    this.change({ image: { width, height } });
  }

  seek(step: number): void {
    this.playback.pause();
    if (step >= 0 && step !== this.view().step) this.change({ step });
  }

  // Starts the line motion, or stops it at its present phase.
  flow(on: boolean): void {
    if (on) {
      if (!this.linesMove()) this.change({ vector: { motion: { mode: "phase" } } });
      this.flowing.start();
    } else {
      this.flowing.stop();
      this.address.save();
    }
    this.refresh();
  }

  isFlowing(): boolean {
    return this.flowing.running;
  }

  // The address keeps more than the view.
  saveAddress(): void {
    this.address.edited();
    this.address.save();
  }

  hasPicture(): boolean {
    return this.model.drawnView() !== null;
  }

  copyLink(): Promise<void> {
    return this.address.copy();
  }

  // Opens the view of a saved picture or a saved view. `quality` is preserved unless that view
  // contains it.
  openView(view: View): void {
    const { quality } = this.explicitView();
    this.undoControl.edit(() => this.restore(quality === undefined ? view : { quality, ...view }));
  }

  // Replaces the current view with another one.
  restore(view: View): void {
    this.parts.status.clearError();
    const next = this.firstView(view);
    if (!this.opener.follow(next)) this.replace({ ...next, dataset: this.model.open?.id });
  }

  // --- the server ----------------------------------------------------------------------

  private firstView(explicit: View): View {
    const [width, height] = this.parts.viewport.askedSize();
    return { ...explicit, image: { ...explicit.image, width, height } };
  }

  private linesMove(): boolean {
    const { vector } = this.view();
    return vector?.field !== null && vector?.motion?.mode === "phase";
  }

  private send({ rev, patch }: Outgoing): void {
    this.connection.send({ type: "patch", rev, t: performance.now(), patch });
    this.address.save();
  }

  private replace(view: View): void {
    this.flowing.stop();
    for (const outgoing of this.model.state.replace(view)) this.send(outgoing);
    this.refresh();
  }

  private onState(state: ConnectionState): void {
    this.parts.status.connection(state);
    if (state.name === "locked") this.parts.login.ask();
    if (state.name === "live") this.parts.login.done();
    if (state.name !== "live") this.playback.halt();
    this.showMark();
    if (this.model.open !== null) this.showTime();
  }

  private onHello(hello: HelloMessage): void {
    this.parts.entries.refuse(""); // another server may allow it
    this.parts.viewport.newSession(hello.limits.imagePixelsMax);
    this.answers.newSession();
    this.video.greet();
    if (!this.maps.loaded) this.loadMaps();
    if (this.opener.begin(hello.datasets)) this.sendVisibility();
  }

  private onMessage(message: ServerMessage): void {
    switch (message.type) {
      case "opened":
        this.opener.onOpened(message);
        break;
      case "progress":
        if (!this.opener.awaits(message.id)) break;
        this.parts.status.progress(message.phase, message.done, message.etaMs);
        break;
      case "chosen":
        this.answers.onChosen(message);
        break;
      case "unchanged":
        this.answers.onUnchanged(message);
        this.settleUnchanged();
        break;
      case "stats":
        this.parts.hud.steps(message);
        break;
      case "error":
        this.onError(message);
        break;
    }
  }

  private onOpened(anew: boolean, changed: boolean): void {
    if (changed) {
      if (this.dataset().steps.count > 1) this.playback.again();
      else this.playback.pause();
    }
    if (anew) {
      this.parts.panels.build();
      // The panel is usable without its help, so a failure is not reported.
      loadHelpTexts(this.baseUri).catch(() => undefined);
    }
    this.refresh();
    this.showLegend();
  }

  private onError(message: ErrorMessage): void {
    const { status } = this.parts;
    const text = problemText(message.problem);
    if (this.opener.onError(message, text)) return;
    if (message.rev !== undefined) {
      status.error("view", text);
      this.answers.refuse(message.rev);
      this.flowing.refused(message.rev);
      this.opener.onRefused(message.rev);
      this.refresh();
    } else {
      // An error about a step that the new files lack is cleared by the next picture.
      const ofStep = message.problem.errors?.some(({ pointer }) => pointer === "/step");
      status.error(ofStep ? "view" : "server", text);
    }
  }

  onDrawn(frame: DrawnFrame): void {
    const { header } = frame;
    const { hud, status, viewport } = this.parts;
    if (!this.opener.waiting) status.loaded(); // the data that the view was waiting for
    const chosen = this.answers.drawn(header);
    this.flowing.answered(header.rev);
    if (chosen !== null) {
      this.model.drew(chosen, header.final);
      status.empty(chosen.empty, nightText(chosen.view as View));
    }
    // The server's step is adopted if no newer view was requested or playback is running.
    if (this.playback.running || header.rev === this.model.state.rev) this.followStep(header.step);
    hud.show(frame, chosen, viewport.canvas.width);
    status.clearError("frame");
    if (this.answers.isAfterRefusal(header.rev)) status.clearError("view");
    this.settleUnchanged();
    if (this.answers.isFirst(header)) status.responded(frame.drawnAt - header.t);
    document.documentElement.classList.add("has-picture");
    this.refresh();
    this.showLegend();
  }

  private settleUnchanged(): void {
    const rev = this.answers.settleUnchanged();
    if (rev === null) return;
    const { canvas } = this.parts.viewport;
    this.flowing.answered(rev);
    canvas.dataset.rev = String(Math.max(rev, Number(canvas.dataset.rev)));
    if (this.answers.isAfterRefusal(rev)) this.parts.status.clearError("view");
    this.refresh();
  }

  // Sent as soon as the frame is decoded, shown or not, so that the server may send another one.
  acknowledge(seq: number, decodeMs: number): void {
    this.connection.send({ type: "ack", seq, decodeMs });
  }

  onBroken(seq: number): void {
    this.acknowledge(seq, 0);
    this.parts.status.error("frame", "A frame could not be decoded.");
  }

  // --- display -------------------------------------------------------------------------

  private describe({ title, source, format, dims, steps, axes, choices }: Dataset): void {
    const { timeBar, gizmo, facts, entries } = this.parts;
    entries.show(choices);
    timeBar.setDataset(this.dataset());
    gizmo.setAxes(axes);
    const stepsText = `${steps.count} step${steps.count === 1 ? "" : "s"}`;
    facts.textContent = `${dims.x} × ${dims.y} × ${dims.z} · ${stepsText}`;
    facts.title = `${title} — ${source} (${format})`;
    document.title = `${title} · windsplat`;
  }

  private followStep(step: number): void {
    const before = this.view().step ?? 0;
    const { state } = this.model;
    if (step !== state.document.step) state.follow(step);
    this.playback.shown(step, before);
  }

  private refresh(): void {
    this.showMark();
    if (this.model.open === null) return;
    this.parts.panels.refresh();
    this.showTime();
    this.parts.probe.show();
    this.parts.hover.refresh();
    this.parts.beside.follow();
    const camera = this.model.camera();
    if (camera !== null) {
      this.parts.gizmo.show(camera);
      markCamera(this.parts.viewport.canvas, camera);
    }
  }

  // The frame's state is shown only while no newer view has been requested.
  private showMark(): void {
    const { canvas } = this.parts.viewport;
    const { dataset } = canvas;
    dataset.wanted = String(this.model.state.rev);
    const rests = dataset.rev === dataset.wanted && !this.playback.running;
    const state = rests ? (dataset.state as FrameState | undefined) : undefined;
    const scale = scaleText(Number(dataset.width ?? canvas.width), canvas.width);
    if (dataset.seq !== undefined && !this.connection.live) {
      this.parts.hud.mark("offline", "");
      return;
    }
    this.parts.hud.mark(state ?? "moving", scale);
  }

  private showLegend(): void {
    const view = this.model.drawnView();
    if (view === null) return;
    this.parts.legend.show(legendEntries(this.dataset(), view));
    leaveRoom(document.documentElement, view);
  }

  private showTime(): void {
    this.parts.timeBar.show(this.view().step ?? 0, this.playback.direction);
  }

  private loadMaps(): void {
    this.maps.load(this.baseUri).then(
      () => {
        this.parts.status.clearError("maps");
        if (this.model.open === null) return;
        this.parts.panels.build();
        this.refresh();
        this.showLegend();
      },
      () => this.parts.status.announce("the colour maps could not be loaded yet"),
    );
  }

  private sendVisibility(): void {
    if (!document.hidden) {
      this.connection.wake();
      this.flowing.seen();
    }
    this.connection.send({ type: "visibility", hidden: document.hidden });
  }
}
