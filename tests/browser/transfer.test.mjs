// The opacity curve editor and the colour range in a real browser: operation by mouse, keys and
// numbers, and the effect on pixels, frames and legend.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  control,
  finalPicture,
  framesOf,
  pixels,
  sharedDaemon,
  shot,
  watchFrames,
  watchPatches,
} from "./support.mjs";

const shared = sharedDaemon({ page: { initScript: [watchFrames, watchPatches] } });

// A page without lines, so that only the medium affects the pixels.
const mediaOnly = '#!{"dataset":"tornado","vector":{"field":null}}';

const withPage = (run, options) =>
  shared.withPage(
    async (page) => {
      await page.locator(".transfer-point").first().scrollIntoViewIfNeeded();
      await page.locator(".histogram-caption", { hasText: / to / }).first().waitFor();
      await run(page);
    },
    { path: mediaOnly, ...options },
  );

const drawnCurve = (page) =>
  page.evaluate(() => window.frameHeaders.at(-1).chosen.view.scalars[0].extinction);
const drawnRange = (page) =>
  page.evaluate(() => window.frameHeaders.at(-1).chosen.view.scalars[0].color.range);
const points = (page) => page.locator(".transfer-point");
const center = async (locator) => {
  const { x, y, width, height } = await locator.boundingBox();
  return [x + width / 2, y + height / 2];
};

async function dragPoint(page, index, dx, dy) {
  const [x, y] = await center(points(page).nth(index));
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let n = 1; n <= 10; n++) await page.mouse.move(x + (dx * n) / 10, y + (dy * n) / 10);
  await page.mouse.up();
  await finalPicture(page);
}

const table = (page) =>
  page
    .locator(".transfer-table tbody tr")
    .evaluateAll((rows) =>
      rows.map((row) => [...row.querySelectorAll("input")].map((input) => Number(input.value))),
    );

test("dragging a point up increases opacity, down decreases it", () =>
  withPage(async (page) => {
    const before = await pixels(page);
    const curve = await drawnCurve(page);
    assert.deepEqual(curve, [
      [0, 0],
      [0.12, 0],
      [1, 6],
    ]);
    await dragPoint(page, 1, 0, -60);
    const [, raised] = await drawnCurve(page);
    assert.ok(raised[1] > 3 && raised[1] < 6 && Math.abs(raised[0] - 0.12) < 0.02, `${raised}`);
    const opaque = await pixels(page);
    assert.ok(opaque.mean > before.mean * 1.03, `${before.mean} -> ${opaque.mean}`);
    const note = await page.locator(".legend-medium .legend-note").textContent();
    assert.match(note, /^curve: opacity/);
    await dragPoint(page, 1, 0, 200);
    await dragPoint(page, 2, 0, 70);
    const thin = await pixels(page);
    assert.ok(thin.mean < before.mean * 0.9, `${before.mean} -> ${thin.mean}`);
    assert.equal((await drawnCurve(page))[1][1], 0, "the lower edge is transparent");
  }));

test("dragging a point sends at most one patch per display frame", () =>
  withPage(async (page) => {
    const [x, y] = await center(points(page).nth(1));
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.evaluate(() => {
      window.patches.length = 0;
      window.displayFrames = 0;
      const count = () => {
        window.displayFrames += 1;
        requestAnimationFrame(count);
      };
      requestAnimationFrame(count);
      const surface = document.querySelector(".transfer-points");
      const box = surface.getBoundingClientRect();
      for (let n = 0; n < 200; n++) {
        const at = { clientX: box.left + 60 + n / 4, clientY: box.top + 40, pointerId: 1 };
        surface.dispatchEvent(new PointerEvent("pointermove", at));
      }
    });
    await page.waitForFunction(() => window.patches.length > 0);
    const [sent, frames] = await page.evaluate(() => [window.patches.length, window.displayFrames]);
    assert.ok(sent <= frames + 1, `${sent} patches in ${frames} frames for 200 moves`);
    await page.mouse.up();
    await finalPicture(page);
  }));

