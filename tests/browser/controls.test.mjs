// The panel's controls in a real browser: the patch that each sends, the resulting link, the
// controls that it hides, and for settings that every method supports the change of the picture.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  choose,
  control,
  finalPicture,
  pixels,
  sharedDaemon,
  shot,
  somePicture,
  type,
  unfold,
  watchPatches,
} from "./support.mjs";

const { withPage } = sharedDaemon({ page: { initScript: watchPatches } });

const isShown = (page, label, tag) => control(page, label, tag).isVisible();

// The newest patch that contains this path, and the value there.
const lastPatch = (page, ...path) =>
  page.evaluate((keys) => {
    const inner = (value) => keys.reduce((v, key) => v?.[key], value);
    return window.patches.map(({ patch }) => inner(patch)).findLast((v) => v !== undefined);
  }, path);

// Waits until the link contains this value at this path.
async function linkSays(page, ...pathAndValue) {
  const wanted = pathAndValue.pop();
  await page.waitForFunction(
    ([keys, value]) => {
      const view = JSON.parse(decodeURIComponent(location.hash.slice(2)) || "{}");
      const found = keys.reduce((v, key) => v?.[key], view);
      return JSON.stringify(found) === JSON.stringify(value);
    },
    [pathAndValue, wanted],
  );
}

// Number boxes and sliders: folder, label, value, pointer in the view.
const numbers = [
  ["Winds", "length", 0.08, "vector", "length"],
  ["Winds", "opacity", 0.4, "vector", "opacity"],
  ["Winds", "sampling stride", 2, "vector", "stride"],
  ["Line shape", "core radius r1", 0.9, "vector", "r1"],
  ["Line shape", "edge radius r2", 2.5, "vector", "r2"],
  ["Line shape", "head whitening", 0.1, "vector", "headDesaturation"],
  ["Line shape", "tail darkening", 0.3, "vector", "mark", "tailDarkening"],
  ["Line shape", "halo", 1.5, "vector", "mark", "halo"],
  ["Line shape", "brightness by speed", 0, "vector", "magnitudeIntensity"],
  ["Kernels and jitter", "span \\(strides\\)", 3, "vector", "span"],
  ["Kernels and jitter", "jitter of centre", 0.9, "vector", "jitter", "center"],
  ["Kernels and jitter", "jitter of stride", 0.8, "vector", "jitter", "stride"],
  ["Kernels and jitter", "pattern", 17, "vector", "jitter", "seed"],
  ["Depth and background", "depth cue", 0.9, "depthCue", "strength"],
  ["Depth and background", "darkens from", 0.3, "depthCue", "near"],
  ["Depth and background", "darkest at", 0.6, "depthCue", "far"],
  ["Method", "stop transmittance", 0.04, "method", "stopTransmittance"],
  ["Quality", "moving budget \\(ms\\)", 60, "quality", "budgetMs"],
];

test("every number is sent under its key and kept in the link", () =>
  withPage(async (page) => {
    await unfold(page, ...new Set(numbers.map(([folder]) => folder)));
    for (const [, label, value, ...path] of numbers) {
      await type(page, label, value);
      assert.equal(await lastPatch(page, ...path), value, label);
    }
    for (const [, , value, ...path] of numbers) await linkSays(page, ...path, value);
  }));

// These settings change the picture with every method.
const visible = [
  ["Winds", "length", 0.1],
  ["Winds", "opacity", 0.2],
  ["Winds", "sampling stride", 5],
  ["Line shape", "edge radius r2", 4],
  ["Line shape", "head whitening", 0],
  ["Kernels and jitter", "jitter of centre", 0],
  ["Kernels and jitter", "pattern", 5],
  ["Depth and background", "depth cue", 1],
];

test("line settings change the picture", () =>
  withPage(async (page) => {
    await unfold(page, ...new Set(visible.map(([folder]) => folder)));
    let { hash } = await pixels(page);
    for (const [, label, value] of visible) {
      await type(page, label, value);
      await finalPicture(page);
      const next = (await pixels(page)).hash;
      assert.notEqual(next, hash, label);
      hash = next;
    }
  }));

