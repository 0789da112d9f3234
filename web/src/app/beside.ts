// The second picture beside the first: a session of its own whose view follows that of the first,
// except for its dataset and step, and for its settings and camera while they are not linked. What
// the user chooses in its bar -> its view -> its picture.
import {
  ViewStream,
  type Camera,
  type ChosenMessage,
  type Dataset,
  type FrameHeader,
  type View,
} from "@windsplat/client";
import {
  besideSuffix,
  besideView,
  ownSettings,
  swapped,
  takeBeside,
  withOwnSettings,
  type Beside,
} from "../view/beside";
import {
  roundedCamera,
  afterResizing,
  type Clock,
  type ConnectionState,
  type CameraHost,
  Viewport,
  type ColorMaps,
  watchPresence,
} from "@windsplat/client/parts";
import { byId } from "../base/dom";
import { pictureCaption } from "../view/caption";
import { failureText, problemText } from "../base/problem_text";
import { markCamera } from "../viewport/camera_marks";
import { Legend } from "../viewport/legend";
import { legendEntries } from "../view/legend_entries";

export interface BesideHost {
  view(): View; // of the first picture, with all known values
  explicitView(): View; // of the first picture, without defaults
  drawn(): boolean; // whether the first picture has been drawn
  answered(): boolean; // whether the first picture is that of its newest view
  dataset(): Dataset; // of the first picture
  others(): Map<string, string>; // datasets that may be shown beside it: id -> text
  openOther(id: string): Promise<string>; // opens an entry that is not listed; its id
  openView(view: View): void; // shows another view in the first picture
  edited(): void; // what the address keeps has changed
  cameras: CameraHost; // of the first picture
  maps: ColorMaps;
}

const same = ""; // the dataset of the first picture

const spoken = (withOwnCamera: boolean): string =>
  withOwnCamera
    ? "The volume for comparison, with a camera of its own. Drag or use arrow keys to rotate it."
    : "The volume for comparison, with the camera of the first picture. " +
      "Drag or use the arrow keys to rotate both.";

export class BesidePicture {
  readonly canvas = byId("beside-picture", HTMLCanvasElement);
  private readonly section = byId("beside", HTMLElement);
  private readonly datasets = byId("beside-dataset", HTMLSelectElement);
  private readonly step = byId("beside-step", HTMLInputElement);
  private readonly linked = byId("beside-linked", HTMLInputElement);
  private readonly sameCamera = byId("beside-camera", HTMLInputElement);
  private readonly words = byId("beside-words", HTMLElement);
  private readonly button = byId("compare-button", HTMLButtonElement);
  private readonly viewport: Viewport;
  private readonly legend: Legend;
  private stream: ViewStream | null = null; // while it is shown
  private shows: Beside | null = null;
  private own: View | null = null; // settings that do not follow the first picture, all of them
  private drawn: View | null = null; // as the server drew it
  private choices = 0; // of datasets; answers to earlier ones are too late
  private caption = "";
  private sent = ""; // the view sent last, as text; a refused one is not sent again

  constructor(
    private readonly baseUri: string,
    private readonly clock: Clock,
    private readonly host: BesideHost,
  ) {
    this.legend = new Legend(byId("beside-legend", HTMLElement), host.maps);
    this.viewport = new Viewport(this.canvas, {
      decoded: ({ seq }, decodeMs) => this.stream?.acknowledge(seq, decodeMs),
      drawn: ({ header }) => this.stream?.show(header),
      broken: ({ seq }) => this.stream?.acknowledge(seq),
      videoFailed: () => {}, // no video is asked for
      resized: afterResizing(() => this.follow()),
    });
    const link = { retryNow: () => this.stream?.connection.retryNow() };
    watchPresence(link, () => this.sendVisibility());
    this.datasets.addEventListener("change", () => this.choose(this.datasets.value));
    this.step.addEventListener("change", () => this.chooseStep(this.step.value));
    this.linked.addEventListener("change", () => {
      this.own = this.linked.checked ? null : (this.stream?.explicit ?? null);
      this.show({ ...this.shows, settings: undefined });
    });
    this.sameCamera.addEventListener("change", () => {
      const camera = this.sameCamera.checked ? undefined : (this.cameras.camera() ?? {});
      this.show({ ...this.shows, camera });
    });
    byId("beside-swap", HTMLButtonElement).addEventListener("click", () => this.swap());
    byId("beside-close", HTMLButtonElement).addEventListener("click", () => this.show(null));
  }

  // --- the page's address ----------------------------------------------------------------

  get suffix(): string {
    return besideSuffix(this.kept);
  }

