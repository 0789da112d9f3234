// <windsplat-view src="https://your.host/" dataset="winds">: a live picture of a view in any page.
import { Client } from "../client/client";
import { isOfDataset } from "../client/opener";
import { failureText, ownOrigin, ProblemError, refusesPages } from "../wire/requests";
import type { Camera } from "../view/camera";
import { zoom } from "../view/camera";
import { pixelAt, withoutSize } from "../view/picture_size";
import type { Patch } from "../view/view_state";
import { moveOfKey } from "../viewport/camera_keys";
import { MoveQueue, PointerInput, type Move } from "../viewport/input";
import type { ConnectionState } from "../wire/connection";
import type { Reach } from "../wire/reach";
import type { ChosenMessage, Dataset, FrameHeader, View } from "../wire/protocol";
import { asked, stepOf, viewOf } from "./attributes";
import { ControlBar } from "./control_bar";
import type { ErrorKind, WindsplatEvents } from "./events";
import { LivePicture } from "./live_picture";
import { Loading } from "./loading";
import { fill } from "./template";

const observed = ["src", "dataset", "view", "step", "label", "controls", "interactive"] as const;
const properties = [...observed, "token", "pick"];
// Servers that render pages import the module too, and have no elements.
const Base = globalThis.HTMLElement ?? (class {} as typeof HTMLElement);
const spoken = "A picture of a 3-D field, drawn on a server.";
const needsToken = "the server asks for a token: set the property `token`";
const wrongToken = "the server refuses the token";
const spokenKeys = `${spoken} Drag or use the arrow keys to rotate it.`;

export class WindsplatView extends Base {
  static readonly observedAttributes: readonly string[] = observed;

  // Every element has a read-only property `dataset` (of its data- attributes), which frameworks
  // that set properties would fail to set.
  static {
    const inherited = Object.getOwnPropertyDescriptor(Base.prototype, "dataset");
    Object.defineProperty(this.prototype, "dataset", {
      configurable: true,
      enumerable: true,
      get(this: WindsplatView): unknown {
        return inherited?.get?.call(this);
      },
      set(this: WindsplatView, id: unknown): void {
        this.reflect("dataset", id);
      },
    });
  }

  private readonly inside = fill(this.attachShadow({ mode: "open", delegatesFocus: true }));
  private readonly bar: ControlBar;
  private readonly moves: MoveQueue;
  private readonly loading = new Loading(this.inside, (text) => this.sayFirst(text));
  private live: LivePicture | null = null;
  private client: Client | null = null;
  private given: View | null = null; // by the property `view`
  private kept: View | null = null; // while there is no stream
  private secret: string | undefined;
  // attributes that changed since the last microtask; "page": came into a page
  private changes = new Set<string>();
  // whether those of `dataset` and `step` have changed later than the view
  private attributesFirst = false;
  private playing = false;
  private told = false; // the present outage

  constructor() {
    super();
    const { canvas } = this.inside;
    this.moves = new MoveQueue(
      {
        camera: () => this.camera,
        setCamera: (camera) => this.live?.cameras.setCamera(camera),
        ready: () => this.live?.cameras.ready() ?? true, // without a stream moves are lost
      },
      (run) => void window.requestAnimationFrame(run),
    );
    new PointerInput(canvas, this.moves, {
      clicked: (x, y) => void this.pickAt(x, y),
      // The wheel scrolls the page until the picture was chosen by a click or the tab key.
      takesWheel: ({ ctrlKey }) =>
        this.interactive && (ctrlKey || this.shadowRoot?.activeElement === canvas),
      active: () => this.interactive,
      fingerScrolls: true,
    });
    canvas.addEventListener("keydown", (event) => this.onKey(event));
    this.bar = new ControlBar(this.inside, {
      seek: (step) => this.seek(step),
      toggle: () => (this.playing ? this.pause() : this.play()),
      zoom: (factor) => this.move((camera) => zoom(camera, factor)),
      reset: () => this.resetCamera(),
    });
  }

