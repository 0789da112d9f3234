// Errors reported by the daemon: every frame has one, a requested limit is met, and a lossless
// final frame equals the daemon's picture pixel by pixel.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  control,
  drag,
  finalPicture,
  framesOf,
  movingOf,
  sharedDaemon,
  type,
  watchFrames,
} from "./support.mjs";

// The built-in samples, whose errors depend on the size of the picture.
const { withPage } = sharedDaemon({
  args: [],
  page: { initScript: watchFrames, unfolded: ["Quality"] },
});

const lastFrame = (page) => page.evaluate(() => window.frameHeaders.at(-1));

test("moving frames show an estimated error, final frames a measured one", () =>
  withPage(async (page) => {
    const frames = await framesOf(page, () => drag(page, 90, 20, 30));
    const final = frames.at(-1);
    assert.ok(final.final && final.measured && final.error >= 0, JSON.stringify(final));
    const moving = frames.filter(({ rev, measured }) => rev < final.rev && !measured);
    assert.ok(moving.length > 0);
    for (const { estimated, error, chosen } of moving) {
      assert.ok(estimated && error > 0, `${error}`);
      assert.equal(chosen.error.kind, "estimated");
      assert.ok(
        Math.abs(chosen.error.value / error - 1) < 1e-5,
        "`chosen` contains the same error",
      );
    }
    assert.match(await page.locator("#hud-error").textContent(), /^error [\d.e-]+ measured$/);
    assert.match(await page.locator("#hud-encoding").textContent(), /^ · JPEG [\d.e-]+$/);
  }));

test("a requested error is met without more pixels than needed", () =>
  withPage(async (page) => {
    await type(page, "moving budget \\(ms\\)", 500);
    const moving = async () => movingOf(await framesOf(page, () => drag(page, 90, 20, 60)));
    const best = (await moving()).at(-1);
    await control(page, "limit the error", "input").check();
    for (const limit of [0.2, Math.max(0.001, 2 * best.error)]) {
      await type(page, "max error \\(linear RMSE\\)", limit);
      const frames = await moving();
      // The first frames may have been started for the previous limit.
      const last = frames.at(-1);
      assert.ok(last.error <= limit, `${last.error} exceeds the limit ${limit}`);
      const { maxError } = last.chosen.view.quality; // of the control, in its steps
      assert.ok(Math.abs(maxError - limit) < 0.01 * limit, `${maxError} is not ${limit}`);
      if (limit === 0.2) {
        assert.ok(
          last.width < best.width,
          `${last.width} px would do with fewer than ${best.width}`,
        );
        assert.ok(last.error > best.error);
      }
    }
  }));

test("a lossless final frame equals the pixels of the daemon, a JPEG does not", () =>
  withPage(async (page) => {
    // Counts the pixels that differ from a separately requested PNG of the same view.
    const differing = () =>
      page.evaluate(async () => {
        const { view } = window.frameHeaders.at(-1).chosen;
        const answer = await fetch(new URL("v1/frames", document.baseURI), {
          method: "POST",
          headers: { "Content-Type": "application/json", Accept: "image/png" },
          body: JSON.stringify(view),
        });
        const bitmap = await createImageBitmap(await answer.blob());
        const { width, height } = bitmap;
        const context = new OffscreenCanvas(width, height).getContext("2d");
        context.drawImage(bitmap, 0, 0);
        const words = (ctx) => new Uint32Array(ctx.getImageData(0, 0, width, height).data.buffer);
        const shown = words(document.querySelector("#picture").getContext("2d"));
        return words(context).reduce((sum, word, n) => sum + (word === shown[n] ? 0 : 1), 0);
      });
    assert.equal((await lastFrame(page)).codec, "jpeg");
    assert.ok((await differing()) > 1000);
    await control(page, "lossless final", "input").check();
    await finalPicture(page);
    const { codec, final, width } = await lastFrame(page);
    const full = await page.evaluate(() => document.querySelector("#picture").width);
    assert.deepEqual([codec, final, width], ["png", true, full]);
    assert.equal(await page.locator("#hud-encoding").textContent(), " · PNG lossless");
    assert.equal(await differing(), 0);
    await drag(page, 60, 0);
    await finalPicture(page);
    assert.equal((await lastFrame(page)).codec, "png", "the next final frame is lossless too");
  }));

test("the message of a refused view has the labels of the controls, not JSON pointers", () =>
  withPage(
    async (page) => {
      const view = { dataset: "tornado", vector: { stride: 100 }, annotations: { title: 3 } };
      const hash = `#!${encodeURIComponent(JSON.stringify(view))}`;
      await page.evaluate((address) => (location.hash = address), hash);
      const alert = page.locator("#alert-text");
      await alert.filter({ hasText: "stride" }).waitFor();
      const text = await alert.textContent();
      assert.match(
        text,
        /(Winds|Flow), sampling stride: must be a whole number from 1 to 64, not 100/,
      );
      assert.match(text, /Axes and labels, title: must be true or false/);
      assert.doesNotMatch(text, /\/\w/);
    },
    { alert: true },
  ));
