// Surfaces that the panel adds to the picture: what new ones show, their colours, and what is said
// of those that are not seen.
import assert from "node:assert/strict";
import { test } from "node:test";
import { control, finalPicture, pixels, sharedDaemon, shot, somePicture } from "./support.mjs";
import { type, unfold } from "./support.mjs";

const { withPage } = sharedDaemon();

const surfaces = (page) =>
  page.evaluate(
    () => JSON.parse(decodeURIComponent(location.hash.slice(2)) || "{}").surfaces ?? [],
  );

// Waits until the newest surface of the link satisfies the check.
async function surfaceHas(page, check) {
  for (let tries = 0; tries < 200; tries++) {
    const newest = (await surfaces(page)).at(-1);
    if (newest !== undefined && check(newest)) return;
    await page.waitForTimeout(50);
  }
  assert.fail(`${check}: ${JSON.stringify(await surfaces(page))}`);
}

// The element of a control of the newest surface.
const part = (page, label, tag = "select") =>
  page
    .locator("#panel .lil-title", { hasText: /^Surface \d/ })
    .last()
    .locator("xpath=ancestor::*[contains(@class, 'lil-gui')][1]")
    .locator(".lil-controller", {
      has: page.locator(".lil-name", { hasText: new RegExp(`^${label}`) }),
    })
    .locator(tag)
    .first();

async function pick(page, label, text) {
  const options = await part(page, label).locator("option").allTextContents();
  await part(page, label).selectOption({
    label: options.find((option) => option.startsWith(text)),
  });
}

async function add(page, label) {
  await somePicture(page);
  await unfold(page, "Surfaces");
  const before = (await surfaces(page)).length;
  await page.locator("#panel").getByRole("button", { name: label }).click();
  await page.waitForFunction((count) => {
    const view = JSON.parse(decodeURIComponent(location.hash.slice(2)) || "{}");
    return (view.surfaces ?? []).length > count;
  }, before);
  await finalPicture(page);
}

for (const [what, label] of [
  ["a section", "Add a level section"],
  ["an isosurface", "Add an isosurface"],
]) {
  test(`the colours of ${what} have a range that can be typed`, () =>
    withPage(async (page) => {
      await add(page, label);
      if (what === "an isosurface") {
        await pick(page, "colour by", "wind_speed");
        await finalPicture(page);
      }
      const [from, to] = ["colours from", "colours to"].map((end) => part(page, end, "input"));
      const read = async () => [Number(await from.inputValue()), Number(await to.inputValue())];
      await page.waitForFunction((input) => Number(input.value) > 0, await to.elementHandle());
      const first = await read();
      assert.ok(first[0] < first[1], `the default range is shown: ${first}`);
      const before = (await pixels(page)).hash;
      const wanted = [
        first[0] + 0.3 * (first[1] - first[0]),
        first[1] - 0.3 * (first[1] - first[0]),
      ];
      await from.fill(wanted[0].toPrecision(4));
      await from.press("Enter");
      await to.fill(wanted[1].toPrecision(4));
      await to.press("Tab");
      const sent = wanted.map((value) => Number(value.toPrecision(4)));
      await surfaceHas(page, (s) => `${s.color?.range}` === `${sent}`);
      await finalPicture(page);
      assert.deepEqual(await read(), sent, "the boxes keep what was typed");
      assert.notEqual((await pixels(page)).hash, before, "the colours have changed");
      await shot(page, `surface-colours-${what.split(" ")[1]}`);
    }));
}

// Pixels with a hue: the most of red, green and blue is well above the least.
const colored = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector("#picture");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let n = 0; n < data.length; n += 4) {
      const [r, g, b] = data.subarray(n, n + 3);
      if (Math.max(r, g, b) - Math.min(r, g, b) > 60) count += 1;
    }
    return count;
  });

test("a new isosurface is seen in the cloud of its field", () =>
  withPage(
    async (page) => {
      const before = await colored(page);
      await add(page, "Add an isosurface");
      const after = await colored(page);
      await shot(page, "surface-in-cloud");
      assert.ok(after > before + 2000, `${after} coloured pixels, ${before} before`);
    },
    {
      path: `#!${encodeURIComponent('{"dataset":"climate","vector":{"field":null}}')}`,
    },
  ));

test("levels that are not understood are named, and stay to be corrected", () =>
  withPage(async (page) => {
    await add(page, "Add a level section");
    const label = "contours at \\(values\\)";
    const box = control(page, label, "input");
    await type(page, label, "5 abc");
    await page.locator(".panel-note:visible", { hasText: "“abc” is not a number" }).waitFor();
    assert.equal(await box.inputValue(), "5 abc");
    assert.equal(await box.getAttribute("aria-invalid"), "true");
    await type(page, label, "5 2");
    await finalPicture(page);
    await page.locator(".panel-note", { hasText: "not a number" }).waitFor({ state: "hidden" });
    assert.equal(await box.inputValue(), "2 5");
  }));

test("an isosurface has a value of its field, also after another field is chosen", () =>
  withPage(async (page) => {
    const lineless = (await pixels(page)).hash;
    await add(page, "Add an isosurface");
    assert.notEqual((await pixels(page)).hash, lineless);
    await pick(page, "field", "wind_speed");
    await surfaceHas(page, (s) => s.field === "wind_speed" && s.isovalue > 5 && s.isovalue < 100);
    assert.ok(Number(await part(page, "value", "input").inputValue()) > 5, "in its unit");
    await part(page, "value", "input").fill("999");
    await part(page, "value", "input").press("Enter");
    await page.getByText(/^Empty: wind_speed is .* m s⁻¹ at this step\.$/).waitFor();
    await shot(page, "surface-empty");
  }));

test("a vertical section faces the camera, and one seen edge-on is told", () =>
  withPage(async (page) => {
    await add(page, "Add a vertical section");
    await surfaceHas(page, (s) => s.slice?.axis === "y");
    const note = page.getByText(/^Seen edge-on/);
    assert.equal(await note.isVisible(), false);
    await pick(page, "shape", "layer across x");
    await note.waitFor();
    await shot(page, "surface-edge-on");
  }));
