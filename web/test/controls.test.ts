// The options that the panel offers for a dataset, the controls that apply to a view, and the text
// of legend and HUD.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  colorByPatch,
  compositingHints,
  compositingOptions,
  controlStates,
  exaggerationText,
  depthCuePatch,
  heightOptions,
  mappingOptions,
  methodHints,
  methodOptions,
  planePatch,
  shapePatch,
  sliceIndexMax,
  sliceOptions,
  endTrace,
  slicePatch,
  sliceText,
} from "../src/panels/controls";
import { detailLine, methodText, partsLine, workLines } from "../src/viewport/frame_text";
import { legendEntries, sampleHeights } from "../src/view/legend_entries";
import type { ChosenMessage, Dataset, Field, View } from "@windsplat/client";
import { compassTicks } from "../src/base/ticks";

const axis = (name: string, kind: Dataset["axes"]["x"]["kind"], coordinates: number[]) => ({
  name,
  kind,
  standardName: "",
  units: kind === "pressure" ? "hPa" : "",
  coordinates,
  world: coordinates.map((_, n) => n / 10),
});

const field = (name: string, kind: Field["kind"], units: string, standardName = ""): Field => ({
  name,
  kind,
  components: [name],
  units,
  standardName,
  longName: "",
  range: [0, 1],
  masked: 0,
  rangeOf: "step",
  dtype: "float32",
});

const dataset = {
  id: "gcm",
  dims: { x: 4, y: 1, z: 5 },
  axes: {
    x: axis("lon", "longitude", [0, 90, 180, 270]),
    y: axis("lat", "latitude", [0]),
    z: axis("lev", "pressure", [1000, 850, 700, 500, 200]),
  },
  world: { min: [-1, -1, -1], max: [1, 1, 1] },
  mappings: ["flat", "sphere"],
  fields: [
    field("wind", "vector", "m s-1"),
    field("cloud", "scalar", "1"),
    field("zg", "scalar", "m", "geopotential_height"),
  ],
} as unknown as Dataset;

test("the offered mappings are those listed by the dataset", () => {
  const labels = (mappings: Dataset["mappings"]) =>
    mappingOptions({ ...dataset, mappings, defaultView: { geometry: { mapping: "flat" } } });
  assert.deepEqual(Object.values(labels(["flat"])), ["flat"]);
  assert.deepEqual(Object.values(labels(["flat", "sphere"])), ["flat", "sphere"]);
  const curved = labels(["flat", "sphere", "curvilinear"]);
  assert.deepEqual(Object.values(curved), ["flat", "sphere", "curvilinear"]);
  assert.equal(Object.keys(curved).length, 3);
});

test("heights are offered from the axis or a scalar, metres first", () => {
  assert.deepEqual(Object.values(heightOptions(dataset)), ["", "zg", "cloud"]);
});

test("a plane keeps its other numbers, and a normal without a direction is not sent", () => {
  const plane = slicePatch(dataset, "plane") as View;
  assert.deepEqual(planePatch(plane, "point", 1, 0.25), {
    geometry: { plane: { point: [0, 0.25, 0], normal: [1, 1, 0] } },
  });
  const last: View = { geometry: { plane: { point: [0, 0, 0], normal: [0, 1, 0] } } };
  assert.equal(planePatch(last, "normal", 1, 0), null);
  assert.equal(planePatch({}, "point", 0, 1), null);
  assert.equal(controlStates(plane).combined, true);
});

test("streamlets end where a slice begins, and are offered on the whole grid", () => {
  const traced: View = { vector: { trace: {} } };
  const layer = slicePatch(dataset, "z");
  assert.deepEqual(endTrace(traced, layer), { ...layer, vector: { trace: null } });
  assert.deepEqual(endTrace({}, layer), layer);
  assert.deepEqual(endTrace(traced, slicePatch(dataset, "all")), slicePatch(dataset, "all"));
  assert.deepEqual([controlStates(traced).traced, controlStates(traced).traceable], [true, true]);
  const sliced = controlStates(layer as View);
  assert.deepEqual([sliced.traced, sliced.traceable], [false, false]);
});

