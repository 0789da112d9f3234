// Dataset cards, a page without datasets, a cancelled load, and a lost connection.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  drag,
  finalPicture,
  pixels,
  sharedDaemon,
  shot,
  state,
  watchFrames,
  watchPatches,
} from "./support.mjs";

const shared = sharedDaemon({ page: { initScript: [watchFrames, watchPatches] } });

// `alter` may change a message of the server, withhold it (null) or pass it on (true); while the
// wire is frozen, no message arrives.
function withPage(run, { alter, ...options } = {}) {
  const wire = {};
  const stand = (socket) => {
    wire.say = (message) => socket.send(JSON.stringify(message));
    wire.close = (code) => socket.close({ code });
    const late = [];
    wire.thaw = () => {
      wire.frozen = false;
      for (const data of late.splice(0)) socket.send(data);
    };
    const server = socket.connectToServer();
    server.onMessage((data) => {
      if (wire.frozen) {
        late.push(data);
        return;
      }
      const kept = typeof data === "string" ? alter(JSON.parse(data), wire) : true;
      if (kept !== null) socket.send(kept === true ? data : JSON.stringify(kept));
    });
  };
  return shared.withPage((page) => run(page, wire), {
    ...options,
    prepare: async (page) => {
      await options.prepare?.(page);
      if (alter !== undefined) await page.routeWebSocket(/\/v1\/stream/, stand);
    },
  });
}

const card = (page, title) => page.locator(".card", { hasText: title });

test("a first visit shows a picture, and each card opens its dataset", () =>
  withPage(async (page) => {
    assert.equal(await page.locator("#datasets").isVisible(), false);
    await page.locator("#datasets-button").click();
    assert.equal(await page.locator(".card").count(), 3);
    await page.waitForFunction(() => document.querySelectorAll(".card img").length === 3);
    for (const image of await page.locator(".card img").all()) {
      assert.deepEqual(await image.evaluate((i) => [i.naturalWidth, i.naturalHeight]), [320, 200]);
    }
    await card(page, "Tornado").getByText("64 × 64 × 64 · 12 steps · wind, cloud").waitFor();
    await shot(page, "cards");
    const before = await pixels(page);
    await card(page, "Tornado").click();
    await page.waitForFunction(() => document.title === "Tornado test function · windsplat");
    await finalPicture(page);
    assert.equal(await page.locator("#datasets").isVisible(), false);
    assert.equal(await page.locator("#dataset").inputValue(), "tornado");
    assert.notEqual((await pixels(page)).hash, before.hash);
    const drawn = await page.evaluate(() => window.frameHeaders.at(-1).chosen.view.dataset);
    assert.equal(drawn, "tornado");
  }));

test("card pictures load one at a time, and a failure is shown on its card", () => {
  let running = 0;
  let most = 0;
  return withPage(
    async (page) => {
      await page.keyboard.press("d");
      await card(page, "Electric").getByText("its files are damaged").waitFor();
      await page.waitForFunction(() => document.querySelectorAll(".card img").length === 2);
      assert.equal(most, 1);
    },
    {
      faulty: true, // the browser logs the error response
      prepare: (page) =>
        page.route(/\/frame\.jpg\?width=320&height=200$/, async (route) => {
          running += 1;
          most = Math.max(most, running);
          const problem = { title: "No", status: 422, detail: "its files are damaged" };
          if (route.request().url().includes("efield")) {
            await route.fulfill({ status: 422, json: problem });
          } else {
            await route.fulfill({ response: await route.fetch() });
          }
          running -= 1;
        }),
    },
  );
});

test("cards are usable with arrow keys, Enter and Escape", () =>
  withPage(async (page) => {
    await page.locator("#picture").focus();
    await page.keyboard.press("d");
    const focused = () => page.evaluate(() => document.activeElement.textContent);
    assert.match(await focused(), /^Tornado/);
    await page.keyboard.press("ArrowRight");
    assert.match(await focused(), /^Global/);
    await page.keyboard.press("Escape");
    assert.equal(await page.locator("#datasets").isVisible(), false);
    await page.keyboard.press("d");
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowRight");
    assert.match(await focused(), /^Electric/);
    await page.keyboard.press("Enter");
    await page.waitForFunction(() => /^Electric field/.test(document.title));
    await finalPicture(page);
  }));

test("cards closed and reopened within a frame keep the focus", () =>
  withPage(async (page) => {
    await page.evaluate(() => {
      const [button, dialog] = ["datasets-button", "datasets"].map((id) =>
        document.getElementById(id),
      );
      button.click();
      dialog.close();
      button.click();
      document.querySelectorAll(".card")[1].focus();
    });
    await page.waitForFunction(() => document.querySelectorAll(".card img").length === 3);
    assert.match(await page.evaluate(() => document.activeElement.textContent), /^Global/);
  }));

test("a server without datasets explains how to add one", () =>
  withPage(
    async (page) => {
      await page.getByText("The server has no dataset yet.").waitFor();
      assert.match(await page.locator("#datasets").textContent(), /windsplat serve FILE/);
      assert.equal(await page.locator("#alert").isVisible(), false, "no alert is shown");
      await shot(page, "no-dataset");
    },
    {
      settle: false,
      alter: (message) => (message.type === "hello" ? { ...message, datasets: [] } : true),
      prepare: (page) =>
        page.route(/\/v1\/datasets$/, (r) => r.fulfill({ json: { datasets: [] } })),
    },
  ));

