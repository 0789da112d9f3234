// The sun at the time of a step and the place of the data.
import assert from "node:assert/strict";
import { test } from "node:test";
import { minuteOf, sunAtStep } from "../../src/view/sun_at";
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
