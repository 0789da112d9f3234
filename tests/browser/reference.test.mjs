// The reference in a real browser: rendered on request, shown while held, discarded when the view
// changes.
import assert from "node:assert/strict";
import { test } from "node:test";
import { drag, finalPicture, patience, pixels, sharedDaemon, shot } from "./support.mjs";

// A small picture, because the cost of references is proportional to the pixels.
const { withPage } = sharedDaemon({
  args: ["climate"],
  page: { viewport: { width: 420, height: 480 } },
});

const words = (page) => page.locator("#reference").textContent();
const mark = (page) => page.locator(".mark:visible").textContent();

const ready = (page) =>
  page.waitForFunction(
    () => /ready: hold r · error \S+ true/.test(document.querySelector("#reference").textContent),
    null,
    { timeout: 60_000 * patience },
  );

// Mean and largest difference between the pixel values of picture and reference, the fraction of
// differing pixels, and the offset between their boxes on the page.
const apart = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector("#picture");
    const image = document.querySelector("#reference-picture");
    const { width, height } = canvas;
    const copy = new OffscreenCanvas(width, height).getContext("2d");
    copy.drawImage(image, 0, 0, width, height);
    const truth = copy.getImageData(0, 0, width, height).data;
    const own = canvas.getContext("2d").getImageData(0, 0, width, height).data;
    let sum = 0;
    let differ = 0;
    for (let n = 0; n < own.length; n++) {
      sum += Math.abs(own[n] - truth[n]);
      if (own[n] !== truth[n]) differ += 1;
    }
    const a = canvas.getBoundingClientRect();
    const b = image.getBoundingClientRect();
    return {
      size: [image.naturalWidth - width, image.naturalHeight - height],
      mean: sum / own.length,
      differ: differ / own.length,
      boxes: ["x", "y", "width", "height"].map((key) => a[key] - b[key]),
    };
  });

// A screenshot of the picture without the areas covered by other elements.
async function seen(page) {
  const box = await page.locator("#picture").boundingBox();
  const clip = { x: box.x + 100, y: box.y + 120, width: 220, height: 100 };
  return (await page.screenshot({ clip })).toString("base64");
}

test("r requests the reference and shows it while held", () =>
  withPage(async (page) => {
    const before = await pixels(page);
    const seenBefore = await seen(page);
    const asked = page.waitForResponse((answer) => answer.request().method() === "POST");
    await page.keyboard.down("r");
    await page.keyboard.up("r");
    assert.equal((await asked).status(), 202);
    const view = JSON.parse((await asked).request().postData());
    assert.deepEqual([view.image.width, view.image.height], [before.width, before.height]);
    await page.waitForFunction(() =>
      /^\s*reference \d+×\d+: \d+ %, \d+ s left\s*$/.test(
        document.querySelector("#reference").textContent,
      ),
    );
    assert.equal(await page.locator("#reference-picture").isVisible(), false);
    await ready(page);
    assert.equal(await seen(page), seenBefore, "the reference is not shown until held");
    await page.keyboard.down("r");
    await page.keyboard.down("r"); // key repeat
    assert.equal(await page.locator("#reference-picture").isVisible(), true);
    assert.equal(await mark(page), "reference");
    const { size, mean, differ, boxes } = await apart(page);
    assert.deepEqual(size, [0, 0]);
    assert.ok(mean > 0.01 && mean < 2, `${mean} codes apart on average`);
    assert.ok(differ > 0.01, `${differ} of the values differ`);
    assert.deepEqual(boxes, [0, 0, 0, 0], "both pictures coincide");
    assert.notEqual(await seen(page), seenBefore, "the reference is visible");
    await shot(page, "reference");
    await page.keyboard.up("r");
    assert.equal(await page.locator("#reference-picture").isVisible(), false);
    assert.equal(await mark(page), "final");
    assert.equal(await seen(page), seenBefore, "the same pixels as before");
    assert.equal((await pixels(page)).hash, before.hash);
  }));

test("the shown error is the true error of the picture", () =>
  withPage(async (page) => {
    await page.keyboard.press("r");
    await ready(page);
    const told = Number(/error (\S+) true/.exec(await words(page))[1]);
    const { view, truth } = await page.evaluate(async () => {
      const { src } = document.querySelector("#reference-picture");
      const { jobs } = await (await fetch("v1/jobs")).json();
      const job = jobs.find(({ result }) => result !== null && src.endsWith(result.picture));
      return { view: job.kind, truth: job.result.error };
    });
    assert.equal(view, "reference");
    assert.ok(Math.abs(told - truth.value) <= 0.05 * truth.value, `${told} of ${truth.value}`);
    // An error in display values is at most about 13 times the linear error; the JPEG error adds to
    // it.
    const { mean } = await apart(page);
    assert.ok(mean / 255 < 13 * truth.value + 0.01, `${mean} for ${truth.value}`);
  }));

test("a view change discards the reference and its job", () =>
  withPage(async (page) => {
    await page.keyboard.press("r");
    await ready(page);
    await drag(page, 30, 0, 4);
    await finalPicture(page);
    assert.equal(await page.locator("#reference").isVisible(), false);
    const cancelled = page.waitForResponse((answer) => answer.request().method() === "DELETE");
    await page.keyboard.down("r");
    assert.equal(
      await page.locator("#reference-picture").isVisible(),
      false,
      "the old reference is not shown",
    );
    await page.waitForFunction(() =>
      /: \d+ %/.test(document.querySelector("#reference").textContent),
    );
    await page.keyboard.up("r");
    await page.locator("#picture").focus();
    await page.keyboard.press("ArrowLeft");
    assert.equal((await cancelled).status(), 204);
    await finalPicture(page);
    assert.equal(await page.locator("#reference").isVisible(), false);
    // Escape discards the reference too, and the next press starts again.
    await page.keyboard.press("r");
    await page.waitForFunction(() =>
      /: \d+ %/.test(document.querySelector("#reference").textContent),
    );
    const again = page.waitForResponse((answer) => answer.request().method() === "DELETE");
    await page.keyboard.press("Escape");
    assert.equal((await again).status(), 204);
    assert.equal(await page.locator("#reference").isVisible(), false);
    await page.keyboard.press("r");
    await ready(page);
  }));

test("the button can be held by mouse, finger or space", () =>
  withPage(
    async (page) => {
      const button = page.getByRole("button", { name: "Reference: hold to show it" });
      const isShown = () => page.locator("#reference-picture").isVisible();
      await button.tap();
      await ready(page);
      assert.equal(await isShown(), false);
      const { x, y, width, height } = await button.boundingBox();
      assert.ok(width >= 36 && height >= 36, `as large as its neighbours: ${width} x ${height}`);
      await page.mouse.move(x + width / 2, y + height / 2);
      await page.mouse.down();
      assert.equal(await isShown(), true);
      await page.mouse.move(10, 200);
      await page.mouse.up();
      assert.equal(await isShown(), false, "released outside the button");
      await button.focus();
      await page.keyboard.down("Space");
      assert.equal(await isShown(), true);
      await page.keyboard.up("Space");
      assert.equal(await isShown(), false);
      await shot(page, "reference-390");
    },
    { viewport: { width: 390, height: 500 }, hasTouch: true, isMobile: true, colorScheme: "light" },
  ));
