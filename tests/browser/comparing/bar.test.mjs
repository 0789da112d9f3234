// The bar and the words over the second picture can be read, in both themes.
import assert from "node:assert/strict";
import { test } from "node:test";
import { control, finalPicture, sharedDaemon, shot, unfold } from "../support.mjs";

const { withPage } = sharedDaemon({ page: { viewport: { width: 1440, height: 900 } } });

// Of the controls in the bar, by WCAG 2.2, "contrast ratio".
const contrasts = (page) =>
  page.evaluate(() => {
    const luminance = (color) => {
      const [r, g, b] = color.match(/[\d.]+/g).map((text) => {
        const value = Number(text) / 255;
        return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
      });
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    return [...document.querySelectorAll(".beside-bar :is(select, button)")].map((one) => {
      const { color, backgroundColor } = getComputedStyle(one);
      const [low, high] = [luminance(color), luminance(backgroundColor)].sort((a, b) => a - b);
      return [one.id, (high + 0.05) / (low + 0.05)];
    });
  });

for (const colorScheme of ["light", "dark"]) {
  test(`controls over the second picture are read in the ${colorScheme} theme`, () =>
    withPage(
      async (page) => {
        await page.locator("#compare-button").click();
        await page.locator("#beside-words:not(:empty)").waitFor();
        await shot(page, `beside-bar-${colorScheme}`);
        for (const [id, ratio] of await contrasts(page)) assert.ok(ratio >= 4.5, `${id} ${ratio}`);
        await unfold(page, "Axes and labels");
        assert.equal(await page.locator("#beside-words").isVisible(), true);
        await control(page, "legend in the picture", "input").check();
        await finalPicture(page);
        await page.locator("#beside-words").waitFor({ state: "hidden" });
      },
      { colorScheme },
    ));
}
