// <windsplat-view> in a page of another origin, in a real browser against the real daemon.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { test } from "node:test";
import { assertDrawn, shot } from "../support.mjs";
import {
  event,
  finalOf,
  pixelsOf,
  sessions,
  sessionsOpened,
  sharedSite,
  toldOf,
  until,
} from "./site.mjs";

const shared = sharedSite({ args: ["tornado", "climate"] });
const tornado = `<windsplat-view id="a" src="SRC" dataset="tornado"></windsplat-view>`;
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

async function drag(page, selector, dx, dy) {
  const box = await page.locator(selector).boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + dx, y + dy, { steps: 8 });
  await page.mouse.up();
}

const cameraOf = (page, id = "a") =>
  page.evaluate((name) => document.getElementById(name).camera, id);

test("the element shows a picture of another origin, and tells its frames", async (t) => {
  const page = await shared.pageWith(t, `<p>A text of the site.</p>${tornado}`);
  await finalOf(page);
  assertDrawn(await pixelsOf(page));
  const frames = await toldOf(page, "frame");
  const { header, view } = frames.at(-1).detail;
  assert.deepEqual([header.width, header.height], [480, 300]);
  assert.equal(view.dataset, "tornado");
  assert.deepEqual(await toldOf(page, "error"), []);
  assert.deepEqual(page.faults, [], "also with a strict content security policy");
  await shot(page, "foreign-page");
});

test("a drag turns the camera and the picture; the wheel waits for a click", async (t) => {
  const page = await shared.pageWith(t, tornado);
  await finalOf(page);
  const [before, camera] = [await pixelsOf(page), await cameraOf(page)];
  const box = await page.locator("#a").boundingBox();
  await page.mouse.move(box.x + 100, box.y + 100);
  await page.mouse.wheel(0, -200);
  await page.waitForTimeout(100);
  assert.deepEqual(await cameraOf(page), camera, "the wheel is left to the page");
  await drag(page, "#a", 80, 20);
  const { detail } = await event(page, "view", (one) => one.detail.camera !== null);
  assert.ok(detail.view.camera.eye.length === 3 && detail.view.image === undefined);
  await finalOf(page);
  const turned = await cameraOf(page);
  assert.notDeepEqual(turned.eye, camera.eye);
  assert.notEqual((await pixelsOf(page)).hash, before.hash);
  await page.mouse.wheel(0, -200);
  await until(page, async () => (await cameraOf(page)).height < turned.height, "the wheel zooms");
  await page.keyboard.press("0");
  await finalOf(page);
  const whole = await cameraOf(page);
  assert.deepEqual(whole.eye, camera.eye, "the key 0 shows the whole again");
});

