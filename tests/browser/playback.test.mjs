// Playback in a real browser against the real daemon: both directions, a chosen speed, the slider
// and keys; and the measuring panels, with simulated answers where a test checks how the page
// displays them.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  finalPicture,
  patience,
  sharedDaemon,
  shot,
  state,
  unfold,
  watchPatches,
} from "./support.mjs";

const shared = sharedDaemon();

// Records the displayed steps in order, each once.
const watchSteps = () => {
  window.steps = [];
  addEventListener("DOMContentLoaded", () => {
    const canvas = document.querySelector("#picture");
    new MutationObserver(() => {
      const step = Number(canvas.dataset.step);
      if (window.steps.at(-1) !== step) window.steps.push(step);
    }).observe(canvas, { attributeFilter: ["data-seq"] });
  });
};

// `answers` replaces the server's answers by URL pattern. The requests are recorded in page.asked.
function withPage(run, { answers = {}, ...options } = {}) {
  return shared.withPage(run, {
    viewport: { width: 1280, height: 800 },
    initScript: [watchPatches, watchSteps],
    ...options,
    prepare: async (page) => {
      await options.prepare?.(page);
      page.asked = [];
      for (const [pattern, answer] of Object.entries(answers)) {
        await page.route(new RegExp(pattern), (route) => {
          const url = new URL(route.request().url());
          page.asked.push(url.pathname + url.search);
          return route.fulfill({ json: answer(url) });
        });
      }
    },
  });
}

const stepCount = (page) =>
  page.evaluate(() => Number(document.querySelector("#time-slider").max) + 1);

const shownSteps = (page) => page.evaluate(() => window.steps);

const waitForSteps = (page, count) =>
  page.waitForFunction((n) => window.steps.length >= n, count, {
    polling: 20,
    timeout: 30_000 * patience,
  });

// Asserts that each step follows the previous one in direction `way`, wrapping around at the end.
function assertInOrder(steps, way, count, hint) {
  for (let n = 1; n < steps.length; n++) {
    assert.equal(steps[n], (steps[n - 1] + way + count) % count, `${hint}: ${steps}`);
  }
}

const label = (page, id) => page.locator(id).getAttribute("aria-label");

test("playback shows every step forward, then backward without a jump, until paused", async () => {
  await withPage(async (page) => {
    const count = await stepCount(page);
    assert.ok(count > 4, "the dataset has several steps");
    await page.locator("#time-drop").selectOption("steps");
    await page.locator("#time-fps").selectOption("12");
    await page.locator("#time-play").click();
    assert.equal(await label(page, "#time-play"), "Pause");
    assert.equal(await label(page, "#time-reverse"), "Play backward");
    await waitForSteps(page, 4);
    await page.locator("#time-reverse").click();
    assert.equal(await label(page, "#time-play"), "Play");
    assert.equal(await label(page, "#time-reverse"), "Pause");
    const until = (await shownSteps(page)).length + 5;
    await waitForSteps(page, until);
    await page.locator("#time-reverse").click();
    await finalPicture(page);
    const steps = await shownSteps(page);
    const ways = steps.slice(1).map((step, n) => (step - steps[n] + count) % count);
    const turn = ways.indexOf(count - 1);
    assert.ok(turn >= 3, `forward at first: ${steps}`);
    assertInOrder(steps.slice(0, turn + 1), 1, count, "forward");
    assertInOrder(steps.slice(turn), -1, count, "backward");
    const { step } = await state(page);
    assert.equal(await page.locator("#time-slider").inputValue(), step);
  });
});

test("the achieved pace is shown during playback", async () => {
  await withPage(async (page) => {
    await page.locator("#time-fps").selectOption("5");
    await page.locator("#time-play").click();
    await page.waitForFunction(
      () => /^[\d.]+ steps\/s$/.test(document.querySelector("#hud-pace").textContent),
      null,
      { timeout: 30_000 * patience },
    );
    await shot(page, "playing-1280");
    await page.locator("#time-play").click();
    await finalPicture(page);
    await page.waitForFunction(() => document.querySelector("#hud-pace").textContent === "");
  });
});

test("without loop playback ends at its last step", async () => {
  await withPage(async (page) => {
    await page.locator("#time-loop").uncheck();
    await page.locator("#time-fps").selectOption("30");
    await page.locator("#picture").focus();
    await page.keyboard.press("}");
    await finalPicture(page);
    const last = String((await stepCount(page)) - 1);
    assert.equal((await state(page)).step, last);
    await page.keyboard.press("Shift+Space");
    await page.waitForFunction(
      () =>
        document.querySelector("#picture").dataset.step === "0" &&
        document.querySelector("#time-reverse").getAttribute("aria-label") === "Play backward",
      null,
      { timeout: 30_000 * patience },
    );
    await finalPicture(page);
    await page.keyboard.press("{");
    await page.keyboard.press("]");
    await finalPicture(page);
    assert.equal((await state(page)).step, "1");
  });
});

