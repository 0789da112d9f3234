// The seeds that the panel chooses, and what it makes of those of a view.
import assert from "node:assert/strict";
import { test } from "node:test";
import { kindOf, seedsFor } from "../../src/panels/panel_seeds";
import type { Dataset, View } from "../../src/wire/protocol";

const axis = (...coordinates: number[]) => ({ name: "", units: "", coordinates });
const dataset = {
  axes: { x: axis(0, 100), y: axis(50, -50), z: axis(1000, 200) },
} as unknown as Dataset;

const viewOf = (seeds: unknown): View =>
  ({ vector: { trace: seeds === undefined ? null : { seeds } } }) as View;

test("a kind that is chosen is the kind of the view that it makes", () => {
  for (const kind of ["none", "evenly", "line", "plane"] as const) {
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
