// The surfaces panel: isosurfaces and sections of scalar fields, each with colours and opacity.
import type GUI from "lil-gui";
import { surfaceColors } from "../view/legend_entries";
import { unitText } from "../view/unit_text";
import { failureText } from "../base/problem_text";
import type { FieldRange, Histogram, SurfaceView } from "@windsplat/client";
import { colorsIn, contrastColor } from "../view/contrast_color";
import { fieldOptions } from "./controls";
import { histogramBins } from "./histogram_view";
import { focusControl, focusedControl } from "./panel_folders";
import { keyAccess, type Access, type PanelKit } from "./panel_kit";
import {
  candidates,
  contoursWith,
  facingAxis,
  firstIsosurface,
  isEdgeOn,
  keepsValue,
  levelsIn,
  middleValue,
  noSurfaceText,
  type Axis,
} from "./surface_choice";

const surfacesMax = 8;
const rangesMax = 64; // that are kept
const ownColor = ""; // the choice of colours that needs no field
const cuts: Record<string, string> = {
  isosurface: "isosurface",
  "layer across x": "x",
  "layer across y": "y",
  "layer across z": "z",
  "oblique plane": "plane",
};

const noCut = { isovalue: null, slice: null, plane: null, contours: null };

const kindOf = (surface: SurfaceView): string =>
  surface.slice?.axis ?? (surface.plane ? "plane" : "isosurface");

export function addSurfaces(gui: GUI, kit: PanelKit): void {
  const options = fieldOptions(kit.host.dataset(), "scalar");
  const { axes } = kit.host.dataset();
  const flat = [axes.x, axes.y, axes.z].some((axis) => axis.world.length < 2);
  if (Object.keys(options).length === 0 || flat) return;
  new SurfacesPanel(kit.folder(gui, "Surfaces"), kit, options);
}

class SurfacesPanel {
  private shape = ""; // what decides which controls there are
  private controls: PanelKit;
  private message = ""; // about what could not be added or changed
  private readonly ranges = new Map<string, FieldRange | null>(); // null: asked for

  constructor(
    private readonly folder: GUI,
    private readonly kit: PanelKit,
    private readonly options: Record<string, string>,
  ) {
    this.controls = kit.again();
    kit.onRefresh(() => this.refresh());
    this.refresh();
  }

  // As the view has them, so that no default is sent back.
  private surfaces(): SurfaceView[] {
    return this.kit.host.explicitView().surfaces ?? [];
  }

  private refresh(): void {
    const shape = JSON.stringify([
      this.surfaces().map((s) => [s.field, kindOf(s), s.color?.field, s.contours != null]),
      this.kit.host.maps.loaded,
    ]);
    if (shape !== this.shape) {
      this.shape = shape;
      this.build();
    } else {
      this.controls.refresh();
    }
  }

  private send(surfaces: SurfaceView[]): void {
    this.message = "";
    this.kit.host.change({ surfaces });
  }

  // Keeps the focus that a control had which is built anew.
  private build(): void {
    const at = focusedControl(this.folder);
    this.buildControls();
    if (at !== null) focusControl(this.folder, at);
  }

  private buildControls(): void {
    for (const child of [...this.folder.children]) child.destroy();
    this.controls = this.kit.again();
    this.surfaces().forEach((_, index) => this.addSurface(index));
    this.controls.note(this.folder, () => this.message);
    if (this.surfaces().some((surface) => surface.contours != null)) {
      this.controls.toggle(
        this.folder,
        "numbers on contours",
        keyAccess<boolean>("/annotations/contourLabels"),
      );
    }
    if (this.surfaces().length >= surfacesMax) return;
    const add = (label: string, title: string, run: () => void) =>
      this.controls.action(this.folder, label, title, run);
    add("Add an isosurface", "Where a field has one value", () => this.addIsosurface());
    const section = (axis: Axis) => {
      const field = candidates(this.kit.host.dataset())[0]!;
      this.send([...this.surfaces(), { field, slice: this.layerOf(axis) }]);
    };
    add("Add a level section", "A layer of the grid in colours", () => section("z"));
    add("Add a vertical section", "The one that faces the camera", () =>
      section(facingAxis(this.kit.host.view())),
    );
  }

  private async histogram(field: string): Promise<Histogram> {
    const { host } = this.kit;
    const { step = 0, difference } = host.view();
    return host.api.histogram(host.dataset().id, field, step, histogramBins, difference);
  }

