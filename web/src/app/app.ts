// Application controller: user input -> view document -> outgoing patches; incoming messages and
// frames -> picture, legend, panels, time bar and status text. The parts depend only on this class,
// not on each other.
import { Address } from "./address";
import type { AppParts } from "./app_parts";
import {
  CameraControl,
  ColorMaps,
  type Clock,
  type ConnectionState,
  type FrameState,
  watchPresence,
  type VideoOffer,
  type ViewModel,
  type Outgoing,
  type Patch,
  type DrawnFrame,
} from "@windsplat/client/parts";
import {
  Api,
  type Dataset,
  type ErrorMessage,
  type HelloMessage,
  type ProgressMessage,
  type View,
  ViewStream,
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
  private readonly stream: ViewStream;
  private readonly model: ViewModel;
  private readonly flowing: Flow;
  private parts!: AppParts;
  private opener!: DatasetOpener;
  private address!: Address;

  constructor(
    private readonly clock: Clock,
    private readonly baseUri: string,
  ) {
    this.api = new Api(baseUri, (url, init) => fetch(url, init));
    this.stream = this.makeStream();
    this.model = this.stream.model;
    this.cameras = new CameraControl(this.model, {
      change: (patch) => this.change(patch),
      size: () => this.parts.viewport.size(),
      ready: () => this.stream.connection.ready,
    });
    this.video = offerVideo(clock, {
      send: (message) => void this.stream.send(message),
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
      send: (message) => this.stream.send(message),
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
        this.send([outgoing]);
        return outgoing.rev;
      },
      ended: () => {
        this.address.save();
        this.refresh();
      },
    });
  }

  private makeStream(): ViewStream {
    return new ViewStream(
      this.baseUri,
      {},
      {
        frame: (frame) => {
          // A frame that cannot be shown must still return its credit to the server.
          this.parts.viewport.show(frame).catch(() => this.onBroken(frame.header.seq));
        },
        state: (state) => this.onState(state),
        settled: (rev) => this.onSettled(rev),
        changed: () => this.address.save(),
        progress: (message) => this.onProgress(message),
        stats: (message) => this.parts.hud.steps(message),
      },
      {
        acknowledge: "manual",
        clock: this.clock,
        opener: {
          begin: (hello) => this.onHello(hello),
          replace: (view) => this.turnTo(view),
          opened: (message) => this.opener.onOpened(message),
          refused: (message) => this.onError(message),
        },
      },
    );
  }

  start(parts: AppParts): void {
    this.parts = parts;
    this.address = new Address(
      {
        document: () => this.model.state.document,
        busy: () => this.playback.running || this.flowing.running || this.opener.opensEntry,
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
      this.stream.connection.start();
    });
    this.tellVisibility();
    watchPresence(this.stream.connection, () => this.tellVisibility());
  }

  private makeOpener({ status, list, cards, entries }: AppParts): DatasetOpener {
    return new DatasetOpener(
      {
        sendMessage: (message) => void this.stream.send(message),
        send: (outgoing) => this.send(outgoing),
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
          ).finally(() => this.address.save()),
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
    this.undoControl.edit(() => this.stream.change(patch));
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
    this.stream.connection.retryNow();
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
    this.stream.replace(view);
  }

  private turnTo(view: View): void {
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

  private send(outgoing: Outgoing[]): void {
    this.stream.transmit(outgoing);
    this.address.save();
  }

  private replace(view: View): void {
    this.flowing.stop();
    this.send(this.model.state.replace(view));
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
    this.video.greet();
    if (!this.maps.loaded) this.loadMaps();
    this.opener.begin(hello.datasets);
  }

  private onProgress({ id, phase, done, etaMs }: ProgressMessage): void {
    if (this.opener.awaits(id)) this.parts.status.progress(phase, done, etaMs);
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
      this.stream.withdraw(message.rev);
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
    const before = this.view().step ?? 0;
    const chosen = this.stream.show(header, this.playback.running);
    this.playback.shown(header.step, before);
    this.flowing.answered(header.rev);
    if (chosen !== null) status.empty(chosen.empty, nightText(chosen.view as View));
    hud.show(frame, chosen, viewport.canvas.width);
    status.clearError("frame");
    if (this.stream.isAfterRefusal(header.rev)) status.clearError("view");
    status.responded(frame);
    document.documentElement.classList.add("has-picture");
    this.refresh();
    this.showLegend();
  }

  private onSettled(rev: number): void {
    const { canvas } = this.parts.viewport;
    this.flowing.answered(rev);
    canvas.dataset.rev = String(Math.max(rev, Number(canvas.dataset.rev)));
    if (this.stream.isAfterRefusal(rev)) this.parts.status.clearError("view");
    this.refresh();
  }

  // Sent as soon as the frame is decoded, shown or not, so that the server may send another one.
  acknowledge(seq: number, decodeMs: number): void {
    this.stream.acknowledge(seq, decodeMs);
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
    if (dataset.seq !== undefined && !this.stream.connection.live) {
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

  private tellVisibility(): void {
    this.stream.setHidden(document.hidden);
    if (!document.hidden) this.flowing.seen();
  }
}
