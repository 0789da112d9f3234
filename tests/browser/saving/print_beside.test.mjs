// Printing while two pictures are compared: neither is asked for anew at the size of the paper, and
// settings are linked again afterwards.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  control,
  finalPicture,
  patience,
  sharedDaemon,
  unfold,
  watchPatches,
} from "../support.mjs";

const { withPage } = sharedDaemon({
  page: { viewport: { width: 1300, height: 640 }, initScript: [watchPatches] },
});

async function bothFinal(page) {
  await finalPicture(page);
  await page.waitForFunction(
    () => {
      const { rev, wanted, state } = document.querySelector("#beside-picture").dataset;
      return state === "final" && rev === wanted;
    },
    null,
    { polling: 20, timeout: 20_000 * patience },
  );
}

const compare = async (page) => {
  await page.locator("#compare-button").click();
  await bothFinal(page);
};

const inPrint = async (page, run) => {
  await page.emulateMedia({ media: "print" });
  await run();
  await page.emulateMedia({ media: null });
};

test("what changes while a page is printed does not ask for pictures of the paper's size", () =>
  withPage(async (page) => {
    await compare(page);
    const sizes = () =>
      page.evaluate(() =>
        window.patches.flatMap(({ patch }) => (patch.image?.width ? [patch.image.width] : [])),
      );
    const before = await sizes();
    assert.ok(before.length >= 2, "both have told theirs");
    await inPrint(page, async () => {
      await page.locator("#picture").press("ArrowLeft");
      await page.waitForTimeout(400);
    });
    await bothFinal(page);
    const others = (await sizes()).filter((width) => !before.includes(width));
    assert.deepEqual(others, []);
  }));

test("settings are linked again after printing, by the browser or as its preview", () =>
  withPage(async (page) => {
    await compare(page);
    await unfold(page, "Line colour");
    for (const map of ["plasma", "viridis", "magma", "plasma"]) {
      await page.locator("#beside-linked").uncheck();
      await control(page, "map").selectOption(map);
      if (map === "viridis") await page.pdf({ format: "A4", landscape: true });
      else await inPrint(page, () => page.waitForTimeout(map === "magma" ? 300 : 0));
      await page.locator("#beside-linked").check();
      await bothFinal(page);
      assert.equal(await page.locator("#beside-legend").isVisible(), false, "one legend again");
    }
  }));
