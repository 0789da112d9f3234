// Controls of the panels: each shows one key of the view and changes it by a merge patch. Labels
// are defined here; explanations (titles) and limits come from the schema of the view.
import GUI, { Controller, type NumberController } from "lil-gui";
import {
  viewRanges,
  type Api,
  type Range,
  type Dataset,
  type FrameHeader,
  type View,
} from "@windsplat/client";
import { explain } from "./help_texts";
import { type ColorMaps, type Patch, clamp } from "@windsplat/client/parts";
import { controlStates, type ControlStates, type Options } from "./controls";
import { make } from "../base/dom";
import { PictureStore } from "../base/picture_store";
import { Folders, type FolderOptions } from "./panel_folders";
import { nameKey } from "../base/key_words";
import { histogramBins, HistogramView } from "./histogram_view";
import { unitText } from "../view/unit_text";
import type { RangeMode } from "./range_choice";
import { formatNumber } from "../base/ticks";
import type { CurveSource } from "./transfer_view";

export interface PanelHost {
  view(): View; // with all known defaults
  explicitView(): View; // without them
  atRest(): boolean; // the picture is the final one of the view, and nothing moves
  change(patch: Patch): void;
  quietly(run: () => void): void; // runs changes that add no undo entry
  dataset(): Dataset;
  maps: ColorMaps;
  api: Api;
  playing(): boolean;
  frame(): FrameHeader | null; // the frame on the canvas
}

// A histogram of a field with a selectable range.
export interface HistogramOptions {
  key: string; // key of the range, unique within the panel
  folder?: string; // title of the folder
  open?: boolean; // at first
  field(): string | null; // null: no field at present
  title(): string;
  range(): Range | null;
  defaultRange(): Range | null; // null: not known
  choose(range: Range | null): void; // null: the default
  map?(): string | undefined; // colour map of the range
  curve?: CurveSource;
}

export interface NumberOptions {
  min?: number;
  max?: number;
  step?: number;
  field?: boolean; // a number box without a slider
}

// What is preserved when panels are rebuilt.
export class Kept {
  readonly modes = new Map<string, RangeMode>();
  readonly folders = new Folders();
  readonly pictures = new PictureStore();
}

export function valueAt(view: unknown, pointer: string): unknown {
  let value = view;
  for (const key of pointer.split("/").slice(1)) {
    if (typeof value !== "object" || value === null) return undefined;
    value = (value as Record<string, unknown>)[key];
  }
  return value;
}

export function patchAt(pointer: string, value: unknown): Patch {
  const keys = pointer.split("/").slice(1);
  return keys.reduceRight<unknown>((inner, key) => ({ [key]: inner }), value) as Patch;
}

// Custom access to a value that is not simply one key.
export interface Access<T> {
  pointer: string; // pointer of the key whose explanation is shown
  get(view: View): T | null | undefined;
  set(value: T): Patch | null;
}

export const keyAccess = <T>(pointer: string): Access<T> => ({
  pointer,
  get: (view) => valueAt(view, pointer) as T | null | undefined,
  set: (value) => patchAt(pointer, value),
});

// Rounds to the digits that a control shows.
const shownValue = <T>(value: T): T =>
  typeof value === "number" ? (Number(value.toPrecision(6)) as T) : value;

// A box has room for about six characters: 0.000001 would be displayed as 0.0000.
function shortenSmall(controller: NumberController): void {
  const update = controller.updateDisplay.bind(controller);
  controller.updateDisplay = () => {
    update();
    const value = controller.getValue();
    if (value !== 0 && Math.abs(value) < 1e-3 && !controller._inputFocused) {
      controller.$input.value = formatNumber(value, 6);
    }
    return controller;
  };
  controller.updateDisplay();
}

// A colour or a time, edited by the browser's own picker.
class PickerBox extends Controller {
  private readonly input = make("input");

  constructor(folder: GUI, model: { value: string }, type: "color" | "datetime-local") {
    super(folder, model, "value", type === "color" ? "color-box" : "time-box");
    this.input.type = type;
    this.input.setAttribute("aria-labelledby", this.$name.id);
    this.input.addEventListener(type === "color" ? "input" : "change", () => {
      if (this.input.value === "") this.updateDisplay();
      else this.setValue(this.input.value);
    });
    this.$widget.append(this.input);
    this.updateDisplay();
  }

  override updateDisplay(): this {
    this.input.value = this.getValue() as string;
    return this;
  }
}

export class PanelKit {
  private readonly refreshers: (() => void)[] = [];

  constructor(
    readonly host: PanelHost,
    private readonly kept: Kept,
  ) {}

  get pictures(): PictureStore {
    return this.kept.pictures;
  }

  // For controls that are replaced on their own.
  again(): PanelKit {
    return new PanelKit(this.host, this.kept);
  }

  folder(parent: GUI, title: string, options?: FolderOptions): GUI {
    return this.kept.folders.add(parent, title, options);
  }

