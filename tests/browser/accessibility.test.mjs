// Accessibility of the page: axe's rules in both themes and in small windows, operation by keyboard
// alone, and reduced motion.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { test } from "node:test";
import { finalPicture, pixels, sharedDaemon, shot, state } from "./support.mjs";

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

const { withPage } = sharedDaemon();

async function violations(page) {
  await page.evaluate(axe);
  // Contrast during a fade differs from the final contrast.
  await page.evaluate(() =>
    Promise.allSettled(document.getAnimations().map(({ finished }) => finished)),
  );
  const found = await page.evaluate(() =>
    window.axe.run(document, {
      resultTypes: ["violations"],
      // An experimental rule: who speaks a command says what is written.
      rules: { "label-content-name-mismatch": { enabled: true } },
    }),
  );
  assert.ok(found.passes.length > 15, "axe has checked the page");
  return found.violations.map(({ id, nodes }) => [
    id,
    ...nodes.map(({ target, any }) => [...target, ...any.map(({ message }) => message)].join(" ")),
  ]);
}

// Opens every folder of the panel, including nested ones.
async function unfoldAll(page) {
  const folded = page.locator('#panel .lil-title[aria-expanded="false"]:visible');
  while ((await folded.count()) > 0) await folded.first().click();
}

const windows = [
  ["dark", { colorScheme: "dark" }],
  ["light", { colorScheme: "light" }],
  ["dark phone", { colorScheme: "dark", viewport: { width: 390, height: 844 } }],
  ["light phone", { colorScheme: "light", viewport: { width: 390, height: 844 } }],
];

// Opens each dialog as a user does and waits for its complete content.
const openers = {
  about: async (page) => {
    await page.keyboard.press("a");
    await page.locator("#about dd").first().waitFor();
  },
  datasets: async (page) => {
    await page.keyboard.press("d");
    await page.waitForFunction(() => {
      const cards = [...document.querySelectorAll("#cards .card")];
      return cards.length > 0 && cards.every((card) => card.querySelector("img")?.complete);
    });
  },
  help: async (page) => {
    await page.keyboard.press("?");
    await page.locator("#help").waitFor();
  },
  login: async (page) => {
    // the button is shown once the server asks for a token
    await page.evaluate(() => document.querySelector("#login-button").click());
    await page.locator("#login").waitFor();
  },
  save: async (page) => {
    await page.keyboard.press("s");
    await page.locator("#keep-name").fill("a view");
    await page.keyboard.press("Enter");
    await page.locator("#kept li").waitFor();
  },
};

for (const [name, options] of windows) {
  test(`axe reports no violation: ${name}`, () =>
    withPage(async (page) => {
      assert.deepEqual(await violations(page), [], "after loading");
      if (await page.locator("#panel").isVisible()) {
        await unfoldAll(page);
        assert.deepEqual(await violations(page), [], "with the whole panel open");
      }
      const dialogs = await page.locator("dialog").evaluateAll((all) => all.map((d) => d.id));
      assert.deepEqual(dialogs.sort(), Object.keys(openers).sort());
      for (const [dialog, open] of Object.entries(openers)) {
        await page.evaluate(() => document.activeElement?.blur());
        await open(page);
        assert.deepEqual(await violations(page), [], `with #${dialog} open`);
        await page.keyboard.press("Escape");
        await page.locator(`#${dialog}`).waitFor({ state: "hidden" });
      }
    }, options));
}

// A busy browser may report the visibility of a plot late; until then the plot is not drawn.
test("axe reports no violation while plots wait to become visible", () =>
  withPage(
    async (page) => {
      await unfoldAll(page);
      assert.deepEqual(await violations(page), []);
    },
    { initScript: () => (IntersectionObserver.prototype.observe = () => {}) },
  ));

test("axe reports a button without a name", () =>
  withPage(async (page) => {
    await page.evaluate(() =>
      document.querySelector("header").append(document.createElement("button")),
    );
    assert.deepEqual(
      (await violations(page)).map(([id]) => id),
      ["button-name"],
    );
  }));

// The name of the focused element, and whether its focus is visible.
const focused = (page) =>
  page.evaluate(() => {
    const element = document.activeElement;
    if (element === null || element === document.body) return null;
    const ring = (node) => {
      const { outlineStyle, outlineWidth, boxShadow } = getComputedStyle(node);
      return (outlineStyle !== "none" && parseFloat(outlineWidth) > 0) || boxShadow !== "none";
    };
    const box = element.getBoundingClientRect();
    const name = element.getAttribute("aria-label") ?? element.textContent.trim().slice(0, 30);
    return {
      what: `${element.tagName}#${element.id} ${name}`,
      ring: ring(element) || [...element.parentElement.children, element.parentElement].some(ring),
      seen: box.width > 0 && box.height > 0 && box.bottom > 0 && box.top < innerHeight,
    };
  });

