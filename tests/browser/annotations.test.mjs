// Annotations that the panel adds to the picture, and overlays that make room for them.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  control,
  finalPicture,
  pictureBox,
  pixels,
  sharedDaemon,
  shot,
  type,
  unfold,
} from "./support.mjs";

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

test("a title of one's own is drawn in place of the dataset's until it is emptied", () =>
  withPage(async (page) => {
    await unfold(page, "Axes and labels");
    await control(page, "title", "input").check();
    await finalPicture(page);
    const { hash: dataset } = await pixels(page);
    await type(page, "own title", "Storm of 18 January");
    await finalPicture(page);
    assert.notEqual((await pixels(page)).hash, dataset);
    assert.equal(await control(page, "own title", "input").inputValue(), "Storm of 18 January");
    await type(page, "own title", "");
    await finalPicture(page);
    assert.equal((await pixels(page)).hash, dataset);
  }));

test("size and colour of a part are its own while it is shown, and can be taken back", () =>
  withPage(async (page) => {
    await unfold(page, "Axes and labels", "Size and colour of each");
    const row = (label) => control(page, label, "input");
    for (const part of ["box", "legend", "title"]) {
      assert.equal(await row(`${part} size`).isVisible(), false, part);
    }
    for (const label of ["title", "box"]) await row(label).check();
    await finalPicture(page);
    const { hash: plain } = await pixels(page);
    await row("own title colour").check();
    await row("title colour").fill("#ff2000");
    await finalPicture(page);
    const { hash: colored } = await pixels(page);
    assert.notEqual(colored, plain);
    const red = await page.locator("#picture").evaluate((canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height / 5);
      let count = 0;
      for (let n = 0; n < data.length; n += 4) {
        if (data[n] > 200 && data[n + 1] < 90 && data[n + 2] < 60) count += 1;
      }
      return count;
    });
    assert.ok(red > 50, `the title is red: ${red} pixels`);
    await type(page, "title size", 2);
    await finalPicture(page);
    assert.notEqual((await pixels(page)).hash, colored);
    // The address is written with a delay.
    await page.waitForFunction(() => decodeURIComponent(location.hash).includes('"size":2'));
    const { annotations } = await page.evaluate(() =>
      JSON.parse(decodeURIComponent(location.hash.slice(2))),
    );
    assert.deepEqual(annotations.titleStyle, { size: 2, textColor: "#ff2000" });
    assert.equal(annotations.boxStyle, undefined, "the box keeps its own");
    await shot(page, "annotation-styles");
    await type(page, "title size", 1);
    await row("own title colour").uncheck();
    await finalPicture(page);
    assert.equal(await row("title colour").isVisible(), false);
    assert.equal((await pixels(page)).hash, plain);
  }));

// Keeps the pixels of the picture in the page.
const keepPixels = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector("#picture");
    const { width, height } = canvas;
    window.keptPixels = canvas.getContext("2d").getImageData(0, 0, width, height);
  });

// The rectangle of the pixels that have changed since, in CSS pixels of the page.
async function changedBox(page) {
  const picture = await pictureBox(page);
  const found = await page.evaluate(() => {
    const canvas = document.querySelector("#picture");
    const { width, height } = canvas;
    const now = canvas.getContext("2d").getImageData(0, 0, width, height).data;
    const then = window.keptPixels.data;
    const box = [width, height, 0, 0];
    for (let n = 0; n < width * height; n++) {
      if ([0, 1, 2].every((c) => now[4 * n + c] === then[4 * n + c])) continue;
      const [x, y] = [n % width, Math.floor(n / width)];
      box[0] = Math.min(box[0], x);
      box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x + 1);
      box[3] = Math.max(box[3], y + 1);
    }
    return { box, scale: canvas.clientWidth / width };
  });
  const [left, top, right, bottom] = found.box.map((edge) => edge * found.scale);
  return { x: picture.x + left, y: picture.y + top, width: right - left, height: bottom - top };
}

const overlap = (a, b) =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;

const sizes = [
  { width: 1440, height: 900 },
  { width: 1000, height: 480 },
];
const cases = [
  ["title", ["#hud"]],
  ["stepTime", ["#hud"]],
  ["north", [".gizmo-end", ".corner-buttons button"]],
  ["scaleBar", ["#open-link"]],
];

for (const size of sizes) {
  test(`no overlay lies on an annotation at ${size.width} x ${size.height}`, async () => {
    for (const [key, overlays] of cases) {
      const embed = key === "scaleBar" ? "?embed" : "";
      const hash = (on) => {
        const view = { dataset: "climate", annotations: { [key]: on } };
        return `#!${encodeURIComponent(JSON.stringify(view))}`;
      };
      await withPage(
        async (page) => {
          await finalPicture(page);
          await keepPixels(page);
          await page.evaluate((address) => (location.hash = address), hash(true));
          await page.waitForFunction(
            (wanted) => document.documentElement.dataset.annotations === wanted,
            key,
          );
          await finalPicture(page);
          const drawn = await changedBox(page);
          assert.ok(drawn.width > 8 && drawn.height > 4, `${key} is drawn`);
          for (const overlay of overlays) {
            for (const element of await page.locator(overlay).all()) {
              const box = await element.boundingBox();
              assert.ok(box !== null, `${overlay} is shown`);
              assert.ok(!overlap(drawn, box), `${overlay} lies on ${key}`);
              const stage = await pictureBox(page);
              assert.ok(box.y + box.height <= stage.y + stage.height, `${overlay} is inside`);
            }
          }
          await shot(page, `annotation-${key}-${size.width}`);
        },
        { path: `${embed}${hash(false)}`, viewport: size },
      );
    }
  });
}
