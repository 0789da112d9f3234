// What the page writes instead of world units, and numbers and units as people write them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { linearTicks, stepNumber, unevenTicks } from "../src/base/ticks";
import { colorScale } from "../src/view/color_scale";
import { beyondEnds, legendEntries } from "../src/view/legend_entries";
import { unitText } from "../src/view/unit_text";
import { opacityText } from "../src/panels/transfer";
import { isGeographic } from "../src/viewport/gizmo";
import type { Dataset, View } from "@windsplat/client";

const grid = (kind: string, units: string, coordinates: number[]) =>
  ({
    dims: { x: 2, y: 2, z: 4 },
    world: { min: [-1, -0.5, -0.3], max: [1, 0.5, 0.3] },
    axes: {
      x: { name: "x", units: "m", kind, coordinates: [0, 1], world: [-0.5, 0.5] },
      y: { name: "y", units: "m", kind, coordinates: [0, 1], world: [-0.25, 0.25] },
      z: { name: "z", units, kind, coordinates, world: [-0.225, -0.075, 0.075, 0.225] },
    },
    fields: [
      { name: "wind", kind: "vector", units: "m s-1", range: [0.5, 57.2] },
      { name: "heat", kind: "scalar", units: "K", range: [200, 310] },
    ],
  }) as unknown as Dataset;
const pressure = grid("pressure", "hPa", [1000, 700, 400, 100]);
const room = grid("cartesian", "m", [0, 1, 2, 3]);
const colored = (color: object): View =>
  ({ vector: { field: "wind", color, magnitudeRange: [0, 30] }, scalars: [] }) as unknown as View;

test("ticks have the decimals of their step", () => {
  const texts = linearTicks([101310, 101350]).map(({ text }) => text);
  assert.deepEqual(texts, ["101310", "101320", "101330", "101340", "101350"]);
  assert.deepEqual(
    linearTicks([0.9998, 1.0002], 4).map(({ text }) => text),
    ["0.9998", "0.9999", "1", "1.0001", "1.0002"],
  );
  assert.equal(stepNumber(0.30000000000000004, 0.1), "0.3");
  assert.equal(stepNumber(0.12345, 0.01), "0.12");
  assert.equal(stepNumber(2.5e7, 5e6), "2.5e7");
  assert.deepEqual(
    unevenTicks([101301, 101303], 0.17, (value) => (value - 101301) / 2).map(({ text }) => text),
    ["101301", "101301.5", "101302", "101302.5", "101303"],
  );
});

test("round levels are preferred where space is short", () => {
  const textsOf = (range: [number, number], place: (value: number) => number) =>
    unevenTicks(range, 0.17, place).map(({ text }) => text);
  // As the server's legend writes levels of 10 to 1000 hPa that are placed by their logarithm.
  assert.deepEqual(
    textsOf([1000, 10], (value) => 0.205 + 0.1716 * Math.log(1000 / value)),
    ["50", "200", "1000"],
  );
  assert.deepEqual(
    textsOf([0, 3], (value) => value / 3),
    ["0", "1", "2", "3"],
  );
  assert.deepEqual(
    textsOf([5, 5], () => 0.5),
    [],
  );
});

test("units that are written out become symbols", () => {
  for (const units of ["meter second-1", "Metres second^-1", "meters per second", "m per sec"]) {
    assert.equal(unitText(units), "m s⁻¹", units);
  }
  assert.equal(unitText("watts per meter2"), "W m⁻²");
  assert.equal(unitText("meter/second"), "m/s");
  assert.equal(unitText("centimeter/s"), "cm/s");
  assert.equal(unitText("millimetres per day"), "mm day⁻¹");
  assert.equal(unitText("degrees_Celsius"), "°C");
  for (const units of ["DEG C", "deg C", "Degrees Celsius", "degree c"]) {
    assert.equal(unitText(units), "°C", units);
  }
  assert.equal(unitText("deg C m-1"), "°C m⁻¹");
  assert.equal(unitText("deg Cel"), "deg Cel");
  assert.equal(unitText("Kelvin"), "K");
  assert.equal(unitText("percent"), "%");
  assert.equal(unitText("per mille"), "per mille");
  assert.equal(unitText("meteors"), "meteors");
});

