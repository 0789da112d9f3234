// The surfaces panel: isosurfaces and sections of scalar fields, each with colours and opacity.
import type GUI from "lil-gui";
import { surfaceColors, unitText } from "../view/legend_entries";
import type { SurfaceView } from "../wire/protocol";
import { fieldOptions } from "./controls";
import type { Access, PanelKit } from "./panel_kit";

const surfacesMax = 8;
const ownColor = ""; // the choice of colours that needs no field
const cuts: Record<string, string> = {
  isosurface: "isosurface",
  "layer across x": "x",
  "layer across y": "y",
  "layer across z": "z",
  "oblique plane": "plane",
};

type Axis = "x" | "y" | "z";

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

  constructor(
    private readonly folder: GUI,
    private readonly kit: PanelKit,
    private readonly options: Record<string, string>,
  ) {
    this.controls = kit.again();
    kit.onRefresh(() => this.refresh());
    this.refresh();
  }

  private surfaces(): SurfaceView[] {
    return this.kit.host.view().surfaces ?? [];
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
    this.kit.host.change({ surfaces });
  }

  private build(): void {
    for (const child of [...this.folder.children]) child.destroy();
    this.controls = this.kit.again();
    this.surfaces().forEach((_, index) => this.addSurface(index));
    if (this.surfaces().length >= surfacesMax) return;
    const field = Object.values(this.options)[0]!;
    this.controls.action(this.folder, "Add an isosurface", "Where a field has one value", () => {
      this.send([...this.surfaces(), { field, isovalue: this.middleOf(field), opacity: 0.5 }]);
    });
    this.controls.action(this.folder, "Add a section", "A layer of the grid in colours", () => {
      this.send([...this.surfaces(), { field, slice: this.layerOf("z") }]);
    });
  }

  private middleOf(field: string): number {
    const known = this.kit.host.dataset().defaultView?.scalars?.find((s) => s.field === field);
    const range = known?.color?.range ?? [0, 1];
    return Number((0.5 * (range[0] + range[1])).toPrecision(3));
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
    change: (value: T, surface: SurfaceView) => Partial<SurfaceView>,
  ): Access<T> {
    return {
      pointer: `/surfaces/${key}`,
      get: () => {
        const surface = this.surfaces()[index];
        return surface === undefined ? undefined : get(surface);
      },
      set: (value) => {
        const surface = this.surfaces()[index];
        return surface === undefined ? null : this.update(index, change(value, surface));
      },
    };
  }

  private cutBy(kind: string, surface: SurfaceView): Partial<SurfaceView> {
    const none = { isovalue: null, slice: null, plane: null, contours: null };
    if (kind === "isosurface") return { ...none, isovalue: this.middleOf(surface.field) };
    if (kind === "plane") return { ...none, plane: { point: [0, 0, 0], normal: [1, 1, 0] } };
    return { ...none, slice: this.layerOf(kind as Axis) };
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
        (field, s) => ({
          field,
          ...(s.isovalue == null ? {} : { isovalue: this.middleOf(field) }),
          color: { ...s.color, range: null },
        }),
      ),
      this.options,
    );
    this.controls.choice(
      folder,
      "shape",
      this.access(index, "shape", kindOf, (kind, s) => this.cutBy(kind, s)),
      cuts,
    );
    this.addPlace(folder, index, surface);
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
        (s) => s.color?.range as [number, number] | null | undefined,
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
        (interval, s) => ({ contours: interval > 0 ? { ...s.contours, interval } : null }),
      ),
      { field: true },
    );
  }
}
