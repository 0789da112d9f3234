// The lines panel: field, length and opacity; colour, profile, kernels and motion.
import type GUI from "lil-gui";
import type { Controller } from "lil-gui";
import { colorByPatch, colorField, fieldOptions } from "./controls";
import type { Range } from "@windsplat/client";
import { colorScale } from "../view/color_scale";
import { unitText } from "../view/unit_text";
import { keyAccess, type PanelKit } from "./panel_kit";
import { namePart } from "../base/key_words";
import { vectorsTitle } from "../view/words";
import { addTrace, kindOf } from "./panel_seeds";
import type { SeedPoints } from "./seed_points";
import { addMark } from "./panel_mark";

// Returns the points of seeds; null: there are no vectors.
export function addLines(gui: GUI, kit: PanelKit): SeedPoints | null {
  const dataset = kit.host.dataset();
  const options = fieldOptions(dataset, "vector");
  if (Object.keys(options).length === 0) return null;
  namePart("vector", vectorsTitle(dataset));
  const folder = kit.folder(gui, vectorsTitle(dataset), { open: true, key: "Vectors" });
  let named = Object.values(options)[0]!;
  kit.toggle(folder, "shown", {
    pointer: "/vector/field",
    get: (view) => view.vector?.field !== null,
    set: (on) => ({ vector: { field: on ? named : null } }),
  });
  const field = kit.choice(
    folder,
    "field",
    {
      pointer: "/vector/field",
      get: (view) => (named = view.vector?.field ?? named),
      set: (field) => ({ vector: { field } }),
    },
    options,
  );
  const units = unitText(dataset.fields.find((field) => field.name === named)?.units);
  const per = units === "" ? "" : ` (${units})`;
  const main = addMain(folder, kit, per);
  const parts = [
    field,
    ...main.controls,
    addLineColor(folder, kit, per),
    addShape(folder, kit),
    addMore(folder, kit, per),
  ];
  kit.showWhen((states) => states.lines, ...parts);
  return main.points;
}

interface MainControls {
  controls: Controller[];
  points: SeedPoints;
}

function addMain(folder: GUI, kit: PanelKit, per: string): MainControls {
  const { vector } = kit.host.view();
  const top = vector?.magnitudeRange?.[1] ?? 1;
  const length = vector?.length ?? 0.05;
  const long = kit.number(folder, "length", keyAccess("/vector/length"), {
    min: 0,
    max: Math.min(10, Number((5 * length).toPrecision(2))),
  });
  const points = addTrace(folder, kit);
  const opacity = kit.number(folder, "opacity", keyAccess("/vector/opacity"));
  const least = kit.number(folder, `min |v|${per}`, keyAccess("/vector/minMagnitude"), {
    min: 0,
    max: top,
  });
  const stride = kit.number(folder, "sampling stride", keyAccess("/vector/stride"), {
    min: 1,
    max: 16,
    step: 1,
  });
  // Lines through seeds have other lengths and numbers, and no weak part of them is left out.
  const eachSample = (): boolean => kindOf(kit.host.view()) === "none";
  kit.enableWhen(eachSample, long, least, stride);
  return { controls: [long, opacity, least, stride], points };
}

function addLineColor(parent: GUI, kit: PanelKit, per: string): GUI {
  const folder = kit.folder(parent, "Line colour", { open: true });
  const { host } = kit;
  const scalars = fieldOptions(host.dataset(), "scalar");
  const hasScalars = Object.keys(scalars).length > 0;
  kit.choice(
    folder,
    "colour by",
    {
      pointer: "/vector/color/by",
      get: (view) => view.vector?.color?.by,
      set: (by) => colorByPatch(host.dataset(), host.view(), by),
    },
    {
      height: "worldZ",
      "distance from the eye": "screenZ",
      "height and rise": "rise",
      [`magnitude${per}`]: "magnitude",
      direction: "direction",
      ...(hasScalars ? { "a scalar field": "scalar" } : {}),
      constant: "constant",
    },
  );
  if (hasScalars) {
    const field = kit.choice(
      folder,
      "scalar",
      {
        pointer: "/vector/color/field",
        get: (view) => view.vector?.color?.field,
        // The units of the new field may differ, so its default range is used.
        set: (name) => ({ vector: { color: { field: name, range: null } } }),
      },
      scalars,
    );
    kit.showWhen((states) => states.colorField, field);
  }
  const map = kit.map(folder, "map", keyAccess("/vector/color/map"));
  const scale = () => colorScale(host.dataset(), host.view());
  type Ends = [number, number] | null | undefined;
  const ends = kit.range(
    folder,
    "colours",
    {
      pointer: "/vector/color/range",
      get: (view) => {
        const range = view.vector?.color?.range as Ends;
        return range ? [scale().shown(range[0]), scale().shown(range[1])] : range;
      },
      set: ([from, to]) => ({
        vector: { color: { range: [scale().stored(from), scale().stored(to)] } },
      }),
    },
    "",
  );
  kit.onRefresh(() => {
    const { units } = scale();
    ends.forEach((end, n) => {
      end.name(`colours ${n === 0 ? "from" : "to"}${units === "" ? "" : ` (${units})`}`);
    });
  });
  const auto = kit.action(folder, "Default range", "Colour range back to the default", () =>
    host.change({ vector: { color: { range: null } } }),
  );
  kit.showWhen((states) => states.ranged, map, ...ends, auto);
  const counted = () => colorField(host.view());
  const defaults = host.dataset().defaultView?.vector;
  const histogram = kit.histogram(folder, {
    key: "lines",
    map: () => host.view().vector?.color?.map,
    defaultRange: () =>
      defaults?.color?.by === host.view().vector?.color?.by
        ? ((defaults?.color?.range ?? null) as Range | null)
        : null,
    title: () => (host.view().vector?.color?.by === "magnitude" ? "|v|" : (counted() ?? "")),
    field: counted,
    range: () => (host.view().vector?.color?.range ?? null) as Range | null,
    choose: (range) => host.change({ vector: { color: { range } } }),
  });
  kit.showWhen((states) => states.counted, histogram);
  kit.toggle(folder, "true colours", {
    pointer: "/vector/color/trueColors",
    get: (view) => view.vector?.color?.trueColors === true,
    set: (on) => ({ vector: { color: { trueColors: on ? true : null } } }),
  });
  const weight = kit.number(folder, "share of rise", keyAccess("/vector/color/riseWeight"));
  kit.showWhen((states) => states.rise, weight);
  const constant = kit.color(folder, "colour", keyAccess("/vector/color/constant"));
  kit.showWhen((states) => states.constant, constant);
  return folder;
}

