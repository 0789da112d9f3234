// Controls of the panels: each shows one key of the view and changes it by a merge patch.
// Labels are ours; the explanations (titles) and limits come from the view's schema.
import GUI, { type Controller } from "lil-gui";
import { viewHelp } from "../generated/view_help";
import type { ColorMaps } from "./color_maps";
import { controlStates, type ControlStates, type Options } from "./controls";
import { make } from "./dom";
import type { Dataset, View } from "./protocol";
import type { Patch } from "./view_state";

export interface PanelHost {
  view(): View; // with every default that is known
  change(patch: Patch): void;
  dataset(): Dataset;
  maps: ColorMaps;
}

export interface NumberLook {
  min?: number;
  max?: number;
  step?: number;
  field?: boolean; // a number box without a slider
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

// A value's own read and write, where it is not simply a key.
export interface Access<T> {
  pointer: string; // whose explanation to show
  get(view: View): T | null | undefined;
  set(value: T): Patch | null;
}

export const keyAccess = <T>(pointer: string): Access<T> => ({
  pointer,
  get: (view) => valueAt(view, pointer) as T | null | undefined,
  set: (value) => patchAt(pointer, value),
});

// As many digits as anyone turns by hand.
const shownValue = <T>(value: T): T =>
  typeof value === "number" ? (Number(value.toPrecision(6)) as T) : value;

export class PanelKit {
  private readonly refreshers: (() => void)[] = [];

  constructor(readonly host: PanelHost) {}

  refresh(): void {
    for (const refresh of this.refreshers) refresh();
  }

  onRefresh(run: () => void): void {
    this.refreshers.push(run);
  }

  number(folder: GUI, label: string, access: Access<number>, look: NumberLook = {}): Controller {
    const help = viewHelp[access.pointer];
    const min = look.min ?? help?.min;
    const max = look.max ?? help?.max;
    const model = { value: shownValue(access.get(this.host.view()) ?? min ?? 0) };
    const controller = look.field
      ? folder.add(model, "value")
      : folder.add(model, "value", min, max);
    if (look.step !== undefined) controller.step(look.step);
    return this.bind(controller, label, model, access);
  }

  toggle(folder: GUI, label: string, access: Access<boolean>): Controller {
    const model = { value: access.get(this.host.view()) ?? false };
    return this.bind(folder.add(model, "value"), label, model, access);
  }

  // A value that is not offered is still shown while the view has it.
  choice(folder: GUI, label: string, access: Access<string>, options: Options): Controller {
    const withOwn = (value: string): Options =>
      Object.values(options).includes(value) ? options : { ...options, [value]: value };
    const model = { value: access.get(this.host.view()) ?? Object.values(options)[0] ?? "" };
    const controller = folder.add(model, "value", withOwn(model.value));
    let offered = model.value;
    this.onRefresh(() => {
      const value = access.get(this.host.view());
      if (value === undefined || value === null || value === offered) return;
      offered = value;
      controller.options(withOwn(value));
    });
    return this.bind(controller, label, model, access);
  }

  color(folder: GUI, label: string, access: Access<string>): Controller {
    const model = { value: access.get(this.host.view()) ?? "#000000" };
    return this.bind(folder.addColor(model, "value"), label, model, access);
  }

  // A colour map's picker, with the map itself in it.
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

  // Two boxes for the ends of a range; both are sent, as the wire takes arrays whole.
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

  action(folder: GUI, label: string, title: string, run: () => void): Controller {
    const controller = folder.add({ run }, "run").name(label);
    controller.domElement.title = title;
    return controller;
  }

  // Words below the controls before them, of the view as it is.
  note(folder: GUI, text: () => string): void {
    const element = make("p", "panel-note");
    folder.$children.append(element);
    element.hidden = true;
    const write = () => {
      const words = text();
      if (element.textContent === words) return;
      element.textContent = words;
      element.hidden = words === "";
    };
    this.onRefresh(write);
    write();
  }

  // Shown only while they count.
  showWhen(counts: (states: ControlStates) => boolean, ...parts: (Controller | GUI)[]): void {
    this.follow(counts, (on) => parts.forEach((part) => part.show(on)));
  }

  // Out of use while they do not count.
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
    controller.domElement.title = viewHelp[access.pointer]?.text ?? "";
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
