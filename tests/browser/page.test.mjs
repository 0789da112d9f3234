// The page in a real browser against the real daemon: the main user actions and their results.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  assertDrawn,
  control,
  drag,
  finalPicture,
  ownPage,
  patience,
  pictureBox,
  pixels,
  sharedDaemon,
  shot,
  somePicture,
  state,
  watchFrames,
  watchPatches,
} from "./support.mjs";

const shared = sharedDaemon();
const { withPage } = shared;

const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };

// Waits until the colour maps are loaded and the legend shows one.
const mapsAreShown = (page) =>
  page.waitForFunction(() =>
    /linear-gradient/.test(document.querySelector(".legend-strip").style.background),
  );

test("the climate sample is shown within 3 s of load and its final frame soon after", (t) =>
  withPage(
    async (page) => {
      const loaded = Date.now();
      await somePicture(page, 3000 * patience);
      t.diagnostic(`first picture ${Date.now() - loaded} ms after load`);
      await finalPicture(page);
      t.diagnostic(`final picture ${Date.now() - loaded} ms after load`);
      assert.equal(await page.locator("#dataset").inputValue(), "climate");
      const stats = await pixels(page);
      assertDrawn(stats);
      const { width, height } = await pictureBox(page);
      assert.deepEqual([stats.width, stats.height], [Math.round(width), Math.round(height)]);
      assert.equal(await page.locator("#mark").textContent(), "final");
      assert.match(await page.locator("#hud-times").textContent(), /render [\d.]+ · encode [\d.]+/);
      assert.equal(await page.locator("#status").textContent(), "live");
    },
    { settle: false },
  ));

test("pictures above the server's pixel limit are not requested", async (t) => {
  const args = ["tornado", "--max-pixels", "1000000"];
  const viewport = { width: 1920, height: 1080 };
  const { page } = await ownPage(t, shared.browser, { args, viewport });
  await finalPicture(page);
  const { width, height } = await state(page);
  const drawn = Number(width) * Number(height);
  assert.ok(drawn <= 1_000_000 && drawn > 990_000, `${width} x ${height}`);
  assert.equal(await page.locator("#alert").isVisible(), false);
});

test("a drag rotates the volume and ends in a final frame", () =>
  withPage(async (page) => {
    const before = await state(page);
    const first = await pixels(page);
    await drag(page, 160, 60);
    await finalPicture(page);
    const after = await state(page);
    // The volume follows the pointer: dragging right moves the eye west, dragging down moves it up.
    assert.ok(Number(after.azimuth) < Number(before.azimuth) - 10, `${after.azimuth}`);
    assert.ok(Number(after.elevation) > Number(before.elevation) + 5, `${after.elevation}`);
    assert.ok(Number(after.seq) >= Number(before.seq) + 2, "moving frames precede the final one");
    const second = await pixels(page);
    assertDrawn(second);
    assert.notEqual(second.hash, first.hash);
    await shot(page, "dragged");
  }));

test("the right button pans, the wheel zooms", () =>
  withPage(async (page) => {
    const before = await state(page);
    const box = await pictureBox(page);
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.wheel(0, -300);
    await page.waitForFunction(
      (d) => Number(document.querySelector("#picture").dataset.distance) < d,
      0.8 * Number(before.distance),
    );
    await finalPicture(page);
    const near = { ...(await state(page)), ...(await pixels(page)) };
    await page.mouse.down({ button: "right" });
    await page.mouse.move(box.x + box.width / 2 + 80, box.y + box.height / 2, { steps: 4 });
    await page.mouse.up({ button: "right" });
    await finalPicture(page);
    const after = await state(page);
    assert.equal(after.azimuth, before.azimuth);
    assert.equal(after.elevation, before.elevation);
    assert.equal(after.distance, near.distance);
    const moved = await pixels(page);
    assertDrawn(moved);
    assert.notEqual(moved.hash, near.hash);
  }));

test("every dataset of the picker can be shown", () =>
  withPage(async (page) => {
    const ids = await page.locator("#dataset option").evaluateAll((all) => all.map((o) => o.value));
    assert.ok(
      ["climate", "efield", "tornado"].every((id) => ids.includes(id)),
      `${ids}`,
    );
    const hashes = new Set([(await pixels(page)).hash]);
    for (const id of ids.filter((one) => one !== "climate")) {
      await page.locator("#dataset").selectOption(id);
      await page.waitForFunction((want) => location.hash.includes(`%22${want}%22`), id);
      await finalPicture(page);
      const stats = await pixels(page);
      assertDrawn(stats);
      hashes.add(stats.hash);
      assert.ok((await page.locator(".legend-entry").count()) >= 1);
      await shot(page, `dataset-${id}`);
    }
    assert.equal(hashes.size, ids.length, "the pictures differ");
  }));