test("a press on an empty position adds a point, double click or Delete removes it", () =>
  withPage(async (page) => {
    const box = await page.locator(".transfer-points").boundingBox();
    await page.mouse.click(box.x + 0.5 * box.width, box.y + 0.3 * box.height);
    await finalPicture(page);
    const added = await drawnCurve(page);
    assert.equal(added.length, 4);
    assert.ok(Math.abs(added[2][0] - 0.5) < 0.01 && Math.abs(added[2][1] - 0.7 * 7.5) < 0.15);
    assert.equal(
      await control(page, "transparent below", "input").isDisabled(),
      true,
      "the curve is not a ramp",
    );
    await page.mouse.dblclick(...(await center(points(page).nth(2))), { delay: 20 });
    await finalPicture(page);
    assert.equal((await drawnCurve(page)).length, 3);
    assert.equal(await control(page, "transparent below", "input").isDisabled(), false);
    await page.mouse.dblclick(box.x + 0.6 * box.width, box.y + 0.5 * box.height);
    await finalPicture(page);
    assert.equal(
      (await drawnCurve(page)).length,
      4,
      "a double click on an empty position adds one point",
    );
    await points(page).nth(2).focus();
    await page.keyboard.press("Delete");
    await finalPicture(page);
    assert.equal((await drawnCurve(page)).length, 3);
    for (let n = 0; n < 4; n++) {
      await points(page).first().focus();
      await page.keyboard.press("Delete");
    }
    await finalPicture(page);
    assert.equal((await drawnCurve(page)).length, 1, "the last point remains");
  }));

test("arrow keys move the focused point, finer with shift, and not the volume", () =>
  withPage(async (page) => {
    const azimuth = await page.locator("#picture").getAttribute("data-azimuth");
    await points(page).nth(1).focus();
    for (let n = 0; n < 5; n++) await page.keyboard.press("ArrowRight");
    await page.keyboard.press("Shift+ArrowRight");
    for (let n = 0; n < 3; n++) await page.keyboard.press("ArrowUp");
    await finalPicture(page);
    const [, moved] = await drawnCurve(page);
    assert.ok(Math.abs(moved[0] - 0.171) < 1e-6, `${moved}`);
    assert.ok(Math.abs(moved[1] - 0.06 * 7.5) < 0.01, `${moved}`);
    const label = await points(page).nth(1).getAttribute("aria-label");
    const percent = -100 * Math.expm1(-0.02 * moved[1]);
    assert.match(label, /^point 2: 0.171 → [\d.]+ % opaque in 1 % of the box$/);
    assert.ok(Math.abs(Number(label.match(/→ ([\d.]+)/)[1]) - percent) < 0.06 * percent, label);
    assert.equal(await page.locator("#picture").getAttribute("data-azimuth"), azimuth);
  }));

test("the table and the plot show the same curve", () =>
  withPage(async (page) => {
    await page.getByText("Points as numbers").click();
    assert.deepEqual(await table(page), await drawnCurve(page));
    const fill = async (name, value) => {
      await page.getByLabel(name, { exact: true }).fill(String(value));
      await page.getByLabel(name, { exact: true }).press("Enter");
    };
    await page.getByRole("button", { name: "Add a point" }).click();
    await fill("value of point 3", 0.25);
    await fill("extinction of point 3", 5);
    await finalPicture(page);
    assert.deepEqual((await drawnCurve(page))[2], [0.25, 5]);
    assert.deepEqual(await table(page), await drawnCurve(page));
    await fill("value of point 3", 7);
    assert.equal((await table(page))[2][0], 1, "clamped to its neighbour");
    await page.getByLabel("remove point 2", { exact: true }).click();
    await finalPicture(page);
    assert.deepEqual(await table(page), await drawnCurve(page));
    assert.equal((await table(page)).length, 3);
    const focused = () => page.evaluate(() => document.activeElement.ariaLabel);
    assert.equal(await focused(), "remove point 2", "the focus moves to the next row");
    const box = page.getByLabel("extinction of point 2", { exact: true });
    await box.focus();
    for (let n = 0; n < 2; n++) await page.keyboard.press("ArrowUp");
    await finalPicture(page);
    assert.equal(await focused(), "extinction of point 2", "the focus is preserved");
    assert.deepEqual((await drawnCurve(page))[1], [1, 7]);
    await box.fill("-3");
    await box.press("Enter");
    assert.equal(await box.inputValue(), "0", "the focused box shows the clamped value");
    await shot(page, "transfer-table");
  }));

test("density scales every curve, and a logarithmic scale magnifies small values", () =>
  withPage(async (page) => {
    await dragPoint(page, 1, 30, -20);
    const before = await drawnCurve(page);
    await control(page, "density", "input").fill("12");
    await control(page, "density", "input").press("Enter");
    await finalPicture(page);
    const after = await drawnCurve(page);
    after.forEach(([value, extinction], n) => {
      assert.equal(value, before[n][0]);
      assert.ok(Math.abs(extinction - 2 * before[n][1]) < 1e-9);
    });
    const [, low] = await center(points(page).nth(1));
    const patches = await page.evaluate(() => window.patches.length);
    await page.getByLabel("log opacity").check();
    const [, high] = await center(points(page).nth(1));
    assert.ok(high < low - 15, `${low} -> ${high}`);
    assert.equal(
      await page.evaluate(() => window.patches.length),
      patches,
      "the scale is not part of the view",
    );
    await shot(page, "transfer-log");
  }));