  // Reads values and then changes the surfaces, unless these have changed meanwhile.
  private afterReading<T>(read: () => Promise<T>, use: (answer: T) => void): void {
    const before = JSON.stringify(this.surfaces());
    const { id } = this.kit.host.dataset();
    const isCurrent = () =>
      this.kit.host.explicitView().dataset === id && JSON.stringify(this.surfaces()) === before;
    const say = (text: string) => {
      this.message = text;
      this.controls.refresh();
    };
    read().then(
      (answer) => isCurrent() && use(answer),
      (failure: unknown) => isCurrent() && say(failureText(failure)),
    );
  }

  private addIsosurface(): void {
    const fields = candidates(this.kit.host.dataset());
    this.afterReading(
      () => firstIsosurface(fields, (field) => this.histogram(field)),
      (found) => {
        if (found !== null) {
          const color = { constant: this.newColor() };
          return this.send([...this.surfaces(), { ...found, opacity: 0.5, color }]);
        }
        this.message = "No field has different values at this step.";
        this.controls.refresh();
      },
    );
  }

  // One that is told from the media, among which the surface may lie.
  private newColor(): string {
    const { maps } = this.kit.host;
    return contrastColor(colorsIn(this.kit.host.view(), (map) => maps.stops(map)));
  }

  // The surface at this index becomes an isosurface of a field, at the present value if the field
  // has it.
  private cutAtValue(index: number, field: string, change: Partial<SurfaceView>): null {
    const before = this.surfaces()[index]!;
    const kept = before.isovalue;
    this.afterReading(
      () => this.histogram(field),
      (histogram) => {
        const dataset = this.kit.host.dataset();
        const keeps =
          typeof kept === "number" && keepsValue(dataset, before.field, field, kept, histogram);
        const isovalue = keeps ? kept : (middleValue(histogram) ?? histogram.range?.[0]);
        if (isovalue === undefined) {
          this.message = `${field} has no values at this step.`;
          this.controls.refresh();
          return;
        }
        this.update(index, { ...change, field, isovalue });
      },
    );
    return null;
  }

  // What a user should know of a surface that is not seen.
  private noteOf(index: number): string {
    const surface = this.surfaces()[index];
    const { host } = this.kit;
    if (surface === undefined || host.playing()) return "";
    if (isEdgeOn(host.dataset(), host.view(), surface)) {
      return "Seen edge-on: turn the picture, or choose another shape.";
    }
    const known = typeof surface.isovalue === "number" ? this.rangeOf(surface.field) : null;
    return known === null ? "" : noSurfaceText(host.dataset(), surface, known);
  }

  private rangeOf(field: string): FieldRange | null {
    const { host } = this.kit;
    const { id } = host.dataset();
    const { step = 0, difference } = host.view();
    const key = JSON.stringify([id, step, field, difference ?? null]);
    const known = this.ranges.get(key);
    if (known !== undefined) return known;
    if (this.ranges.size > rangesMax) this.ranges.clear();
    this.ranges.set(key, null);
    host.api.range(id, field, step, difference).then(
      (range) => {
        this.ranges.set(key, range);
        this.controls.refresh();
      },
      () => undefined, // the frame tells what is wrong
    );
    return null;
  }

  private layerOf(axis: Axis): { axis: Axis; index: number } {
    return { axis, index: Math.floor((this.kit.host.dataset().axes[axis].world.length - 1) / 2) };
  }

  private update(index: number, change: Partial<SurfaceView>): null {
    const all = this.surfaces();
    this.send(all.map((surface, n) => (n === index ? { ...surface, ...change } : surface)));
    return null; // already sent
  }

  private access<T>(
    index: number,
    key: string,
    get: (surface: SurfaceView) => T | null | undefined,
    change: (value: T, surface: SurfaceView) => Partial<SurfaceView> | null, // null: sent later
  ): Access<T> {
    return {
      pointer: `/surfaces/${key}`,
      get: () => {
        const surface = this.surfaces()[index];
        return surface === undefined ? undefined : get(surface);
      },
      set: (value) => {
        const surface = this.surfaces()[index];
        const changed = surface === undefined ? null : change(value, surface);
        return changed === null ? null : this.update(index, changed);
      },
    };
  }

  private cutBy(kind: string): Partial<SurfaceView> {
    if (kind === "plane") return { ...noCut, plane: { point: [0, 0, 0], normal: [1, 1, 0] } };
    return { ...noCut, slice: this.layerOf(kind as Axis) };
  }