test("playback updates step, slider and time; pausing keeps the step", () =>
  withPage(async (page) => {
    const firstTime = await page.locator("#time-label").textContent();
    const first = await pixels(page);
    await page.locator("#time-fps").selectOption("2"); // slow enough not to wrap around
    await page.locator("#time-play").click();
    await page.waitForFunction(() => Number(document.querySelector("#picture").dataset.step) >= 2);
    assert.equal(await page.locator("#time-play").getAttribute("aria-label"), "Pause");
    await page.locator("#time-play").click();
    await finalPicture(page);
    // The last frame of the playback may still arrive, so all values are read in one call.
    const shown = await page.evaluate(() => ({
      step: document.querySelector("#picture").dataset.step,
      slider: document.querySelector("#time-slider").value,
      words: document.querySelector("#time-step").textContent,
      time: document.querySelector("#time-label").textContent,
    }));
    assert.ok(Number(shown.step) >= 1);
    assert.equal(shown.slider, shown.step);
    assert.match(shown.words, new RegExp(`^step ${Number(shown.step) + 1} of \\d+$`));
    assert.notEqual(shown.time, firstTime);
    assert.notEqual((await pixels(page)).hash, first.hash);
    await page.locator("#time-first").click();
    await page.waitForFunction(() => document.querySelector("#picture").dataset.step === "0");
    await finalPicture(page);
    assert.equal(
      (await pixels(page)).hash,
      first.hash,
      "the first step has the same pixels as before",
    );
  }));

test("another colour map changes the picture and the legend", () =>
  withPage(async (page) => {
    const legend = page.locator(".legend-lines");
    const strip = () => legend.locator(".legend-strip").evaluate((e) => e.style.background);
    await mapsAreShown(page);
    const before = { hash: (await pixels(page)).hash, strip: await strip() };
    assert.ok((await legend.locator(".legend-tick").count()) >= 2, "the legend has ticks");
    await control(page, "map").selectOption("magma");
    await page.waitForFunction(() => location.hash.includes("magma"));
    await finalPicture(page);
    assert.notEqual((await pixels(page)).hash, before.hash);
    assert.notEqual(await strip(), before.strip);
    await control(page, "colour by").selectOption({
      label: await page
        .locator("#panel option", {
          hasText: /^magnitude/,
        })
        .first()
        .textContent(),
    });
    await page.waitForFunction(() =>
      /magnitude/.test(document.querySelector(".legend-lines .legend-name").textContent),
    );
    assert.match(await legend.locator(".legend-units").textContent(), /^m s⁻¹$/);
    await shot(page, "magnitude");
  }));

test("lines and medium can be switched off and on", () =>
  withPage(async (page) => {
    const all = await pixels(page);
    const switches = page
      .locator("#panel .lil-controller.lil-boolean", {
        has: page.locator(".lil-name", { hasText: /^shown$/ }),
      })
      .locator("input");
    await switches.nth(0).uncheck();
    await page.waitForFunction(() => document.querySelector(".legend-lines") === null);
    await finalPicture(page);
    const medium = await pixels(page);
    assert.notEqual(medium.hash, all.hash);
    assertDrawn(medium);
    await switches.nth(0).check();
    await switches.nth(1).uncheck();
    await page.waitForFunction(() => document.querySelector(".legend-medium") === null);
    await finalPicture(page);
    const lines = await pixels(page);
    assert.notEqual(lines.hash, medium.hash);
    await switches.nth(1).check();
    await page.waitForFunction(() => document.querySelector(".legend-medium") !== null);
    await finalPicture(page);
    assert.equal((await pixels(page)).hash, all.hash, "the initial picture is restored");
  }));

test("a link restores the same pixels in another window", () =>
  withPage(async (page) => {
    await drag(page, -90, 25);
    await control(page, "map").selectOption("plasma");
    await finalPicture(page);
    await page.waitForFunction(() => /plasma/.test(location.hash) && /camera/.test(location.hash));
    const here = await pixels(page);
    await withPage(
      async (other) => {
        const there = await pixels(other);
        assert.equal(there.hash, here.hash);
        const { azimuth } = await state(page);
        assert.equal((await state(other)).azimuth, azimuth);
      },
      { path: new URL(page.url()).hash },
    );
  }));

test("the view is restored on reload and in a second tab", () =>
  withPage(async (page) => {
    await page.reload({ waitUntil: "load" });
    await finalPicture(page);
    assertDrawn(await pixels(page));
    const second = await page.context().newPage();
    await second.goto(page.url(), { waitUntil: "load" });
    await finalPicture(second);
    assertDrawn(await pixels(second));
  }));

