// Histograms, sample positions and time series, and the page's requests for them.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { Ajv2020 } from "ajv/dist/2020.js";
import {
  Api,
  type Answer,
  type Histogram,
  pointInPlane,
  project,
  type Camera,
  type Dataset,
  type View,
} from "@windsplat/client";
import type { Vec3 } from "@windsplat/client/parts";
import {
  barPath,
  clipRange,
  countedText,
  type Counted,
  neat,
  quantile,
  RangeDrag,
  valueAt,
} from "../src/view/histogram";
import {
  coordinatesOf,
  magnitude,
  middleSample,
  nearestIndex,
  sampleAt,
  valueText,
  worldOf,
} from "../src/view/sample_position";
import { derivedIn } from "../src/view/view_fields";
import { described } from "./page";
import { timeEnds, seriesCurve } from "../src/panels/series_plot";

const histogram = (counts: number[], change: Partial<Counted> = {}): Counted => ({
  range: [0, counts.length],
  counts,
  masked: 0,
  below: 0,
  above: 0,
  log: false,
  ...change,
});

// --- histograms ---------------------------------------------------------------------------

test("a field without values is said to have none, and nothing is chosen of it", async () => {
  const none: Histogram = { ...histogram([0, 0], { masked: 12 }), range: null };
  assert.deepEqual(await server(none).api.histogram("d", "t", 0, 2), none);
  assert.equal(countedText(none, " K"), "no values · 12 masked");
  assert.equal(clipRange(none, 0.01), null);
  assert.equal(countedText(histogram([1], { range: [2, 3] }), " K"), "2 to 3 K");
});

test("quantiles of uniform counts are proportional", () => {
  const even = histogram(Array.from({ length: 100 }, () => 7));
  for (const share of [0.01, 0.25, 0.5, 0.99]) {
    assert.ok(Math.abs(quantile(even, share) - 100 * share) < 1e-9);
  }
  assert.deepEqual(clipRange(even, 0.01), [1, 99]);
});

test("samples beyond the range count, masked ones do not", () => {
  // 100 samples: 30 below, 60 inside, 10 above.
  const cut = histogram([30, 30], { below: 30, above: 10, masked: 900 });
  assert.equal(quantile(cut, 0.2), 0, "clamped to the low end of the range");
  assert.equal(quantile(cut, 0.45), 0.5);
  assert.equal(quantile(cut, 0.95), 2);
});

test("clipping omits outliers, and reports none for a constant field", () => {
  const outlier = histogram([0, 0, 500, 499, 0, 0, 0, 0, 0, 1]);
  const [low, high] = clipRange(outlier, 0.01)!;
  assert.ok(low > 2 && low < 2.1 && high > 3.9 && high <= 4);
  assert.equal(clipRange(histogram([0, 0], { below: 5 }), 0.01), null);
});

test("bar heights follow counts or their logarithms", () => {
  const heights = (path: string) => [...path.matchAll(/V([\d.]+)h1/g)].map((m) => 1 - Number(m[1]));
  assert.deepEqual(heights(barPath([0, 5, 10], false)), [0, 0.5, 1]);
  const [none, some, most] = heights(barPath([0, 9, 99], true));
  assert.deepEqual([none, most], [0, 1]);
  assert.ok(Math.abs(some! - 0.5) < 1e-3, "log(10) is half of log(100)");
  assert.equal(barPath([0, 0], false), "");
});

test("values have the precision of their range", () => {
  assert.equal(neat(0.123456789, [0, 1]), 0.123);
  assert.equal(neat(98765.4321, [0, 100000]), 98765);
  assert.equal(neat(1.23456789e-6, [0, 1e-5]), 1.23e-6);
  assert.equal(valueAt(0.5, [250, 350]), 300);
  assert.equal(valueAt(7, [250, 350]), 350);
});