  private addSurface(index: number): void {
    const surface = this.surfaces()[index]!;
    const title = `Surface ${index + 1}: ${surface.field}`;
    const folder = this.controls.folder(this.folder, title, { open: true });
    this.controls.choice(
      folder,
      "field",
      this.access(
        index,
        "field",
        (s) => s.field,
        (field, s) => {
          const color = { ...s.color, range: null };
          if (s.isovalue == null) return { field, color };
          return this.cutAtValue(index, field, { color });
        },
      ),
      this.options,
    );
    this.controls.choice(
      folder,
      "shape",
      this.access(index, "shape", kindOf, (kind, s) =>
        kind === "isosurface" ? this.cutAtValue(index, s.field, noCut) : this.cutBy(kind),
      ),
      cuts,
    );
    this.addPlace(folder, index, surface);
    this.controls.note(folder, () => this.noteOf(index));
    this.controls.number(
      folder,
      "opacity",
      this.access(
        index,
        "opacity",
        (s) => s.opacity ?? 1,
        (opacity) => ({ opacity }),
      ),
      { min: 0, max: 1, step: 0.01 },
    );
    this.addColors(folder, index, surface);
    this.controls.action(folder, "Remove", "Take this surface out of the view", () => {
      this.send(this.surfaces().filter((_, n) => n !== index));
    });
  }

  // The range of the colours in the newest picture where the view has none.
  private drawnRange(index: number): number[] | null | undefined {
    return this.kit.host.view().surfaces?.[index]?.color?.range;
  }

  private unitsOf(name: string): string {
    const info = this.kit.host.dataset().fields.find((field) => field.name === name);
    return unitText(info?.units);
  }

  private addPlace(folder: GUI, index: number, surface: SurfaceView): void {
    const kind = kindOf(surface);
    const units = this.unitsOf(surface.field);
    if (kind === "isosurface") {
      this.controls.number(
        folder,
        units === "" ? "value" : `value (${units})`,
        this.access(
          index,
          "isovalue",
          (s) => s.isovalue,
          (isovalue) => ({ isovalue }),
        ),
        { field: true },
      );
    } else if (kind === "plane") {
      for (const key of ["point", "normal"] as const) {
        ["x", "y", "z"].forEach((axis, at) => {
          this.controls.number(
            folder,
            `${key} ${axis}`,
            this.access(
              index,
              `plane/${key}`,
              (s) => s.plane?.[key][at],
              (value, s) => {
                const to = [...(s.plane?.[key] ?? [0, 0, 1])] as [number, number, number];
                to[at] = value;
                const whole = s.plane ?? { point: [0, 0, 0], normal: [0, 0, 1] };
                return Math.hypot(...to) > 1e-6 || key === "point"
                  ? { plane: { ...whole, [key]: to } }
                  : {};
              },
            ),
            { field: true, step: 0.05 },
          );
        });
      }
    } else {
      const last = this.kit.host.dataset().axes[kind as Axis].world.length - 1;
      this.controls.number(
        folder,
        "layer",
        this.access(
          index,
          "slice/index",
          (s) => s.slice?.index,
          (at) => ({ slice: { axis: kind as Axis, index: at } }),
        ),
        { min: 0, max: last, step: 0.05 },
      );
    }
  }

  private addColors(folder: GUI, index: number, surface: SurfaceView): void {
    const isosurface = kindOf(surface) === "isosurface";
    this.controls.choice(
      folder,
      "colour by",
      this.access(
        index,
        "color/field",
        (s) => s.color?.field ?? ownColor,
        (name, s) => ({
          color: { ...s.color, field: name === ownColor ? null : name, range: null },
          ...(name === ownColor && isosurface ? { contours: null } : {}),
        }),
      ),
      { [isosurface ? "one colour" : "its own values"]: ownColor, ...this.options },
    );
    const name = surfaceColors(surface);
    if (name === null) {
      this.controls.color(
        folder,
        "colour",
        this.access(
          index,
          "color/constant",
          (s) => s.color?.constant ?? "#d8d8d8",
          (constant, s) => ({ color: { ...s.color, constant } }),
        ),
      );
      return;
    }
    this.controls.map(
      folder,
      "map",
      this.access(
        index,
        "color/map",
        (s) => s.color?.map ?? "viridis",
        (map, s) => ({ color: { ...s.color, map } }),
      ),
    );
    this.controls.range(
      folder,
      "colours",
      this.access(
        index,
        "color/range",
        (s) => (s.color?.range ?? this.drawnRange(index)) as [number, number] | null | undefined,
        (range, s) => ({ color: { ...s.color, range } }),
      ),
      this.unitsOf(name),
    );
    this.controls.number(
      folder,
      "contours every (0: none)",
      this.access(
        index,
        "contours/interval",
        (s) => s.contours?.interval ?? 0,
        (interval, s) => ({
          contours: contoursWith(s.contours, { interval: interval > 0 ? interval : null }),
        }),
      ),
      { field: true },
    );
    this.controls.text(
      folder,
      "contours at (values)",
      this.access(
        index,
        "contours/levels",
        (s) => (s.contours?.levels ?? []).join(" "),
        (text, s) => ({ contours: contoursWith(s.contours, { levels: levelsIn(text) }) }),
      ),
    );
  }
}