  // What restores this picture beside the first one; null: it is not shown.
  get kept(): Beside | null {
    if (this.shows === null || this.own === null) return this.shows;
    return { ...this.shows, settings: ownSettings(this.host.view(), this.own) };
  }

  // Shows what the address keeps; returns its rest.
  take(hash: string): string {
    const [rest, beside] = takeBeside(hash);
    this.open(beside);
    return rest;
  }

  // Shows what was kept; its own settings once the first picture has been drawn, from whose they
  // depart. null: closes this picture.
  open(beside: Beside | null): void {
    this.own = null;
    this.show(beside);
  }

  // --- its camera ------------------------------------------------------------------------

  get hasOwnCamera(): boolean {
    return this.shows?.camera !== undefined;
  }

  // Moves this picture alone, or both.
  readonly cameras: CameraHost = {
    camera: () => {
      const own = this.shows?.camera;
      if (own === undefined) return this.host.cameras.camera();
      const set = Object.entries(own).filter(([, value]) => value !== null);
      const camera = { ...this.drawn?.camera, ...Object.fromEntries(set) } as Camera;
      return camera.eye && camera.target && camera.up ? camera : null;
    },
    setCamera: (camera) => {
      if (this.hasOwnCamera) this.setOwnCamera(roundedCamera(camera));
      else this.host.cameras.setCamera(camera);
    },
    ready: () =>
      this.hasOwnCamera ? (this.stream?.connection.ready ?? true) : this.host.cameras.ready(),
  };

  // The server then frames the whole box.
  resetCamera(): void {
    const { projection, fovY } = this.shows?.camera ?? {};
    this.setOwnCamera({ projection, fovY });
  }

  private setOwnCamera(camera: Beside["camera"]): void {
    if (this.shows === null) return;
    this.shows = { ...this.shows, camera };
    this.stream?.connection.wake();
    this.follow();
    this.host.edited();
  }

  // --- what it shows ---------------------------------------------------------------------

  toggle(): void {
    if (this.shows !== null) {
      this.show(null);
      return;
    }
    if (!this.host.drawn()) return;
    // At first another step, if there is one; otherwise another dataset.
    const { count } = this.host.dataset().steps;
    const now = this.host.view().step ?? 0;
    const [other] = this.host.others().keys();
    this.show(count > 1 ? { step: now > 0 ? 0 : count - 1 } : {});
    if (count <= 1 && other !== undefined) this.choose(other);
    this.datasets.focus();
  }

  private show(beside: Beside | null): void {
    if (beside === null && this.shows === null) return;
    const hadFocus = this.section.contains(document.activeElement);
    this.shows = beside;
    this.section.hidden = beside === null;
    this.button.setAttribute("aria-pressed", String(beside !== null));
    document.documentElement.classList.toggle("comparing", beside !== null);
    if (beside === null) {
      this.own = null;
      this.choices += 1;
      this.stream?.close();
      this.stream = null;
      this.words.textContent = "";
      if (hadFocus) this.returnFocus();
    }
    this.follow();
    this.host.edited();
  }

  // Narrow pages have no button.
  private returnFocus(): void {
    const main = byId("picture", HTMLCanvasElement);
    (this.button.offsetParent === null ? main : this.button).focus();
  }

  private choose(id: string): void {
    const choice = ++this.choices;
    this.words.textContent = "";
    if (id === same) {
      this.show({ ...this.shows, dataset: undefined });
      return;
    }
    this.host.openOther(id).then(
      (dataset) => {
        if (this.shows !== null && choice === this.choices) this.show({ ...this.shows, dataset });
      },
      (failure: unknown) => {
        if (this.shows === null || choice !== this.choices) return;
        this.words.textContent = failureText(failure);
        this.words.classList.add("refused");
        this.writeBar(); // the dataset that is still shown
      },
    );
  }

  private chooseStep(text: string): void {
    const counted = Number(text);
    const step = text.trim() === "" || !(counted >= 1) ? undefined : Math.round(counted) - 1;
    this.show({ ...this.shows, step });
  }

  // The first picture shows what this one shows, and the other way round.
  private swap(): void {
    if (this.shows === null || this.shows.settings !== undefined) return;
    const [explicit, first] = [this.host.explicitView(), this.host.view()];
    const [view, beside, own] = swapped({ explicit, first, beside: this.shows, own: this.own });
    this.own = own;
    this.show(beside);
    this.host.openView(view);
  }

