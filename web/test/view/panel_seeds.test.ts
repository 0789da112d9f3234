// The seeds that the panel chooses, and what it makes of those of a view.
import assert from "node:assert/strict";
import { test } from "node:test";
import { kindOf, reachOf, reachPatch, seedsFor } from "../../src/panels/panel_seeds";
import { pointsFrom, pointsText, withPoint } from "../../src/panels/seed_points";
import { legendEntries } from "../../src/view/legend_entries";
import type { Dataset, View } from "@windsplat/client";

const axis = (...coordinates: number[]) => ({ name: "", units: "", coordinates });
const dataset = {
  axes: { x: axis(0, 100), y: axis(50, -50), z: axis(1000, 200) },
} as unknown as Dataset;

const viewOf = (seeds: unknown): View =>
  ({ vector: { trace: seeds === undefined ? null : { seeds } } }) as View;

test("a kind that is chosen is the kind of the view that it makes", () => {
  for (const kind of ["none", "evenly", "points", "line", "plane"] as const) {
    assert.equal(kindOf(viewOf(seedsFor(kind, dataset))), kind);
  }
  assert.equal(kindOf(viewOf(undefined)), "none");
});

test("a new line crosses the data within their box", () => {
  const { line } = seedsFor("line", dataset) as {
    line: { from: number[]; to: number[]; count: number };
  };
  assert.deepEqual(line, { from: [10, -40, 600], to: [90, 40, 600], count: 20 });
});

test("choosing a kind leaves no seeds of another", () => {
  const chosen = seedsFor("evenly", dataset) as Record<string, unknown>;
  assert.deepEqual(chosen, { points: [], evenly: 100, line: null, block: null });
});

test("points are typed one a line, and what is no point is named", () => {
  assert.deepEqual(pointsFrom(" 10 20,300 \n\u22121 2e1 3\n", dataset), [
    [10, 20, 300],
    [-1, 20, 3],
  ]);
  assert.throws(() => pointsFrom(" \n", dataset), /at least one/);
  assert.throws(() => pointsFrom("1 2 3\n4 5", dataset), /Point 2 needs three numbers: x y z/);
  assert.throws(() => pointsFrom("1 2 north", dataset), /Point 1/);
  assert.throws(() => pointsFrom("1 2 3\n".repeat(1001), dataset), /At most 1000 points, not 1001/);
});

test("points come back from their text, and a place is picked once", () => {
  const points: [number, number, number][] = [
    [10.5, -20, 300],
    [0, 0, 1e-3],
  ];
  assert.deepEqual(pointsFrom(pointsText(points), dataset), points);
  assert.equal(withPoint(points, [10.5, -20, 300.0000001]), points);
  assert.deepEqual(withPoint(points, [1 / 3, 2, 3])!.at(-1), [0.333333, 2, 3]);
  const full = Array.from({ length: 1000 }, (_, n) => [n, 0, 0] as [number, number, number]);
  assert.equal(withPoint(full, [0.5, 0, 0]), null);
});

test("lines go as far as they can, for a length or for a time", () => {
  const box = { ...dataset, world: { min: [-1, -1, 0], max: [1, 1, 1] } } as unknown as Dataset;
  const view = { vector: { magnitudeRange: [0, 30] } } as View;
  for (const reach of ["data", "length", "duration"] as const) {
    const seeds = reachPatch(reach, box, view);
    assert.equal(reachOf(viewOf(seeds)), reach);
  }
  assert.deepEqual(reachPatch("length", box, view), { length: 1.5, duration: null });
  // Half of the diagonal, 3, at 30.
  assert.deepEqual(reachPatch("duration", box, view), { length: null, duration: 0.05 });
});

test("lines through seeds have no longest one, and no weak one is left out", () => {
  const drawn = {
    ...{ fields: [{ name: "wind", units: "m/s", range: [0, 60] }], steps: { count: 1 } },
  } as unknown as Dataset;
  const vector = {
    ...{ field: "wind", minMagnitude: 12, magnitudeRange: [0, 50] },
    color: { by: "magnitude", range: [0, 60], map: "viridis" },
  };
  const entry = (trace: unknown) =>
    legendEntries(drawn, { vector: { ...vector, trace } } as unknown as View)[0]!;
  assert.match(entry({}).leftOut, /slower than 12/);
  assert.match(entry({}).note, /longest line 50/);
  assert.equal(entry({ seeds: { evenly: 10 } }).leftOut, "");
  assert.doesNotMatch(entry({ seeds: { evenly: 10 } }).note, /longest/);
});