test("near and far of the depth cue cannot cross", () =>
  withPage(async (page) => {
    await unfold(page, "Depth and background");
    await type(page, "darkens from", 1.5);
    const { near, far } = await lastPatch(page, "depthCue");
    assert.equal(near, 1.5);
    assert.ok(far > near);
    await finalPicture(page);
    assert.equal(await page.locator("#alert").isVisible(), false);
    await type(page, "depth cue", 0);
    assert.equal(await control(page, "darkens from", "input").isDisabled(), true);
    await type(page, "depth cue", 0.5);
    assert.equal(await control(page, "darkens from", "input").isDisabled(), false);
  }));

test("stride and minimum optical depth of a medium are sent", () =>
  withPage(async (page) => {
    const first = await pixels(page);
    await unfold(page, "Volume: cloud > More");
    await type(page, "min optical depth", 0.02);
    assert.equal((await lastPatch(page, "scalars"))[0].minOpticalDepth, 0.02);
    await finalPicture(page);
    assert.notEqual((await pixels(page)).hash, first.hash);
  }));

test("lines that are switched off hide their controls", () =>
  withPage(async (page) => {
    const shown = control(page, "shown", "input");
    await shown.uncheck();
    await page.waitForFunction(() => document.querySelector(".legend-lines") === null);
    assert.equal(await isShown(page, "length", "input"), false);
    assert.equal(await isShown(page, "colour by"), false);
    await shown.check();
    assert.equal(await isShown(page, "length", "input"), true);
    assert.equal(await isShown(page, "colour by"), true);
    assert.equal(await isShown(page, "pieces of a line", "input"), false);
    await control(page, "follow the flow", "input").check();
    await control(page, "pieces of a line", "input").waitFor();
  }));

test("the span control needs overlap, and the pattern control needs jitter", () =>
  withPage(async (page) => {
    await unfold(page, "Kernels and jitter");
    const disabled = (label) => control(page, label, "input").isDisabled();
    assert.deepEqual(
      [await disabled("span \\(strides\\)"), await disabled("pattern")],
      [false, false],
    );
    await control(page, "kernels overlap", "input").uncheck();
    assert.equal(await lastPatch(page, "vector", "jitter", "overlap"), false);
    assert.equal(await disabled("span \\(strides\\)"), true);
    await type(page, "jitter of centre", 0);
    await type(page, "jitter of stride", 0);
    assert.equal(await disabled("pattern"), true);
    assert.equal(await disabled("new each step"), true);
  }));

