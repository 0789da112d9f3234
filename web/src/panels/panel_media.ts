// The media panel: up to four scalar fields, each with a switch, field, colours and opacity.
import type GUI from "lil-gui";
import type { Range, ScalarView } from "@windsplat/client";
import { fieldOptions } from "./controls";
import { volumesTitle } from "../view/words";
import { unitText } from "../view/unit_text";
import {
  curveOf,
  densityOf,
  followMedia,
  mediaOf,
  rampCurve,
  thresholdOf,
  withDensity,
  type Curve,
  type Layer,
} from "./media";
import type { Access, PanelKit } from "./panel_kit";
import { namePart } from "../base/key_words";
import { isRamp } from "./transfer";

const layersMax = 4;

export function addMedia(gui: GUI, kit: PanelKit): void {
  const options = fieldOptions(kit.host.dataset(), "scalar");
  if (Object.keys(options).length === 0) return;
  const title = volumesTitle(kit.host.dataset());
  namePart("scalars", title);
  const folder = kit.folder(gui, title, { open: true, key: "Volumes" });
  new MediaPanel(folder, kit, options);
}

class MediaPanel {
  private layers: Layer[] = [];
  private shape = ""; // fields and switches for which the controls were built
  private controls: PanelKit;
  private readonly forms = new Map<string, Curve>(); // curves by field before density scaling

  constructor(
    private readonly folder: GUI,
    private readonly kit: PanelKit,
    private readonly options: Record<string, string>,
  ) {
    this.controls = kit.again();
    kit.onRefresh(() => this.refresh());
    this.refresh();
  }

  private refresh(): void {
    this.layers = followMedia(this.layers, this.kit.host.view().scalars ?? []);
    const shape = JSON.stringify([
      this.layers.map((layer) => [layer.view.field, layer.on, layer.view.extinction != null]),
      this.kit.host.maps.loaded,
    ]);
    if (shape !== this.shape) {
      this.shape = shape;
      this.build();
    } else {
      this.controls.refresh();
    }
  }

  private send(): void {
    this.kit.host.change({ scalars: mediaOf(this.layers) });
  }

  private build(): void {
    for (const child of [...this.folder.children]) child.destroy();
    this.controls = this.kit.again();
    this.layers.forEach((_, index) => this.addLayer(index));
    if (this.layers.length >= layersMax) return;
    const used = new Set(this.layers.map((layer) => layer.view.field));
    const free = Object.values(this.options).find((field) => !used.has(field));
    const field = free ?? Object.values(this.options)[0]!;
    this.controls.action(this.folder, "Add a volume", "One more scalar field", () => {
      this.layers.push({ view: { field }, on: true });
      this.send();
    });
  }

  private update(index: number, change: Partial<ScalarView>): null {
    const layer = this.layers[index];
    if (layer === undefined) return null;
    layer.view = { ...layer.view, ...change };
    if (layer.on) this.send();
    else this.controls.refresh();
    return null; // already sent
  }

  private addLayer(index: number): void {
    const name = this.viewOf(index).field;
    const info = this.kit.host.dataset().fields.find((field) => field.name === name);
    const units = unitText(info?.units);
    const folder = this.controls.folder(this.folder, `Volume: ${name}`, { open: true });
    folder.domElement.title = info?.longName ?? "";
    this.addField(folder, index);
    this.addOpacity(folder, index, units);
    this.addColors(folder, index, units);
    this.addCurve(folder, index);
    this.addSampling(folder, index);
    this.controls.action(folder, "Remove", "Take this volume out of the view", () => {
      this.layers.splice(index, 1);
      this.send();
    });
  }

  private viewOf(index: number): ScalarView {
    return this.layers[index]?.view ?? { field: "" };
  }

  private addField(folder: GUI, index: number): void {
    this.controls.toggle(folder, "shown", {
      pointer: "/scalars",
      get: () => this.layers[index]?.on,
      set: (on) => {
        this.layers[index]!.on = on;
        this.send();
        return null;
      },
    });
    this.controls.choice(
      folder,
      "field",
      {
        pointer: "/scalars/field",
        get: () => this.viewOf(index).field,
        // The range and opacity of another field do not apply, so the defaults are used.
        set: (field) => {
          this.layers[index]!.view = { field };
          this.send();
          return null;
        },
      },
      this.options,
    );
  }

