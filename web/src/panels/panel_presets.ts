// Presets as small pictures. The server renders them one after another while the view rests and
// the pictures are visible; a change of the view ends the request that is under way.
import type GUI from "lil-gui";
import { make, observeVisibility } from "../base/dom";
import { ProblemError, type View } from "@windsplat/client";
import type { PanelKit } from "./panel_kit";
import { presetsOf, presetView, type Preset } from "../view/presets";

export interface PresetSwitch {
  openView(view: View): void; // replaces the present view; can be undone
}

const [width, height] = [192, 120]; // pixels, two for each of the page
const restMs = 700; // after the last change of the view
const busyMs = 3000; // until a busy server is asked again
const triesMax = 5;
const refusedCodes = [400, 422]; // of a view that the server does not draw

// Whether asking again would be in vain; a login, a busy server or a lost connection may change.
export const isRefusedView = (failure: unknown): boolean =>
  failure instanceof ProblemError && refusedCodes.includes(failure.status);

export function addPresets(gui: GUI, kit: PanelKit, actions: PresetSwitch): void {
  const folder = kit.folder(gui, "Views to start from", { open: true });
  const pictures = new PresetPictures(kit, actions);
  folder.$children.append(pictures.element);
  kit.onRefresh(() => pictures.refresh());
  pictures.refresh();
}

interface Tile {
  preset: Preset;
  button: HTMLButtonElement;
  image: HTMLImageElement;
}

// What a preset's picture shows: the step and the region of the present view.
export function pictureView(preset: Preset, kit: Pick<PanelKit, "host">): View {
  const { dataset, explicitView } = kit.host;
  const { step, region, image } = explicitView();
  const background = image?.background === undefined ? {} : { background: image.background };
  const now: View = { ...(region === undefined ? {} : { region }), ...(step ? { step } : {}) };
  return { ...presetView(preset, dataset(), now), image: { ...background, width, height } };
}

class PresetPictures {
  readonly element = make("div", "presets");
  private readonly tiles: Tile[];
  private readonly refused = new Set<string>(); // keys of views that the server does not draw
  private visible = false;
  private shown = ""; // the view at the last refresh
  private request: AbortController | null = null;
  private timer: number | undefined;
  private tries = 0;

  constructor(
    private readonly kit: PanelKit,
    private readonly actions: PresetSwitch,
  ) {
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Views to start from");
    this.tiles = presetsOf(kit.host.dataset(), width / height).map((preset) => this.tile(preset));
    this.element.append(...this.tiles.map(({ button }) => button));
    observeVisibility(this.element, (visible) => {
      this.visible = visible;
      if (visible) this.startSoon(restMs);
      else this.stop();
    });
  }

  refresh(): void {
    const { host } = this.kit;
    const now = JSON.stringify(host.view());
    const changed = now !== this.shown;
    this.shown = now;
    if (changed || !host.atRest()) {
      this.stop();
      this.tries = 0;
    }
    for (const tile of this.tiles) this.show(tile);
    if (host.atRest() && this.request === null) this.startSoon(restMs);
  }

  private tile(preset: Preset): Tile {
    const button = make("button", "preset");
    button.type = "button";
    button.title = preset.about;
    const image = make("img");
    image.alt = "";
    const frame = make("span", "preset-picture");
    frame.append(image);
    button.append(frame, make("span", "preset-title", preset.title));
    button.addEventListener("click", () => this.apply(preset.key));
    return { preset, button, image };
  }

  // With the camera of the present shape of the picture.
  private apply(key: string): void {
    const { host } = this.kit;
    const { width: wide = 1, height: high = 1 } = host.view().image ?? {};
    const preset = presetsOf(host.dataset(), wide / high).find((one) => one.key === key);
    if (preset === undefined) return;
    this.actions.openView(presetView(preset, host.dataset(), host.explicitView()));
  }

  private keyOf(tile: Tile): string {
    return JSON.stringify(pictureView(tile.preset, this.kit));
  }

  // The picture of another step stays until that of this one is there.
  private show(tile: Tile): void {
    const key = this.keyOf(tile);
    const url = this.kit.pictures.find(key);
    if (url !== undefined && tile.image.src !== url) tile.image.src = url;
    tile.button.hidden = this.refused.has(key);
    const isAwaited = !tile.image.hasAttribute("src") && this.tries < triesMax;
    tile.button.setAttribute("aria-busy", String(isAwaited));
  }

  private stop(): void {
    window.clearTimeout(this.timer);
    this.timer = undefined;
    this.request?.abort();
    this.request = null;
  }

  private startSoon(ms: number): void {
    if (this.timer !== undefined || !this.visible || this.tries >= triesMax) return;
    this.timer = window.setTimeout(() => {
      this.timer = undefined;
      if (this.request === null && this.kit.host.atRest()) void this.load();
    }, ms);
  }

  private async load(): Promise<void> {
    const request = new AbortController();
    this.request = request;
    const failed = this.tries;
    for (const tile of this.tiles) {
      const key = this.keyOf(tile);
      if (this.refused.has(key) || this.kit.pictures.find(key) !== undefined) continue;
      const goesOn = await this.draw(tile, key, request.signal);
      if (!goesOn || request.signal.aborted || !this.element.isConnected) break;
    }
    if (this.request !== request) return;
    this.request = null;
    if (this.tries > failed) this.startSoon(busyMs);
  }

  // Returns whether the server can be asked for the next picture: also where it has no memory for
  // this one.
  private async draw(tile: Tile, key: string, signal: AbortSignal): Promise<boolean> {
    const { api } = this.kit.host;
    try {
      this.kit.pictures.keep(key, await api.picture(pictureView(tile.preset, this.kit), signal));
    } catch (failure) {
      if (signal.aborted) return false;
      if (isRefusedView(failure)) this.refused.add(key);
      else {
        this.tries += 1;
        for (const one of this.tiles) this.show(one);
        return failure instanceof ProblemError && failure.status === 507;
      }
    }
    this.show(tile);
    return true;
  }
}