test("an oblique plane is offered on flat grids only, and ends where the server refuses it", () => {
  const plane = { point: [0, 0, 0], normal: [1, 1, 0] };
  for (const bent of [{ mapping: "sphere" }, { mapping: "curvilinear" }, { heightField: "zg" }]) {
    const view = { geometry: bent } as View;
    assert.deepEqual(Object.values(sliceOptions(dataset, view)), ["all", "x", "z"]);
    assert.match(sliceText(dataset, view), /oblique plane needs a flat/);
    const shown = { geometry: { plane } } as View;
    assert.deepEqual(shapePatch(shown, view.geometry!), { geometry: { ...bent, plane: null } });
    assert.deepEqual(shapePatch({}, view.geometry!), view);
  }
  const flat = { geometry: { mapping: "flat", heightField: null, plane } } as View;
  assert.ok(Object.values(sliceOptions(dataset, flat)).includes("plane"));
  assert.deepEqual(shapePatch(flat, { mapping: "flat" }), { geometry: { mapping: "flat" } });
});

test("a slice starts in the middle of an axis with layers and shows its position", () => {
  assert.deepEqual(Object.values(sliceOptions(dataset, {})), ["all", "x", "z", "plane"]);
  assert.equal(sliceIndexMax(dataset, "x"), 3);
  assert.deepEqual(slicePatch(dataset, "z"), {
    geometry: { slice: { axis: "z", index: 2 }, plane: null },
  });
  assert.deepEqual(slicePatch(dataset, "all"), { geometry: { slice: null, plane: null } });
  const view: View = { geometry: { slice: { axis: "z", index: 3 } } };
  assert.match(sliceText(dataset, view), /3 of 0 to 4: lev 500 hPa/);
  assert.equal(sliceText(dataset, {}), "");
  const half: View = { geometry: { slice: { axis: "x", index: 0.5 } } };
  const [first, second] = dataset.axes.x.coordinates;
  assert.ok(sliceText(dataset, half).includes(` between ${first} and ${second}`));
});

test("colouring by another quantity resets the range, and scalars are named", () => {
  assert.deepEqual(colorByPatch(dataset, {}, "direction"), {
    vector: { color: { by: "direction", range: null, map: "compass" } },
  });
  const turned: View = { vector: { color: { map: "compass" } } };
  assert.deepEqual(colorByPatch(dataset, turned, "magnitude"), {
    vector: { color: { by: "magnitude", range: null, map: null } },
  });
  assert.deepEqual(colorByPatch(dataset, {}, "scalar"), {
    vector: { color: { by: "scalar", range: null, field: "cloud" } },
  });
  const named: View = { vector: { color: { field: "zg" } } };
  assert.deepEqual(colorByPatch(dataset, named, "scalar"), {
    vector: { color: { by: "scalar", range: null } },
  });
});

test("the ends of the depth cue stay in order", () => {
  const ends = (patch: unknown) => (patch as { depthCue: { near: number; far: number } }).depthCue;
  assert.deepEqual(ends(depthCuePatch({}, "near", 0.5)), { near: 0.5, far: 1 });
  for (const [end, value] of [
    ["near", 1.5],
    ["far", -0.5],
    ["near", 1],
  ] as const) {
    const next = ends(depthCuePatch({ depthCue: { near: 0, far: 1 } }, end, value));
    assert.equal(next[end], value);
    assert.ok(next.near < next.far);
  }
});

test("controls without effect are hidden or disabled", () => {
  const whole: View = {
    vector: { field: "wind", color: { by: "rise" }, jitter: { center: 0, stride: 0.3 } },
    depthCue: { strength: 0.3 },
  };
  const plain = controlStates(whole);
  assert.deepEqual(
    [plain.lines, plain.ranged, plain.rise, plain.colorField, plain.span, plain.pattern],
    [true, true, true, false, true, true],
  );
  assert.deepEqual(
    [plain.motion, plain.slab, plain.slice, plain.fovY, plain.depthCue],
    [false, false, false, true, true],
  );
  const off = (view: View) => controlStates({ ...whole, ...view });
  assert.equal(off({ vector: { field: null, motion: { mode: "phase" } } }).motion, false);
  assert.equal(off({ vector: { field: null } }).depthCue, false);
  assert.equal(off({ vector: { jitter: { center: 0, stride: 0 } } }).pattern, false);
  assert.equal(off({ vector: { jitter: { overlap: false } } }).span, false);
  assert.equal(off({ vector: { color: { by: "scalar" } } }).colorField, true);
  assert.equal(off({ vector: { color: { by: "constant" } } }).ranged, false);
  assert.equal(off({ vector: { motion: { mode: "phase" } } }).motion, true);
  assert.equal(off({ method: { name: "slab" } }).slab, true);
  assert.equal(off({ geometry: { slice: { axis: "x", index: 0 } } }).slice, true);
  assert.equal(off({ camera: { projection: "orthographic" } }).fovY, false);
  const globe = { mapping: "sphere" } as const;
  assert.equal(off({ geometry: { mapping: "flat" } }).ground, true);
  assert.equal(off({ ground: { show: "on" } }).ground, true);
  assert.equal(off({ geometry: globe }).ground, true);
  assert.equal(off({ geometry: globe, ground: { show: "auto" } }).ground, true);
  assert.equal(off({ geometry: globe, ground: { show: "off" } }).ground, false);
  assert.equal(off({ ground: { tint: false } }).tint, false);
  assert.equal(off({ depthCue: { strength: 0 } }).depthCue, false);
  assert.equal(off({}).light, false);
  assert.equal(off({ light: null }).light, false);
  assert.equal(off({ light: {} }).light, true);
});

