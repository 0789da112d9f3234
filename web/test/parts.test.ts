// The smaller pure parts of the page: numbers, legend, links, media, gestures, picture size, times.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { gesture, MoveQueue, pictureSize, readableTime } from "@windsplat/client/parts";
import { legendEntries, sampleHeights } from "../src/view/legend_entries";
import { unitText } from "../src/view/unit_text";
import { hashOfView, viewOfHash } from "../src/view/link";
import {
  densityOf,
  followMedia,
  mediaOf,
  rampCurve,
  thresholdOf,
  withDensity,
  type Curve,
  type Layer,
} from "../src/panels/media";
import { patchAt, valueAt } from "../src/panels/panel_kit";
import type { Dataset, View, Camera } from "@windsplat/client";
import { problemText } from "../src/base/problem_text";
import { formatBytes, formatNumber, linearTicks, niceTicks } from "../src/base/ticks";

const dataset: Dataset = {
  id: "gcm",
  title: "GCM",
  source: "gcm.nc",
  format: "netCDF-4",
  state: "ready",
  dims: { x: 2, y: 2, z: 4 },
  axes: {
    x: {
      name: "lon",
      standardName: "longitude",
      units: "degrees_east",
      kind: "longitude",
      coordinates: [0, 1],
      world: [-0.5, 0.5],
    },
    y: {
      name: "lat",
      standardName: "latitude",
      units: "degrees_north",
      kind: "latitude",
      coordinates: [0, 1],
      world: [-0.5, 0.5],
    },
    z: {
      name: "lev",
      standardName: "air_pressure",
      units: "hPa",
      kind: "pressure",
      coordinates: [1000, 700, 500, 200],
      world: [-0.12, -0.06, 0.0, 0.12],
    },
  },
  world: { min: [-1, -1, -0.15], max: [1, 1, 0.15] },
  mappings: ["flat", "sphere"],
  fields: [
    {
      name: "wind",
      kind: "vector",
      components: ["u", "v"],
      units: "m s-1",
      standardName: "",
      longName: "",
      range: [0, 50],
      masked: 0,
      rangeOf: "step",
      dtype: "float32",
    },
    {
      name: "cloud",
      kind: "scalar",
      components: ["cloud"],
      units: "1",
      standardName: "",
      longName: "cloud fraction",
      range: [0, 1],
      masked: 0,
      rangeOf: "step",
      dtype: "float32",
    },
  ],
  leftOut: [],
  notes: [],
  choices: [],
  steps: { count: 1, times: [{ value: 0, text: "" }] },
  timeUnits: "",
  residentBytes: 0,
  bytesWhenResident: 0,
};

const vector = (color: object): View => ({
  dataset: "gcm",
  vector: { field: "wind", magnitudeRange: [0, 60], color: { map: "magma", ...color } },
  scalars: [],
});

test("ticks are 1, 2 or 5 times a power of ten apart and within the range", () => {
  assert.deepEqual(niceTicks(0, 1, 5), [0, 0.2, 0.4, 0.6, 0.8, 1]);
  assert.deepEqual(niceTicks(0, 60, 5), [0, 20, 40, 60]);
  assert.deepEqual(niceTicks(-0.3, 0.3, 3), [-0.2, 0, 0.2]);
  assert.deepEqual(niceTicks(200, 310, 5), [200, 250, 300]);
  assert.deepEqual(niceTicks(1, 0, 5), niceTicks(0, 1, 5));
  for (const [low, high] of [
    [0, 1e-12],
    [-1e30, 3e30],
    [99.9, 100.1],
  ] as const) {
    const ticks = niceTicks(low, high, 5);
    assert.ok(ticks.length >= 2 && ticks.length <= 11, `${ticks}`);
    for (const tick of ticks) assert.ok(tick >= low && tick <= high);
  }
  for (const [low, high] of [
    [1, 1],
    [NaN, 1],
    [0, Infinity],
  ] as const) {
    assert.deepEqual(niceTicks(low, high, 5), []);
  }
});

test("a reversed range has reversed ticks", () => {
  assert.deepEqual(
    linearTicks([0, 10], 2).map((tick) => [tick.at, tick.text]),
    [
      [0, "0"],
      [0.5, "5"],
      [1, "10"],
    ],
  );
  assert.deepEqual(
    linearTicks([10, 0], 2).map((tick) => [Math.abs(tick.at), tick.text]),
    [
      [1, "0"],
      [0.5, "5"],
      [0, "10"],
    ],
  );
});

