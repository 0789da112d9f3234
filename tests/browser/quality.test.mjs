// The Quality panel in a real browser: the daemon's frames, by their headers and `chosen` messages,
// comply with the requested quality.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  control,
  drag,
  finalPicture,
  framesOf,
  movingOf,
  sharedDaemon,
  shot,
  type,
  watchFrames,
  watchPatches,
} from "./support.mjs";

const { withPage } = sharedDaemon({
  args: [], // the built-in samples, which take longer than small budgets
  page: { initScript: [watchFrames, watchPatches], unfolded: ["Quality"] },
});

const budget = "moving budget \\(ms\\)";
const limited = "limit the error";
const limit = "max error \\(linear RMSE\\)";

const widthOf = (page) => page.evaluate(() => document.querySelector("#picture").width);
const qualities = (page) =>
  page.evaluate(() =>
    window.patches.flatMap(({ patch }) => (patch.quality === undefined ? [] : [patch.quality])),
  );
const linkedQuality = (page) =>
  page.evaluate(() => JSON.parse(decodeURIComponent(location.hash.slice(2)) || "{}").quality);

test("a small budget reduces moving frames, a large one keeps their full size", () =>
  withPage(async (page) => {
    const full = await widthOf(page);
    const widths = {};
    const finals = []; // ms
    for (const ms of [500, 5]) {
      await type(page, budget, ms);
      const frames = await framesOf(page, () => drag(page, 120, 30, 60));
      const moving = movingOf(frames);
      assert.ok(moving.length >= 1, "moving frames were received");
      widths[ms] = moving.at(-1).width;
      const last = frames.at(-1);
      finals.push(last.renderUs / 1000);
      assert.deepEqual([last.final, last.width], [true, full], "the final frame has full size");
      assert.equal(last.chosen.view.quality.budgetMs, ms, "the frame was drawn for this budget");
    }
    // On a busy machine the large budget may not suffice for full-size frames.
    assert.ok(Math.min(...finals) > 0);
    if (Math.max(...finals) < 200) assert.equal(widths[500], full);
    assert.ok(widths[5] < widths[500], `${widths[5]} px, ${widths[500]} px of ${full}`);
  }));

test("an error limit is set by a switch and its magnitude", () =>
  withPage(async (page) => {
    assert.equal(await control(page, limit, "input").isVisible(), false, "no limit by default");
    await control(page, limited, "input").check();
    assert.deepEqual(await qualities(page), [{ maxError: 0.01 }]);
    const slider = page.getByRole("slider", { name: "max error (linear RMSE)" });
    const box = page.getByRole("textbox", { name: "max error (linear RMSE)" });
    assert.equal(await slider.getAttribute("aria-valuetext"), "0.01");
    for (let n = 0; n < 20; n++) await slider.press("ArrowLeft");
    assert.deepEqual(
      (await qualities(page)).at(-1),
      { maxError: 0.001 },
      "20 presses are a decade",
    );
    assert.equal(await box.inputValue(), "0.001");
    await box.fill("0.0234");
    await box.press("Enter");
    assert.deepEqual((await qualities(page)).at(-1), { maxError: 0.0234 });
    assert.ok(Math.abs(Number(await slider.inputValue()) - Math.log10(0.0234)) < 0.05);
    await shot(page, "quality");
    await page.waitForFunction(() => location.hash.includes("0.0234"));
    await control(page, limited, "input").uncheck();
    assert.deepEqual((await qualities(page)).at(-1), { maxError: null });
    assert.equal(await box.isVisible(), false);
    await finalPicture(page);
    assert.equal(await control(page, limited, "input").isChecked(), false);
    await control(page, limited, "input").check();
    assert.deepEqual(
      (await qualities(page)).at(-1),
      { maxError: 0.0234 },
      "the last limit is restored",
    );
  }));

test("a link contains budget, error and lossless, and `All defaults` removes them", () =>
  withPage(
    async (page) => {
      assert.equal(await control(page, budget, "input").inputValue(), "66");
      assert.equal(await control(page, limited, "input").isChecked(), true);
      const box = page.getByRole("textbox", { name: "max error (linear RMSE)" });
      assert.equal(await box.inputValue(), "0.002");
      assert.equal(await control(page, "lossless final", "input").isChecked(), true);
      const drawn = await page.evaluate(() => window.frameHeaders.at(-1).chosen.view.quality);
      assert.deepEqual(drawn, { budgetMs: 66, maxError: 0.002, lossless: true });
      await control(page, "lossless final", "input").uncheck();
      await page.waitForFunction(() => /%22lossless%22:false/.test(location.hash));
      assert.deepEqual(await linkedQuality(page), {
        budgetMs: 66,
        maxError: 0.002,
        lossless: false,
      });
      await page.locator("#panel").getByRole("button", { name: "All defaults" }).click();
      await finalPicture(page);
      assert.equal(await control(page, limited, "input").isChecked(), false);
      assert.equal(await control(page, budget, "input").inputValue(), "33");
      await page.waitForFunction(() => !location.hash.includes("quality"));
    },
    { path: '#!{"quality":{"budgetMs":66,"maxError":0.002,"lossless":true}}' },
  ));