test("a drag moves a nearby end, or draws a range elsewhere", () => {
  const end = new RangeDrag(0.21, [0.2, 0.8], 0.05);
  assert.deepEqual(end.to(0.4), [0.4, 0.8]);
  assert.deepEqual(end.to(0.9), [0.8, 0.9], "the ends are swapped when dragged past each other");
  assert.equal(end.end(), null);
  const fresh = new RangeDrag(0.5, [0.2, 0.8], 0.05);
  assert.equal(fresh.to(0.502), null, "a tiny movement draws no range");
  assert.deepEqual(fresh.to(0.6), [0.5, 0.6]);
  assert.deepEqual(fresh.to(0.45), [0.45, 0.5]);
});

test("a click moves the nearer end; an inverted range stays inverted", () => {
  assert.deepEqual(new RangeDrag(0.35, [0.2, 0.8], 0.05).end(), [0.35, 0.8]);
  assert.deepEqual(new RangeDrag(0.65, [0.2, 0.8], 0.05).end(), [0.2, 0.65]);
  assert.deepEqual(new RangeDrag(0.65, [0.8, 0.2], 0.05).end(), [0.65, 0.2]);
  assert.deepEqual(new RangeDrag(0.2, [0.8, 0.2], 0.05).to(0.4), [0.8, 0.4]);
  assert.equal(
    new RangeDrag(0.2, [0.2, 0.8], 0.05).end(),
    null,
    "a click on an end without movement",
  );
});

// --- the server ---------------------------------------------------------------------------

function server(answer: unknown, status = 200): { api: Api; asked: string[] } {
  const asked: string[] = [];
  const api = new Api("http://host/base/", async (url): Promise<Answer> => {
    asked.push(url);
    return { ok: status < 400, status, json: async () => answer, blob: async () => new Blob() };
  });
  return { api, asked };
}

const series = {
  position: {
    x: 0,
    y: -45,
    z: 500,
    units: { x: "degrees_east", y: "degrees_north", z: "hPa" },
    index: { x: 0, y: 0, z: 1 },
  },
  times: [
    { value: 0, text: "2001-01-01T00:00:00Z" },
    { value: 6, text: "2001-01-01T06:00:00Z" },
    { value: 12, text: "2001-01-01T12:00:00Z" },
  ],
  values: [1, null, 7],
  units: "K",
};

test("a series of the schema is parsed, and its ends are shown as times", async () => {
  const schemas = ["view", "messages"].map((name): object =>
    JSON.parse(readFileSync(`../protocol/${name}.schema.json`, "utf8")),
  );
  const ajv = new Ajv2020({ schemas, strict: false });
  assert.ok(ajv.validate("messages.schema.json#/$defs/series", series), ajv.errorsText());
  const { times } = await server(series).api.series("d", "t", [1, 2, 3], null);
  assert.deepEqual(timeEnds(times), ["2001-01-01 00:00Z", "2001-01-01 12:00Z"]);
  assert.deepEqual(timeEnds([]), ["", ""]);
  const strings = server({ ...series, times: ["2001-01-01T00:00:00Z"] });
  await assert.rejects(strings.api.series("d", "t", [1, 2, 3], null), /not be understood/);
});

test("requests of values say what is subtracted, and which derived fields are wanted", async () => {
  const both = { dataset: "a b", step: 0 };
  const h = server(histogram([1, 2]));
  await h.api.histogram("d", "t", 7, 64, both);
  await h.api.histogram("d", "t", 7, 64, null);
  const queries = (asked: string[]) => asked.map((url) => url.slice(url.indexOf("?")));
  assert.deepEqual(queries(h.asked), [
    "?step=7&bins=64&minus=a%20b&minusStep=0",
    "?step=7&bins=64",
  ]);
  const r = server({ range: [1, 2], masked: 0, rangeOf: "step" });
  await r.api.range("d", "t", 3, { step: 2 });
  assert.deepEqual(queries(r.asked), ["?step=3&minusStep=2"]);
  const p = server({ position: { x: 1, y: 2, z: 3 }, values: {} });
  const derived = ["wind_speed", "a,b", "dew point"];
  await p.api.probe("d", [1, 2, 3], null, { step: 4, difference: { dataset: "e" }, derived });
  assert.deepEqual(queries(p.asked), ["?index=1,2,3&step=4&minus=e&fields=wind_speed,dew%20point"]);
});

