// Pictures of the methods, slices, mappings, colours and line motion, as chosen in the panel: each
// choice changes the picture, and reverting it restores the previous one.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  choose,
  control,
  finalPicture,
  pixels,
  sharedDaemon,
  shot,
  type,
  unfold,
  watchPatches,
} from "./support.mjs";

const { withPage } = sharedDaemon({ page: { initScript: watchPatches } });

// The final picture after a change, saved as a screenshot called `name`.
async function picture(page, name) {
  await finalPicture(page);
  await shot(page, `picture-${name}`);
  return pixels(page);
}

const head = (page) => page.locator("#hud-head").textContent();

test("slabs change the picture, as does their thickness, and the HUD names them", () =>
  withPage(async (page) => {
    await unfold(page, "Method");
    await choose(page, "method", /^kernel$/);
    const kernel = await picture(page, "kernel");
    await choose(page, "method", /^slab$/);
    const slab = await picture(page, "slab");
    assert.notEqual(slab.hash, kernel.hash);
    assert.ok(
      Math.abs(slab.mean - kernel.mean) < 0.3 * kernel.mean,
      "the mean brightness is similar",
    );
    assert.match(await head(page), /slab of 1 cells analytic/);
    await type(page, "slab thickness", 4);
    assert.notEqual((await picture(page, "slab-4")).hash, slab.hash);
    assert.match(await head(page), /slab of 4 cells/);
    await choose(page, "method", /^kernel$/);
    assert.equal((await picture(page, "kernel-again")).hash, kernel.hash);
  }));

test("every compositing method changes the picture", () =>
  withPage(async (page) => {
    await unfold(page, "Method");
    const hashes = new Set([(await pixels(page)).hash]);
    for (const [option, word] of [
      [/^cd \(/, "cd"],
      [/^simple/, "simple"],
      [/^cd-naive/, "cd-naive"],
      [/^cd-euler/, "cd-euler"],
    ]) {
      await choose(page, "compositing", option);
      hashes.add((await picture(page, `compositing-${word}`)).hash);
      assert.match(await head(page), new RegExp(`slab of 1 cells ${word}( |$)`));
    }
    assert.equal(hashes.size, 5);
  }));

test("a slice faces the viewer, and another layer is another picture", () =>
  withPage(async (page) => {
    const whole = await pixels(page);
    await unfold(page, "Section");
    for (const axis of ["x", "y", "z"]) {
      await choose(page, "slice", new RegExp(`^across ${axis}`));
      const middle = await picture(page, `slice-${axis}`);
      assert.notEqual(middle.hash, whole.hash);
      // Seen along its normal, a slice fills the width; across x or y it is a strip of the box.
      const most = axis === "z" ? 1 : 0.5;
      assert.ok(middle.covered > 0.03 && middle.covered < most, `${axis}: ${middle.covered}`);
      await page.locator("#panel .panel-note", { hasText: /^Layer \d+ of 0 to \d+/ }).waitFor();
      await type(page, "layer", 3);
      assert.notEqual((await picture(page, `slice-${axis}-3`)).hash, middle.hash);
    }
    await choose(page, "slice", /^off/);
    assert.equal((await picture(page, "slice-off")).hash, whole.hash);
  }));

test("a globe is about as high as wide", () =>
  withPage(async (page) => {
    await unfold(page, "Place");
    await choose(page, "shape", /^sphere/);
    const globe = await picture(page, "globe");
    const box = await page.evaluate(() => {
      const canvas = document.querySelector("#picture");
      const { width, height } = canvas;
      const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
      const seen = { left: width, right: 0, top: height, bottom: 0 };
      for (let n = 0; n < width * height; n++) {
        if (data[4 * n] + data[4 * n + 1] + data[4 * n + 2] < 60) continue;
        const [x, y] = [n % width, Math.floor(n / width)];
        seen.left = Math.min(seen.left, x);
        seen.right = Math.max(seen.right, x);
        seen.top = Math.min(seen.top, y);
        seen.bottom = Math.max(seen.bottom, y);
      }
      return { width: seen.right - seen.left, height: seen.bottom - seen.top };
    });
    assert.ok(globe.covered > 0.02);
    const ratio = box.width / box.height;
    assert.ok(ratio > 0.6 && ratio < 1.7, `${box.width} x ${box.height}`);
  }));

test("line colours show direction and scalars", () =>
  withPage(async (page) => {
    await choose(page, "colour by", /^direction$/);
    const direction = await picture(page, "direction");
    const ticks = page.locator(".legend-lines .legend-tick");
    assert.equal((await ticks.allTextContents()).join(""), "NESWN");
    await choose(page, "colour by", /^a scalar field$/);
    const scalar = await picture(page, "scalar");
    assert.notEqual(scalar.hash, direction.hash);
    const named = await page.locator(".legend-lines .legend-name").textContent();
    assert.match(named, /: /);
    await choose(page, "colour by", /^constant/);
    assert.notEqual((await picture(page, "one-color")).hash, scalar.hash);
  }));

test("the texture follows its phase, moves during motion and stops with it", () =>
  withPage(async (page) => {
    const still = await pixels(page);
    await unfold(page, "Time");
    await choose(page, "texture", /^moves/);
    const begun = await picture(page, "phase-0");
    await type(page, "time \\(steps\\)", 0.4);
    assert.notEqual((await picture(page, "phase-0.4")).hash, begun.hash);
    const flow = control(page, "animate lines", "input");
    await flow.check();
    const hashes = new Set();
    for (let n = 0; n < 6; n++) {
      await page.waitForTimeout(150);
      hashes.add((await pixels(page)).hash);
    }
    assert.ok(hashes.size >= 3, `${hashes.size} different pictures`);
    await flow.uncheck();
    await choose(page, "texture", /^still$/);
    assert.equal((await picture(page, "still")).hash, still.hash);
  }));
