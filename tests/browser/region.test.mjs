// Handles of the region over the picture.
import assert from "node:assert/strict";
import { test } from "node:test";
import { control, finalPicture, sharedDaemon, shot, state, type } from "./support.mjs";

const { withPage } = sharedDaemon();

const climate = `#!${encodeURIComponent('{"dataset":"climate"}')}`;
const unfolded = ["Data", "Region"];

test("handles on the picture crop the region, by pointer and by keys", async () => {
  await withPage(
    async (page) => {
      const region = () =>
        page.evaluate(
          () => JSON.parse(decodeURIComponent(location.hash.slice(2)) || "{}").region ?? {},
        );
      const until = (check, what) =>
        page.waitForFunction(check, undefined, { polling: 50 }).catch(() => assert.fail(what));
      const handle = page.locator('.region-handle[aria-label="Region: last lon"]');
      const before = Number(await handle.getAttribute("aria-valuenow"));
      const { x, y, width, height } = await handle.locator(".region-knob").boundingBox();
      const [left, top] = [x + width / 2, y + height / 2];
      await page.mouse.move(left, top);
      await page.mouse.down();
      for (const way of [40, 80, 120]) await page.mouse.move(left - way, top);
      await page.mouse.up();
      await finalPicture(page);
      const after = Number(await handle.getAttribute("aria-valuenow"));
      assert.ok(after < before, `${after} is before ${before}`);
      const moved = await handle.locator(".region-knob").boundingBox();
      const travelled = left - moved.x - moved.width / 2;
      assert.ok(Math.abs(travelled - 120) < 8, `the handle is under the pointer: ${travelled}`);
      await until(
        () => /region/.test(decodeURIComponent(location.hash)),
        "the link has the region",
      );
      const [west, east] = (await region()).x;
      assert.ok(west < east && east < 170, `${west} to ${east}`);
      await handle.press("ArrowLeft");
      assert.equal(Number(await handle.getAttribute("aria-valuenow")), after - 1);
      await page.locator("#undo-button").click();
      await page.locator("#undo-button").click();
      await finalPicture(page);
      assert.equal(
        Number(await handle.getAttribute("aria-valuenow")),
        before,
        "one drag, one undo",
      );
      await page.locator("#panel .lil-title", { hasText: /^Region$/ }).click();
      assert.equal(await page.locator("#region-box").isVisible(), false);
    },
    { unfolded, path: climate },
  );
});

test("pictures that do not move the handles leave them alone", async () => {
  await withPage(
    async (page) => {
      await page.evaluate(() => {
        window.changes = 0;
        const count = (all) => (window.changes += all.length);
        const what = { subtree: true, childList: true, attributes: true };
        new MutationObserver(count).observe(document.querySelector("#region-box"), what);
      });
      const { rev } = await state(page);
      await page.keyboard.press("]");
      await finalPicture(page);
      assert.notEqual((await state(page)).rev, rev, "another step is drawn");
      assert.equal(await page.evaluate(() => window.changes), 0);
      await page.locator("#picture").press("ArrowRight");
      await finalPicture(page);
      assert.ok((await page.evaluate(() => window.changes)) > 0, "they follow the camera");
      await shot(page, "region-handles");
    },
    { unfolded, path: climate },
  );
});

test("undo of a region tells the whole range at once, before the next picture", async () => {
  await withPage(
    async (page) => {
      const box = control(page, "lon to \\(°E\\)", "input");
      const whole = await box.inputValue();
      await type(page, "lon to \\(°E\\)", 60);
      await finalPicture(page);
      assert.equal(Number(await box.inputValue()), 60);
      await page.locator("#picture").press("Shift"); // ends the typing
      // In one turn of the page, in which no picture arrives.
      const after = await box.evaluate((input) => {
        document.querySelector("#undo-button").click();
        return input.value;
      });
      assert.equal(after, whole);
      await finalPicture(page);
      assert.equal(await box.inputValue(), whole);
    },
    { unfolded, path: climate },
  );
});