test("numbers and byte counts are short", () => {
  const rows: [number, string][] = [
    [0, "0"],
    [0.30000000000000004, "0.3"],
    [12345.678, "12350"],
    [1e-5, "1e-5"],
    [2.5e7, "2.5e7"],
    [-0.02, "-0.02"],
    [NaN, "–"],
  ];
  for (const [value, text] of rows) assert.equal(formatNumber(value), text);
  assert.deepEqual([999, 9200, 92_000, 1.5e6, 3.74e9].map(formatBytes), [
    "999 B",
    "9.2 kB",
    "92 kB",
    "1.5 MB",
    "3.74 GB",
  ]);
});

test("height labels are levels of the vertical axis at their positions", () => {
  const [entry] = legendEntries(dataset, vector({ by: "worldZ", range: [-0.24, 0.15] }));
  assert.equal(entry!.units, "hPa");
  assert.match(entry!.title, /pressure/);
  const at = Object.fromEntries(entry!.ticks.map((tick) => [tick.text, tick.at]));
  assert.ok(Math.abs(at["1000"]! - (0.24 - 0.12) / 0.39) < 1e-9);
  assert.ok(Math.abs(at["500"]! - 0.24 / 0.39) < 1e-9);
  assert.ok(at["1000"]! < at["500"]!, "low pressure is at the top");
});

test("stretching the volume moves the levels along", () => {
  const stretched: View = { ...vector({}), geometry: { scale: [1, 1, 2] } };
  assert.deepEqual(sampleHeights(dataset, stretched), [-0.24, -0.12, 0, 0.24]);
  // Scaled by 20, the height exceeds the width: 2 x 0.15 x 20 = 6 is now the longest edge.
  const tower: View = { ...vector({}), geometry: { scale: [1, 1, 20] } };
  assert.ok(Math.abs(sampleHeights(dataset, tower)![3]! - (0.12 * 20 * 2) / 6) < 1e-12);
  const index: View = { ...vector({}), geometry: { vertical: "index" } };
  assert.equal(sampleHeights(dataset, index), null);
  const [entry] = legendEntries(dataset, {
    ...vector({ by: "worldZ", range: [-0.1, 0.1] }),
    geometry: { vertical: "index" },
  });
  assert.match(`${entry!.units}${entry!.note}`, /^from low to high/);
});

test("each colouring has its unit, a constant colour has no range", () => {
  const units = (color: object) => legendEntries(dataset, vector(color))[0]!.units;
  assert.equal(units({ by: "magnitude", range: [0, 60] }), "m s⁻¹");
  assert.equal(units({ by: "screenZ", range: [1, 3] }), "");
  assert.equal(units({ by: "rise", range: [-0.02, 0.02] }), "");
  const [constant] = legendEntries(dataset, vector({ by: "constant", constant: "#ff0000" }));
  assert.deepEqual([constant!.range, constant!.color], [null, "#ff0000"]);
  assert.match(constant!.note, /60 m s⁻¹/);
});

test("the legend states the slow limit in the unit of the field", () => {
  const calls = (minMagnitude: number | undefined, units = "m s-1") => {
    const fields = dataset.fields.map((field) => ({ ...field, units }));
    const view: View = { vector: { field: "wind", minMagnitude }, scalars: [{ field: "cloud" }] };
    return legendEntries({ ...dataset, fields }, view).map((entry) => entry.leftOut);
  };
  assert.deepEqual(calls(3), ["slower than 3 m s⁻¹ not drawn", ""]);
  assert.equal(calls(12.5, "km/h")[0], "slower than 12.5 km/h not drawn");
  assert.equal(calls(0.5, "V m-1")[0], "weaker than 0.5 V m⁻¹ not drawn");
  assert.equal(calls(0.25, "1")[0], "weaker than 0.25 not drawn");
  for (const all of [0, undefined]) assert.deepEqual(calls(all), ["", ""]);
});

test("powers in units are superscript", () => {
  const rows: [string | undefined, string][] = [
    ["m s-1", "m s⁻¹"],
    ["kg m**-2 s^-1", "kg m⁻² s⁻¹"],
    ["m2", "m²"],
    ["m/s", "m/s"],
    ["%", "%"],
    ["hPa", "hPa"],
    ["(0 - 1)", ""],
    [undefined, ""],
    ["degrees_north", "degrees_north"],
    ["W/m2", "W/m²"],
    ["m10", "m¹⁰"],
  ];
  for (const [units, text] of rows) assert.equal(unitText(units), text);
});