test("every offered method and operator is explained, and the reference is not offered", () => {
  assert.deepEqual(Object.values(methodOptions), ["kernel", "slab"]);
  for (const method of Object.values(methodOptions)) assert.ok(methodHints[method]);
  const offered = Object.values(compositingOptions);
  assert.deepEqual([...offered].sort(), ["analytic", "cd", "cd-euler", "cd-naive", "simple"]);
  for (const one of offered) assert.ok(compositingHints[one]);
  assert.match(compositingHints["cd-euler"]!, /unstable/);
  assert.match(compositingHints["cd-naive"]!, /seams/);
});

test("bearings have compass labels for any start of the range", () => {
  const labels = (low: number, high: number) =>
    compassTicks([low, high]).map(({ at, text }) => `${text}${at.toFixed(2)}`);
  assert.deepEqual(labels(0, 360), ["N0.00", "E0.25", "S0.50", "W0.75", "N1.00"]);
  assert.deepEqual(labels(360, 0), ["N1.00", "E0.75", "S0.50", "W0.25", "N0.00"]);
  assert.deepEqual(labels(-180, 180), ["S0.00", "W0.25", "N0.50", "E0.75", "S1.00"]);
  assert.deepEqual(labels(45, 225), ["E0.25", "S0.75"]);
  for (const { text } of compassTicks([10, 60])) assert.match(text, /^\d+°$/);
});

const colored = (color: object): View => ({
  dataset: "gcm",
  vector: { field: "wind", magnitudeRange: [0, 60], color: { map: "magma", ...color } },
  scalars: [],
});

test("the legend labels direction by the compass and a scalar by its name and unit", () => {
  const [direction] = legendEntries(dataset, colored({ by: "direction", range: [0, 360] }));
  assert.equal(direction!.title, "wind: direction");
  assert.equal(direction!.ticks.map((tick) => tick.text).join(""), "NESWN");
  const [scalar] = legendEntries(
    dataset,
    colored({ by: "scalar", field: "zg", range: [0, 16000] }),
  );
  assert.equal(scalar!.title, "wind: zg");
  assert.equal(scalar!.units, "m");
  assert.deepEqual(scalar!.range, [0, 16000]);
});

test("the legend of colour by rise has its own range and tells the share of the height", () => {
  const rise = (riseWeight: number) =>
    legendEntries(dataset, colored({ by: "rise", range: [-0.02, 0.02], riseWeight }))[0]!;
  assert.equal(rise(1).title, "wind: rise");
  assert.deepEqual(rise(1).range, [-0.02, 0.02]);
  assert.equal(rise(0.7).title, "wind: height and rise");
  assert.match(
    rise(0.7).note,
    /^from low and sinking to high and rising, 70 % rise of a line, 30 % height in the box/,
  );
});

test("levels are at their axis positions unless the grid is curved", () => {
  assert.notEqual(sampleHeights(dataset, {}), null);
  assert.equal(sampleHeights(dataset, { geometry: { mapping: "sphere" } }), null);
  assert.equal(sampleHeights(dataset, { geometry: { heightField: "zg" } }), null);
});

test("the HUD tells what was computed and is held for the parts of the picture", () => {
  const ground = { part: "ground", shown: true, count: 921_600, bytes: 3_400_000 } as const;
  const surfaces = { part: "surfaces", shown: false, count: 0, bytes: 0 } as const;
  const region = { part: "region", shown: true, count: 120, bytes: 0 } as const;
  assert.equal(
    partsLine({ parts: [ground, surfaces, region] }),
    "ground 921.6 k pixels 3.4 MB · region 120 samples outside",
  );
  assert.equal(partsLine({ parts: [surfaces] }), "");
});

