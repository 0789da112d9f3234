// The page's one mind: what the user does -> view document -> patches out; messages and frames in
// -> picture, legend, panels, time bar and words. Parts do not know each other, only this does.
import {
  anglesOf,
  distanceOf,
  frameBox,
  scaledBox,
  withProjection,
  type Angles,
  type Box,
  type Camera,
  type Vec3,
} from "./camera";
import { ColorMaps } from "./color_maps";
import {
  Connection,
  streamUrl,
  type Clock,
  type ConnectionState,
  type SocketLike,
} from "./connection";
import { debounced } from "./dom";
import { Flow } from "./flow";
import type { Gizmo } from "./gizmo";
import type { Hud } from "./hud";
import type { Legend } from "./legend";
import { legendEntries } from "./legend_entries";
import { hashOfView, viewOfHash } from "./link";
import type { Panels } from "./panels";
import {
  type ChosenMessage,
  type Dataset,
  type DatasetSummary,
  type ErrorMessage,
  type HelloMessage,
  type ServerMessage,
  type UnchangedMessage,
  type View,
} from "./protocol";
import { problemText, type Status } from "./status";
import type { TimeBar } from "./time_bar";
import { ViewState, withDefaults, type Outgoing, type Patch } from "./view_state";
import type { DrawnFrame, Viewport } from "./viewport";

export interface AppParts {
  viewport: Viewport;
  hud: Hud;
  legend: Legend;
  gizmo: Gizmo;
  panels: Panels;
  timeBar: TimeBar;
  status: Status;
  picker: HTMLSelectElement;
  facts: HTMLElement; // dims and steps of the dataset
}

const firstChoice = "climate"; // of the samples, the one that shows most
const chosenKept = 8; // `chosen` messages whose frames may still come
const hashDelayMs = 400;
const presenceMs = 60_000;
const globe: Box = { min: [-1, -1, -1], max: [1, 1, 1] }; // of a grid that is bent to a sphere

const round = (v: number): number => Number(v.toFixed(6));
const roundAll = (v: Vec3): Vec3 => [round(v[0]), round(v[1]), round(v[2])];

export class App {
  readonly maps = new ColorMaps();
  private readonly state = new ViewState();
  private readonly connection: Connection;
  private parts!: AppParts;
  private datasets: DatasetSummary[] = [];
  private open: Dataset | null = null; // what is shown
  private openId = 0;
  private opening = false; // `opened` has not come yet
  private readonly chosen = new Map<number, ChosenMessage>();
  private drawn: ChosenMessage | null = null;
  private shownSeq = 0; // of the frame on the canvas
  private unchanged: UnchangedMessage | null = null; // its frame is not shown yet
  private playing = false;
  private refusedRev = 0; // of the newest patch that was refused
  private restored = new Set<number>(); // revs of the view that took a refused one's place
  private answeredT = 0; // t of the newest patch that a frame has answered
  private readonly flowing: Flow;
  private readonly saveHash = debounced(() => this.writeHash(), hashDelayMs);

  constructor(
    clock: Clock,
    private readonly baseUri: string,
  ) {
    this.connection = new Connection(
      streamUrl(baseUri),
      // A socket's handlers may ask for less than what the browser hands them.
      (url, protocol) => new WebSocket(url, protocol) as unknown as SocketLike,
      clock,
      {
        state: (state) => this.onState(state),
        hello: (hello) => this.onHello(hello),
        message: (message) => this.onMessage(message),
        frame: (frame) => {
          // A frame that cannot be shown still gives its credit back.
          this.parts.viewport.show(frame).catch(() => this.onBroken(frame.header.seq));
        },
      },
    );
    this.flowing = new Flow({
      now: () => performance.now(),
      setTimeout: clock.setTimeout,
      clearTimeout: clock.clearTimeout,
      hidden: () => document.hidden,
      wanted: () => this.linesMove(),
      time: () => this.view().vector?.motion?.time ?? 0,
      send: (time) => {
        const outgoing = this.state.change({ vector: { motion: { time } } });
        this.send(outgoing);
        return outgoing.rev;
      },
      ended: () => {
        this.saveHash();
        this.refresh();
      },
    });
  }

