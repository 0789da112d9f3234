// The folders of the panel: their order, which of them a dataset has, headings, and what is kept.
import assert from "node:assert/strict";
import { test } from "node:test";
import { control, finalPicture, sharedDaemon, unfold } from "./support.mjs";

const { withPage } = sharedDaemon();

const top = "#panel .lil-root > .lil-children > .lil-gui > .panel-heading";

const titles = (page) => page.locator(`${top}:visible`).allTextContents();

const openDataset = async (page, id) => {
  await page.locator("#dataset").selectOption(id);
  await page.waitForFunction((one) => location.hash.includes(`%22${one}%22`), id);
  await finalPicture(page);
};

test("folders are ordered by task and named for the data", () =>
  withPage(async (page) => {
    const after = ["Surfaces", "Place", "Light", "Time", "Quality"];
    const before = await titles(page);
    assert.deepEqual(before.slice(-8), ["Data", "Winds", "Clouds and volumes", ...after]);
    await openDataset(page, "efield");
    assert.deepEqual((await titles(page)).slice(-8), ["Data", "Vectors", "Volumes", ...after]);
  }));

test("titles of folders are headings one level below those around them", () =>
  withPage(async (page) => {
    await unfold(page, "Camera in numbers");
    const levels = await page
      .getByRole("heading")
      .evaluateAll((all) =>
        Object.fromEntries(
          all.map((one) => [
            one.textContent,
            Number(one.getAttribute("aria-level") ?? one.tagName.slice(1)),
          ]),
        ),
      );
    const { windsplat, Place, Camera } = levels;
    assert.deepEqual([windsplat, Place, Camera, levels["Camera in numbers"]], [1, 2, 3, 4]);
  }));

test("folders stay open and closed as they were left, also with another dataset", () =>
  withPage(async (page) => {
    const isOpen = (label) => control(page, label, "input").isVisible();
    await unfold(page, "Winds > More");
    await page
      .locator(top, { hasText: /^Clouds and volumes$/ })
      .locator("button")
      .click();
    await control(page, "density", "input").waitFor({ state: "hidden" });
    assert.deepEqual([await isOpen("x component ×"), await isOpen("density")], [true, false]);
    await openDataset(page, "tornado");
    assert.deepEqual([await isOpen("x component ×"), await isOpen("density")], [true, false]);
  }));

test("the probe opens the folder around it", () =>
  withPage(async (page) => {
    await page.keyboard.press("i");
    await page.locator("#panel .probe-values dd").first().waitFor();
    assert.equal(await page.locator("#probe-x").isVisible(), true);
  }));
