// Annotations that the server draws into the picture, switched by the panel.
import assert from "node:assert/strict";
import { test } from "node:test";
import { control, finalPicture, pixels, sharedDaemon, shot, unfold } from "./support.mjs";

const { withPage } = sharedDaemon();

const labels = [
  "box",
  "axes",
  "north arrow",
  "scale bar",
  "legend in the picture",
  "title",
  "time",
];

test("each annotation changes the picture, and the server's legend replaces the page's", () =>
  withPage(async (page) => {
    await unfold(page, "Axes and labels");
    await finalPicture(page);
    assert.equal(await page.locator(".legend-entry").first().isVisible(), true);
    const plain = (await pixels(page)).hash;
    let before = plain;
    for (const label of labels) {
      await control(page, label, "input").check();
      await finalPicture(page);
      const { hash } = await pixels(page);
      assert.notEqual(hash, before, label);
      before = hash;
    }
    assert.equal(await page.locator(".legend-entry").count(), 0);
    await shot(page, "annotations");
    for (const label of labels) await control(page, label, "input").uncheck();
    await finalPicture(page);
    assert.equal((await pixels(page)).hash, plain, "nothing else has changed");
    assert.equal(await page.locator(".legend-entry").first().isVisible(), true);
  }));