test("derived fields of a view are those that it draws or colours by", () => {
  const dataset = described("a", { fields: ["wind", "t", "speed", "shear", "vorticity"] });
  for (const field of dataset.fields.slice(2)) field.dtype = "derived" as typeof field.dtype;
  const view = {
    vector: { field: "wind", color: { by: "scalar", field: "speed" } },
    scalars: [{ field: "t" }],
    surfaces: [{ field: "t", color: { field: "shear" } }],
  } as View;
  assert.deepEqual(derivedIn(dataset, view), ["speed", "shear"]);
  const plain = { ...view, vector: { field: null, color: { by: "scalar", field: "speed" } } };
  assert.deepEqual(derivedIn(dataset, plain as View), ["shear"]);
});

test("each request has its URL below the base path", async () => {
  const counted = histogram([1, 2]);
  const h = server(counted);
  assert.deepEqual(await h.api.histogram("a b", "|v|/x", 7, 64), counted);
  assert.deepEqual(h.asked, [
    "http://host/base/v1/datasets/a%20b/fields/%7Cv%7C%2Fx/histogram?step=7&bins=64",
  ]);
  const r = server({ range: [1, 2], masked: 0, rangeOf: "all" });
  assert.deepEqual((await r.api.range("d", "t", null)).range, [1, 2]);
  assert.deepEqual(r.asked, ["http://host/base/v1/datasets/d/fields/t/range?of=all"]);
  const p = server({ position: { x: 1, y: 2, z: 3 }, values: {} });
  await p.api.probe("d", [1, 2, 3], null, { step: 4 });
  await p.api.probe("d", [1, 2, 3], "h of z", { step: 4 });
  assert.deepEqual(p.asked, [
    "http://host/base/v1/datasets/d/probe?index=1,2,3&step=4",
    "http://host/base/v1/datasets/d/probe?index=1,2,3&heightField=h%20of%20z&step=4",
  ]);
  const s = server(series);
  await s.api.series("d", "t", [1, 2, 3], "z");
  assert.deepEqual(s.asked, [
    "http://host/base/v1/datasets/d/fields/t/series?index=1,2,3&heightField=z",
  ]);
});

test("errors show the text of the server or of the page", async () => {
  const refused = server(
    { title: "Not Found", status: 404, detail: "there is no such field" },
    404,
  );
  await assert.rejects(refused.api.range("d", "t", null), /^ProblemError: there is no such field$/);
  await assert.rejects(server("<html>", 502).api.range("d", "t", null), /HTTP 502/);
  await assert.rejects(server({ range: [1] }).api.range("d", "t", null), /not be understood/);
  await assert.rejects(server({ counts: [1] }).api.histogram("d", "t", 0, 8), /not be understood/);
  const dark = server({ range: null, masked: 9, rangeOf: "all" });
  assert.equal((await dark.api.range("d", "t", null)).range, null);
});

// --- sample positions ---------------------------------------------------------------------

const axis = (coordinates: number[], world: number[]) => ({ coordinates, world });
const dataset = {
  dims: { x: 4, y: 2, z: 3 },
  axes: {
    x: axis([0, 90, 180, 270], [-0.75, -0.25, 0.25, 0.75]),
    y: axis([-45, 45], [-0.25, 0.25]),
    z: axis([1000, 500, 200], [-0.1, 0, 0.1]),
  },
  world: { min: [-1, -0.5, -0.15], max: [1, 0.5, 0.15] },
} as unknown as Dataset;

test("sample coordinates and nearest samples are found on axes of either direction", () => {
  assert.deepEqual(middleSample(dataset), [1, 0, 1]);
  assert.deepEqual(coordinatesOf(dataset, [3, 1, 0]), [270, 45, 1000]);
  assert.equal(nearestIndex([1000, 500, 200], 340), 2);
  assert.equal(nearestIndex([1000, 500, 200], 9999), 0);
  assert.equal(nearestIndex([0, 90, 180], 46), 1);
});