test("slab thickness is offered for slabs only, and each compositing operator is explained", () =>
  withPage(async (page) => {
    await unfold(page, "Method");
    const note = (text) => page.locator("#panel .panel-note", { hasText: text });
    await control(page, "slab thickness", "input").waitFor(); // slabs are the default
    await choose(page, "method", /^kernel$/);
    assert.equal(await lastPatch(page, "method", "name"), "kernel");
    assert.equal(await isShown(page, "slab thickness", "input"), false);
    assert.deepEqual(await control(page, "method").locator("option").allTextContents(), [
      "kernel",
      "slab",
    ]);
    await choose(page, "method", /^slab$/);
    assert.equal(await lastPatch(page, "method", "name"), "slab");
    assert.equal(await isShown(page, "slab thickness", "input"), true);
    await type(page, "slab thickness", 2);
    assert.equal(await lastPatch(page, "method", "slabThickness"), 2);
    await choose(page, "method", /^kernel$/);
    for (const [option, word, hint] of [
      [/^cd \(/, "cd", /no seams/],
      [/^cd-naive/, "cd-naive", /seams around/],
      [/^cd-euler/, "cd-euler", /unstable/],
      [/^simple/, "simple", /behind its/],
      [/^analytic/, "analytic", /exactly/],
    ]) {
      await choose(page, "compositing", option);
      assert.equal(await lastPatch(page, "method", "compositing"), word);
      await note(hint).waitFor();
    }
    await choose(page, "detail", /^full$/);
    assert.equal(await lastPatch(page, "method", "detail"), "full");
    await note(/Every sample/).waitFor();
  }));

test("a slice is selected by axis and layer and can be removed", () =>
  withPage(async (page) => {
    await unfold(page, "Section");
    assert.equal(await isShown(page, "layer", "input"), false);
    const { x, y, z } = await page.evaluate(() => {
      const [a, b, c] = document.querySelector("#facts").textContent.match(/\d+/g).map(Number);
      return { x: a, y: b, z: c };
    });
    for (const [axis, samples] of Object.entries({ x, y, z })) {
      await choose(page, "slice", new RegExp(`^across ${axis}`));
      const middle = Math.floor((samples - 1) / 2);
      assert.deepEqual(await lastPatch(page, "geometry", "slice"), { axis, index: middle });
      await type(page, "layer", 10_000);
      assert.deepEqual(await lastPatch(page, "geometry", "slice"), { axis, index: samples - 1 });
    }
    await choose(page, "slice", /^off/);
    assert.equal(await lastPatch(page, "geometry", "slice"), null);
  }));

test("the default camera faces a slice or plane, and a globe ends the plane", () =>
  withPage(async (page) => {
    const faces = (azimuth, elevation) =>
      page.waitForFunction(
        ([a, e]) => {
          const { azimuth, elevation } = document.querySelector("#picture").dataset;
          return Math.abs(azimuth - a) < 0.1 && Math.abs(elevation - e) < 0.1;
        },
        [azimuth, elevation],
      );
    await unfold(page, "Section", "Place");
    await choose(page, "slice", /^across z/);
    await faces(0, 90);
    await choose(page, "slice", /^across x/);
    await faces(90, 0);
    await choose(page, "slice", /^oblique plane$/);
    await faces(-45, 0);
    await finalPicture(page);
    await shot(page, "plane");
    await choose(page, "shape", /^sphere/);
    const { mapping, plane } = await lastPatch(page, "geometry");
    assert.deepEqual([mapping, plane], ["sphere", null]);
    await page.locator("#panel .panel-note", { hasText: /^An oblique plane needs/ }).waitFor();
    const offered = await control(page, "slice").locator("option").allTextContents();
    assert.ok(!offered.includes("oblique plane"), `${offered}`);
    await faces(0, 35);
  }));

test("a region is given by ranges, a filter and the polygon of a file", () =>
  withPage(async (page) => {
    await unfold(page, "Region");
    await type(page, "lon from \\(°E\\)", -30);
    await type(page, "lon to \\(°E\\)", 40);
    const [low, high] = await lastPatch(page, "region", "x");
    assert.deepEqual([low, high], [-30, 40]);
    await finalPicture(page);
    await choose(page, "winds only where", /^cloud$/);
    await page.locator("#panel .panel-note", { hasText: /^Winds where cloud is/ }).waitFor();
    const [filter] = await lastPatch(page, "region", "where");
    assert.equal(filter.field, "cloud");
    assert.ok(filter.range[0] < filter.range[1], `${filter.range}`);
    const ring = [
      [-30, 0],
      [40, 0],
      [40, 60],
      [-30, 0],
    ];
    const polygon = { type: "Polygon", coordinates: [ring] };
    const file = (value) => ({
      name: "land.geojson",
      mimeType: "application/geo+json",
      buffer: Buffer.from(JSON.stringify(value)),
    });
    const chosen = page.locator('#panel input[type="file"]');
    await chosen.setInputFiles(file({ type: "Point", coordinates: [0, 0] }));
    await page.locator("#panel .panel-note", { hasText: /land.geojson: .*no Polygon/ }).waitFor();
    await chosen.setInputFiles(file({ type: "Feature", geometry: polygon }));
    await page.locator("#panel .panel-note", { hasText: /^Within a polygon/ }).waitFor();
    assert.deepEqual(await lastPatch(page, "region", "polygon"), polygon);
    await finalPicture(page);
    await page.locator("#panel button", { hasText: /^everything$/ }).click();
    assert.equal(await lastPatch(page, "region"), null);
    await page.waitForFunction(() => !location.hash.includes("region"));
  }));

test("the probe tells distance and bearing from a position that is kept", () =>
  withPage(async (page) => {
    await unfold(page, "Probe");
    const values = page.locator("#panel .probe-values dd").first();
    await values.waitFor();
    await page.locator("#panel button", { hasText: /^Measure from here$/ }).click();
    const before = Number(await page.locator("#probe-y").inputValue());
    await page.locator("#probe-y").fill(String(before + 10));
    await page.locator("#probe-y").press("Enter");
    const way = page.locator("#panel .probe-words", { hasText: /towards/ });
    await way.waitFor();
    const [, km, bearing] = /([\d.]+) km towards ([\d.]+)°/.exec(await way.textContent());
    const moved = Number(await page.locator("#probe-y").inputValue()) - before;
    assert.ok(Math.abs(km - moved * 111.195) < 0.6, `${km} km for ${moved} degrees`);
    assert.equal(Number(bearing), 0);
    await page.locator("#panel button", { hasText: /^End measuring$/ }).click();
    await way.waitFor({ state: "hidden" });
  }));

test("a globe is offered for longitudes, and heights replace the vertical axis", () =>
  withPage(async (page) => {
    await unfold(page, "Place > More");
    await choose(page, "shape", /^sphere/);
    assert.equal(await lastPatch(page, "geometry", "mapping"), "sphere");
    await choose(page, "shape", /^flat/);
    await type(page, "vertical stretch", 3);
    assert.deepEqual(await lastPatch(page, "geometry", "scale"), [1, 1, 3]);
    await type(page, "stretch in x", 2);
    assert.deepEqual(await lastPatch(page, "geometry", "scale"), [2, 1, 3]);
    const heights = await control(page, "height field").locator("option").allTextContents();
    assert.ok(heights.length >= 2, `${heights}`);
    await control(page, "height field").selectOption({ label: heights[1] });
    assert.match(await lastPatch(page, "geometry", "heightField"), /./);
    const asked = page.waitForRequest(/\/probe\?index=\d+,\d+,\d+&heightField=\w+&step=0$/);
    await page.locator("#probe-button").click();
    await asked;
    await page.locator("#probe-button").click();
    await page.locator("#dataset").selectOption("tornado");
    await page.waitForFunction(() => location.hash.includes("%22tornado%22"));
    await finalPicture(page);
    await unfold(page, "Place");
    assert.equal(await isShown(page, "shape"), false);
  }));

test("colour by direction has compass labels, by a scalar its name", () =>
  withPage(async (page) => {
    assert.equal(await isShown(page, "scalar"), false);
    await choose(page, "colour by", /^direction$/);
    assert.equal(await lastPatch(page, "vector", "color", "by"), "direction");
    assert.equal(await isShown(page, "scalar"), false);
    await choose(page, "colour by", /^a scalar field$/);
    assert.equal(await isShown(page, "scalar"), true);
    const { by, field, range } = await lastPatch(page, "vector", "color");
    assert.deepEqual([by, range], ["scalar", null]);
    const offered = await control(page, "scalar").locator("option").allTextContents();
    assert.ok(offered.some((text) => text.startsWith(field)));
    await choose(page, "colour by", /^height and rise$/);
    assert.equal(await isShown(page, "share of rise", "input"), true);
    await choose(page, "colour by", /^constant/);
    assert.equal(await isShown(page, "share of rise", "input"), false);
    assert.equal(await isShown(page, "map"), false, "a constant colour has no map");
    await linkSays(page, "vector", "color", "by", "constant");
    await control(page, "colour", "input").fill("#ff8000");
    assert.equal(await lastPatch(page, "vector", "color", "constant"), "#ff8000");
  }));

// --- line motion: checks the patches only, which do not depend on the rendered picture -------

const moves = (page) =>
  page.evaluate(() =>
    window.patches
      .filter(({ patch }) => patch.vector?.motion?.time !== undefined)
      .map(({ at, rev, patch }) => ({ at, rev, time: patch.vector.motion.time })),
  );

test("line motion follows the frame rate, and the link is updated when it stops", () =>
  withPage(async (page) => {
    await unfold(page, "Time");
    assert.equal(await isShown(page, "cycles a step", "input"), false);
    const flow = control(page, "animate lines", "input");
    await flow.check();
    assert.equal(await lastPatch(page, "vector", "motion", "mode"), "phase");
    assert.equal(await isShown(page, "cycles a step", "input"), true);
    await page.waitForFunction(
      () => window.patches.filter(({ patch }) => patch.vector?.motion?.time > 0).length >= 8,
    );
    const hash = await page.evaluate(() => location.hash);
    assert.ok(!/%22time%22/.test(hash), "the link is not updated during the motion");
    await flow.uncheck();
    const sent = await moves(page);
    for (let n = 1; n < sent.length; n++) {
      assert.ok(sent[n].time > sent[n - 1].time, "the time increases");
      assert.ok(sent[n].at - sent[n - 1].at > 60, "at most 15 patches a second");
    }
    await page.waitForTimeout(300);
    assert.equal((await moves(page)).length, sent.length, "no patch is sent after the stop");
    await linkSays(page, "vector", "motion", "time", sent.at(-1).time);
    await finalPicture(page);
  }));

test("a hidden page stops line motion", () =>
  withPage(async (page) => {
    await unfold(page, "Time");
    await control(page, "animate lines", "input").check();
    await page.waitForFunction(
      () => window.patches.filter(({ patch }) => patch.vector?.motion?.time > 0).length >= 3,
    );
    const hide = (hidden) =>
      page.evaluate((value) => {
        Object.defineProperty(document, "hidden", { value, configurable: true });
        document.dispatchEvent(new Event("visibilitychange"));
      }, hidden);
    await hide(true);
    const before = (await moves(page)).length;
    await page.waitForTimeout(500);
    assert.equal((await moves(page)).length, before);
    await hide(false);
    await page.waitForFunction(
      (count) =>
        window.patches.filter(({ patch }) => patch.vector?.motion?.time > 0).length >= count + 3,
      before,
    );
    await choose(page, "texture", /^still$/);
    await page.waitForFunction(() => {
      const last = window.patches.at(-1).patch.vector?.motion;
      return last?.mode === "still";
    });
    const unchecked = page.locator("input:not(:checked)");
    await control(page, "animate lines", "input").and(unchecked).waitFor({ state: "attached" });
    assert.equal(await lastPatch(page, "vector", "motion", "mode"), "still");
  }));

test("screenshots of the open panel", async () => {
  const folders = [
    "Line shape",
    "Kernels and jitter",
    "Section",
    "Place",
    "Camera",
    "Depth and background",
    "Time",
    "Method",
    "Quality",
  ];
  const windows = [
    ["hd", { viewport: { width: 1280, height: 720 } }],
    ["narrow", { viewport: { width: 360, height: 800 }, hasTouch: true, isMobile: true }],
  ];
  for (const [name, options] of windows) {
    await withPage(async (page) => {
      await somePicture(page);
      await shot(page, `panel-${name}`);
      await unfold(page, ...folders);
      const wide = await page.evaluate(() => {
        const panel = document.querySelector("#panel");
        return panel.scrollWidth - panel.clientWidth;
      });
      assert.ok(wide <= 0, `the panel is ${wide} px too wide`);
      for (const [part, title] of [
        ["lines", "Line shape"],
        ["place", "Place"],
        ["method", "Method"],
      ]) {
        await page
          .locator("#panel .lil-title")
          .filter({ hasText: new RegExp(`^${title}$`) })
          .first()
          .evaluate((element) => element.scrollIntoView());
        await page.waitForTimeout(250); // animation of the folders
        await shot(page, `panel-${name}-${part}`);
      }
    }, options);
  }
});