test("dragging the slider pauses playback until release", async () => {
  await withPage(async (page) => {
    await page.locator("#time-fps").selectOption("2");
    await page.locator("#time-play").click();
    await waitForSteps(page, 2);
    const box = await page.locator("#time-slider").boundingBox();
    const y = box.y + box.height / 2;
    await page.mouse.move(box.x + 0.2 * box.width, y);
    await page.mouse.down();
    for (let n = 20; n <= 70; n++) await page.mouse.move(box.x + (n / 100) * box.width, y);
    const under = await page.locator("#time-slider").inputValue();
    assert.equal(await label(page, "#time-play"), "Play", "playback is paused");
    const words = await page.locator("#time-step").textContent();
    assert.match(words, new RegExp(`step ${Number(under) + 1} `));
    await page.waitForFunction(
      (step) => document.querySelector("#picture").dataset.step === step,
      under,
    );
    await page.mouse.up();
    assert.equal(await label(page, "#time-play"), "Pause", "playback resumes");
    await page.waitForFunction(
      (step) => Number(document.querySelector("#picture").dataset.step) === Number(step) + 1,
      under,
      { polling: 20 },
    );
    await page.locator("#time-play").click();
    await finalPicture(page);
  });
});

test("the time bar fits at 700 pixels", async () => {
  await withPage(
    async (page) => {
      const inside = await page.evaluate(() => {
        const bar = document.querySelector("#time").getBoundingClientRect();
        const parts = [...document.querySelectorAll("#time button, #time input, #time select")];
        return parts
          .map((part) => [part.id, part.getBoundingClientRect()])
          .filter(([, box]) => box.width > 0)
          .map(([id, box]) => [id, box.left >= bar.left && box.right <= bar.right + 0.5, box.top])
          .filter(([, fits]) => !fits);
      });
      assert.deepEqual(inside, []);
      assert.equal(
        await page.evaluate(() => document.documentElement.scrollWidth),
        700,
        "nothing overflows",
      );
      await shot(page, "playback-700");
    },
    { viewport: { width: 700, height: 500 } },
  );
});

// --- measuring panels -----------------------------------------------------------------------

const bell = Array.from({ length: 128 }, (_, n) =>
  Math.round(1e4 * Math.exp(-(((n - 40) / 18) ** 2))),
);
const position = {
  x: 0,
  y: 0,
  z: 0,
  units: { x: "degrees_east", y: "degrees_north", z: "hPa" },
  index: { x: 0, y: 0, z: 0 },
};
const measured = {
  "/histogram\\?": () => ({
    range: [0, 64],
    counts: bell,
    masked: 12,
    below: 0,
    above: 0,
    log: false,
  }),
  "/range\\?of=all": () => ({ range: [-3, 99], masked: 0, rangeOf: "all" }),
  "/probe\\?": (url) => ({
    position,
    values: {
      cloud: { value: Number(url.searchParams.get("step")) + 0.25, units: "1" },
      wind: { value: [3, 4, 0], units: "m s-1" },
    },
  }),
  "/series\\?": () => ({
    position,
    times: [0, 1, 2].map((value) => ({ value, text: `2001-01-01T0${value}:00:00Z` })),
    values: [1, null, 7],
    units: "K",
  }),
};

const lastRange = (page) =>
  page.evaluate(
    () =>
      window.patches.map(({ patch }) => patch.scalars?.[0]?.color).findLast((c) => c)?.range ??
      null,
  );

