// Plot of error against time in the Quality panel, in a real browser. The forecast is simulated;
// the effects of budget and limit on the frames are the daemon's own.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  control,
  drag,
  framesOf,
  movingOf,
  patience,
  sharedDaemon,
  shot,
  type,
  unfold,
  watchFrames,
  watchPatches,
} from "./support.mjs";

const shared = sharedDaemon();

const points = [4, 9, 20, 45, 100, 220].map((ms, n) => ({
  method: n % 2 === 0 ? "kernel" : "slab",
  slabThickness: n % 2 === 0 ? null : 2,
  width: 1136,
  height: 818,
  coarser: 0,
  ms,
  timed: true,
  error: 0.2 / ms,
  errorLow: 0.1 / ms,
  errorHigh: 0.4 / ms,
  kind: n === 3 ? "measured" : "estimated",
  pareto: n !== 2,
}));

// The server's forecast is `json`; page.asked contains the views for which it was requested.
function withPage(run, { status = 200, json = { view: {}, points, chosen: 2 }, ...options } = {}) {
  return shared.withPage(run, {
    initScript: [watchFrames, watchPatches],
    ...options,
    prepare: async (page) => {
      await options.prepare?.(page);
      page.asked = [];
      await page.route(/\/v1\/forecasts$/, (route) => {
        page.asked.push(route.request().postDataJSON());
        return route.fulfill({ status, json });
      });
    },
  });
}

const handle = (page, name) => page.getByRole("slider", { name, exact: true }).last();
const budgetOf = (page) =>
  page.evaluate(
    () => window.patches.map(({ patch }) => patch.quality?.budgetMs).findLast((v) => v) ?? null,
  );

async function open(page) {
  await unfold(page, "Quality");
  await page.locator(".forecast").scrollIntoViewIfNeeded();
  await page.locator(".forecast circle").first().waitFor();
}

test("the plot loads when visible and at rest, and describes each setting", () =>
  withPage(async (page) => {
    assert.deepEqual(page.asked, [], "no request while hidden");
    await open(page);
    assert.equal(page.asked.length, 1);
    assert.equal(page.asked[0].dataset, "climate");
    assert.equal(page.asked[0].quality.budgetMs, 33);
    const circles = page.locator(".forecast circle");
    assert.equal(await circles.count(), points.length);
    assert.equal(await page.locator(".forecast .plot-measured").count(), 1);
    const told = await circles.nth(3).locator("title").textContent();
    assert.equal(
      told,
      "slab of 2 cells, 1136×818: 45 ms, error 0.0044 (0.0022 to 0.0089), measured",
    );
    // Equal ratios of time are equal distances: 4 -> 20 as far as 20 -> 100.
    const x = async (n) => Number(await circles.nth(n).getAttribute("cx"));
    assert.ok(Math.abs((await x(2)) - (await x(0)) - ((await x(4)) - (await x(2)))) < 0.01);
    const line = await page.locator(".forecast polyline").getAttribute("points");
    assert.equal(line.split(" ").length, points.length - 1, "the line connects the Pareto points");
    const final = page.locator(".plot-final");
    const frame = await page.evaluate(() => window.frameHeaders.at(-1));
    assert.match(await final.locator("title").textContent(), /^final [\d.]+ ms, error /);
    const label = await page.locator(".forecast").getAttribute("aria-label");
    assert.equal(label, "error against time: 6 settings, 1 measured");
    assert.ok(frame.final);
    const again = page.waitForRequest(/\/v1\/forecasts$/);
    await drag(page, 60, 10);
    await again;
    await page.waitForFunction(() => /final/.test(document.querySelector("#mark").textContent));
    assert.notDeepEqual(
      page.asked.at(-1).camera,
      page.asked[0].camera,
      "the request contains the current view",
    );
    const entries = await page.locator(".plot-key li").allInnerTexts();
    assert.deepEqual(entries.slice(0, 2), ["measured", "estimated"]);
    assert.equal(entries.length, 8);
    assert.match(
      await page.locator(".forecast ~ .histogram-caption").textContent(),
      /final [\d.]+ ms, error [\d.e-]+, (indistinguishable|slight|visible)/,
    );
    await page.locator(".plot-key").scrollIntoViewIfNeeded();
    await shot(page, "plot");
  }));