test("a slow dataset has a progress bar, and Cancel returns to the previous view", () =>
  withPage(
    async (page, wire) => {
      await drag(page, 80, 20);
      await finalPicture(page);
      const before = await pixels(page);
      const hash = await page.evaluate(() => window.patches.at(-1).patch.camera);
      wire.frozen = true;
      await page.locator("#dataset").selectOption("tornado");
      const loading = page.locator("#loading");
      await loading.waitFor();
      assert.equal(
        await page.locator("#loading-bar").getAttribute("value"),
        null,
        "the progress is indeterminate",
      );
      wire.say({ type: "progress", id: null, phase: "loading wind", done: 0.25, etaMs: 4000 });
      await page.getByText("loading wind: 25 %, 4 s left").waitFor();
      assert.equal(await page.locator("#loading-bar").evaluate((bar) => bar.value), 0.25);
      await shot(page, "loading");
      await page.locator("#cancel-button").click();
      wire.thaw(); // releases late pictures of the other dataset
      assert.equal(await loading.isVisible(), false);
      await finalPicture(page);
      assert.equal(await page.locator("#dataset").inputValue(), "climate");
      const { view } = await page.evaluate(() => window.frameHeaders.at(-1).chosen);
      assert.equal(view.dataset, "climate");
      assert.deepEqual(view.camera.eye, hash.eye, "the camera is restored too");
      assert.equal((await pixels(page)).hash, before.hash);
      assert.equal(await page.locator("#alert").isVisible(), false);
    },
    { alter: () => true },
  ));

test("a cancelled dataset stays closed despite late messages", () =>
  withPage(
    async (page, wire) => {
      await page.locator("#dataset").selectOption("tornado");
      await page.locator("#loading").waitFor();
      await page.locator("#cancel-button").click();
      await finalPicture(page);
      const problem = { type: "about:blank", title: "Gone", status: 422, detail: "no such file" };
      wire.say({ type: "progress", id: 2, phase: "loading", done: 0.5, etaMs: null });
      wire.say({ type: "error", id: 2, problem });
      if (wire.held !== undefined) wire.say(wire.held);
      await drag(page, 40, 0);
      await finalPicture(page);
      assert.equal(await page.locator("#alert").isVisible(), false);
      assert.equal(await page.locator("#loading").isVisible(), false);
      assert.match(await page.title(), /^Global circulation/);
    },
    {
      alter: (message, wire) => {
        if (message.type !== "opened" || message.dataset.id !== "tornado") return true;
        wire.held = message;
        return null;
      },
    },
  ));

test("a lost connection is shown as offline with the reason, and the button retries at once", () =>
  withPage(
    async (page, wire) => {
      const before = await pixels(page);
      assert.equal(await page.locator("#mark").textContent(), "final");
      wire.close(1008); // policy violation: the page waits long before it reconnects
      await page.locator("#offline").waitFor();
      assert.equal(await page.locator("#mark").textContent(), "offline");
      assert.match(
        await page.locator("#offline-text").textContent(),
        /refused this page.*in \d+ s/,
      );
      assert.equal((await pixels(page)).hash, before.hash, "the last picture remains");
      const { filter } = await page.locator("#picture").evaluate((e) => {
        return { filter: getComputedStyle(e).filter };
      });
      assert.match(filter, /brightness/);
      await shot(page, "offline");
      await page.locator("#retry-button").click();
      await page.waitForFunction(() => document.documentElement.dataset.connection === "live");
      await finalPicture(page);
      assert.equal(await page.locator("#mark").textContent(), "final");
      assert.equal(await page.locator("#offline").isVisible(), false);
      wire.close(4410);
      await page.locator("#offline").waitFor();
      assert.match(await page.locator("#offline-text").textContent(), /long time without input/);
      assert.equal(await page.locator("#mark").textContent(), "offline");
      const { seq } = await state(page);
      await page.locator("#retry-button").click();
      await page.waitForFunction(
        (old) => document.querySelector("#picture").dataset.seq !== old,
        seq,
      );
      await finalPicture(page);
    },
    { alter: () => true },
  ));

for (const [name, options] of [
  ["low", { viewport: { width: 701, height: 503 } }],
  ["phone", { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true }],
]) {
  test(`a small window (${name}) leaves most of the picture free, and nothing overflows`, () =>
    withPage(async (page) => {
      const share = await page.evaluate(() => {
        const area = (element) => {
          const { width, height } = element.getBoundingClientRect();
          return width * height;
        };
        const covered = [...document.querySelectorAll(".legend-entry, .hud")].map(area);
        return covered.reduce((a, b) => a + b, 0) / area(document.querySelector("#picture"));
      });
      assert.ok(share < 0.35, `${Math.round(100 * share)} % covered`);
      const wide = await page.evaluate(
        () => document.documentElement.scrollWidth - document.documentElement.clientWidth,
      );
      assert.ok(wide <= 0);
      await page.locator("#datasets-button").click();
      await page.locator(".card img").first().waitFor();
      const over = await page.locator("#datasets").evaluate((d) => d.scrollWidth - d.clientWidth);
      assert.ok(over <= 0, `${over} px`);
      await shot(page, `cards-${name}`);
    }, options));
}