test("a link to an unknown dataset shows no other one until it is chosen", () =>
  withPage(
    async (page) => {
      await page.locator("#datasets-note", { hasText: /no dataset “nowhere”/ }).waitFor();
      await page.locator(".card").first().click();
      await finalPicture(page);
      assert.equal(await page.locator("#dataset").inputValue(), "tornado");
      assertDrawn(await pixels(page));
    },
    { path: '#!{"dataset":"nowhere"}', settle: false },
  ));

test("a link with a value out of range names the value and shows the remaining view", () =>
  withPage(
    async (page) => {
      await page.locator("#alert").waitFor();
      assert.match(
        await page.locator("#alert-text").textContent(),
        /length: must be a number from 0 to 10, not -5/,
      );
      assert.equal(await page.locator("#dataset").inputValue(), "climate");
      assertDrawn(await pixels(page));
    },
    { path: '#!{"dataset":"climate","vector":{"length":-5}}', alert: true },
  ));

test("after a server is killed the picture is dimmed and the page reconnects", async (t) => {
  const { daemon, page } = await ownPage(t, shared.browser, {
    initScript: [watchFrames, watchPatches],
  });
  await finalPicture(page);
  await control(page, "map").selectOption("plasma");
  await page.locator("#time-next").click();
  await drag(page, 70, -20);
  await finalPicture(page);
  const before = await pixels(page);
  const lastFrame = () => page.evaluate(() => window.frameHeaders.at(-1));
  const frameBefore = await lastFrame();
  assert.equal(frameBefore.step, 1);
  await daemon.kill("SIGKILL");
  await page.waitForFunction(
    () =>
      document.documentElement.dataset.connection === "waiting" &&
      /lost/.test(document.querySelector("#status").textContent),
  );
  assert.equal((await pixels(page)).hash, before.hash, "the last picture remains");
  await page.evaluate(() => (window.patches.length = 0));
  assert.match(
    await page.locator("#picture").evaluate((e) => getComputedStyle(e).filter),
    /brightness/,
  );
  await shot(page, "lost");
  await daemon.start();
  await page.waitForFunction(() => document.documentElement.dataset.connection === "live", null, {
    timeout: 20_000 * patience,
  });
  await finalPicture(page);
  assert.equal((await pixels(page)).hash, before.hash, "the same view as before");
  const frame = await lastFrame();
  const summary = ({ final, step, width, height, codec, quality, method, level, chosen }) => ({
    ...{ final, step, width, height, codec, quality, method, level },
    view: chosen.view,
  });
  assert.deepEqual(summary(frame), summary(frameBefore));
  assert.equal(frame.final, true);
  const patches = await page.evaluate(() => window.patches.map(({ patch }) => patch));
  assert.equal(patches.length, 1, "the whole view in one patch");
  assert.equal(patches[0].vector.color.map, "plasma");
  // The browser logs the failed connections; there must be no other errors.
  const others = page.faults.filter((text) => !/WebSocket|ERR_CONNECTION_REFUSED/.test(text));
  assert.deepEqual(others, []);
});

test("a restarted server with other datasets shows one without repeated requests", async (t) => {
  const { daemon, page } = await ownPage(t, shared.browser, { args: ["tornado"] });
  let messages = 0;
  page.on("websocket", (socket) => socket.on("framesent", () => (messages += 1)));
  await finalPicture(page);
  await daemon.kill("SIGKILL");
  await daemon.start("efield");
  await page.waitForFunction(() => document.querySelector("#dataset").value === "efield", null, {
    timeout: 20_000 * patience,
  });
  await finalPicture(page);
  assertDrawn(await pixels(page));
  messages = 0;
  await page.waitForTimeout(1000);
  assert.ok(messages < 10, `${messages} messages in a second of rest`);
});

test("the picture keeps its size while a dataset opens", async () => {
  // Runs in the page before its own scripts.
  const watchSize = () => {
    window.sizes = new Set();
    document.addEventListener("DOMContentLoaded", () => {
      const canvas = document.querySelector("#picture");
      const note = () => window.sizes.add(`${canvas.clientWidth} x ${canvas.clientHeight}`);
      note();
      new ResizeObserver(note).observe(canvas);
    });
  };
  for (const size of [phone, {}, { viewport: { width: 900, height: 700 } }]) {
    const options = { ...size, initScript: watchSize };
    await withPage(async (page) => {
      const sizes = await page.evaluate(() => [...window.sizes]);
      assert.equal(sizes.length, 1, `${sizes.join(", ")} in ${JSON.stringify(size)}`);
    }, options);
  }
});

