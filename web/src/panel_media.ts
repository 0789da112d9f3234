// The media's panel: up to four scalar fields, each with its switch, field, colours and opacity.
import type GUI from "lil-gui";
import { fieldOptions } from "./controls";
import { unitText } from "./legend_entries";
import {
  curveOf,
  densityOf,
  followMedia,
  mediaOf,
  rampCurve,
  thresholdOf,
  withDensity,
  type Layer,
} from "./media";
import { PanelKit, type Access } from "./panel_kit";
import type { ScalarView } from "./protocol";

const layersMax = 4;

export function addMedia(gui: GUI, kit: PanelKit): void {
  const options = fieldOptions(kit.host.dataset(), "scalar");
  if (Object.keys(options).length === 0) return;
  const folder = gui.addFolder("Media");
  new MediaPanel(folder, kit, options);
}

class MediaPanel {
  private layers: Layer[] = [];
  private shape = ""; // fields and switches that the controls were built for
  private controls: PanelKit;

  constructor(
    private readonly folder: GUI,
    private readonly kit: PanelKit,
    private readonly options: Record<string, string>,
  ) {
    this.controls = new PanelKit(kit.host);
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
    this.controls = new PanelKit(this.kit.host);
    this.layers.forEach((_, index) => this.addLayer(index));
    if (this.layers.length >= layersMax) return;
    const used = new Set(this.layers.map((layer) => layer.view.field));
    const free = Object.values(this.options).find((field) => !used.has(field));
    const field = free ?? Object.values(this.options)[0]!;
    this.controls.action(this.folder, "Add a medium", "One more scalar field", () => {
      this.layers.push({ view: { field }, on: true });
      this.send();
    });
  }

  private update(index: number, change: Partial<ScalarView>): null {
    const layer = this.layers[index];
    if (layer === undefined) return null;
    layer.view = { ...layer.view, ...change };
    if (layer.on) this.send();
    return null; // sent already
  }

  private addLayer(index: number): void {
    const name = this.viewOf(index).field;
    const info = this.kit.host.dataset().fields.find((field) => field.name === name);
    const units = unitText(info?.units);
    const folder = this.folder.addFolder(`Medium: ${name}`);
    folder.domElement.title = info?.longName ?? "";
    this.addField(folder, index);
    this.addOpacity(folder, index, units);
    this.addColors(folder, index, units);
    this.addSampling(folder, index);
    this.controls.action(folder, "Remove", "Take this medium out of the view", () => {
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
        // Another field's range and opacity would mean nothing: its own defaults.
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
  }

  private addSampling(folder: GUI, index: number): void {
    this.controls.number(
      folder,
      "every n-th sample",
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
    const layer = () => this.viewOf(index);
    if (layer().extinction == null) return; // the server has not told its default yet
    const range = (): [number, number] =>
      (layer().color?.range ?? [curveOf(layer())[0]![0], curveOf(layer()).at(-1)![0]]) as [
        number,
        number,
      ];
    const density: Access<number> = {
      pointer: "/scalars/extinction",
      get: () => densityOf(curveOf(layer())),
      set: (value) =>
        this.update(index, {
          extinction: withDensity(curveOf(layer()), range(), value) as ScalarView["extinction"],
        }),
    };
    const [low, high] = [Math.min(...range()), Math.max(...range())];
    const most = densityOf(curveOf(layer()));
    this.controls.number(folder, "density", density, {
      min: 0,
      max: most > 0 ? Number((4 * most).toPrecision(2)) : 100,
    });
    this.controls.number(
      folder,
      units === "" ? "clear below" : `clear below (${units})`,
      {
        pointer: "/scalars/extinction",
        get: () => thresholdOf(curveOf(layer())) ?? low,
        set: (value) =>
          this.update(index, {
            extinction: rampCurve(
              range(),
              value,
              densityOf(curveOf(layer())) || most,
            ) as ScalarView["extinction"],
          }),
      },
      { min: low, max: high },
    );
  }
}
