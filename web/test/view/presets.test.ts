// The views that a dataset offers to start from.
import assert from "node:assert/strict";
import { test } from "node:test";
import { project, type Camera, ProblemError, type Dataset, type View } from "@windsplat/client";
import { isRefusedView } from "../../src/panels/panel_presets";
import { presetsOf, presetView } from "../../src/view/presets";
import { described, type Described } from "../page";

const keysOf = (dataset: Dataset): string[] => presetsOf(dataset, 1.6).map(({ key }) => key);

const viewOf = (dataset: Dataset, key: string): View =>
  presetsOf(dataset, 1.6).find((one) => one.key === key)!.view;

// Winds and clouds on a box of this many samples.
function storm(size: number, more: Described = {}): Dataset {
  const dataset = described("storm", { fields: ["wind", "cloud"], size, ...more });
  dataset.fields.find(({ name }) => name === "wind")!.longName = "wind";
  return dataset;
}

test("winds and clouds have views of both, of each, and of surfaces, light and place", () => {
  assert.deepEqual(keysOf(storm(40, { mappings: ["flat", "sphere"] })), [
    ...["default", "lines", "volumes", "streamlets", "light", "isosurface", "sections"],
    ...["above", "level", "globe", "figure"],
  ]);
  const titles = presetsOf(storm(40), 1.6).map(({ title }) => title);
  assert.deepEqual(titles.slice(0, 5), [
    ...["Winds and clouds", "Winds", "Clouds", "Streamlets", "Sunlit clouds"],
  ]);
});

test("data without vectors have no lines, data without volumes no light", () => {
  assert.deepEqual(keysOf(described("box", { fields: ["temperature"] })), [
    ...["default", "light", "isosurface", "sections", "above", "level", "figure"],
  ]);
  assert.deepEqual(keysOf(described("box", { fields: ["wind"] })), [
    ...["default", "streamlets", "above", "level", "figure"],
  ]);
});

test("data of one layer have neither surfaces nor other sides", () => {
  const layer = storm(40);
  layer.dims.z = 1;
  assert.deepEqual(keysOf(layer), ["default", "lines", "volumes", "streamlets", "figure"]);
});

test("an isosurface lies in the middle of the shown range, without volumes of a speed's", () => {
  const warm = described("warm", { fields: ["temperature"] });
  warm.defaultView!.scalars![0]!.color = { range: [220, 300] };
  assert.deepEqual(viewOf(warm, "isosurface").surfaces, [{ field: "temperature", isovalue: 260 }]);
  const windy = described("windy", { fields: ["wind"] });
  windy.fields.push({ ...windy.fields[0]!, name: "wind_speed", kind: "scalar", dtype: "derived" });
  windy.fields.at(-1)!.range = null;
  assert.equal(keysOf(windy).includes("isosurface"), false, "without a known range");
  windy.defaultView!.vector!.magnitudeRange = [10, 50];
  assert.deepEqual(viewOf(windy, "isosurface").surfaces, [{ field: "wind_speed", isovalue: 30 }]);
  const both = storm(40);
  both.fields.push(windy.fields.at(-1)!);
  assert.deepEqual(viewOf(both, "isosurface").surfaces, [
    { field: "cloud", isovalue: 15, color: { field: "wind_speed" } },
  ]);
});

test("clouds scatter the light, other volumes are shaded by their slopes", () => {
  const shading = (fields: string[]) =>
    viewOf(described("lit", { fields }), "light").scalars!.map((one) => one.shading);
  assert.deepEqual(shading(["cloud", "temperature"]), ["scatter", "gradient"]);
});

test("streamlets are longer and fewer where there are samples to spare", () => {
  const streamlets = (size: number) => {
    const dataset = storm(size);
    dataset.defaultView!.vector = { field: "wind", length: 0.05, stride: 2 };
    const { length, stride } = viewOf(dataset, "streamlets").vector!;
    return [length, stride];
  };
  assert.deepEqual(
    [streamlets(10), streamlets(40), streamlets(500)],
    [
      [0.125, 2],
      [0.125, 3],
      [0.125, 3],
    ],
  );
});

test("the map from above shows the whole box, which touches the edges but for a margin", () => {
  for (const aspect of [0.5, 1.6, 4]) {
    const dataset = storm(40);
    dataset.world = { min: [-1, -0.5, -0.1], max: [1, 0.5, 0.1] };
    const above = presetsOf(dataset, aspect).find(({ key }) => key === "above")!;
    const camera = { fovY: 35, ...above.view.camera } as Camera;
    const [left, top] = project(camera, [-1, 0.5, 0.1], aspect)!;
    const [right, bottom] = project(camera, [1, -0.5, -0.1], aspect)!;
    assert.ok(Math.min(left, top) > 0 && Math.max(right, bottom) < 1, `${[left, top]}`);
    assert.ok(Math.min(left, top) < 0.03, `${[left, top]}`);
  }
});

test("a preset keeps what is shown of the data and how it is drawn, nothing else", () => {
  const now: View = {
    dataset: "storm",
    step: 3,
    region: { x: [0, 2] },
    quality: { budgetMs: 50 },
    method: { name: "kernel" },
    image: { width: 640, height: 400 },
    camera: { eye: [0, 0, 3] },
    light: { azimuth: 10 },
    surfaces: [{ field: "cloud", isovalue: 1 }],
  };
  const lines = presetsOf(storm(40), 1.6).find(({ key }) => key === "lines")!;
  const { camera: _c, light: _l, surfaces: _s, ...kept } = now;
  assert.deepEqual(presetView(lines, storm(40), now), { ...kept, scalars: [] });
});

test("sections show the speed where there is one, across the shorter horizontal axis", () => {
  const dataset = storm(40);
  dataset.dims = { x: 20, y: 41, z: 9 };
  const surfaces = (field: string) => [
    { field, slice: { axis: "x", index: 9 } },
    { field, slice: { axis: "z", index: 2 } },
  ];
  assert.deepEqual(viewOf(dataset, "sections").surfaces, surfaces("cloud"));
  dataset.fields.push({ ...dataset.fields[1]!, name: "wind_speed", dtype: "derived" });
  assert.deepEqual(viewOf(dataset, "sections").surfaces, surfaces("wind_speed"));
});

test("only a view that the server refuses is given up", () => {
  for (const status of [400, 422])
    assert.ok(isRefusedView(new ProblemError("", status)), `${status}`);
  for (const status of [401, 403, 404, 409, 429, 500, 503]) {
    assert.equal(isRefusedView(new ProblemError("", status)), false, `${status}`);
  }
  assert.equal(isRefusedView(new TypeError("network")), false);
});

test("a figure has the colours of its legend, as one of the command line", () => {
  assert.equal(viewOf(storm(40), "figure").vector?.color?.trueColors, true);
});