  private addColors(folder: GUI, index: number, units: string): void {
    const color = () => this.viewOf(index).color;
    this.controls.map(folder, "map", {
      pointer: "/scalars/color/map",
      get: () => color()?.map,
      set: (map) => this.update(index, { color: { ...color(), map } }),
    });
    this.controls.range(
      folder,
      "colours",
      {
        pointer: "/scalars/color/range",
        get: () => color()?.range,
        set: (range) => this.update(index, { color: { ...color(), range } }),
      },
      units,
    );
    const shading = this.controls.choice(
      folder,
      "effect of sunlight",
      {
        pointer: "/scalars/shading",
        get: () => this.viewOf(index).shading,
        set: (shading) => this.update(index, { shading: shading as ScalarView["shading"] }),
      },
      { scatters: "scatter", "shades slopes": "gradient", "has no effect": "none" },
    );
    this.controls.showWhen((states) => states.light, shading);
  }

  private addCurve(parent: GUI, index: number): void {
    const field = this.viewOf(index).field;
    const color = () => this.viewOf(index).color;
    const { defaultView } = this.kit.host.dataset();
    const known = defaultView?.scalars?.find((medium) => medium.field === field);
    this.controls.histogram(parent, {
      key: `medium ${field}`,
      folder: "Opacity curve",
      open: true,
      title: () => field,
      field: () => field,
      range: () => (color()?.range ?? null) as Range | null,
      defaultRange: () => (known?.color?.range ?? null) as Range | null,
      // For a medium without a range the server supplies the default.
      choose: (range) => this.update(index, { color: { ...color(), range: range ?? undefined } }),
      map: () => color()?.map ?? undefined,
      ...(this.viewOf(index).extinction == null
        ? {} // the server has not sent the default curve yet
        : {
            curve: {
              curve: () => curveOf(this.viewOf(index)),
              setCurve: (curve) => this.setCurve(index, curve),
            },
          }),
    });
  }

  private setCurve(index: number, curve: Curve): null {
    return this.update(index, { extinction: curve as ScalarView["extinction"] });
  }

  private addSampling(parent: GUI, index: number): void {
    const folder = this.controls.more(parent);
    this.controls.number(
      folder,
      "sampling stride",
      {
        pointer: "/scalars/stride",
        get: () => this.viewOf(index).stride,
        set: (stride) => this.update(index, { stride }),
      },
      { min: 1, max: 16, step: 1 },
    );
    this.controls.number(
      folder,
      "min optical depth",
      {
        pointer: "/scalars/minOpticalDepth",
        get: () => this.viewOf(index).minOpticalDepth,
        set: (minOpticalDepth) => this.update(index, { minOpticalDepth }),
      },
      { min: 0, max: 0.05, step: 0.0001 },
    );
  }

  private addOpacity(folder: GUI, index: number, units: string): void {
    // the server has not sent the default curve yet
    if (this.viewOf(index).extinction == null) return;
    const curve = () => curveOf(this.viewOf(index));
    const low = () => Math.min(curve()[0]![0], ...(this.viewOf(index).color?.range ?? []));
    const ends = (): Range => [low(), curve().at(-1)![0]];
    const density: Access<number> = {
      pointer: "/scalars/extinction",
      get: () => densityOf(curve()),
      // A curve scaled to zero regains its shape.
      set: (value) => {
        const { field } = this.viewOf(index);
        const form = densityOf(curve()) > 0 ? curve() : (this.forms.get(field) ?? curve());
        this.forms.set(field, form);
        return this.setCurve(index, withDensity(form, ends(), value));
      },
    };
    const most = densityOf(curve());
    this.controls.number(folder, "density", density, {
      min: 0,
      max: most > 0 ? Number((4 * most).toPrecision(2)) : 100,
    });
    const clear = this.controls.number(
      folder,
      units === "" ? "transparent below" : `transparent below (${units})`,
      {
        pointer: "/scalars/extinction",
        get: () => thresholdOf(curve()) ?? low(),
        set: (value) => this.setCurve(index, rampCurve(ends(), value, densityOf(curve()) || most)),
      },
      { min: ends()[0], max: ends()[1] },
    );
    // "transparent below" applies only to ramps and to curves scaled to zero.
    const follow = () => clear.enable(densityOf(curve()) === 0 || isRamp(curve()));
    this.controls.onRefresh(follow);
    follow();
  }
}