test("positions follow the scale of the geometry and are unknown on a curved grid", () => {
  const plain: View = {};
  assert.deepEqual(worldOf(dataset, plain, [3, 1, 0]), [0.75, 0.25, -0.1]);
  // Scaled to twice the height, x is still the longest edge.
  const tall = { geometry: { scale: [1, 1, 2] } } as View;
  assert.deepEqual(worldOf(dataset, tall, [3, 1, 0]), [0.75, 0.25, -0.2]);
  // Scaled by three, y is the longest edge with length 2, so everything else shrinks by 2/3.
  const long = { geometry: { scale: [1, 3, 1] } } as View;
  const [x, y] = worldOf(dataset, long, [3, 1, 0])!;
  assert.ok(Math.abs(x - 0.5) < 1e-12 && Math.abs(y - 0.5) < 1e-12);
  assert.equal(worldOf(dataset, { geometry: { mapping: "sphere" } } as View, [0, 0, 0]), null);
  assert.deepEqual(sampleAt(dataset, tall, [0.7, -0.3, -0.21]), [3, 0, 0]);
  assert.equal(sampleAt(dataset, plain, [1.1, 0, 0]), null, "outside the box");
});

const camera = (projection: Camera["projection"]): Camera => ({
  projection,
  eye: [1, -3, 2],
  target: [0.1, 0.2, 0],
  up: [0, 0, 1],
  fovY: 40,
  height: 2.5,
});

test("a point of a plane is found at its screen position", () => {
  for (const projection of ["perspective", "orthographic"] as const) {
    for (const [axis, point] of [
      [2, [0.4, -0.3, 0.1]],
      [0, [-0.6, 0.2, -0.1]],
      [1, [0, 0.5, 0.05]],
    ] as [0 | 1 | 2, Vec3][]) {
      const at = project(camera(projection), point, 1.6)!;
      const found = pointInPlane(camera(projection), at, 1.6, axis, point[axis])!;
      found.forEach((value, n) => assert.ok(Math.abs(value - point[n]!) < 1e-9));
    }
  }
});

test("the target projects to the centre, points behind the eye do not project", () => {
  const c = camera("perspective");
  const [x, y] = project(c, c.target, 1.6)!;
  assert.ok(Math.abs(x - 0.5) < 1e-12 && Math.abs(y - 0.5) < 1e-12);
  assert.equal(project(c, [2, -8, 5], 1.6), null);
  assert.equal(pointInPlane(c, [0.5, 0.5], 1.6, 2, 5), null, "a plane above the eye");
  // At the upper edge of the picture a ray is half the field of view above the centre.
  const level: Camera = { ...c, eye: [0, -1, 0], target: [0, 0, 0] };
  const top = Math.tan((20 * Math.PI) / 180);
  assert.ok(Math.abs(project(level, [0, 0, top], 1.6)![1]) < 1e-12);
});

test("values are formatted as text", () => {
  assert.equal(valueText(0.4, "1"), "0.4");
  assert.equal(valueText(280.25, "K"), "280.3 K");
  assert.equal(valueText([3, 4, 0], "m s-1"), "(3, 4, 0), |v| 5 m s⁻¹");
  assert.equal(valueText(null, "K"), "masked");
  assert.equal(valueText([1, null, 2], "K"), "masked");
  assert.equal(magnitude([2, 3, 6]), 7);
});

test("a series plot has gaps where there is no value", () => {
  const course = seriesCurve([1, 3, null, 2, null, 5, 5])!;
  assert.deepEqual([course.low, course.high], [1, 5]);
  assert.equal(course.path, "M0 1.0000L1 0.5000M3 0.7500h0.25M5 0.0000L6 0.0000");
  assert.equal(seriesCurve([null, null]), null);
  assert.equal(seriesCurve([4, 4])!.path, "M0 0.5000L1 0.5000");
});