test("the range follows the step, is fixed for all steps, and is custom after an edit", () =>
  withPage(
    async (page) => {
      const range = page.locator(".range-choice select").last();
      const ranges = new Map();
      for (const step of [0, 1]) {
        const url = `${shared.daemon.url}v1/datasets/tornado/fields/vorticity/range?step=${step}`;
        ranges.set(step, (await (await fetch(url)).json()).range);
      }
      assert.notDeepEqual(ranges.get(0), ranges.get(1));
      const close = (a, b) => a.every((end, n) => Math.abs(end - b[n]) <= 1e-5 * Math.abs(b[n]));
      const drawn = async (wanted) => {
        await page.waitForFunction(([low, high]) => {
          const { view } = window.frameHeaders.at(-1)?.chosen ?? {};
          const now = view?.scalars[0].color.range ?? [NaN, NaN];
          const near = (a, b) => Math.abs(a - b) <= 1e-5 * Math.abs(b);
          return near(now[0], low) && near(now[1], high);
        }, wanted);
        await finalPicture(page);
      };
      await range.selectOption("step");
      await drawn(ranges.get(0));
      const legend = await page.locator(".legend-medium .legend-ticks").innerHTML();
      await page.locator("#time-next").click();
      await drawn(ranges.get(1));
      assert.notEqual(await page.locator(".legend-medium .legend-ticks").innerHTML(), legend);
      const box = control(page, "colours to \\(s⁻¹\\)", "input");
      assert.ok(
        close([Number(await box.inputValue())], [ranges.get(1)[1]]),
        "the panel shows the restored range",
      );
      await page.locator("#undo-button").click();
      await drawn(ranges.get(0));
      assert.equal(await range.inputValue(), "step", "one undo entry per step");
      await page.locator("#redo-button").click();
      await drawn(ranges.get(1));
      assert.equal(await range.inputValue(), "step");
      await range.selectOption("all");
      const url = `${shared.daemon.url}v1/datasets/tornado/fields/vorticity/range?of=all`;
      const all = (await (await fetch(url)).json()).range;
      await drawn(all);
      await page.locator("#time-next").click();
      await finalPicture(page);
      assert.ok(close(await drawnRange(page), all));
      assert.equal(await range.inputValue(), "all");
      const before = await pixels(page);
      await box.fill(String(all[1] / 3));
      await box.press("Enter");
      await finalPicture(page);
      assert.equal(await range.inputValue(), "custom");
      assert.ok(close([(await drawnRange(page))[1]], [all[1] / 3]));
      assert.notEqual((await pixels(page)).hash, before.hash);
      await range.selectOption("step");
      const strip = await page.locator(".histogram-strip").last().boundingBox();
      await page.mouse.move(strip.x + 0.3 * strip.width, strip.y + 12);
      await page.mouse.down();
      await page.mouse.move(strip.x + 0.5 * strip.width, strip.y + 12, { steps: 4 });
      await page.mouse.up();
      await finalPicture(page);
      assert.equal(await range.inputValue(), "custom", "custom after a drag over the colours");
    },
    { path: '#!{"dataset":"tornado","vector":{"field":null},"scalars":[{"field":"vorticity"}]}' },
  ));

test("colour ranges of lines by magnitude can follow the step", () =>
  withPage(
    async (page) => {
      await page
        .locator("#panel .lil-gui", { hasText: /^Line colour/ })
        .last()
        .locator(".lil-title", { hasText: /^Histogram$/ })
        .click();
      const range = page.locator(".range-choice select").first();
      const frames = await framesOf(page, async () => {
        await range.selectOption("step");
        await page.waitForFunction(() => window.frameHeaders.length > 0);
      });
      const url = `${shared.daemon.url}v1/datasets/tornado/fields/wind/range?step=0`;
      const wanted = (await (await fetch(url)).json()).range;
      const drawn = frames.at(-1).chosen.view.vector.color.range;
      assert.ok(Math.abs(drawn[1] / wanted[1] - 1) < 1e-5, `${drawn} for ${wanted}`);
    },
    { path: '#!{"dataset":"tornado","vector":{"color":{"by":"magnitude"}}}' },
  ));

test("on a phone the editor fits and its points can be dragged", () =>
  withPage(
    async (page) => {
      const wide = await page.evaluate(() => {
        const panel = document.querySelector("#panel");
        return panel.scrollWidth - panel.clientWidth;
      });
      assert.ok(wide <= 0, `${wide} px too wide`);
      const { width } = await points(page).first().boundingBox();
      assert.ok(width >= 40, `${width}`);
      await shot(page, "transfer-360");
    },
    { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true },
  ));