  // A folder for what is rarely needed.
  more(parent: GUI): GUI {
    return this.folder(parent, "More");
  }

  refresh(): void {
    for (const refresh of this.refreshers) refresh();
  }

  onRefresh(run: () => void): void {
    this.refreshers.push(run);
  }

  number(
    folder: GUI,
    label: string,
    access: Access<number>,
    options: NumberOptions = {},
  ): Controller {
    const [least, most] = viewRanges[access.pointer] ?? [];
    const min = options.min ?? least;
    const max = options.max ?? most;
    const model = { value: shownValue(access.get(this.host.view()) ?? min ?? 0) };
    const controller = options.field
      ? folder.add(model, "value")
      : folder.add(model, "value", min, max);
    if (options.step !== undefined) controller.step(options.step);
    shortenSmall(controller as NumberController);
    return this.bind(controller, label, model, access);
  }

  // A number spanning many magnitudes: a box, and a logarithmic slider that yields two digits.
  logarithmic(folder: GUI, label: string, access: Access<number>): Controller {
    const [min = 1e-6, max = 1] = viewRanges[access.pointer] ?? [];
    const within = (value: number): number => clamp(shownValue(value), min, max);
    const controller = this.number(
      folder,
      label,
      { ...access, set: (value) => (Number.isFinite(value) ? access.set(within(value)) : null) },
      { field: true, step: min },
    );
    const slider = make("input", "log-slider");
    slider.type = "range";
    slider.min = String(Math.log10(min));
    slider.max = String(Math.log10(max));
    slider.step = "0.05";
    slider.setAttribute("aria-label", label);
    slider.addEventListener("input", () => {
      const value = Number((10 ** Number(slider.value)).toPrecision(2));
      const patch = access.set(within(value));
      if (patch !== null) this.host.change(patch);
    });
    const follow = () => {
      const value = access.get(this.host.view());
      if (typeof value !== "number") return;
      slider.value = String(Math.log10(value));
      slider.setAttribute("aria-valuetext", String(shownValue(value)));
    };
    this.onRefresh(follow);
    follow();
    controller.domElement.querySelector(".lil-widget")?.prepend(slider);
    return controller;
  }

  toggle(folder: GUI, label: string, access: Access<boolean>): Controller {
    const model = { value: access.get(this.host.view()) ?? false };
    return this.bind(folder.add(model, "value"), label, model, access);
  }

  // The options may depend on the view. A value that is not among them is still listed while the
  // view contains it.
  choice(
    folder: GUI,
    label: string,
    access: Access<string>,
    options: Options | ((view: View) => Options),
  ): Controller {
    const now = (): Options =>
      typeof options === "function" ? options(this.host.view()) : options;
    const withOwn = (value: string): Options =>
      Object.values(now()).includes(value) ? now() : { ...now(), [value]: value };
    const model = { value: access.get(this.host.view()) ?? Object.values(now())[0] ?? "" };
    let offered = withOwn(model.value);
    const controller = folder.add(model, "value", offered);
    this.onRefresh(() => {
      const next = withOwn(access.get(this.host.view()) ?? model.value);
      if (JSON.stringify(next) === JSON.stringify(offered)) return;
      offered = next;
      controller.options(next);
    });
    return this.bind(controller, label, model, access);
  }

  // A line of text, sent once it is entered. `set` throws an Error whose message says what it does
  // not understand: it is shown below, and the text stays to be corrected.
  text(folder: GUI, label: string, access: Access<string>): Controller {
    const { pointer } = access;
    const now = (): string => access.get(this.host.view()) ?? "";
    const model = { value: now() };
    let refused = "";
    const controller = folder.add(model, "value").name(label);
    nameKey(pointer, label);
    explain(controller.domElement, pointer);
    const input = controller.domElement.querySelector("input")!;
    const kit = this.again();
    kit.note(folder, () => refused);
    const show = () => {
      const isEdited = input === document.activeElement || refused !== "";
      if (isEdited || now() === model.value) return;
      model.value = now();
      controller.updateDisplay();
    };
    controller.onFinishChange((value: string) => {
      refused = "";
      try {
        const patch = access.set(value);
        if (patch !== null) this.host.change(patch);
      } catch (reason) {
        refused = (reason as Error).message;
      }
      input.setAttribute("aria-invalid", String(refused !== ""));
      kit.refresh();
    });
    this.onRefresh(show);
    return controller;
  }

  color(folder: GUI, label: string, access: Access<string>): Controller {
    const model = { value: access.get(this.host.view()) ?? "#000000" };
    return this.bind(new PickerBox(folder, model, "color"), label, model, access);
  }

  // A time to the minute, without its time zone: 2024-06-21T12:00.
  time(folder: GUI, label: string, access: Access<string>): Controller {
    const model = { value: access.get(this.host.view()) ?? "" };
    return this.bind(new PickerBox(folder, model, "datetime-local"), label, model, access);
  }