test("the tab key reaches every control once with visible focus", () =>
  withPage(async (page) => {
    const expected = await page.evaluate(
      () =>
        [...document.querySelectorAll("button, select, input, [tabindex='0'], a[href]")].filter(
          (e) =>
            e.checkVisibility({ visibilityProperty: true }) &&
            !e.disabled &&
            e.tabIndex >= 0 &&
            e.closest("[inert]") === null,
        ).length,
    );
    assert.ok(expected > 30, `${expected} controls`);
    const seen = [];
    await page.evaluate(() => document.activeElement?.blur());
    for (let n = 0; n < 2 * expected; n++) {
      await page.keyboard.press("Tab");
      const now = await focused(page);
      if (now === null) break; // the focus has moved on to the browser's own controls
      seen.push(now);
    }
    assert.ok(seen.length >= expected, `${seen.length} of ${expected} were reached`);
    assert.ok(seen.length < 2 * expected, "the tab order is finite");
    assert.deepEqual(
      seen.filter(({ ring }) => !ring),
      [],
      "every focus is visible",
    );
    assert.deepEqual(
      seen.filter(({ seen: at }) => !at),
      [],
      "every focused control is scrolled into view",
    );
  }));

test("keyboard alone opens a dataset, rotates, lengthens lines and shows the help", () =>
  withPage(async (page) => {
    const tabTo = async (selector) => {
      for (let n = 0; n < 200; n++) {
        if (await page.evaluate((s) => document.activeElement?.matches(s) ?? false, selector))
          return;
        await page.keyboard.press("Tab");
      }
      assert.fail(`the tab key does not come to ${selector}`);
    };
    await tabTo("#dataset");
    const before = await page.locator("#facts").textContent();
    const options = await page
      .locator("#dataset option")
      .evaluateAll((all) => all.map((o) => o.value));
    const at = options.indexOf(await page.locator("#dataset").inputValue());
    await page.keyboard.press(at === 0 ? "ArrowDown" : "ArrowUp");
    await page.waitForFunction(
      (text) => document.querySelector("#facts").textContent !== text,
      before,
    );
    await finalPicture(page);
    const first = await pixels(page);
    await tabTo("#picture");
    const { azimuth } = await state(page);
    await page.keyboard.press("ArrowRight");
    await finalPicture(page);
    assert.notEqual((await state(page)).azimuth, azimuth);
    assert.notEqual((await pixels(page)).hash, first.hash);
    const turned = await pixels(page);
    await tabTo("#panel .lil-number input");
    for (let n = 0; n < 5; n++) await page.keyboard.press("ArrowUp");
    await finalPicture(page);
    assert.notEqual((await pixels(page)).hash, turned.hash, "longer lines change the picture");
    await tabTo("#help-button");
    await page.keyboard.press("Enter");
    await page.locator("#help").waitFor();
    await page.keyboard.press("Escape");
    assert.equal(await page.evaluate(() => document.activeElement.id), "help-button");
  }));

test("with reduced motion there is no animation", () =>
  withPage(
    async (page) => {
      const moving = await page.evaluate(() =>
        [...document.querySelectorAll("*")].flatMap((element) => {
          const { animationName, animationDuration, transitionDuration } =
            getComputedStyle(element);
          const long = (text) => text.split(",").some((t) => parseFloat(t) > 0.01);
          const moves =
            (animationName !== "none" && long(animationDuration)) || long(transitionDuration);
          return moves ? [`${element.tagName}#${element.id}.${element.className}`] : [];
        }),
      );
      assert.deepEqual(moving, []);
    },
    { reducedMotion: "reduce" },
  ));

// The distinct colours along the middle of an element, as it is on the screen.
async function colorsAlong(page, selector) {
  const clip = await page.locator(selector).first().boundingBox();
  const shot = await page.screenshot({ clip });
  return page.evaluate(async (text) => {
    const file = new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]);
    const bitmap = await createImageBitmap(file);
    const { width, height } = bitmap;
    const context = new OffscreenCanvas(width, height).getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, Math.floor(height / 2), width, 1);
    return new Set(new Uint32Array(data.buffer)).size;
  }, shot.toString("base64"));
}

test("colour bars, curves and marks keep their colours where the system forces its own", () =>
  withPage(
    async (page) => {
      for (const bar of [".legend-lines .legend-strip", "#panel .map-strip"]) {
        await page.locator(bar).first().scrollIntoViewIfNeeded();
        const colors = await colorsAlong(page, bar);
        assert.ok(colors > 30, `${colors} colours in ${bar}`);
      }
      const ramp = await colorsAlong(page, ".legend-medium .legend-strip");
      assert.ok(ramp > 10, `${ramp} colours of the volume's bar`);
      await shot(page, "forced-colors");
      assert.deepEqual(await violations(page), []);
    },
    { forcedColors: "active" },
  ));

test("the card of the dataset that is shown is marked", () =>
  withPage(async (page) => {
    await page.locator("#dataset").selectOption("tornado");
    await finalPicture(page);
    await openers.datasets(page);
    const marked = page.locator('.card[aria-current="true"]');
    assert.deepEqual(await marked.locator(".card-title").allInnerTexts(), [
      "Tornado test function",
    ]);
    const frame = (card) => card.evaluate((element) => getComputedStyle(element).borderColor);
    const other = page.locator('.card[aria-current="false"]').first();
    assert.notEqual(await frame(marked), await frame(other));
  }));