  connectedCallback(): void {
    for (const name of properties) this.upgrade(name);
    this.showAttributes();
    if (this.live === null) this.schedule("page");
  }

  /** A node that is only moved within the page keeps its stream. */
  disconnectedCallback(): void {
    queueMicrotask(() => {
      if (!this.isConnected) this.stop();
    });
  }

  attributeChangedCallback(name: string, before: string | null, now: string | null): void {
    if (before !== now) this.schedule(name);
  }

  // --- properties ------------------------------------------------------------------------

  /** Address of the server; without one that of the page. */
  get src(): string {
    return new URL(this.getAttribute("src") ?? "", document.baseURI).href;
  }

  set src(url: string | URL | null | undefined) {
    this.reflect("src", url);
  }

  /** The explicit keys of the view, without the size of the picture. */
  get view(): View {
    const view = this.live?.stream.explicit ?? this.kept;
    return view === null ? this.askedView() : withoutSize(view);
  }

  /**
   * An object, or JSON text. What was set before may be set again, as frameworks do whenever they
   * render: reset() goes back to it.
   */
  set view(view: View | string | null | undefined) {
    const given = view === null || view === undefined ? null : viewOf(view);
    if (JSON.stringify(given) === JSON.stringify(this.given)) return;
    this.given = given;
    this.schedule("view");
  }

  /** The token of the server; an attribute would show it to everyone who can read the page. */
  set token(token: string | undefined | null) {
    this.secret = token ?? undefined;
    this.schedule("src");
  }

  /** A time step, counted from 0. */
  get step(): number {
    return this.view.step ?? 0;
  }

  set step(step: number | null | undefined) {
    this.reflect("step", step);
  }

  get label(): string {
    return this.getAttribute("label") ?? "";
  }

  set label(label: string | null | undefined) {
    this.reflect("label", label);
  }

  get controls(): boolean {
    return this.hasAttribute("controls");
  }

  set controls(on: boolean) {
    this.toggleAttribute("controls", Boolean(on));
  }

  /** Whether pointer, wheel, keys and touch move the camera. */
  get interactive(): boolean {
    return this.getAttribute("interactive") !== "false";
  }

  set interactive(on: boolean | "true" | "false" | null | undefined) {
    this.reflect("interactive", on);
  }

  /** Whether a click asks the server what is seen there. */
  get pick(): boolean {
    return this.hasAttribute("pick");
  }

  set pick(on: boolean) {
    this.toggleAttribute("pick", Boolean(on));
  }

  /** null: not known before the first picture. */
  get camera(): Camera | null {
    return this.live?.cameras.camera() ?? null;
  }

  set camera(camera: Camera) {
    this.live?.cameras.setCamera(camera);
  }

  /** The description of the dataset that is shown; null: not known yet. */
  get description(): Dataset | null {
    return this.live?.stream.dataset ?? null;
  }

  /** The server over REST; null while the element is in no page. */
  get server(): Client | null {
    return this.client;
  }

  // --- methods ---------------------------------------------------------------------------

  /** Changes the view by a merge patch (RFC 7396). */
  change(patch: Patch): void {
    this.live?.stream.change(patch);
  }

  /** Shows the view of the attributes and properties again. */
  reset(): void {
    this.schedule("reset");
  }

  /** The server frames the whole volume, or faces the slice. */
  resetCamera(): void {
    this.live?.cameras.reset();
  }

  /**
   * The header of the final frame of the present view, once it is shown. Fails if the view is
   * refused or the connection is lost before.
   */
  async final(): Promise<FrameHeader> {
    if (this.changes.size > 0) await Promise.resolve(); // attributes take effect first
    if (this.live === null) throw new Error("no stream: the element is in no page");
    return (await this.live.stream.final()).header;
  }

  /** Plays all steps from the first to the last, again and again. fps: steps per second. */
  play(fps = 10): void {
    const count = this.description?.steps.count ?? 0;
    if (count < 2) return;
    this.setPlaying(this.live?.stream.play(0, count - 1, { fps }) ?? false);
  }