test("the HUD names the level and the part of a store that are drawn, and the level wanted", () => {
  const level = (n: number) => ({ halvings: [n, n, n] as [number, number, number] });
  const part = { first: [0, 64, 0], count: [64, 128, 64] } as {
    first: [number, number, number];
    count: [number, number, number];
  };
  const wanted = level(0);
  assert.equal(detailLine({}), "");
  assert.equal(detailLine({ detail: { wanted, drawn: level(0) } }), "");
  assert.equal(
    detailLine({ detail: { wanted, drawn: level(1) } }),
    "level 1,1,1 · wanted full detail",
  );
  assert.equal(
    detailLine({ detail: { wanted, drawn: { ...level(0), ...part } } }),
    "full detail · part of 64 x 128 x 64 samples",
  );
  const boxes = { size: [64, 64, 64] as [number, number, number], count: 2 };
  assert.equal(
    detailLine({ detail: { wanted, drawn: { ...level(0), ...part, boxes } } }),
    "full detail · part of 2 boxes within 64 x 128 x 64 samples",
  );
  assert.equal(
    detailLine({ detail: { wanted: level(1), drawn: { ...level(2), ...part } } }),
    "level 2,2,2 · part of 64 x 128 x 64 samples · wanted level 1,1,1",
  );
  assert.equal(
    detailLine({ detail: { wanted, drawn: level(3), missingBytes: 5_000_000 } }),
    "level 3,3,3 · wanted full detail · finer detail is being loaded (5.0 MB)",
  );
});

test("the HUD names method and compositing, and the samples that were skipped", () => {
  const chosen = { method: "kernel", compositing: "cd", slabThickness: null } as ChosenMessage;
  assert.equal(methodText(chosen), "kernel cd");
  assert.equal(
    methodText({ ...chosen, method: "slab", slabThickness: 0.5 }),
    "slab of 0.5 cells cd",
  );
  const work = {
    samples: 97_280,
    culled: 1000,
    skippedVector: 111,
    skippedScalar: 22_200,
    skippedBoth: 6280,
    occluded: 0,
    pixelUpdates: 3_300_000,
    exponentials: 1_234_000_000,
    skippedBound: 0.472,
    variant: "over",
  } as ChosenMessage["work"];
  const unknown = { value: null, kind: "none" } as const;
  const words = workLines({ work, skippedChange: unknown }).join(" · ");
  for (const part of [
    "90.0 k of 97.3 k samples",
    "culled 1.0 k",
    "6.3 k both · change ≤ 0.47",
    "111 lines",
    "22.2 k splats",
    "occluded 0",
    "3.3 M pixel updates",
    "1.2 G exponentials",
    "over",
  ]) {
    assert.ok(words.includes(part), `${part} in ${words}`);
  }
  const skippedChange = { value: 0.0256, kind: "measured" } as const;
  assert.match(workLines({ work, skippedChange })[1], / both · change 0\.026$/);
  const estimated = { value: 0.3, kind: "estimated" } as const;
  assert.match(workLines({ work, skippedChange: estimated })[1], /change 0\.3 est\.$/);
  assert.match(workLines({ work, skippedChange: { value: 0, kind: "measured" } })[1], /change 0$/);
});

test("the vertical exaggeration follows the scales, and is 1 to scale", () => {
  const pressures = { ...dataset, dims: { x: 4, y: 3, z: 5 }, verticalExaggeration: 15 } as Dataset;
  const z = { ...dataset.axes.z, kind: "height" };
  const wide = { ...pressures, axes: { ...dataset.axes, z } } as Dataset;
  const text = (geometry: View["geometry"]) => exaggerationText(wide, { geometry });
  assert.equal(text({}), "A vertical stretch of 1 draws heights 15 times as high as to scale.");
  assert.match(text({ scale: [1, 2, 4] }), /stretch of 4 draws heights 30 times/);
  assert.equal(text({ vertical: "metric" }), "Heights are drawn to scale.");
  assert.equal(text({ mapping: "sphere" }), "");
  assert.equal(text({ heightField: "height" }), "");
  assert.equal(text({ vertical: "index" }), "");
  assert.equal(exaggerationText(dataset, {}), "", "unknown");
  assert.match(exaggerationText(pressures, {}), /heights about 15 times/);
  assert.equal(exaggerationText(pressures, { geometry: { vertical: "linear" } }), "");
});
