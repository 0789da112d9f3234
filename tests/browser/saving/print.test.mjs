// What leaves the page on paper: printing shows picture, caption and legend on white; saved
// pictures have a size in print; the camera is copied and pasted as numbers.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import {
  control,
  drag,
  finalPicture,
  patience,
  pixels,
  sharedDaemon,
  shot,
  state,
  type,
  unfold,
} from "../support.mjs";

const { withPage } = sharedDaemon({ args: ["tornado"] });

test("printing shows the picture with caption and legend on white, and nothing else", () =>
  withPage(async (page) => {
    const before = await pixels(page);
    const { wanted } = await state(page);
    const pdf = await page.pdf({ format: "A4", landscape: true });
    const text = pdf.toString("latin1");
    assert.equal(text.match(/\/Type\s*\/Page\b/g).length, 1, "one page");
    assert.match(text, /\/Subtype\s*\/Image/, "the picture");
    await page.emulateMedia({ media: "print" });
    const shown = await page.evaluate(() => {
      const box = (selector) => {
        const { left, top, right, bottom } = document
          .querySelector(selector)
          .getBoundingClientRect();
        return { left, top, right, bottom };
      };
      return {
        picture: box("#picture"),
        legend: box("#legend"),
        caption: document.querySelector("#print-caption").innerText,
        hidden: ["header", "footer", "#panel", "#hud", ".corner"].filter(
          (one) => getComputedStyle(document.querySelector(one)).display !== "none",
        ),
        paper: getComputedStyle(document.body).backgroundColor,
        ink: getComputedStyle(document.querySelector(".legend-entry")).color,
        strip: getComputedStyle(document.querySelector(".legend-strip")).backgroundImage,
      };
    });
    await shot(page, "printed");
    assert.deepEqual(shown.hidden, []);
    assert.equal(shown.paper, "rgb(255, 255, 255)");
    assert.equal(shown.ink, "rgb(0, 0, 0)");
    assert.match(shown.strip, /linear-gradient/);
    assert.match(shown.caption, /^Tornado test function · step 1 of 12/);
    assert.ok(shown.picture.right - shown.picture.left > 300);
    assert.ok(shown.legend.top >= shown.picture.bottom, "the legend is below the picture");
    await page.emulateMedia({ media: null });
    await page.waitForTimeout(400);
    assert.equal((await state(page)).wanted, wanted, "no other picture was asked for");
    assert.equal((await pixels(page)).hash, before.hash);
  }));

test("a saved picture has the chosen dots per inch", () =>
  withPage(async (page) => {
    await page.keyboard.press("s");
    await page.locator("#save-scale").selectOption("1");
    await page.locator("#save-dpi").fill("150");
    await page.locator("#save-dpi").press("Tab");
    assert.match(await page.locator("#save-size").innerText(), /mm in print/);
    const [download] = await Promise.all([
      page.waitForEvent("download", { timeout: 60_000 * patience }),
      page.locator("#save-picture").click(),
    ]);
    const png = await readFile(await download.path());
    const at = png.indexOf("pHYs");
    assert.ok(at > 0 && at < png.indexOf("IDAT"));
    // 150 / 0.0254 m = 5905.5
    assert.deepEqual(
      [png.readUInt32BE(at + 4), png.readUInt32BE(at + 8), png[at + 12]],
      [5906, 5906, 1],
    );
  }));

test("the camera is read and set in numbers, copied and pasted", () =>
  withPage(async (page) => {
    await unfold(page, "Camera in numbers");
    const box = page.locator(".camera-text");
    const first = { ...JSON.parse(await box.inputValue()), fovY: 30 };
    const paste = async (camera) => {
      await box.fill(JSON.stringify(camera));
      await box.press("Enter");
      await finalPicture(page);
      return pixels(page);
    };
    const before = await paste(first);
    await drag(page, 120, 40);
    await finalPicture(page);
    const moved = JSON.parse(await box.inputValue());
    assert.notDeepEqual(moved.eye, first.eye, "the text follows the camera");
    const shownX = await control(page, "eye x", "input").inputValue();
    assert.ok(Math.abs(Number(shownX) - moved.eye[0]) < 1e-3, `${shownX}, ${moved.eye[0]}`);
    await shot(page, "camera-numbers");
    assert.notEqual((await pixels(page)).hash, before.hash);
    assert.equal((await paste(first)).hash, before.hash, "the first camera again");
    await type(page, "target z", 0.25);
    await finalPicture(page);
    await page.locator("#picture").focus();
    assert.equal(JSON.parse(await box.inputValue()).target[2], 0.25);
    await box.fill('{"eye": [1, 2]}');
    await box.press("Enter");
    assert.match(await page.locator(".camera-refused").innerText(), /eye must be three numbers/);
  }));
