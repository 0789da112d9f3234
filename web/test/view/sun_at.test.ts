// The sun at the time of a step and the place of the data.
import assert from "node:assert/strict";
import { test } from "node:test";
import { minuteOf, nightText, sunAtStep, sunHeight } from "../../src/view/sun_at";
import type { View } from "@windsplat/client";
import { described } from "../page";

test("times in UTC are cut to the minute, others are none", () => {
  assert.equal(minuteOf("2024-06-21T12:34Z"), "2024-06-21T12:34");
  assert.equal(minuteOf("2024-06-21T12:34:56Z"), "2024-06-21T12:34");
  assert.equal(minuteOf("2024-06-21T12:34:56.5Z"), "2024-06-21T12:34");
  for (const text of ["", "10 s", "2024-06-21", "2024-06-21T12:34", "12024-06-21T12:34Z"]) {
    assert.equal(minuteOf(text), null, text);
  }
});

test("the sun stands at the time of the step over the middle of the data", () => {
  const dataset = described("europe", { size: 3 });
  const noon = sunAtStep(dataset, 1);
  assert.deepEqual(noon, { utc: "2001-01-01T01:00Z", longitude: 0, latitude: 0 }, "without places");
  Object.assign(dataset.axes.x, { kind: "longitude", coordinates: [-30, 0, 40] });
  Object.assign(dataset.axes.y, { kind: "latitude", coordinates: [70, 50, 35] });
  dataset.steps.times[2] = { value: 2, text: "20 s" };
  assert.deepEqual(sunAtStep(dataset, 2), {
    utc: "2024-03-20T12:00Z",
    longitude: 5,
    latitude: 52.5,
  });
});

test("the sun culminates at known heights", () => {
  // At noon the height is 90 - |latitude - declination|; the declination is 23.44 at the solstice
  // and passes 0 at the equinox. Greenwich lies at 51.48 N.
  const known: [string, number, number, number][] = [
    ["2024-06-20T12:02Z", 0, 51.48, 90 - 51.48 + 23.44],
    ["2024-06-20T00:02Z", 0, 51.48, -(90 - 51.48 - 23.44)],
    ["2024-03-20T12:07Z", 0, 0, 90],
    ["2024-03-20T18:07Z", 0, 0, 0],
    ["2024-12-21T00:00Z", 180, -23.44, 90],
  ];
  for (const [utc, longitude, latitude, height] of known) {
    const got = sunHeight({ utc, longitude, latitude });
    assert.ok(Math.abs(got - height) < 0.6, `${utc}: ${got}, ${height}`);
  }
});

test("a picture at night says so, one by day or without light does not", () => {
  const sunAt = { utc: "2024-06-20T00:02Z", longitude: 0, latitude: 51.48 };
  const lit = (light: object, geometry = {}) => nightText({ light, geometry } as View);
  assert.equal(lit({ sunAt }), "The sun is 15° below the horizon here at this time.");
  assert.equal(lit({ sunAt: { ...sunAt, utc: "2024-06-20T12:02Z" } }), "");
  assert.equal(lit({ elevation: -4, sunAt: null }), "The sun is 4° below the horizon.");
  assert.equal(lit({ elevation: 40 }), "");
  assert.equal(lit({ sunAt }, { mapping: "sphere" }), "", "it shines on the other side");
  assert.equal(nightText({ light: null } as View), "");
});