test("a histogram loads when visible, and a drag over its colours sets their range", async () => {
  await withPage(
    async (page) => {
      const medium = page.locator("#panel .lil-gui", { hasText: /^Volume: / }).last();
      await medium.locator(".histogram").scrollIntoViewIfNeeded();
      const svg = medium.locator(".histogram svg");
      await page.waitForFunction(() =>
        [...document.querySelectorAll(".histogram-caption")].some((p) =>
          /0 to 64/.test(p.textContent),
        ),
      );
      assert.equal(page.asked.length, 1, "no histogram is computed while hidden");
      assert.match(page.asked[0], /^\/v1\/datasets\/climate\/fields\/.+step=0&bins=128$/);
      assert.match(await svg.getAttribute("aria-label"), /0 to 64.*12 masked/);
      await medium.getByRole("button", { name: "1–99 %" }).click();
      const [low, high] = await lastRange(page);
      // A Gaussian about bin 40 that falls to 1/e within 18 bins of width 0.5; the range is 2.33
      // deviations to each side.
      const deviation = (18 / Math.SQRT2) * 0.5;
      assert.ok(Math.abs(low - (20.25 - 2.326 * deviation)) < 0.4, `${low}`);
      assert.ok(Math.abs(high - (20.25 + 2.326 * deviation)) < 0.4, `${high}`);
      const strip = medium.locator(".histogram-strip");
      await strip.scrollIntoViewIfNeeded();
      const box = await strip.boundingBox();
      await page.mouse.move(box.x + 0.7 * box.width, box.y + 12);
      await page.mouse.down();
      await page.mouse.move(box.x + 0.8 * box.width, box.y + 12);
      await page.mouse.move(box.x + 0.9 * box.width, box.y + 12);
      await page.mouse.up();
      const dragged = await lastRange(page);
      assert.ok(Math.abs(dragged[0] - 0.7 * 64) < 0.5 && Math.abs(dragged[1] - 0.9 * 64) < 0.5);
      await medium.getByLabel("log counts").uncheck();
      await finalPicture(page);
      await shot(page, "histogram-1280");
    },
    { answers: measured },
  );
});

test("the range of all steps is added to the view and removed from it", async () => {
  await withPage(
    async (page) => {
      const medium = page.locator("#panel .lil-gui", { hasText: /^Volume: / }).last();
      const range = medium.locator(".range-choice select");
      await range.selectOption("all");
      await page.waitForFunction(() =>
        window.patches.some(({ patch }) => patch.scalars?.[0]?.color?.range?.[1] === 99),
      );
      assert.deepEqual(await lastRange(page), [-3, 99]);
      await finalPicture(page);
      assert.equal(await range.inputValue(), "all");
      await range.selectOption("default");
      assert.equal(await lastRange(page), null, "the default is restored");
      await finalPicture(page);
      assert.equal(await range.inputValue(), "default");
    },
    { answers: measured },
  );
});

test("the probe reads a position, follows the step and plots the series", async () => {
  await withPage(
    async (page) => {
      await page.locator("#probe-button").click();
      assert.equal(await page.locator("#probe-button").getAttribute("aria-pressed"), "true");
      const values = page.locator(".probe-values");
      await values.getByText("0.25").waitFor();
      assert.match(await values.textContent(), /\(3, 4, 0\), \|v\| 5 m s⁻¹/);
      assert.ok(await page.locator("#probe-mark").isVisible());
      await page.locator("#picture").focus();
      await page.keyboard.press("]");
      await values.getByText("1.25").waitFor();
      const before = await page.locator("#probe-x").inputValue();
      const picture = await page.locator("#picture").boundingBox();
      const mark = await page.locator("#probe-mark").boundingBox();
      const at = { x: mark.x + mark.width / 2 + 60, y: mark.y + mark.height / 2 };
      await page.mouse.click(at.x, at.y);
      await page.waitForFunction((x) => document.querySelector("#probe-x").value !== x, before);
      const moved = await page.locator("#probe-mark").boundingBox();
      assert.ok(Math.abs(moved.x + moved.width / 2 - at.x) < 0.03 * picture.width);
      assert.ok(Math.abs(moved.y + moved.height / 2 - at.y) < 0.03 * picture.width);
      await page.getByRole("button", { name: "Over time" }).click();
      const course = page.locator(".course");
      await course.waitFor();
      assert.match(await course.getAttribute("aria-label"), /From 1 K to 7 K/);
      const label = await course.getAttribute("aria-label");
      assert.match(label, /between 2001-01-01 00:00Z and 2001-01-01 02:00Z$/);
      assert.match(await course.textContent(), /2001-01-01 00:00Z.*2001-01-01 02:00Z/);
      await finalPicture(page);
      await course.scrollIntoViewIfNeeded();
      await shot(page, "probe-1280");
      await page.locator("#probe-button").click();
      assert.equal(await page.locator("#probe-mark").isVisible(), false);
    },
    { answers: measured },
  );
});

test("alt + click probes a position while the probe is off", async () => {
  await withPage(
    async (page) => {
      await page.locator("#picture").click({ modifiers: ["Alt"] });
      await page.locator(".probe-values").getByText("0.25").waitFor();
      assert.equal(await page.locator("#probe-button").getAttribute("aria-pressed"), "true");
      assert.equal((await page.evaluate(() => window.patches)).at(-1).patch.camera, undefined);
    },
    { answers: measured },
  );
});

test("an answer that cannot be parsed is reported", async () => {
  await withPage(
    async (page) => {
      await page.route(/\/probe\?/, (route) =>
        route.fulfill({ status: 200, json: { nothing: true } }),
      );
      await unfold(page, "Probe");
      await page.getByText("The server's answer could not be understood.").waitFor();
    },
    { answers: {} },
  );
});
