// The folders of the panel: their order, which of them a dataset has, headings, and what is kept.
import assert from "node:assert/strict";
import { test } from "node:test";
import { assertDrawn, choose, control, drag, finalPicture, pixels } from "./support.mjs";
import { sharedDaemon, shot, type, unfold } from "./support.mjs";

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
    const after = ["Surfaces", "Place", "Light", "Time", "Compare", "Quality"];
    const before = await titles(page);
    assert.deepEqual(before.slice(-9), ["Data", "Winds", "Clouds and volumes", ...after]);
    await openDataset(page, "efield");
    assert.deepEqual((await titles(page)).slice(-9), ["Data", "Vectors", "Volumes", ...after]);
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

// --- presets ------------------------------------------------------------------------------------

const preset = (page, title) =>
  page.locator(".preset", { has: page.locator(".preset-title", { hasText: title }) });

// Waits until every preset that is offered has its picture.
const allPictures = (page) =>
  page.waitForFunction(() => {
    const images = [...document.querySelectorAll(".preset:not([hidden]) img")];
    return images.length > 0 && images.every((one) => one.naturalWidth > 0);
  });

// Counts requests for pictures.
const countPictures = (page) => {
  const asked = [];
  page.on("request", (request) => request.url().endsWith("/v1/frames") && asked.push(request));
  return asked;
};

test("each preset has a picture of its own, and a click draws it", () =>
  withPage(async (page) => {
    for (const dataset of ["climate", "tornado", "efield"]) {
      if (dataset !== "climate") await openDataset(page, dataset);
      await allPictures(page);
      await shot(page, `presets-${dataset}`);
      const shown = await page.locator(".preset:visible .preset-title").allTextContents();
      assert.ok(shown.length >= 8, `${shown}`);
      const hashes = new Set();
      for (const title of shown) {
        await preset(page, new RegExp(`^${title}$`)).click();
        await finalPicture(page);
        const stats = await pixels(page);
        assertDrawn(stats);
        hashes.add(stats.hash);
      }
      assert.equal(hashes.size, shown.length, dataset);
    }
  }));

test("a preset without media comes while a histogram of one is read", () =>
  withPage(
    async (page) => {
      const waiting = [];
      await page.route(/\/histogram\?/, (route) => void waiting.push(route));
      await unfold(page, "Opacity curve");
      await page.locator("#panel .transfer-point").first().scrollIntoViewIfNeeded();
      for (const until = Date.now() + 15_000; waiting.length === 0 && Date.now() < until;) {
        await page.waitForTimeout(50);
      }
      assert.ok(waiting.length > 0, "a histogram was asked for");
      await preset(page, /^Sections$/).click();
      await finalPicture(page);
      const answered = page.waitForResponse(/\/histogram\?/);
      await Promise.all(waiting.map((route) => route.continue()));
      await (await answered).finished();
      await page.waitForTimeout(300); // an error of the page fails the test
    },
    { path: `#!${encodeURIComponent('{"dataset":"tornado"}')}` },
  ));

test("a preset keeps step and region, and undo restores the view before it", () =>
  withPage(
    async (page) => {
      const before = await pixels(page);
      const { hash } = new URL(page.url());
      await preset(page, /^Streamlets$/).click();
      await finalPicture(page);
      assert.notEqual((await pixels(page)).hash, before.hash);
      await page.waitForFunction(() => location.hash.includes("trace"));
      const view = JSON.parse(decodeURIComponent(new URL(page.url()).hash.slice(2)));
      assert.deepEqual(
        [view.step, view.region, view.vector.trace, view.camera, view.depthCue],
        [2, { x: [0, 180] }, {}, undefined, undefined],
      );
      await page.keyboard.press("Control+z");
      await finalPicture(page);
      assert.equal((await pixels(page)).hash, before.hash);
      await page.waitForFunction((link) => location.hash === link, hash);
    },
    {
      path: `#!${JSON.stringify({
        dataset: "climate",
        step: 2,
        region: { x: [0, 180] },
        depthCue: { strength: 0.9 },
      })}`,
    },
  ));

test("pictures of presets are asked for at rest only, and once for each step", () =>
  withPage(
    async (page) => {
      const asked = countPictures(page);
      await drag(page, 60, 20, 20);
      assert.equal(asked.length, 0, "not while the view moves");
      await finalPicture(page);
      await allPictures(page);
      const count = asked.length;
      assert.equal(count, await page.locator(".preset:visible").count());
      await drag(page, 60, 20, 4);
      await finalPicture(page);
      await openDataset(page, "tornado");
      await allPictures(page);
      await openDataset(page, "climate");
      await allPictures(page);
      const others = asked.slice(count).filter((one) => one.postData().includes('"climate"'));
      assert.deepEqual(others.length, 0, "known pictures are not asked for again");
    },
    { path: '#!{"dataset":"climate","vector":{"stride":3}}' },
  ));

