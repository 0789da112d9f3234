// The study report: numbers as text, and logarithmic axes.
import assert from "node:assert/strict";
import { test } from "node:test";
import { logDomain, logTicks } from "../report/figure";
import { powerOfTen, scientific, short } from "../report/text";

test("numbers of the report are formatted as text", () => {
  assert.equal(short(0.00015), "0.00015");
  assert.equal(short(1e-6), "1e-6");
  assert.equal(short(1e30), "1e30");
  assert.equal(short(-0.25), "-0.25");
  assert.equal(short(0), "0");
  assert.equal(short(123456.7, 4), "1.235e5");
  assert.equal(short(10000), "10000");
  assert.equal(short(null), "–");
  assert.equal(scientific(0.0123), "1.23e-2");
  assert.equal(powerOfTen(1e-3), "10⁻³");
  assert.equal(powerOfTen(200), "2×10²");
});

test("a logarithmic axis has a margin and spans at least half a decade", () => {
  const [low, high] = logDomain([1, null, 0, 100]);
  assert.ok(low < 1 && low > 0.5 && high > 100 && high < 200);
  for (const values of [[3], [], [null]]) {
    const [from, to] = logDomain(values);
    assert.ok(to / from >= Math.sqrt(10) && to / from < 10, `${from} to ${to}`);
  }
});

test("ticks of a logarithmic axis lie within it and do not overlap", () => {
  assert.deepEqual(logTicks([0.9, 25]), [1, 2, 5, 10, 20]);
  assert.deepEqual(logTicks([0.0008, 2]), [1e-3, 1e-2, 1e-1, 1]);
  assert.deepEqual(logTicks([2.2, 7.9]), [3, 5, 7]);
  assert.ok(logTicks([1e-30, 1e30]).length <= 11);
});