test("no legend says world units", () => {
  const cases = ["worldZ", "screenZ", "rise"].flatMap((by) =>
    [pressure, room].map((dataset) => [dataset, by] as const),
  );
  for (const [dataset, by] of cases) {
    const view = colored({ by, range: [-0.2, 0.2] });
    const bent = { ...view, geometry: { vertical: "index" } } as View;
    for (const shown of [view, bent]) {
      assert.doesNotMatch(JSON.stringify(legendEntries(dataset, shown)), /world unit/);
    }
  }
  const [entry] = legendEntries(room, colored({ by: "worldZ", range: [-0.225, 0.225] }));
  assert.equal(entry!.units, "m");
  assert.deepEqual(
    entry!.ticks.map(({ text }) => text),
    ["0", "1", "2", "3"],
  );
  assert.match(
    legendEntries(room, colored({ by: "screenZ", range: [5, 2] }))[0]!.note,
    /^from far to near/,
  );
});

test("colours by height are set in coordinates of the vertical axis", () => {
  const scale = colorScale(pressure, colored({ by: "worldZ" }));
  assert.equal(scale.units, "hPa");
  assert.ok(Math.abs(scale.shown(-0.15) - 850) < 1e-9);
  for (const value of [-0.3, -0.1, 0, 0.2]) {
    assert.ok(Math.abs(scale.stored(scale.shown(value)) - value) < 1e-12);
  }
  assert.equal(colorScale(pressure, colored({ by: "magnitude" })).units, "m s⁻¹");
  assert.equal(colorScale(pressure, colored({ by: "scalar", field: "heat" })).units, "K");
  assert.equal(colorScale(pressure, colored({ by: "direction" })).units, "°");
});

test("an extinction is given as the opacity of 1 % of the box", () => {
  assert.equal(opacityText(0), "0 % opaque in 1 % of the box");
  assert.equal(opacityText(50), "63.2 % opaque in 1 % of the box");
  assert.equal(opacityText(500), "99.9 % opaque in 1 % of the box");
});

test("the legend marks the ends beyond which values lie", () => {
  assert.deepEqual(beyondEnds([0, 50], [10, 84]), [false, true]);
  assert.deepEqual(beyondEnds([50, 0], [10, 84]), [true, false]);
  assert.deepEqual(beyondEnds([20, 50], [10, 50]), [true, false]);
  assert.deepEqual(beyondEnds([0, 1], null), [false, false]);
  const [lines] = legendEntries(pressure, colored({ by: "magnitude", range: [0, 30] }));
  assert.deepEqual(lines!.beyond, [false, true]);
  // Values that are transparent are not drawn, so they lie beyond no end.
  const medium = (extinction: [number, number][]) =>
    legendEntries(pressure, {
      vector: { field: null },
      scalars: [{ field: "heat", color: { range: [250, 300] }, extinction }],
    } as unknown as View)[0]!.beyond;
  assert.deepEqual(
    medium([
      [250, 0],
      [300, 9],
    ]),
    [false, true],
  );
  assert.deepEqual(
    medium([
      [250, 9],
      [300, 9],
    ]),
    [true, true],
  );
});

test("east, north and up are named where they are known", () => {
  const axes = (kind: string, x: string, y: string) =>
    ({ x: { kind, name: x }, y: { kind, name: y } }) as unknown as Dataset["axes"];
  assert.ok(isGeographic(axes("longitude", "lon", "lat")));
  assert.ok(isGeographic(axes("cartesian", "west_east", "south_north")));
  assert.ok(!isGeographic(axes("cartesian", "x", "y")));
});

test("the legend tells how lines differ from its colours, unless they are true", () => {
  const faded = (trueColors: boolean) => {
    const view = colored({ by: "magnitude", range: [0, 30], trueColors });
    const vector = { ...view.vector, headDesaturation: 0.7, magnitudeIntensity: 0.6 };
    return legendEntries(pressure, { ...view, vector, depthCue: { strength: 0.3 } } as View)[0]!
      .note;
  };
  assert.equal(
    faded(false),
    "longest line 30 m s⁻¹, white end ahead, weaker and farther lines are darker",
  );
  assert.equal(faded(true), "longest line 30 m s⁻¹");
});