test("the legend shows only what is rendered", () => {
  assert.deepEqual(
    legendEntries(dataset, { dataset: "gcm", vector: { field: null }, scalars: [] }),
    [],
  );
  const both = legendEntries(dataset, {
    ...vector({ by: "magnitude", range: [0, 1] }),
    scalars: [
      {
        field: "cloud",
        color: { map: "grays", range: [0, 2] },
        extinction: [
          [0, 0],
          [1, 0],
          [2, 5],
        ],
      },
    ],
  });
  assert.deepEqual(
    both.map((entry) => entry.kind),
    ["lines", "medium"],
  );
  assert.equal(both[1]!.title, "cloud fraction");
  assert.deepEqual(both[1]!.extinction, [
    [0, 0],
    [0.5, 0],
    [1, 1],
  ]);
});

test("a link restores the view without the window size", () => {
  const view: View = {
    dataset: "a b/ü#%\"'",
    step: 3,
    image: { width: 100, height: 50 },
    camera: { eye: [0, -3.25, 1e-7] },
    vector: { field: null },
  };
  const hash = hashOfView(view);
  assert.match(hash, /^#!\{[!-~]*\}$/, "printable ASCII only");
  const { image: _image, ...rest } = view;
  assert.deepEqual(viewOfHash(hash), rest);
  const url = new URL(`http://h/${hash}`);
  assert.deepEqual(viewOfHash(url.hash), viewOfHash(hash), "an address preserves the view");
  assert.deepEqual(viewOfHash('#!{"dataset":"x","image":{"width":9,"background":"#112233"}}'), {
    dataset: "x",
    image: { background: "#112233" },
  });
});

test("an invalid link gives no view", () => {
  for (const hash of ["", "#", "#x", "#!", "#!{", "#![]", "#!null", "#!7", "#!%", "#!%E0%A4%A"]) {
    assert.equal(viewOfHash(hash), null, hash);
  }
});

test("density scales the opacity curve, threshold moves its start", () => {
  const curve: Curve = [
    [0, 0],
    [0.2, 0],
    [0.5, 2],
    [1, 8],
  ];
  assert.equal(densityOf(curve), 8);
  assert.equal(thresholdOf(curve), 0.2);
  assert.deepEqual(withDensity(curve, [0, 1], 4), [
    [0, 0],
    [0.2, 0],
    [0.5, 1],
    [1, 4],
  ]);
  assert.equal(
    thresholdOf([
      [0, 1],
      [1, 2],
    ]),
    null,
  );
  assert.deepEqual(rampCurve([0, 10], 4, 3), [
    [0, 0],
    [4, 0],
    [10, 3],
  ]);
  assert.deepEqual(
    rampCurve([10, 0], 0, 3),
    [
      [0, 0],
      [10, 3],
    ],
    "a reversed colour range",
  );
  const top = rampCurve([0, 10], 99, 3);
  for (let n = 1; n < top.length; n++) assert.ok(top[n]![0] > top[n - 1]![0], "values ascend");
  // A curve scaled to zero can be scaled back.
  const gone = withDensity(curve, [0, 1], 0);
  assert.equal(densityOf(gone), 0);
  assert.equal(densityOf(withDensity(gone, [0, 1], 5)), 5);
});

test("a disabled medium keeps its position and settings", () => {
  const a = { field: "a" };
  const b = { field: "b", stride: 3 };
  let layers: Layer[] = followMedia([], [a, b]);
  layers = layers.map((layer) => (layer.view.field === "a" ? { ...layer, on: false } : layer));
  assert.deepEqual(mediaOf(layers), [b]);
  layers = followMedia(layers, [{ ...b, stride: 4 }]);
  assert.deepEqual(
    layers.map((layer) => [layer.view.field, layer.on]),
    [
      ["a", false],
      ["b", true],
    ],
  );
  assert.equal(layers[1]!.view.stride, 4);
  assert.deepEqual(
    followMedia(layers, [a, b]).map((layer) => [layer.view.field, layer.on]),
    [
      ["a", true],
      ["b", true],
    ],
    "a medium set elsewhere is not duplicated",
  );
  assert.deepEqual(
    followMedia(layers, []).map((layer) => layer.view.field),
    ["a"],
  );
});

test("pointers read values and create patches", () => {
  assert.equal(valueAt({ a: { b: 3 } }, "/a/b"), 3);
  assert.equal(valueAt({ a: null }, "/a/b"), undefined);
  assert.deepEqual(patchAt("/a/b/c", [1]), { a: { b: { c: [1] } } });
});

test("two pointers have a centre and a distance", () => {
  assert.deepEqual(gesture([{ x: 3, y: 4 }]), { x: 3, y: 4, spread: 0 });
  assert.deepEqual(
    gesture([
      { x: 0, y: 0 },
      { x: 6, y: 8 },
    ]),
    { x: 3, y: 4, spread: 5 },
  );
});

// A camera that counts its changes, on a page whose display frames the test triggers.
class Desk {
  camera: Camera = {
    projection: "perspective",
    eye: [0, -1, 0],
    target: [0, 0, 0],
    up: [0, 0, 1],
    fovY: 35,
    height: 1,
  };
  calls = 0;
  isReady = true;
  private frames: (() => void)[] = [];
  readonly queue = new MoveQueue(
    {
      camera: () => this.camera,
      setCamera: (next) => {
        this.camera = next;
        this.calls += 1;
      },
      ready: () => this.isReady,
    },
    (run) => this.frames.push(run),
  );

  grow(times: number): void {
    for (let n = 0; n < times; n++) this.queue.push((c) => ({ ...c, height: c.height + 1 }));
  }

  get asked(): number {
    return this.frames.length;
  }

  displayFrame(): void {
    for (const run of this.frames.splice(0)) run();
  }
}

test("the first move is sent at once, later ones once per display frame", () => {
  const desk = new Desk();
  desk.grow(50);
  assert.deepEqual([desk.calls, desk.camera.height], [1, 2], "the first move is not delayed");
  assert.equal(desk.asked, 1);
  desk.displayFrame();
  assert.deepEqual([desk.calls, desk.camera.height], [2, 51], "the later moves are combined");
  desk.grow(1);
  assert.equal(desk.calls, 2, "one patch per display frame");
  desk.displayFrame();
  assert.equal(desk.calls, 3);
  desk.displayFrame();
  assert.deepEqual([desk.calls, desk.asked], [3, 0], "at rest no display frame is requested");
  desk.grow(1);
  assert.equal(desk.calls, 4, "the next move is not delayed");
});

test("while patches are held back moves are merged", () => {
  const desk = new Desk();
  desk.isReady = false;
  desk.grow(3);
  for (let n = 0; n < 10; n++) {
    desk.displayFrame();
    desk.grow(1);
  }
  assert.equal(desk.calls, 0);
  desk.isReady = true;
  desk.displayFrame();
  assert.deepEqual([desk.calls, desk.camera.height], [1, 14]);
});

test("the picture uses the pixel density up to a limit", () => {
  const most = 35_389_440; // limit of the server
  assert.deepEqual(pictureSize(800, 600, 1, most), [800, 600]);
  assert.deepEqual(pictureSize(800, 600, 2, most), [1600, 1200]);
  assert.deepEqual(pictureSize(400, 300, 3, most), [800, 600]);
  assert.deepEqual(pictureSize(0, 0, 1, most), [16, 16]);
  for (const [w, h, density] of [
    [3840, 2160, 2],
    [8000, 100, 1],
    [1440, 900, 2],
  ] as const) {
    for (const limit of [most, 300_000]) {
      const [width, height] = pictureSize(w, h, density, limit);
      assert.ok(width * height <= Math.min(limit, 3.7e6) && width <= 4096 && height <= 4096);
      assert.ok(Math.abs(width / height / (w / h) - 1) < 0.02);
    }
  }
});

test("times are readable, and unknown ones unchanged", () => {
  assert.equal(readableTime("2001-01-01T03:00:00Z"), "2001-01-01 03:00Z");
  assert.equal(readableTime("2001-01-01T03:00:07Z"), "2001-01-01 03:00:07Z");
  assert.equal(readableTime("step 3"), "step 3");
});

test("a problem is described by its invalid values", () => {
  const problem = { type: "about:blank", title: "Bad", status: 422, detail: "d" };
  assert.equal(problemText(problem), "d");
  assert.equal(problemText({ ...problem, detail: "" }), "Bad");
  assert.equal(
    problemText({ ...problem, errors: [{ pointer: "/step", detail: "too large" }] }),
    "Time step: too large",
  );
});

test("the page has a strict content security policy at any base path", () => {
  const page = readFileSync("index.html", "utf8");
  assert.doesNotMatch(page, /<style|\sstyle=|\son\w+=|javascript:/i);
  for (const [, script] of page.matchAll(/<script([^>]*)>/g))
    assert.match(script!, /src="%SCRIPT%"/);
  for (const [, , address] of page.matchAll(/\b(src|href)="([^"]*)"/g)) {
    assert.match(address!, /^%[A-Z]+%$/, "relative, hashed names only");
  }
  for (const sheet of ["base", "stage", "panel", "responsive"]) {
    assert.doesNotMatch(readFileSync(`src/styles/${sheet}.css`, "utf8"), /url\(|@import/);
  }
});
