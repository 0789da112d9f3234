// Where the legend says that sections lie: the words of the server's legend.
import assert from "node:assert/strict";
import { test } from "node:test";
import { legendEntries } from "../../src/view/legend_entries";
import type { Dataset, SurfaceView, View } from "@windsplat/client";
import { described } from "../page";

const axis = (name: string, kind: Dataset["axes"]["x"]["kind"], units: string, at: number[]) => ({
  ...{ name, kind, units, standardName: "", coordinates: at },
  world: at.map((_, n) => -1 + (2 * n) / (at.length - 1)),
});

// Longitudes of 0 to 30, latitudes about the equator, levels evenly spaced in their logarithm.
const atmosphere: Dataset = described("gcm", {
  axes: {
    x: axis("lon", "longitude", "degrees_east", [0, 10, 20, 30]),
    y: axis("lat", "latitude", "degrees_north", [-10, 0, 10]),
    z: axis("lev", "pressure", "hPa", [1000, 500, 250]),
  },
});

type Cut = Pick<SurfaceView, "slice" | "plane">;

const ofSurface = (cut: Cut, view: View = {}, dataset = atmosphere): string =>
  legendEntries(dataset, {
    ...view,
    vector: { field: null },
    scalars: [],
    surfaces: [{ field: "temperature", ...cut }],
  })[0]!.note;

const slice = (along: "x" | "y" | "z", index: number): Cut => ({ slice: { axis: along, index } });
const plane = (...normal: [number, number, number]): Cut => ({
  plane: { point: [0, 0, 0], normal },
});

test("a section along an axis tells its coordinate, between samples as the box places them", () => {
  assert.equal(ofSurface(slice("z", 1)), "section at 500 hPa");
  assert.equal(ofSurface(slice("z", 0.5)), "section at 707.11 hPa");
  const linear: View = { geometry: { vertical: "linear" } };
  assert.equal(ofSurface(slice("z", 0.5), linear), "section at 750 hPa");
  assert.equal(ofSurface(slice("x", 1)), "section at 10°E");
  assert.equal(ofSurface(slice("y", 0.25)), "section at 7.5°S");
  assert.equal(ofSurface(slice("y", 1)), "section at 0°");
});

test("a plane tells its coordinate, or the place nearest to the middle of the box", () => {
  assert.equal(ofSurface(plane(0, 2, 0)), "section at 0°");
  assert.equal(ofSurface(plane(0, 0, 1)), "section at 500 hPa");
  assert.equal(ofSurface(plane(1, 1, 0)), "vertical section through 15°E, 0°");
  assert.equal(ofSurface(plane(1, 0, 1)), "oblique section through 15°E, 0°, 500 hPa");
  const region: View = { region: { longitudes: [0, 10] } };
  assert.equal(ofSurface(plane(1, 1, 0), region), "vertical section", "of an unknown box");
});

test("sections of other grids tell heights, kilometres, or rows and columns", () => {
  const { x, y } = atmosphere.axes;
  const sea: Dataset = {
    ...atmosphere,
    axes: { x, y, z: axis("deptht", "depth", "m", [10, 0.5]) },
  };
  assert.equal(ofSurface(slice("z", 1), {}, sea), "section at depth 0.5 m");
  const metres: Dataset = {
    ...atmosphere,
    axes: {
      x: axis("x", "cartesian", "m", [-4e6, -2e6, 0, 2e6]),
      y,
      z: axis("z", "height", "m", [120, 340, 870]),
    },
  };
  assert.equal(ofSurface(slice("x", 1), {}, metres), "section at x = −2000 km");
  assert.equal(ofSurface(slice("z", 2), {}, metres), "section at height 870 m");
  const curved: Dataset = { ...atmosphere, mappings: ["flat", "curvilinear"] };
  assert.equal(ofSurface(slice("y", 2), {}, curved), "section at row j = 2");
  assert.equal(ofSurface(plane(0, 1, 0), {}, curved), "vertical section");
  const globe: View = { geometry: { mapping: "sphere" } };
  assert.equal(ofSurface(slice("z", 1), globe), "section at 500 hPa");
});

test("a layer of the whole view is told by lines and media", () => {
  const geometry = { slice: { axis: "z", index: 2 } } as const;
  const entries = legendEntries(atmosphere, {
    geometry,
    vector: { field: "wind" },
    scalars: [{ field: "temperature" }],
  });
  assert.deepEqual(
    entries.map(({ kind, note }) => [kind, note.split(", ")[0]]),
    [
      ["lines", "section at 250 hPa"],
      ["medium", "section at 250 hPa"],
    ],
  );
});
