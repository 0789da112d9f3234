// The legend of lines.
import assert from "node:assert/strict";
import { test } from "node:test";
import { legendEntries } from "../../src/view/legend_entries";
import type { Dataset, View } from "@windsplat/client";
import { described } from "../page";

test("the legend names the end of a line that is ahead", () => {
  const note = (lines: object) =>
    legendEntries(described("gcm"), {
      vector: { field: "wind", magnitudeRange: [0, 60], ...lines },
      scalars: [],
    })[0]!.note;
  const white = { headDesaturation: 0.7 };
  assert.match(note(white), /, white end ahead$/);
  assert.match(note({ ...white, mark: { shape: "taper" } }), /, pointed end ahead$/);
  assert.match(note({ ...white, mark: { shape: "comet" } }), /, bright end ahead$/);
  assert.doesNotMatch(note({ ...white, mark: { shape: "arrow" } }), /ahead/);
  assert.match(note({ headDesaturation: 0, mark: { tailDarkening: 0.5 } }), /, bright end ahead$/);
});

const surfaceLegend = (surfaces: View["surfaces"]) =>
  legendEntries(described("gcm", { fields: ["wind", "temperature", "humidity"] }), {
    vector: { field: null },
    scalars: [],
    surfaces,
  }).map(({ kind, title, units, range, map, color, note }) => {
    assert.equal(kind, "surface");
    return { title, units, range, map, color, note };
  });

test("the legend of an isosurface tells its value, and its colour or that of another field", () => {
  const [plain, coloured] = surfaceLegend([
    { field: "temperature", isovalue: 273.2, color: { constant: "#123456" } },
    {
      field: "temperature",
      isovalue: 250,
      color: { field: "humidity", map: "magma", range: [200, 300] },
    },
  ]);
  assert.deepEqual(plain, {
    title: "temperature",
    units: "",
    range: null,
    map: null,
    color: "#123456",
    note: "surface where it is 273.2 K",
  });
  assert.deepEqual(coloured, {
    title: "humidity",
    units: "K",
    range: [200, 300],
    map: "magma",
    color: null,
    note: "surface where temperature is 250 K",
  });
});

test("the legend of a section has its own colours and its contours; unseen ones have none", () => {
  const slice = { axis: "z", index: 1 } as const;
  const entries = surfaceLegend([
    { field: "temperature", slice, color: { range: [0, 30] }, contours: { interval: 2.5 } },
    { field: "temperature", slice, color: { range: [0, 30] }, contours: { levels: [0, 12.25] } },
    { field: "temperature", slice, opacity: 0 },
    { field: "humidity", slice, opacity: 0, contours: { interval: 1 } },
  ]);
  assert.deepEqual(
    entries.map(({ title, units, range, note }) => [title, units, range, note]),
    [
      ["temperature", "K", [0, 30], "section at z = 1 m, contours every 2.5 K"],
      ["temperature", "K", [0, 30], "section at z = 1 m, contours at 0, 12.25 K"],
      ["humidity", "K", [0, 30], "section at z = 1 m, contours every 1 K"],
    ],
  );
});

test("the legend says that the values are differences, without the range of the field", () => {
  const view = {
    vector: { field: "wind", color: { by: "magnitude", range: [0, 1] } },
    scalars: [],
  } as const;
  const dataset = described("gcm");
  const fields = dataset.fields.map((field) => ({ ...field, range: [0, 60] }));
  const entry = (more: object) =>
    legendEntries({ ...dataset, fields } as never, { ...view, ...more } as never)[0]!;
  assert.equal(entry({}).title, "wind: magnitude");
  assert.deepEqual(entry({}).beyond, [false, true]);
  const difference = entry({ difference: { step: 0 } });
  assert.equal(difference.title, "difference of wind: magnitude");
  assert.deepEqual(difference.beyond, [false, false]);
});

test("the legend has the words of the server's legend", () => {
  const dataset = described("gcm", { fields: ["wind", "cloud_cover"] });
  const titles = (longName: string, kind: Dataset["axes"]["z"]["kind"]) => {
    const fields = dataset.fields.map((field) => ({ ...field, longName }));
    const z = { ...dataset.axes.z, kind };
    return legendEntries({ ...dataset, fields, axes: { ...dataset.axes, z } } as Dataset, {
      vector: { field: "wind", color: { by: "worldZ", range: [-1, 1] } },
      scalars: [{ field: "cloud_cover" }],
    }).map(({ title }) => title);
  };
  const [lines, cloud] = titles("percent cloudiness as a fraction", "height");
  assert.deepEqual([lines, cloud], ["wind: height", "percent cloudiness as a fraction"]);
  assert.equal(titles("", "depth")[0], "wind: depth");
  assert.equal(titles("a name of more than forty characters, cut", "height")[1], "cloud cover");
});