test("a change of the view ends a request for a picture, and a folded list asks for none", () =>
  withPage(
    async (page) => {
      const asked = await page.waitForEvent("request", (one) => one.url().endsWith("/v1/frames"));
      const ended = page.waitForEvent("requestfailed", (one) => one === asked);
      await page.keyboard.press("ArrowLeft");
      await ended;
      await page.unroute("**/v1/frames");
      await page
        .locator(top, { hasText: /^Views to start from$/ })
        .locator("button")
        .click();
      await page.locator(".presets").waitFor({ state: "hidden" });
      const later = countPictures(page);
      await finalPicture(page);
      await page.waitForTimeout(2000);
      assert.equal(later.length, 0);
    },
    { settle: false, prepare: (page) => page.route("**/v1/frames", () => {}) },
  ));

test("a preset that the server does not draw is not offered", () =>
  withPage(
    async (page) => {
      await preset(page, /^Globe$/).waitFor({ state: "hidden" });
      await allPictures(page);
      assert.equal(await preset(page, /^Winds$/).isVisible(), true);
    },
    {
      faulty: true, // the browser logs the refusal
      prepare: (page) =>
        page.route("**/v1/frames", (route) =>
          route.request().postData().includes('"sphere"')
            ? route.fulfill({ status: 422, json: { title: "no", status: 422, detail: "no" } })
            : route.continue(),
        ),
    },
  ));

test("a preset that the server has no memory for does not keep others from being drawn", () => {
  const refused = [];
  return withPage(
    async (page) => {
      const others = page.locator(".preset:visible", { hasNotText: /^Globe$/ }).locator("img");
      await page.waitForFunction(
        () =>
          [...document.querySelectorAll(".preset img")].filter((one) => one.naturalWidth > 0)
            .length ===
          document.querySelectorAll(".preset").length - 1,
      );
      assert.ok((await others.count()) >= 8);
      assert.ok(await preset(page, /^Globe$/).isVisible(), "it is asked for again");
      assert.ok(refused.length >= 1 && refused.length <= 5, `${refused.length}`);
    },
    {
      faulty: true, // the browser logs the refusals
      prepare: (page) =>
        page.route("**/v1/frames", (route) => {
          if (!route.request().postData().includes('"sphere"')) return route.continue();
          refused.push(route.request().url());
          return route.fulfill({ status: 507, json: { title: "no", status: 507, detail: "no" } });
        }),
    },
  );
});

// --- light and surfaces -------------------------------------------------------------------------

const lightOf = (page) =>
  page.evaluate(() => JSON.parse(decodeURIComponent(location.hash.slice(2))).light);

test("the sun stands at a time and place, or in a direction", () =>
  withPage(async (page) => {
    await unfold(page, "Light");
    await control(page, "sunlight", "input").check();
    await choose(page, "sun by", /^time and place$/);
    await page.waitForFunction(() => location.hash.includes("sunAt"));
    const { sunAt } = await lightOf(page);
    assert.equal(sunAt.utc, "2001-01-01T00:00Z", "at the time of the step");
    assert.equal(await control(page, "sun from \\(°\\)", "input").isVisible(), false);
    await finalPicture(page);
    const night = await pixels(page);
    await control(page, "time \\(UTC\\)", "input").fill("2001-06-21T12:00");
    await control(page, "time \\(UTC\\)", "input").blur();
    await type(page, "longitude \\(°\\)", 10);
    await finalPicture(page);
    assert.notEqual((await pixels(page)).hash, night.hash);
    await page.waitForFunction(() => location.hash.includes("06-21T12:00Z"));
    const { utc, longitude } = (await lightOf(page)).sunAt;
    assert.deepEqual([utc, longitude], ["2001-06-21T12:00Z", 10]);
    await page.locator("#panel button", { hasText: /^At the time of the step$/ }).click();
    await page.waitForFunction(() => location.hash.includes("01-01T00:00Z"));
    await choose(page, "sun by", /^direction$/);
    await page.waitForFunction(() => !location.hash.includes("sunAt"));
    assert.equal(await control(page, "time \\(UTC\\)", "input").isVisible(), false);
    assert.equal(await control(page, "sun from \\(°\\)", "input").isVisible(), true);
  }));

test("the legend shows surfaces, and the range of their colours can be set", () =>
  withPage(async (page) => {
    await unfold(page, "Surfaces");
    await page.locator("#panel button", { hasText: /^Add a level section$/ }).click();
    const card = page.locator(".legend-surface");
    await card.locator(".legend-note", { hasText: /^section at \d+ hPa$/ }).waitFor();
    await finalPicture(page);
    const surface = (label) =>
      page
        .locator("#panel .lil-gui", { hasText: /^Surface 1/ })
        .last()
        .locator(".lil-controller", { hasText: new RegExp(`^${label}`) })
        .locator("input");
    const high = Number(await surface("colours to").inputValue());
    assert.ok(high > Number(await surface("colours from").inputValue()), "the default range");
    const ticks = () => card.locator(".legend-tick").allTextContents();
    const largest = Number((await ticks()).at(-1));
    assert.ok(largest > high / 2 && largest <= high, `${largest} of ${high}`);
    await page.keyboard.press("Shift"); // another key begins another undo entry
    await surface("colours to").fill(String(3 * high));
    await surface("colours to").press("Enter");
    await finalPicture(page);
    assert.ok(Number((await ticks()).at(-1)) > high, `${await ticks()}`);
    await shot(page, "legend-surface");
    await page.keyboard.press("Escape");
    await page.locator("#undo-button").click();
    await page.locator("#undo-button").click();
    await card.waitFor({ state: "detached" });
  }));

