// What new surfaces show, and what the panel says of those that are not seen.
import assert from "node:assert/strict";
import { test } from "node:test";
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
} from "../../src/panels/surface_choice";
import { legendEntries } from "../../src/view/legend_entries";
import { completeView } from "@windsplat/client/parts";
import type { Histogram, Dataset, View } from "@windsplat/client";
import { described } from "../page";

const histogram = (counts: number[], change: Partial<Histogram> = {}): Histogram => ({
  range: [200, 300],
  counts,
  masked: 0,
  below: 0,
  above: 0,
  log: false,
  ...change,
});

test("an isosurface starts at a value between most samples", () => {
  assert.equal(middleValue(histogram([50, 50, 0, 0, 0, 0, 0, 0, 0, 0])), 210);
  const zeros = histogram([1e6, 0, 0, 0, 0, 0, 0, 0, 0, 1], { range: [0, 1e-4] });
  assert.equal(middleValue(zeros), 5e-5, "of a field that is zero nearly everywhere");
  assert.equal(middleValue(histogram([5], { range: [3, 3] })), null, "all are equal");
  assert.equal(middleValue(histogram([0, 0], { masked: 10 })), null, "all are masked");
});

test("an isosurface starts with a field that has values", async () => {
  const known: Record<string, Histogram> = {
    absv: histogram([2, 3], { masked: 14 }),
    t: histogram([10, 9]),
    q: histogram([19]),
  };
  const asked: string[] = [];
  const found = await firstIsosurface(["absv", "t", "q"], async (field) => {
    asked.push(field);
    return known[field]!;
  });
  assert.equal(found?.field, "t");
  assert.deepEqual(asked, ["absv", "t"], "no more than needed are read");
  const only = await firstIsosurface(["absv"], async () => known.absv!);
  assert.equal(only?.field, "absv", "the only one there is");
});

const fieldOf = (name: string, units: string, masked: number | null) => ({
  ...described("gcm").fields[0]!,
  name,
  units,
  masked,
  kind: "scalar" as const,
});

function dataset(): Dataset {
  const { x, y, z } = described("gcm").dims;
  const fields = [fieldOf("absv", "s-1", x * y * z), fieldOf("t", "K", 0), fieldOf("q", "1", null)];
  return { ...described("gcm"), fields, defaultView: { scalars: [{ field: "q" }] } };
}

test("fields of which many samples are masked are offered last", () => {
  assert.deepEqual(candidates(dataset()), ["q", "t", "absv"]);
});

test("a value is kept for a field of the same unit that has it", () => {
  const data = dataset();
  assert.equal(keepsValue(data, "t", "t", 250, histogram([1])), true);
  assert.equal(keepsValue(data, "t", "t", 310, histogram([1])), false);
  assert.equal(keepsValue(data, "t", "q", 250, histogram([1])), false);
});

test("an isosurface beyond the values of its field says which these are", () => {
  const of = (isovalue: number, range: [number, number] | null) =>
    noSurfaceText(dataset(), { field: "t", isovalue }, { range, masked: 0, rangeOf: "step" });
  assert.equal(of(300, [200, 290]), "Empty: t is 200 to 290 K at this step.");
  assert.equal(of(250, [200, 290]), "");
  assert.match(of(250, null), /^Every sample of t is masked/);
});

const from = (eye: number[]): View => ({
  camera: { eye, target: [0, 0, 0], up: [0, 0, 1], projection: "perspective" } as View["camera"],
});

test("a section that the camera sees edge-on is told, and the facing one offered", () => {
  const data = dataset();
  const slice = (axis: "x" | "y" | "z") => ({ field: "t", slice: { axis, index: 0.5 } });
  data.axes.x.world = [-0.01, 0.01];
  data.axes.y.world = [-0.01, 0.01];
  const south = from([0, -5, 1]);
  const east = from([5, 0, 1]);
  assert.equal(facingAxis(south), "y");
  assert.equal(facingAxis(east), "x");
  assert.equal(isEdgeOn(data, south, slice("x")), true);
  assert.equal(isEdgeOn(data, south, slice("y")), false);
  assert.equal(isEdgeOn(data, east, slice("y")), true);
  const globe: View = { ...south, geometry: { mapping: "sphere" } };
  assert.equal(isEdgeOn(data, globe, slice("x")), false, "a layer of a globe is bent");
  const plane = { field: "t", plane: { point: [0, 0, 0], normal: [1, 0, 0] } } as never;
  assert.equal(isEdgeOn(data, south, plane), true);
});

test("colours of a surface have the range of the picture until fields or shape change", () => {
  const drawn = { surfaces: [{ field: "t", isovalue: 3, color: { field: "q", range: [0, 9] } }] };
  const range = (surface: object) =>
    completeView(drawn as never, { surfaces: [surface] } as never).surfaces![0]!.color?.range;
  assert.deepEqual(range({ field: "t", isovalue: 5, color: { field: "q", range: null } }), [0, 9]);
  assert.deepEqual(
    range({ field: "t", isovalue: 3, color: { field: "q", range: [1, 2] } }),
    [1, 2],
  );
  assert.equal(range({ field: "t", isovalue: 3, color: { field: "t" } }), undefined);
  assert.equal(range({ field: "t", slice: { axis: "z", index: 0 } }), undefined);
});

test("the legend of a surface marks the ends beyond which its field has values", () => {
  const data = dataset();
  data.fields[1]!.range = [200, 310];
  const beyond = (surface: object) =>
    legendEntries(data, {
      vector: { field: null },
      scalars: [],
      surfaces: [{ field: "t", ...surface }] as View["surfaces"],
    })[0]!.beyond;
  const slice = { axis: "z", index: 0 };
  assert.deepEqual(beyond({ slice, color: { range: [220, 300] } }), [true, true]);
  assert.deepEqual(beyond({ slice, color: { range: [200, 400] } }), [false, false]);
  assert.deepEqual(beyond({ isovalue: 250 }), [false, false], "one colour");
  const own = { isovalue: 250, color: { field: "t", range: [200, 300] } };
  assert.deepEqual(beyond(own), [false, false], "it has one value");
});

test("levels of contours are numbers in any order, between spaces, commas or semicolons", () => {
  assert.deepEqual(levelsIn("280, 273.15;  -5 273.15"), [-5, 273.15, 280]);
  assert.deepEqual(levelsIn("\u22125 1e3"), [-5, 1000]);
  assert.deepEqual(levelsIn(" "), []);
  assert.throws(() => levelsIn("5 abc"), /“abc” is not a number/);
  const many = Array.from({ length: 65 }, (_, n) => n).join(" ");
  assert.throws(() => levelsIn(many), /At most 64 levels, not 65/);
});

test("contours remain while they have an interval or levels", () => {
  assert.deepEqual(contoursWith(null, { levels: [1] }), { levels: [1] });
  const both = contoursWith({ interval: 5, lineWidth: 2 }, { levels: [1] });
  assert.deepEqual(both, { interval: 5, lineWidth: 2, levels: [1] });
  assert.deepEqual(contoursWith(both, { interval: null })?.levels, [1]);
  assert.equal(contoursWith({ interval: 5 }, { interval: null }), null);
  assert.equal(contoursWith({ levels: [1] }, { levels: [] }), null);
});