test("keys turn a picture that has the focus, and it is accessible", async (t) => {
  const page = await shared.pageWith(
    t,
    `<main><h1>Site</h1>${tornado.replace(" id", ' label="A storm" controls id')}</main>`,
  );
  await finalOf(page);
  const picture = page.getByRole("img", { name: "A storm" });
  const { eye } = await cameraOf(page);
  await page.evaluate(() => document.querySelector("#a").focus());
  assert.equal(await picture.evaluate((one) => one.matches(":focus")), true);
  await page.keyboard.press("ArrowLeft");
  await until(page, async () => (await cameraOf(page)).eye[0] !== eye[0], "the arrow key turns it");
  await page.getByRole("button", { name: "Whole picture" }).click();
  await until(page, async () => (await cameraOf(page)).eye[0] === eye[0], "the button resets it");
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run("main"));
  assert.deepEqual(
    violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`),
    [],
  );
});

test("two elements show different datasets, and a removed one closes its stream", async (t) => {
  const page = await shared.pageWith(
    t,
    tornado + tornado.replace('"a"', '"b"').replace('"tornado"', '"climate" step="1" controls'),
  );
  await finalOf(page, "#a");
  await finalOf(page, "#b");
  await shot(page, "foreign-page-two");
  assert.notEqual((await pixelsOf(page, "#a")).hash, (await pixelsOf(page, "#b")).hash);
  assert.equal(await sessions(shared.daemon), 2);
  const steps = await page.evaluate(() => document.querySelector("#b").description.steps.count);
  assert.equal(await page.evaluate(() => document.querySelector("#b").step), 1);
  assert.ok(steps > 2);
  const opened = await sessionsOpened(shared.daemon);
  await page.evaluate(() => document.body.append(document.querySelector("#a")));
  await finalOf(page, "#a");
  assert.equal(await sessionsOpened(shared.daemon), opened, "a moved node keeps its stream");
  await page.evaluate(() => document.querySelector("#a").remove());
  await until(page, async () => (await sessions(shared.daemon)) === 1, "one stream is left");
  await page.evaluate(() => document.querySelector("#b").remove());
  await until(page, async () => (await sessions(shared.daemon)) === 0, "no stream is left");
});

test("an element that comes back shows its view as it was left", async (t) => {
  const page = await shared.pageWith(t, tornado);
  await finalOf(page);
  await drag(page, "#a", -60, 10);
  await finalOf(page);
  const [camera, before] = [await cameraOf(page), await pixelsOf(page)];
  await page.evaluate(() => {
    window.element = document.querySelector("#a");
    window.element.remove();
  });
  await until(page, async () => (await sessions(shared.daemon)) === 0, "no stream is left");
  await page.evaluate(() => {
    window.told.length = 0;
    document.body.append(window.element);
  });
  await finalOf(page);
  assert.deepEqual((await cameraOf(page)).eye, camera.eye);
  assert.equal((await pixelsOf(page)).hash, before.hash);
});

test("attributes and properties change the view in any order", async (t) => {
  const page = await shared.pageWith(t, `<div id="place"></div>`);
  await page.evaluate((src) => {
    // As frameworks do: properties first, in any order.
    const element = document.createElement("windsplat-view");
    element.id = "a";
    element.view = { scalars: [] };
    element.src = src;
    element.dataset = "tornado";
    document.querySelector("#place").append(element);
  }, shared.daemon.url);
  await finalOf(page);
  assert.deepEqual((await toldOf(page, "frame")).at(-1).detail.view.scalars, []);
  assert.equal(await page.evaluate(() => document.querySelector("#a").dataset.seq > 0), false);
  await page.evaluate(() => document.querySelector("#a").setAttribute("dataset", "climate"));
  await event(page, "frame", ({ detail }) => detail.final && detail.view.dataset === "climate");
  await page.evaluate(() => document.querySelector("#a").setAttribute("step", "2"));
  await event(page, "frame", ({ detail }) => detail.final && detail.step === 2);
  await page.evaluate(() => (document.querySelector("#a").view = { dataset: "tornado" }));
  await event(page, "frame", ({ detail }) => detail.final && detail.view.scalars.length > 0);
  assert.deepEqual(await toldOf(page, "error"), []);
  await page.evaluate(() => document.querySelector("#a").setAttribute("view", "{"));
  await page.evaluate(() => document.querySelector("#a").setAttribute("step", "-1"));
  const { detail } = await event(page, "error", (one) => /step must be/.test(one.detail.message));
  assert.equal(detail.kind, "attribute");
});

test("properties that were set before the element was defined hold", async (t) => {
  const page = await shared.pageWith(t, `<windsplat-view id="a"></windsplat-view>`, {
    defined: false,
  });
  await page.evaluate(async (src) => {
    Object.assign(document.querySelector("#a"), { src, view: { dataset: "climate", step: 1 } });
    await import("/client/element.js");
  }, shared.daemon.url);
  await finalOf(page);
  const { step, view } = (await toldOf(page, "frame")).at(-1).detail;
  assert.deepEqual([step, view.dataset], [1, "climate"]);
});

test("playback shows one step after another", async (t) => {
  const page = await shared.pageWith(t, tornado.replace('"tornado"', '"climate" controls'));
  await finalOf(page);
  await page.getByRole("button", { name: "Play" }).click();
  await event(page, "frame", ({ detail }) => detail.step === 2);
  await page.getByRole("button", { name: "Pause" }).click();
  await finalOf(page); // after the frames in flight
  const step = await page.evaluate(() => document.querySelector("#a").step);
  await page.waitForTimeout(300);
  assert.equal(await page.evaluate(() => document.querySelector("#a").step), step);
});

test("an unknown dataset is reported once, in words and as a problem", async (t) => {
  const page = await shared.pageWith(t, tornado.replace('"tornado"', '"gone"'));
  const { detail } = await event(page, "error");
  assert.equal(detail.kind, "dataset");
  assert.match(detail.message, /gone/);
  assert.ok(detail.problem.status >= 400);
  assert.match(await page.locator("windsplat-view [part=message]").innerText(), /gone/);
  await shot(page, "foreign-page-gone");
  await page.waitForTimeout(200);
  assert.equal((await toldOf(page, "error")).length, 1);
  await page.evaluate(() => document.querySelector("#a").setAttribute("dataset", "tornado"));
  await finalOf(page);
  assert.equal(await page.locator("windsplat-view [part=message]").innerText(), "");
});

test("an invalid view is written on the default picture, and the controls work", async (t) => {
  const wrong = `<windsplat-view id="a" src="SRC" dataset="climate" controls
    view='{"vector":{"strid":3}}'></windsplat-view>`;
  const page = await shared.pageWith(t, wrong);
  const { detail } = await event(page, "error");
  assert.deepEqual([detail.kind, /strid/.test(detail.message)], ["view", true]);
  await event(page, "frame", (one) => one.detail.final);
  const message = page.locator("windsplat-view [part=message]");
  assert.equal(await message.innerText(), detail.message);
  await shot(page, "foreign-page-invalid");
  await page.getByRole("slider", { name: "Time step" }).fill("2");
  await event(page, "frame", (one) => one.detail.step === 2 && one.detail.final);
  assert.equal(await message.innerText(), "", "until a later change is shown");
  assert.equal((await toldOf(page, "error")).length, 1);
  await page.getByRole("button", { name: "Play" }).click();
  await event(page, "frame", (one) => one.detail.step === 3);
});

test("loading and controls cover nothing of the picture", async (t) => {
  const page = await shared.pageWith(t, tornado.replace('"tornado"', '"climate" controls'));
  const element = page.locator("#a");
  await finalOf(page);
  const [picture, bar] = await Promise.all(
    ["picture", "controls"].map((name) => element.locator(`[part=${name}]`).boundingBox()),
  );
  assert.ok(bar.y >= picture.y + picture.height, "the bar is below the picture");
  assert.ok(bar.y + bar.height <= picture.y + 300.5, "and within the element");
  const loading = element.locator("[part=loading]");
  assert.equal(await loading.isHidden(), true);
  // As if the server told that it loads.
  const shown = await page.evaluate(async () => {
    const element = document.querySelector("#a");
    const [message, line] = ["message", "loading"].map((name) =>
      element.shadowRoot.querySelector(`[part=${name}]`),
    );
    element.live.stream.onMessage({ type: "progress", phase: "loading cloud", done: 0.4 });
    const atOnce = line.hidden;
    while (line.hidden) await new Promise((done) => setTimeout(done, 20));
    const box = line.getBoundingClientRect();
    return [atOnce, message.textContent, line.ariaLabel, line.ariaValueNow, box.height <= 3];
  });
  assert.deepEqual(shown, [true, "", "loading cloud", "40", true]);
  await shot(page, "foreign-page-loading");
  await page.evaluate(() => document.querySelector("#a").change({ step: 1 }));
  await finalOf(page);
  assert.equal(await loading.isHidden(), true, "until the next picture");
});

test("an element opens one stream, also if its properties are set in the same task", async (t) => {
  const page = await shared.pageWith(t, "");
  const warnings = [];
  page.on("console", (one) => warnings.push(one.text()));
  let sockets = 0;
  page.on("websocket", () => (sockets += 1));
  const before = await sessionsOpened(shared.daemon);
  await page.evaluate(async (src) => {
    await customElements.whenDefined("windsplat-view");
    document.body.innerHTML = `<windsplat-view id="a" src="${src}" dataset="tornado"
      view='{"scalars":[]}'></windsplat-view>`;
    const element = document.querySelector("#a");
    element.token = "a-token";
    element.step = 0;
    element.controls = true;
  }, shared.daemon.url);
  await finalOf(page);
  assert.deepEqual((await toldOf(page, "frame")).at(-1).detail.view.scalars, []);
  assert.equal(sockets, 1);
  assert.equal((await sessionsOpened(shared.daemon)) - before, 1);
  assert.deepEqual(warnings, []);
});

test("a refused change is told, and the picture stays", async (t) => {
  const page = await shared.pageWith(t, tornado);
  await finalOf(page);
  await page.evaluate(() => document.querySelector("#a").change({ vector: { stride: -3 } }));
  const { detail } = await event(page, "error");
  assert.equal(detail.kind, "view");
  assert.match(detail.message, /^\/vector\/stride: /);
  assert.equal(detail.problem.errors[0].pointer, "/vector/stride");
  assert.equal(await page.evaluate(() => document.querySelector("#a").view.vector), undefined);
});

test("without interaction pointers and keys do nothing", async (t) => {
  const fixed = tornado.replace("<windsplat-view", '<windsplat-view interactive="false"');
  const page = await shared.pageWith(t, fixed);
  await finalOf(page);
  const camera = await cameraOf(page);
  await drag(page, "#a", 80, 20);
  await page.keyboard.press("ArrowLeft");
  await page.waitForTimeout(150);
  assert.deepEqual(await cameraOf(page), camera);
});

test("an element out of sight is sent no frames until it is scrolled to", async (t) => {
  const page = await shared.pageWith(t, tornado, {
    css: "windsplat-view { width: 480px; height: 300px; margin-top: 3000px; }",
  });
  await page.waitForFunction(() => document.querySelector("#a").description !== null);
  await page.evaluate(() => document.querySelector("#a").change({ scalars: [] }));
  await page.waitForTimeout(600);
  const drawn = async () =>
    (await toldOf(page, "frame")).filter(({ detail }) => detail.view?.scalars.length === 0);
  assert.deepEqual(await drawn(), [], "nothing of the change is sent");
  await page.locator("#a").scrollIntoViewIfNeeded();
  await finalOf(page);
  assert.ok((await drawn()).length > 0);
});
