// "About this dataset": description -> sections.
import assert from "node:assert/strict";
import { test } from "node:test";
import { aboutSections } from "../src/app/about";
import type { Dataset } from "@windsplat/client";

const axis = (name: string, units: string, coordinates: number[]) => ({
  name,
  standardName: "",
  units,
  kind: "cartesian",
  coordinates,
  world: coordinates,
});

const dataset = {
  title: "Winds",
  source: "winds.nc",
  format: "netCDF classic",
  axes: {
    x: axis("x", "km", [0, 10, 20]),
    y: axis("y", "km", [5]),
    z: axis("lev", "hPa", [1000, 500]),
  },
  fields: [
    { name: "wind", longName: "", units: "m s**-1", range: null },
    { name: "t", longName: "temperature", units: "K", range: [210, 300.5] },
  ],
  leftOut: [{ name: "U", reason: "on another grid" }],
  notes: ["averaged to mass points"],
  steps: { count: 2, times: [{ text: "2001-01-01T00:00:00Z" }, { text: "2001-01-01T06:00:00Z" }] },
} as unknown as Dataset;

test("tells what was read, converted and left out", () => {
  const sections = aboutSections(dataset);
  assert.deepEqual(
    sections.map(({ title }) => title),
    ["Data", "Fields", "Left out", "Notes"],
  );
  const rows = Object.fromEntries(sections.flatMap((section) => section.rows));
  assert.equal(rows.source, "winds.nc (netCDF classic)");
  assert.equal(rows.x, "0 to 20 km, 3 samples");
  assert.equal(rows.y, "5 km, one sample");
  assert.equal(rows.wind, "m s⁻¹");
  assert.equal(rows.t, "temperature; 210 to 300.5 K");
  assert.equal(rows.U, "on another grid");
  assert.equal(rows.steps, "2, from 2001-01-01 00:00Z to 2001-01-01 06:00Z");
  assert.equal(rows[""], "averaged to mass points");
});

test("tells the levels of a store", () => {
  const levels = [
    {
      dims: { x: 520, y: 140, z: 133 },
      halvings: [0, 0, 0],
      bricks: 81,
      bytes: 9,
      storedBytes: 4e8,
      residentBytes: 2_300_000,
    },
    { dims: { x: 260, y: 70, z: 67 }, halvings: [1, 1, 1], bricks: 1, bytes: 9, residentBytes: 0 },
  ];
  const sections = aboutSections({ ...dataset, levels } as unknown as Dataset);
  assert.deepEqual(sections.find(({ title }) => title === "Levels of detail")?.rows, [
    ["0", "520 x 140 x 133 samples in 81 bricks, 400.0 MB on disk, 2.3 MB in memory"],
    ["1", "260 x 70 x 67 samples in one brick"],
  ]);
});

test("has no empty sections", () => {
  const sections = aboutSections({ ...dataset, leftOut: [], notes: [] });
  assert.deepEqual(
    sections.map(({ title }) => title),
    ["Data", "Fields"],
  );
});

test("longitudes and latitudes have the sides of the Earth", () => {
  const axes = {
    ...dataset.axes,
    x: axis("lon", "degrees_east", [-10, 0, 25]),
    y: axis("lat", "degrees_north", [72, 55]),
  };
  const [data] = aboutSections({ ...dataset, axes } as unknown as Dataset);
  const rows = Object.fromEntries(data!.rows);
  assert.equal(rows.lon, "10 °W to 25 °E, 3 samples");
  assert.equal(rows.lat, "72 to 55 °N, 2 samples");
});