  // A colour map picker that displays the map itself.
  map(folder: GUI, label: string, access: Access<string>): Controller {
    const names = this.host.maps.names();
    const controller = this.choice(
      folder,
      label,
      access,
      Object.fromEntries(names.map((name) => [name, name])),
    );
    const strip = make("span", "map-strip");
    controller.domElement.querySelector(".lil-widget")?.append(strip);
    const paint = () => {
      strip.style.backgroundImage = this.host.maps.gradient(access.get(this.host.view()) ?? "");
    };
    this.onRefresh(paint);
    paint();
    return controller;
  }

  // Two boxes for the ends of a range; both are sent, because a merge patch replaces arrays as a
  // whole.
  range(folder: GUI, label: string, access: Access<[number, number]>, units: string): Controller[] {
    const ends = ["from", "to"] as const;
    return ends.map((end, index) => {
      const unit = units === "" ? "" : ` (${units})`;
      return this.number(
        folder,
        `${label} ${end}${unit}`,
        {
          pointer: access.pointer,
          get: (view) => access.get(view)?.[index],
          set: (value) => {
            const range = access.get(this.host.view());
            if (!range) return null;
            const next: [number, number] = [range[0], range[1]];
            next[index] = value;
            return next[0] === next[1] ? null : access.set(next);
          },
        },
        { field: true },
      );
    });
  }

  // A separate folder, so that the histogram is computed only while visible.
  histogram(parent: GUI, options: HistogramOptions): GUI {
    const folder = this.folder(parent, options.folder ?? "Histogram", { open: options.open });
    const { host } = this;
    const dataset = host.dataset();
    const step = () => (host.playing() ? null : (host.view().step ?? 0));
    const view: HistogramView = new HistogramView({
      ...options,
      key: `${dataset.id} ${options.key}`,
      modes: this.kept.modes,
      units: () => {
        const named = dataset.fields.find((one) => one.name === options.field());
        return unitText(named?.units);
      },
      steps: dataset.steps.count,
      quietly: (run) => host.quietly(run),
      step,
      dataKey: () => {
        const field = options.field();
        const { step: at = 0, difference = null } = host.view();
        return field === null || host.playing() ? null : JSON.stringify([at, field, difference]);
      },
      load: () => {
        const { step: at = 0, difference } = host.view();
        return host.api.histogram(dataset.id, options.field()!, at, histogramBins, difference);
      },
      of: () => {
        const { dataset: id, difference = null } = host.view();
        const field = options.field();
        return id !== dataset.id || field === null ? null : JSON.stringify([field, difference]);
      },
      title: () => (host.view().difference ? `difference of ${options.title()}` : options.title()),
      read: async (at) => {
        const { difference } = host.view();
        const { range } = await host.api.range(dataset.id, options.field()!, at, difference);
        return view.element.isConnected ? range : null; // null if the panel has been rebuilt
      },
      ...(options.map === undefined
        ? {}
        : { gradient: (from, to) => host.maps.gradient(options.map!() ?? "", from, to) }),
    });
    folder.$children.append(view.element);
    this.onRefresh(() => view.refresh());
    return folder;
  }

  action(folder: GUI, label: string, title: string, run: () => void): Controller {
    const controller = folder.add({ run }, "run").name(label);
    controller.domElement.title = title;
    return controller;
  }

  // A note below the preceding controls, updated with the view.
  note(folder: GUI, text: () => string): void {
    const element = make("p", "panel-note");
    folder.$children.append(element);
    element.hidden = true;
    const write = () => {
      const next = text();
      if (element.textContent === next) return;
      element.textContent = next;
      element.hidden = next === "";
    };
    this.onRefresh(write);
    write();
  }

  // Shows the controls only while they apply.
  showWhen(counts: (states: ControlStates) => boolean, ...parts: (Controller | GUI)[]): void {
    this.follow(counts, (on) => parts.forEach((part) => part.show(on)));
  }

  // Disables the controls while they do not apply.
  enableWhen(counts: (states: ControlStates) => boolean, ...controllers: Controller[]): void {
    this.follow(counts, (on) => controllers.forEach((controller) => controller.enable(on)));
  }

  private follow(counts: (states: ControlStates) => boolean, apply: (on: boolean) => void): void {
    let last: boolean | null = null;
    const run = () => {
      const on = counts(controlStates(this.host.view()));
      if (on !== last) apply(on);
      last = on;
    };
    this.onRefresh(run);
    run();
  }

  private bind<T>(
    controller: Controller,
    label: string,
    model: { value: T },
    access: Access<T>,
  ): Controller {
    controller.name(label);
    nameKey(access.pointer, label);
    explain(controller.domElement, access.pointer);
    controller.onChange((value: T) => {
      const patch = access.set(value);
      if (patch !== null) this.host.change(patch);
    });
    this.onRefresh(() => {
      const value = access.get(this.host.view());
      if (value === undefined || value === null || shownValue(value) === model.value) return;
      model.value = shownValue(value);
      controller.updateDisplay();
    });
    return controller;
  }
}