  pause(): void {
    if (!this.playing) return;
    this.live?.stream.pause();
    this.setPlaying(false);
  }

  // --- the stream ------------------------------------------------------------------------

  private start(): void {
    const view = this.attempt(() => this.kept ?? this.askedView());
    const client = this.attempt(() => new Client(this.src, { token: this.secret }));
    if (view === undefined || client === undefined) return;
    this.told = false;
    this.client = client;
    this.live = new LivePicture(this.inside.canvas, client, view, {
      shown: (header, chosen) => this.onShown(header, chosen),
      state: (state) => this.onState(state),
      settled: (rev) => this.settled(rev),
      reached: (reach, reason) => this.lost(reach, reason),
      opened: (dataset) => this.bar.describe(dataset),
      refused: (error) => this.onRefused(error),
      changed: () => this.onChanged(),
      progress: (progress) => this.loading.show(progress),
      broken: () => this.fail("frame", "a frame could not be decoded"),
    });
  }

  private stop(): void {
    if (this.live === null) return;
    this.kept = this.view;
    this.live.stop();
    this.live = null;
    this.client = null;
    this.setPlaying(false);
  }

  // Frameworks set attributes and properties one after another.
  private schedule(name: string): void {
    if (this.changes.size === 0) queueMicrotask(() => this.apply());
    this.changes.add(name);
  }

  private apply(): void {
    const { changes } = this;
    this.changes = new Set();
    const anew = ["dataset", "view", "reset"].some((name) => changes.has(name));
    if (changes.has("view")) this.attributesFirst = false;
    else if (changes.has("dataset") || changes.has("step")) this.attributesFirst = true;
    const step = changes.has("step") ? this.attempt(() => stepOf(this.getAttribute("step"))) : null;
    if (changes.has("src")) this.stop();
    if (anew) this.kept = null;
    else if (this.kept !== null) this.kept = asked(this.kept, null, step ?? null);
    if (!this.isConnected) return;
    this.showAttributes();
    if (this.live === null) {
      this.start();
    } else if (anew) {
      const view = this.attempt(() => this.askedView());
      if (view !== undefined) this.live.stream.replace(view);
    } else if (typeof step === "number") {
      this.seek(step);
    }
  }

  private showAttributes(): void {
    const { canvas, controls } = this.inside;
    const name = this.label || (this.interactive ? spokenKeys : spoken);
    canvas.setAttribute("aria-label", name);
    canvas.tabIndex = this.interactive ? 0 : -1;
    controls.hidden = !this.controls;
  }

  // Of the property `view` or else the attribute, with those of the other attributes: these hold if
  // it does not name a dataset or step itself, or if they have changed later.
  private askedView(): View {
    const view = this.given ?? viewOf(this.getAttribute("view") ?? "");
    const named = asked({}, this.getAttribute("dataset"), stepOf(this.getAttribute("step")));
    return this.attributesFirst ? { ...view, ...named } : { ...named, ...view };
  }

  private attempt<T>(run: () => T): T | undefined {
    try {
      return run();
    } catch (error) {
      this.fail("attribute", failureText(error));
      return undefined;
    }
  }

  // --- what the server tells -------------------------------------------------------------

  private onShown(header: FrameHeader, chosen: ChosenMessage | null): void {
    this.settled(header.rev);
    this.loading.end();
    this.bar.showStep(header.step);
    const view = (chosen?.view ?? null) as View | null;
    this.emit("windsplat-frame", { header, final: header.final, step: header.step, view });
  }

  // The words of a refusal stay until the picture of a later change.
  private settled(rev: number): void {
    if (this.live?.isAfterRefusal(rev) ?? true) this.say("");
  }

  private onChanged(): void {
    const { view, camera } = this;
    this.emit("windsplat-view", { view, camera, step: view.step ?? 0 });
  }