  start(parts: AppParts): void {
    this.parts = parts;
    parts.picker.addEventListener("change", () => this.openDataset(parts.picker.value));
    const linked = viewOfHash(window.location.hash);
    if (linked === null && window.location.hash.length > 1) this.sayBadLink();
    this.state.change(this.firstView(linked ?? {}) as Patch);
    this.loadMaps();
    this.connection.start();
    window.addEventListener("online", () => this.connection.retryNow());
    window.addEventListener("hashchange", () => this.restoreHash());
    document.addEventListener("visibilitychange", () => this.tellVisibility());
    window.setInterval(() => {
      if (!document.hidden) this.tellVisibility();
    }, presenceMs);
  }

  // --- what the user does --------------------------------------------------------------

  // The view with every default that is known: what the newest frame was drawn with, under what
  // the user has said since.
  view(): View {
    const said = this.state.document;
    const drawn = this.drawn?.view.dataset === said.dataset ? this.drawn?.view : undefined;
    const open = this.open?.id === said.dataset ? this.open?.defaultView : undefined;
    return withDefaults(drawn ?? open ?? {}, said) as View;
  }

  dataset(): Dataset {
    if (this.open === null) throw new Error("no dataset is open");
    return this.open;
  }

  change(patch: Patch): void {
    this.connection.wake();
    this.send(this.state.change(patch));
    this.refresh();
  }

  camera(): Camera | null {
    const camera = this.view().camera;
    if (this.open === null || !camera?.eye || !camera.target) return null;
    return {
      projection: camera.projection ?? "perspective",
      eye: camera.eye,
      target: camera.target,
      up: camera.up ?? [0, 0, 1],
      fovY: camera.fovY ?? 35,
      height: camera.height ?? 2,
    };
  }

  setCamera(camera: Camera): void {
    const { eye, target, up, projection } = camera;
    const patch: Patch = {
      eye: roundAll(eye),
      target: roundAll(target),
      up: roundAll(up),
      height: round(camera.height),
    };
    if (projection !== this.view().camera?.projection) patch.projection = projection;
    this.change({ camera: patch });
  }

  // The server frames the whole box anew, whatever the window's shape.
  resetCamera(): void {
    this.change({ camera: { eye: null, target: null, up: null, height: null } });
  }

  lookFrom(angles: Angles): void {
    const camera = this.camera();
    if (camera === null) return;
    const world = this.dataset().world as Box;
    const { mapping, scale } = this.view().geometry ?? {};
    const box = mapping === "sphere" ? globe : scaledBox(world, scale ?? [1, 1, 1]);
    const [width, height] = this.parts.viewport.size();
    this.setCamera(frameBox(camera, box, angles, width / height));
  }

  toggleProjection(): void {
    const camera = this.camera();
    if (camera === null) return;
    const other = camera.projection === "perspective" ? "orthographic" : "perspective";
    this.setCamera(withProjection(camera, other));
  }

  resetAll(): void {
    this.replace(this.firstView({ dataset: this.dataset().id }));
  }

  resize(width: number, height: number): void {
    const image = this.state.document.image;
    if (image?.width === width && image.height === height) return;
    this.change({ image: { width, height } });
  }

  seek(step: number): void {
    if (this.playing) this.pause();
    if (step !== this.view().step) this.change({ step });
  }

  play(): void {
    const { timeBar } = this.parts;
    const to = timeBar.steps - 1;
    if (to < 1) return;
    this.playing = this.connection.send({
      type: "play",
      from: 0,
      to,
      fps: timeBar.fps,
      loop: timeBar.loop,
      drop: true,
    });
    this.showTime();
  }

  pause(): void {
    this.playing = false;
    this.connection.send({ type: "pause" });
    this.showTime();
    this.saveHash();
  }

