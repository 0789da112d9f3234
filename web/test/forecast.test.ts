// Plot of error against time: axes, ticks, text, and the increments of budget and limit.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  axisOver,
  budgetAfter,
  limitAfter,
  logTicks,
  positionOn,
  pointText,
  valueOn,
} from "../src/panels/forecast";
import type { ForecastPoint } from "@windsplat/client";

test("an axis contains its values, omits those without logarithm, and has a minimum width", () => {
  const axis = axisOver([0, Number.NaN, 5, 200], 30);
  assert.ok(axis.low < 5 && axis.high > 200 && axis.low > 1);
  const narrow = axisOver([10, 10], 30);
  assert.ok(Math.abs(narrow.high / narrow.low - 30) < 1e-9);
  assert.ok(Math.abs(narrow.high * narrow.low - 100) < 1e-9, "centred on the values");
  assert.ok(axisOver([], 30).low > 0);
});

test("positions are logarithmic and invertible", () => {
  const axis = { low: 1, high: 10_000 };
  assert.equal(positionOn(axis, 100), 0.5);
  assert.equal(positionOn(axis, 0), 0);
  assert.equal(positionOn(axis, 1e9), 1);
  assert.ok(Math.abs(valueOn(axis, 0.25) - 10) < 1e-9);
  assert.equal(valueOn(axis, 7), 10_000);
});

test("ticks are round and limited by the space", () => {
  assert.deepEqual(logTicks({ low: 4, high: 600 }, 7), [5, 10, 20, 50, 100, 200, 500]);
  assert.deepEqual(logTicks({ low: 4, high: 600 }, 5), [10, 100]);
  assert.deepEqual(logTicks({ low: 2e-6, high: 0.5 }, 5), [1e-5, 1e-4, 1e-3, 1e-2, 1e-1]);
  assert.ok(logTicks({ low: 1e-30, high: 1e30 }, 5).length <= 5);
});

const point: ForecastPoint = {
  method: "slab",
  slabThickness: 2,
  width: 568,
  height: 409,
  coarser: 1,
  ms: 31.4159,
  timed: true,
  error: 0.0112,
  errorLow: 0.006,
  errorHigh: 0.02,
  kind: "estimated",
  pareto: true,
};

test("a setting is formatted with either error metric", () => {
  assert.equal(
    pointText(point, "rmse"),
    "slab of 2 cells, 568×409, data 1/2: 31.4 ms, error 0.011 (0.006 to 0.02), estimated",
  );
  const kernel = { ...point, method: "kernel" as const, slabThickness: null, coarser: 0 };
  assert.match(pointText(kernel, "psnr"), /^kernel, 568×409: 31.4 ms, PSNR 39.0 dB/);
});

test("arrow keys change the error limit by about a hundredth of its value", () => {
  for (let error = 1e-3; error < 1e-2; error = Number((error + 1e-5).toPrecision(3))) {
    for (const way of [1, -1] as const) {
      const by = (limitAfter(error, way, true) / error) ** way;
      assert.ok(by > 1.004 && by < 1.016, `${error} ${way}: ${by}`);
      const coarse = (limitAfter(error, way, false) / error) ** way;
      assert.ok(coarse > 1.04 && coarse < 1.16, `${error} ${way}: ${coarse}`);
    }
  }
});

test("arrow keys change the budget by a twentieth within the protocol limits", () => {
  assert.equal(budgetAfter(100, 1, false), 105);
  assert.equal(budgetAfter(100, -1, true), 99);
  assert.equal(budgetAfter(3, 1, false), 4);
  assert.equal(budgetAfter(1, -1, false), 1);
  assert.equal(budgetAfter(9999, 1, false), 10_000);
});