  private onState(state: ConnectionState): void {
    if (state.name === "live") {
      this.told = false;
      this.say("");
      return;
    }
    this.setPlaying(false);
    this.loading.end();
    if (state.name === "asleep") this.say(`paused: ${state.reason}`);
    if (state.name === "connecting" && !this.told) this.say("connecting …");
  }

  // An outage is told once it is known what the server answers otherwise, while the stream may be
  // on its next attempt.
  private lost(reach: Reach, reason: string): void {
    const { origin } = new URL(this.src);
    const login = this.secret === undefined ? needsToken : wrongToken;
    if (reach === "login") this.outage("login", login);
    else if (reach === "foreign") this.outage("connection", refusesPages(origin));
    else if (reach === "answers" || origin === ownOrigin()) this.outage("connection", reason);
    else this.outage("connection", `no answer from ${origin}`);
  }

  private outage(kind: ErrorKind, message: string): void {
    if (this.told) return;
    this.told = true;
    this.fail(kind, message);
  }

  private onRefused(error: ProblemError): void {
    this.fail(isOfDataset(error) ? "dataset" : "view", error.message, error);
  }

  // --- input -----------------------------------------------------------------------------

  private move(move: Move): void {
    this.moves.push(move);
  }

  private seek(step: number): void {
    this.pause();
    this.change({ step });
  }

  private setPlaying(on: boolean): void {
    this.playing = on;
    this.bar.showPlaying(on);
  }

  private onKey(event: KeyboardEvent): void {
    if (!this.interactive || event.altKey || event.ctrlKey || event.metaKey) return;
    const move = moveOfKey(event);
    if (move !== null) this.move(move);
    else if (!this.runKey(event.key)) return;
    event.preventDefault();
  }

  private runKey(key: string): boolean {
    const count = this.description?.steps.count ?? 1;
    const neighbour = this.step + (key === "]" ? 1 : -1);
    if (key === "0" || key === "Home") this.resetCamera();
    else if (count < 2) return false;
    else if (key === " ") this.playing ? this.pause() : this.play();
    else if (key !== "[" && key !== "]") return false;
    else if (neighbour >= 0 && neighbour < count) this.seek(neighbour);
    return true;
  }

  // What a click shows; only if the page asks for it, since the server draws a part of the picture.
  private async pickAt(x: number, y: number): Promise<void> {
    const { client, live } = this;
    if (client === null || live === null || !this.pick) return;
    const { view } = live.stream;
    try {
      const feature = await client.pick(view, pixelAt(view, [x, y]));
      this.emit("windsplat-pick", { x, y, feature });
    } catch (error) {
      this.fail("pick", failureText(error), error, false);
    }
  }

  // --- output ----------------------------------------------------------------------------

  private say(text: string): void {
    this.inside.message.textContent = text;
  }

  // Where nothing is shown yet there is room for words, but not in place of an error.
  private sayFirst(text: string): boolean {
    const { live } = this;
    if (live === null || live.hasShown) return false;
    if (!live.hasRefused) this.say(text);
    return true;
  }

  private fail(kind: ErrorKind, message: string, cause?: unknown, shown = true): void {
    if (shown) this.say(message);
    const problem = cause instanceof ProblemError ? cause.problem : null;
    this.emit("windsplat-error", { kind, message, problem });
  }

  private emit<K extends keyof WindsplatEvents>(
    name: K,
    detail: WindsplatEvents[K]["detail"],
  ): void {
    this.dispatchEvent(new CustomEvent(name, { detail, bubbles: true, composed: true }));
  }

  // Frameworks remove a property by setting it to null or undefined.
  private reflect(name: string, value: unknown): void {
    if (value === null || value === undefined) this.removeAttribute(name);
    else this.setAttribute(name, String(value));
  }

  // A property that was set before the element was defined hides that of the class.
  private upgrade(name: string): void {
    if (!Object.hasOwn(this, name)) return;
    const values = this as unknown as Record<string, unknown>;
    const value = values[name];
    delete values[name];
    values[name] = value;
  }
}