  // Lets the lines flow or halts them where they are.
  flow(on: boolean): void {
    if (on) {
      if (!this.linesMove()) this.change({ vector: { motion: { mode: "phase" } } });
      this.flowing.start();
    } else {
      this.flowing.stop();
      this.saveHash();
    }
    this.refresh();
  }

  isFlowing(): boolean {
    return this.flowing.running;
  }

  playSettings(): void {
    if (this.playing) this.play();
  }

  openDataset(id: string): void {
    if (id === "" || id === this.open?.id) return;
    this.parts.status.clearError("dataset");
    this.requestOpen(id, this.state.replace(this.firstView({ dataset: id })));
  }

  async copyLink(): Promise<void> {
    this.writeHash();
    try {
      await navigator.clipboard.writeText(window.location.href);
      this.parts.status.say("link copied");
    } catch {
      this.parts.status.say("the address bar holds the link");
    }
  }

  // --- the server ----------------------------------------------------------------------

  private firstView(said: View): View {
    const [width, height] = this.parts.viewport.size();
    return { ...said, image: { ...said.image, width, height } };
  }

  private linesMove(): boolean {
    const { vector } = this.view();
    return vector?.field !== null && vector?.motion?.mode === "phase";
  }

  private send({ rev, patch }: Outgoing): void {
    this.connection.send({ type: "patch", rev, t: performance.now(), patch });
    this.saveHash();
  }

  private replace(view: View): void {
    this.flowing.stop();
    for (const outgoing of this.state.replace(view)) this.send(outgoing);
    this.refresh();
  }

  // The view goes first, so that the first picture is already the wanted one; `open` only asks what
  // the dataset holds.
  private requestOpen(id: string, outgoing: Outgoing[]): void {
    this.openId += 1;
    this.opening = true;
    this.playing = false;
    this.flowing.stop();
    this.parts.status.startLoading(`opening ${id}…`);
    for (const one of outgoing) this.send(one);
    this.connection.send({ type: "open", id: this.openId, dataset: id });
    this.showMark();
  }

  private onState(state: ConnectionState): void {
    this.parts.status.connection(state);
    if (state.name !== "live") this.playing = false;
    if (this.open !== null) this.showTime();
  }

  // A new session: it knows nothing yet, so it is told the dataset and the whole view.
  private onHello(hello: HelloMessage): void {
    this.datasets = hello.datasets;
    // A server that came back with other datasets does not have what was shown.
    if (!this.datasets.some((dataset) => dataset.id === this.open?.id)) this.open = null;
    this.parts.viewport.newSession();
    this.chosen.clear();
    this.unchanged = null;
    this.shownSeq = 0;
    const wanted = this.state.document.dataset;
    const id = wanted ?? this.defaultDataset();
    this.showPicker(id ?? "");
    if (!this.maps.loaded) this.loadMaps();
    if (id === undefined) {
      this.parts.status.error("open", "The server has no dataset to show.");
      return;
    }
    if (wanted === undefined) this.state.change({ dataset: id });
    this.requestOpen(id, [this.state.restate()]);
    this.tellVisibility();
  }

  private defaultDataset(): string | undefined {
    const usable = this.datasets.filter((dataset) => dataset.state !== "failed");
    return (usable.find((dataset) => dataset.id === firstChoice) ?? usable[0])?.id;
  }

  private onMessage(message: ServerMessage): void {
    const { status } = this.parts;
    switch (message.type) {
      case "opened":
        if (message.id === this.openId) this.onOpened(message.dataset);
        break;
      case "progress":
        status.progress(message.phase, message.done, message.etaMs);
        break;
      case "chosen":
        this.chosen.set(message.seq, message);
        for (const seq of this.chosen.keys()) {
          if (this.chosen.size > chosenKept) this.chosen.delete(seq);
        }
        break;
      case "unchanged":
        this.unchanged = message;
        this.settleUnchanged();
        break;
      case "error":
        this.onError(message);
        break;
      default:
        break;
    }
  }