function addShape(parent: GUI, kit: PanelKit): GUI {
  const folder = kit.folder(parent, "Line shape");
  addWidth(folder, kit);
  addMark(folder, kit);
  kit.number(folder, "brightness by speed", keyAccess("/vector/magnitudeIntensity"));
  return folder;
}

function addMore(parent: GUI, kit: PanelKit, per: string): GUI {
  const folder = kit.more(parent);
  const combine = kit.choice(folder, "overlapping lines", keyAccess("/vector/combine"), {
    "nearer over farther": "over",
    "largest of all (or)": "or",
  });
  kit.showWhen((states) => states.combined, combine);
  addMagnitudes(folder, kit, per);
  kit.choice(folder, "direction", keyAccess("/vector/space"), {
    "by components": "components",
    "in world space": "world",
  });
  (["x", "y", "z"] as const).forEach((axis, index) => {
    kit.number(
      folder,
      `${axis} component ×`,
      {
        pointer: "/vector/scale",
        get: (view) => view.vector?.scale?.[index],
        set: (factor) => {
          const scale = [...(kit.host.view().vector?.scale ?? [1, 1, 1])];
          scale[index] = factor;
          return { vector: { scale } };
        },
      },
      { field: true },
    );
  });
  addKernels(folder, kit);
  return folder;
}

// r1 <= r2 always: moving one beyond the other moves both.
function addWidth(folder: GUI, kit: PanelKit): void {
  const r = (key: "r1" | "r2") => kit.host.view().vector?.[key] ?? 1;
  kit.number(
    folder,
    "core radius r1",
    {
      pointer: "/vector/r1",
      get: (view) => view.vector?.r1,
      set: (r1) => ({ vector: { r1, r2: Math.max(r1, r("r2")) } }),
    },
    { min: 0, max: 6 },
  );
  kit.number(
    folder,
    "edge radius r2",
    {
      pointer: "/vector/r2",
      get: (view) => view.vector?.r2,
      set: (r2) => ({ vector: { r1: Math.min(r("r1"), r2), r2 } }),
    },
    { min: 0, max: 8 },
  );
}

function addMagnitudes(folder: GUI, kit: PanelKit, per: string): void {
  const range = (): [number, number] =>
    (kit.host.view().vector?.magnitudeRange ?? [0, 1]) as [number, number];
  const [low, top] = range();
  const limits = { min: Math.min(0, low), max: 2 * top };
  const ascending = (next: [number, number]) =>
    next[0] < next[1] ? { vector: { magnitudeRange: next } } : null;
  kit.number(
    folder,
    `shortest at${per}`,
    {
      pointer: "/vector/magnitudeRange",
      get: (view) => view.vector?.magnitudeRange?.[0],
      set: (value) => ascending([value, range()[1]]),
    },
    limits,
  );
  kit.number(
    folder,
    `longest at${per}`,
    {
      pointer: "/vector/magnitudeRange",
      get: (view) => view.vector?.magnitudeRange?.[1],
      set: (value) => ascending([range()[0], value]),
    },
    limits,
  );
  kit.histogram(folder, {
    key: "lengths",
    defaultRange: () => null,
    title: () => "|v|",
    field: () => kit.host.view().vector?.field ?? null,
    range,
    choose: (next) => kit.host.change({ vector: { magnitudeRange: next } }),
  });
}

function addKernels(parent: GUI, kit: PanelKit): void {
  const folder = kit.folder(parent, "Kernels and jitter");
  kit.toggle(folder, "kernels overlap", keyAccess("/vector/jitter/overlap"));
  const span = kit.number(folder, "span (strides)", keyAccess("/vector/span"), {
    min: 0.5,
    max: 16,
  });
  kit.enableWhen((states) => states.span, span);
  kit.number(folder, "jitter of centre", keyAccess("/vector/jitter/center"));
  kit.number(folder, "jitter of stride", keyAccess("/vector/jitter/stride"));
  const seed = kit.number(folder, "pattern", keyAccess("/vector/jitter/seed"), {
    min: 0,
    max: 99,
    step: 1,
  });
  const perStep = kit.toggle(folder, "new each step", keyAccess("/vector/jitter/perStep"));
  kit.enableWhen((states) => states.pattern, seed, perStep);
}