test("undo takes back changes in every folder, one after another", () =>
  withPage(
    async (page) => {
      await unfold(page, "Section", "Ground", "Axes and labels", "Surfaces", "Light", "Time");
      await unfold(page, "Quality", "Method", "Winds > More", "Volume: cloud > More");
      const link = () => page.evaluate(() => location.hash);
      const view = async () => JSON.parse(decodeURIComponent((await link()).slice(2)));
      const button = (label) =>
        page.locator("#panel button", { hasText: new RegExp(`^${label}$`) });
      const changes = [
        () => preset(page, /^Sections$/).click(),
        () => preset(page, /^Winds and clouds$/).click(),
        () => choose(page, "slice", /^across z/),
        () => type(page, "length", 0.08),
        () => type(page, "min optical depth", 0.01),
        () => button("Add an isosurface").click(),
        () => button("Add a level section").click(),
        () => type(page, "vertical stretch", 3),
        () => choose(page, "show", /^always$/),
        () => control(page, "graticule", "input").check(),
        () => control(page, "axes", "input").check(),
        () => control(page, "sunlight", "input").check(),
        () => choose(page, "sun by", /^time and place$/),
        () => choose(page, "texture", /^moves/),
        () => control(page, "lossless final", "input").check(),
        () => choose(page, "compositing", /^simple/),
      ];
      const moved = (from) => page.waitForFunction((one) => location.hash !== one, from);
      const before = await pixels(page);
      const views = [await view()];
      for (const change of changes) {
        const from = await link();
        await change();
        await moved(from);
        views.push(await view());
      }
      for (let n = changes.length - 1; n >= 0; n--) {
        const from = await link();
        await page.locator("#undo-button").click();
        await moved(from);
        assert.deepEqual(await view(), views[n], `change ${n} is undone`);
      }
      await finalPicture(page);
      assert.equal((await pixels(page)).hash, before.hash);
    },
    { path: '#!{"dataset":"climate","step":0}' },
  ));

test("seeds are points, typed or picked, and followed for a length or over steps", () =>
  withPage(
    async (page) => {
      const seeds = () =>
        page.evaluate(
          () => JSON.parse(decodeURIComponent(location.hash.slice(2))).vector?.trace?.seeds,
        );
      const until = async (holds, what) => {
        for (let n = 0; n < 100; n++, await page.waitForTimeout(50)) {
          if (holds((await seeds()) ?? {})) return;
        }
        assert.fail(`${what}: ${JSON.stringify(await seeds())}`);
      };
      assert.match(await page.locator("#legend").textContent(), /slower than/);
      await control(page, "follow the flow", "input").check();
      await choose(page, "lines through", /points/);
      const box = page.locator(".seed-points textarea");
      await box.fill("-60 40 250\n0, -45, 250");
      await box.press("Tab");
      await until(({ points }) => points?.length === 2, "two points are typed");
      assert.deepEqual((await seeds()).points[1], [0, -45, 250]);
      await box.fill("-60 40");
      await box.press("Tab");
      const words = page.locator(".seed-points .panel-note");
      assert.match(await words.textContent(), /Point 1 needs three numbers: lon lat/);
      const pick = page.locator(".seed-points button");
      await pick.click();
      await page.locator("#picture").click({ position: { x: 330, y: 250 } });
      await until(({ points }) => points?.length === 3, "a point is picked");
      assert.equal((await box.inputValue()).split("\n").length, 3);
      await pick.click();
      await choose(page, "followed", /for a length/);
      await until(({ length }) => length > 0, "a length");
      await finalPicture(page);
      assertDrawn({ ...(await pixels(page)), covered: 1 });
      assert.doesNotMatch(await page.locator("#legend").textContent(), /slower than|longest line/);
      await page.locator(".seed-points").scrollIntoViewIfNeeded();
      await shot(page, "seed-points");
      await type(page, "paths over steps", 2);
      await until(({ pathSteps }) => pathSteps === 2, "paths");
      await finalPicture(page);
      await choose(page, "lines through", /every sample/);
      await box.waitFor({ state: "hidden" });
      await finalPicture(page);
      assert.match(await page.locator("#legend").textContent(), /slower than/);
    },
    { path: `#!${encodeURIComponent('{"dataset":"climate"}')}` },
  ));