  private onOpened(dataset: Dataset): void {
    const { panels, picker, status, timeBar, gizmo, facts } = this.parts;
    const other = this.open?.id !== dataset.id;
    this.open = dataset;
    this.opening = false;
    status.clearError("open");
    status.loaded();
    status.say("live");
    picker.value = dataset.id;
    timeBar.setDataset(dataset);
    gizmo.setGeographic(dataset.axes.x.kind === "longitude");
    const { x, y, z } = dataset.dims;
    const steps = dataset.steps.count;
    facts.textContent = `${x} × ${y} × ${z} · ${steps} step${steps === 1 ? "" : "s"}`;
    facts.title = `${dataset.title} — ${dataset.source} (${dataset.format})`;
    document.title = `${dataset.title} · windsplat`;
    this.restoreDataset();
    if (other) panels.build();
    this.refresh();
    this.showLegend();
  }

  private onError(message: ErrorMessage): void {
    const { status } = this.parts;
    const text = problemText(message.problem);
    if (this.opening && message.id === this.openId) {
      this.openFailed(text);
    } else if (message.rev !== undefined) {
      status.error("view", text);
      this.refusedRev = message.rev;
      // What was refused is taken back, so that controls and link tell what is drawn.
      this.state.refuse(message.rev);
      this.flowing.refused(message.rev);
      // The defaults themselves were refused: to ask for them again would never end.
      if (!this.opening && !this.restored.has(message.rev)) this.restoreDataset();
      this.refresh();
    } else {
      status.error("server", text);
    }
  }

  // A whole view was refused (a link with a value of another release, say): its dataset with the
  // defaults is better than nothing.
  private restoreDataset(): void {
    if (this.open !== null && this.state.document.dataset !== this.open.id) {
      this.parts.status.holdError();
      const outgoing = this.state.replace(this.firstView({ dataset: this.open.id }));
      this.restored = new Set(outgoing.map(({ rev }) => rev));
      for (const one of outgoing) this.send(one);
      this.refresh();
    }
  }

  private openFailed(text: string): void {
    const { status, picker } = this.parts;
    this.opening = false;
    status.loaded();
    status.error("dataset", text);
    const failed = picker.value || this.state.document.dataset;
    const fallback = this.open?.id ?? this.defaultDataset();
    picker.value = fallback ?? "";
    if (fallback === undefined || fallback === failed) return;
    if (this.open !== null) {
      status.say("live");
      this.restoreDataset();
      this.refresh();
    } else {
      this.requestOpen(fallback, this.state.replace(this.firstView({ dataset: fallback })));
    }
  }

  onDrawn(frame: DrawnFrame): void {
    const { header } = frame;
    const { hud, status } = this.parts;
    this.connection.send({ type: "ack", seq: header.seq, decodeMs: frame.decodeMs });
    this.shownSeq = header.seq;
    this.state.settle(header.rev);
    this.flowing.answered(header.rev);
    const chosen = this.chosen.get(header.seq) ?? null;
    this.chosen.delete(header.seq);
    if (chosen !== null) this.drawn = chosen;
    // Nothing newer was asked for, or time runs by itself: the step is the server's.
    if (this.playing || header.rev === this.state.rev) this.followStep(header.step);
    hud.show(frame, chosen);
    status.clearError("frame");
    if (header.rev > this.refusedRev) status.clearError("view");
    this.settleUnchanged();
    // Only the first frame that echoes a patch tells how fast the answer to it was.
    if (header.t > 0 && header.t !== this.answeredT) status.responded(performance.now() - header.t);
    this.answeredT = header.t;
    document.documentElement.classList.add("has-picture");
    this.refresh();
    this.showLegend();
  }