test("handles lie within the plot, at both ends of its axes", () =>
  withPage(async (page) => {
    await open(page);
    await control(page, "limit the error", "input").check();
    const box = await page.locator(".forecast").boundingBox();
    for (const ms of [2, 500]) {
      await type(page, "moving budget \\(ms\\)", ms);
      for (const grip of await page.locator(".plot-handle path").all()) {
        const at = await grip.boundingBox();
        assert.ok(at.y >= box.y, `${ms} ms: ${at.y} below ${box.y}`);
        assert.ok(at.x >= box.x && at.x + at.width <= box.x + box.width - 1);
        assert.ok(at.y + at.height <= box.y + box.height);
      }
    }
  }));

test("an incomplete forecast at rest is requested once more only", () =>
  withPage(async (page) => {
    await open(page);
    const until = Date.now() + 9000 * patience;
    while (page.asked.length < 2 && Date.now() < until) await page.waitForTimeout(50);
    assert.equal(page.asked.length, 2);
    await page.waitForTimeout(6500);
    assert.equal(page.asked.length, 2);
  }));

test("the budget handle sets the budget of moving frames by pointer and keys", () =>
  withPage(async (page) => {
    await open(page);
    const moving = async () => movingOf(await framesOf(page, () => drag(page, 90, 20, 40)));
    const budget = handle(page, "moving budget (ms)");
    assert.equal(await budget.getAttribute("aria-valuetext"), "33 ms");
    const box = await page.locator(".forecast").boundingBox();
    const grip = await budget.boundingBox();
    await page.mouse.move(grip.x + grip.width / 2, grip.y + 20);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width, grip.y + 20, { steps: 5 });
    await page.mouse.up();
    const large = await budgetOf(page);
    assert.ok(large > 200, `${large}`);
    assert.equal(await control(page, "moving budget \\(ms\\)", "input").inputValue(), `${large}`);
    const slow = await moving();
    assert.equal(slow.at(-1).chosen.view.quality.budgetMs, large);
    await budget.focus();
    await page.keyboard.press("ArrowLeft");
    assert.equal(await budgetOf(page), large - Math.max(1, Math.round(0.05 * large)));
    await page.keyboard.press("Shift+ArrowRight");
    assert.equal(await budgetOf(page), large - Math.max(1, Math.round(0.05 * large)) + 1);
    await type(page, "moving budget \\(ms\\)", 2);
    assert.equal(await budgetOf(page), 2, "clamped to the protocol's minimum");
    assert.equal(await budget.getAttribute("aria-valuetext"), "2 ms");
    const quick = await moving();
    assert.equal(quick.at(-1).chosen.view.quality.budgetMs, 2);
    const least = (frames) => Math.min(...frames.slice(-5).map(({ width }) => width));
    assert.ok(least(quick) < least(slow), `${least(quick)} < ${least(slow)}`);
  }));

test("the error limit is a draggable line in every error metric", () =>
  withPage(async (page) => {
    await open(page);
    assert.equal(await handle(page, "max error").count(), 0);
    await control(page, "limit the error", "input").check();
    const limit = page.locator(".plot-handle[aria-label='max error']");
    assert.equal(await limit.getAttribute("aria-valuetext"), "0.01");
    const grip = await limit.boundingBox();
    await page.mouse.move(grip.x + 40, grip.y + grip.height / 2);
    await page.mouse.down();
    await page.mouse.move(grip.x + 40, grip.y + grip.height / 2 - 30, { steps: 5 });
    await page.mouse.up();
    const error = await page.evaluate(() => window.patches.at(-1).patch.quality.maxError);
    assert.ok(error > 0.012, `${error}`);
    await limit.focus();
    await page.keyboard.press("ArrowDown");
    const less = await page.evaluate(() => window.patches.at(-1).patch.quality.maxError);
    assert.ok(Math.abs(less - error / 1.1) < 0.01 * error, `${error} -> ${less}`);
    await type(page, "max error \\(linear RMSE\\)", 5e-6);
    const shown = await control(
      page,
      "max error \\(linear RMSE\\)",
      'input:not([type="range"])',
    ).inputValue();
    assert.equal(shown, "5e-6", "readable in a narrow box");
  }));

test("a server without a forecast shows the reason", () =>
  withPage(
    async (page) => {
      await unfold(page, "Quality");
      await page.locator(".forecast").scrollIntoViewIfNeeded();
      await page.getByText("no forecast for this view").waitFor();
    },
    {
      status: 422,
      faulty: true,
      json: { title: "No", status: 422, detail: "no forecast for this view" },
    },
  ));