  // The first picture, or this one's place, has changed.
  follow(): void {
    if (this.shows === null || !this.host.drawn()) return;
    this.writeBar();
    if (this.stream !== null && !this.stream.connection.ready) return;
    if (!this.hasSettings()) return;
    const next = besideView(this.host.view(), this.shows, this.viewport.askedSize(), this.own);
    const text = JSON.stringify(next);
    if (text === this.sent && this.stream !== null) return;
    this.sent = text;
    if (this.stream === null) this.stream = this.begin(next);
    else this.stream.replace(next);
    this.canvas.dataset.wanted = String(this.stream.model.state.rev);
  }

  private begin(view: View): ViewStream {
    const stream: ViewStream = new ViewStream(
      this.baseUri,
      view,
      {
        frame: (frame) => {
          this.viewport.show(frame).catch(() => stream.acknowledge(frame.header.seq));
        },
        shown: (header, chosen) => this.onShown(header, chosen),
        settled: (rev) => this.onSettled(rev),
        state: (state) => this.onState(state),
        hello: ({ limits }) => {
          this.viewport.newSession(limits.imagePixelsMax);
          this.canvas.dataset.wanted = String(stream.model.state.rev);
          this.follow(); // the limits of the server may be others
        },
        refused: ({ problem, message }) => {
          this.words.textContent = problem === null ? message : problemText(problem);
          this.words.classList.add("refused");
        },
      },
      { acknowledge: "manual", clock: this.clock },
    );
    stream.setHidden(document.hidden);
    return stream;
  }

  // Whether its own settings are known. Those that were kept depart from the settings of the first
  // picture, whose defaults are known once it has been drawn.
  private hasSettings(): boolean {
    const { settings, ...shows } = this.shows!;
    if (settings === undefined) return true;
    if (!this.host.answered()) return false;
    this.own = withOwnSettings(this.host.view(), settings);
    this.shows = shows;
    return true;
  }

  private writeBar(): void {
    const { dataset = same, step } = this.shows!;
    const others = this.host.others();
    if (dataset !== same && !others.has(dataset)) others.set(dataset, dataset);
    const options = [[same, "same dataset"], ...others].map(([id, text]) => `${id}\n${text}`);
    if (this.datasets.dataset.options !== options.join("\n\n")) {
      this.datasets.dataset.options = options.join("\n\n");
      this.datasets.replaceChildren(
        new Option("same dataset", same),
        ...[...others].map(([id, text]) => new Option(text, id)),
      );
    }
    this.datasets.value = dataset;
    this.linked.checked = this.own === null && this.shows!.settings === undefined;
    this.sameCamera.checked = !this.hasOwnCamera;
    this.showLegend();
    this.canvas.ariaLabel = spoken(this.hasOwnCamera);
    if (document.activeElement !== this.step) {
      this.step.value = step === undefined ? "" : String(step + 1);
    }
  }

  // --- the server ------------------------------------------------------------------------

  private onState(state: ConnectionState): void {
    this.section.dataset.connection = state.name;
    if (state.name !== "waiting" && state.name !== "asleep" && state.name !== "locked") return;
    this.words.textContent = state.name === "locked" ? "needs a login" : state.reason;
    this.words.classList.add("refused");
  }

  private onShown(header: FrameHeader, chosen: ChosenMessage | null): void {
    if (chosen !== null && this.stream?.isAfterRefusal(header.rev)) {
      const view = chosen.view as View;
      this.caption = this.captionOf(view, header.step);
      this.showCaption();
      this.drawn = view;
      this.showLegend();
      markCamera(this.canvas, view.camera as Camera); // as the server drew it
    }
    this.follow(); // changes that had to wait
  }

  // The picture shown is the answer to the newest patch.
  private onSettled(rev: number): void {
    if (!this.stream?.isAfterRefusal(rev)) return;
    this.canvas.dataset.rev = String(Math.max(rev, Number(this.canvas.dataset.rev)));
    this.showCaption();
  }

  private showCaption(): void {
    this.words.classList.remove("refused");
    this.words.textContent = this.caption;
  }

  // With settings of its own; otherwise the legend of the first picture is that of both. The page
  // knows the fields of the first picture's dataset only.
  private showLegend(): void {
    const dataset = this.host.dataset();
    const view = this.own === null ? null : this.drawn;
    this.legend.show(view?.dataset === dataset.id ? legendEntries(dataset, view) : []);
  }

  private captionOf({ dataset = "" }: View, step: number): string {
    const first = this.host.dataset();
    if (dataset === first.id) return pictureCaption(first, step);
    return `${this.host.others().get(dataset) ?? dataset} · step ${step + 1}`;
  }

  private sendVisibility(): void {
    this.stream?.setHidden(document.hidden);
  }
}