  // A patch changed nothing that shows: once its frame is there, that is the answer to it.
  private settleUnchanged(): void {
    if (this.unchanged === null || this.shownSeq < this.unchanged.seq) return;
    const { canvas } = this.parts.viewport;
    const { rev } = this.unchanged;
    this.unchanged = null;
    this.state.settle(rev);
    this.flowing.answered(rev);
    canvas.dataset.rev = String(Math.max(rev, Number(canvas.dataset.rev)));
    if (rev > this.refusedRev) this.parts.status.clearError("view");
    this.refresh();
  }

  // A frame that is not shown still has to give its credit back.
  acknowledge(seq: number, decodeMs: number): void {
    this.connection.send({ type: "ack", seq, decodeMs });
  }

  onBroken(seq: number): void {
    this.acknowledge(seq, 0);
    this.parts.status.error("frame", "A frame arrived that is no picture.");
  }

  // --- showing -------------------------------------------------------------------------

  private followStep(step: number): void {
    if (step !== this.state.document.step) this.state.follow(step);
    const { timeBar } = this.parts;
    if (!timeBar.loop && step === timeBar.steps - 1) this.playing = false;
  }

  private refresh(): void {
    this.showMark();
    if (this.open === null) return;
    this.parts.panels.refresh();
    this.showTime();
    const camera = this.camera();
    if (camera !== null) {
      this.parts.gizmo.show(camera);
      const { azimuth, elevation } = anglesOf(camera);
      const { dataset } = this.parts.viewport.canvas;
      dataset.azimuth = azimuth.toFixed(1);
      dataset.elevation = elevation.toFixed(1);
      dataset.distance = distanceOf(camera).toFixed(4);
    }
  }

  // final: nothing newer was asked for and the server will not draw this view again.
  private showMark(): void {
    const { dataset } = this.parts.viewport.canvas;
    dataset.wanted = String(this.state.rev);
    const final = dataset.final === "true" && dataset.rev === dataset.wanted && !this.playing;
    this.parts.hud.mark(final, Number(dataset.level ?? 0));
  }

  private showLegend(): void {
    const view = this.drawn?.view;
    if (this.open === null || view?.dataset !== this.open.id) return;
    this.parts.legend.show(legendEntries(this.open, view as View));
  }

  private showTime(): void {
    this.parts.timeBar.show(this.view().step ?? 0, this.playing);
  }

  private showPicker(id: string): void {
    const { picker } = this.parts;
    picker.replaceChildren(
      ...this.datasets.map((dataset) => {
        const option = new Option(dataset.title || dataset.id, dataset.id);
        option.disabled = dataset.state === "failed";
        return option;
      }),
    );
    picker.value = id;
  }

  private loadMaps(): void {
    this.maps.load(this.baseUri).then(
      () => {
        this.parts.status.clearError("maps");
        if (this.open === null) return;
        this.parts.panels.build();
        this.refresh();
        this.showLegend();
      },
      () => this.parts.status.say("the colour maps could not be loaded yet"),
    );
  }

  // Also said now and then while the page is seen: a viewer who only looks is not idle.
  private tellVisibility(): void {
    if (!document.hidden) {
      this.connection.wake();
      this.flowing.seen();
    }
    this.connection.send({ type: "visibility", hidden: document.hidden });
  }

  private writeHash(): void {
    if (this.playing || this.flowing.running) return;
    const hash = hashOfView(this.state.document);
    if (window.location.hash !== hash) window.history.replaceState(null, "", hash);
  }

  private sayBadLink(): void {
    this.parts.status.error("link", "This link holds no view that can be read.");
  }

  private restoreHash(): void {
    const view = viewOfHash(window.location.hash);
    if (view === null) {
      this.sayBadLink();
      return;
    }
    this.parts.status.clearError("link");
    const next = this.firstView(view);
    const id = view.dataset ?? this.open?.id ?? this.defaultDataset();
    if (id !== undefined && id !== this.open?.id) {
      this.requestOpen(id, this.state.replace({ ...next, dataset: id }));
    } else {
      this.replace({ ...next, dataset: id });
    }
  }
}