test("every function is usable by keyboard", () =>
  withPage(async (page) => {
    const start = await state(page);
    const until = (key, value) =>
      page.waitForFunction(
        ([k, v]) => document.querySelector("#picture").dataset[k] === v,
        [key, value],
      );
    await page.keyboard.press("ArrowRight");
    await until("azimuth", (Number(start.azimuth) - 5).toFixed(1));
    await page.keyboard.press("ArrowDown");
    await until("elevation", (Number(start.elevation) + 5).toFixed(1));
    await page.keyboard.press("+");
    await page.waitForFunction(
      (d) => Number(document.querySelector("#picture").dataset.distance) < d,
      Number(start.distance),
    );
    await page.keyboard.press("5");
    await until("elevation", "90.0");
    await page.keyboard.press("3");
    await until("azimuth", "90.0");
    await until("elevation", "0.0");
    await page.keyboard.press("o");
    await finalPicture(page);
    assert.equal(await control(page, "projection").inputValue(), "orthographic");
    assertDrawn(await pixels(page));
    await page.keyboard.press("o");
    await page.keyboard.press("0");
    await finalPicture(page);
    await until("azimuth", start.azimuth);
    await page.keyboard.press("]");
    await until("step", "1");
    await page.keyboard.press("[");
    await until("step", "0");
    await page.keyboard.press("Space");
    await page.waitForFunction(() => Number(document.querySelector("#picture").dataset.step) >= 1);
    await page.keyboard.press("Space");
    assert.equal(await page.locator("#hud-times").isVisible(), false);
    await page.keyboard.press("\\");
    assert.equal(await page.locator("#hud-times").isVisible(), true);
    await page.keyboard.press("\\");
    assert.equal(await page.locator("#hud-times").isVisible(), false);
    await page.keyboard.press("a");
    const about = page.locator("#about");
    assert.match(await about.textContent(), /percent cloudiness/);
    assert.match(await about.textContent(), /m s⁻¹/);
    await shot(page, "about");
    await page.keyboard.press("Escape");
    assert.equal(await about.isVisible(), false);
    await page.keyboard.press("?");
    assert.equal(await page.locator("#help").isVisible(), true);
    await shot(page, "help");
    await page.keyboard.press("Escape");
    assert.equal(await page.locator("#help").isVisible(), false);
    // A focused control handles the keys itself.
    await page.locator("#time-first").click();
    await until("step", "0");
    await page.locator("#time-slider").focus();
    const { azimuth } = await state(page);
    await page.keyboard.press("ArrowRight");
    await until("step", "1");
    await finalPicture(page);
    assert.equal((await state(page)).azimuth, azimuth);
  }));

test("the page works under a base path", async (t) => {
  const { page } = await ownPage(t, shared.browser, { basePath: "/a/b/" });
  await finalPicture(page);
  assertDrawn(await pixels(page));
  await mapsAreShown(page);
  assert.deepEqual(page.faults, []);
});

test("on a high-density screen the picture has the screen's resolution", () =>
  withPage(
    async (page) => {
      const box = await pictureBox(page);
      const stats = await pixels(page);
      assert.deepEqual(
        [stats.width, stats.height],
        [Math.round(2 * box.width), Math.round(2 * box.height)],
      );
    },
    { viewport: { width: 900, height: 600 }, deviceScaleFactor: 2 },
  ));

test("a resized window gets a picture of that size", () =>
  withPage(async (page) => {
    await page.setViewportSize({ width: 1000, height: 700 });
    const box = await pictureBox(page);
    await page.waitForFunction(
      (width) => document.querySelector("#picture").width === width,
      Math.round(box.width),
    );
    await finalPicture(page);
    assertDrawn(await pixels(page));
  }));

test("every control has a name, and nothing overflows a narrow window", async () => {
  for (const width of [1440, 360]) {
    await withPage(
      async (page) => {
        const overflow = await page.evaluate(
          () => document.documentElement.scrollWidth - innerWidth,
        );
        assert.ok(overflow <= 0, `${overflow} px too wide at ${width}`);
        const cdp = await page.context().newCDPSession(page);
        const { nodes } = await cdp.send("Accessibility.getFullAXTree");
        const roles = new Set([
          "button",
          "combobox",
          "checkbox",
          "slider",
          "spinbutton",
          "textbox",
          "image",
          "img",
          "link",
          "ColorWell",
        ]);
        const nameless = nodes.filter(
          (node) => !node.ignored && roles.has(node.role?.value) && !node.name?.value,
        );
        assert.deepEqual(
          nameless.map((node) => [node.role.value, node.properties]),
          [],
        );
        assert.ok(nodes.filter((node) => roles.has(node.role?.value)).length > 20);
      },
      { viewport: { width, height: 800 } },
    );
  }
});

test("screenshots of the usual windows", async () => {
  const windows = [
    ["desktop", { viewport: { width: 1440, height: 900 } }],
    ["desktop-light", { viewport: { width: 1440, height: 900 }, colorScheme: "light" }],
    ["small", { viewport: { width: 1024, height: 768 } }],
    ["phone", phone],
  ];
  for (const [name, options] of windows) {
    await withPage(async (page) => {
      await page.locator(".legend-entry").first().waitFor();
      await shot(page, name);
    }, options);
  }
});
