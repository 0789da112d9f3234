// <windsplat-view> as frameworks use it, without one: mounted, removed and moved; properties that
// are set again with every rendering, and removed as null or undefined.
import assert from "node:assert/strict";
import { test } from "node:test";
import { event, finalOf, sessions, sessionsOpened, sharedSite, toldOf, until } from "./site.mjs";

const shared = sharedSite({ args: ["tornado", "climate"] });

// A page with the functions `mount`, `render` and `unmount` in its window.
async function framework(t) {
  const page = await shared.pageWith(t, `<div id="one"></div><div id="two"></div>`);
  await page.evaluate(async (src) => {
    await customElements.whenDefined("windsplat-view");
    const place = (id) => document.getElementById(id);
    window.render = (properties) => Object.assign(place("a"), properties);
    window.mount = (properties, where = "one") => {
      const element = document.createElement("windsplat-view");
      Object.assign(element, { id: "a", src, ...properties });
      place(where).append(element);
    };
    window.unmount = () => place("a").remove();
    window.move = (where) => place(where).append(place("a"));
  }, shared.daemon.url);
  return page;
}

const call = (page, name, ...words) =>
  page.evaluate(([which, given]) => window[which](...given), [name, words]);
const seen = (page) =>
  page.evaluate(() => {
    const { view, camera, pick, controls } = document.querySelector("#a");
    return { view, eye: camera?.eye, pick, controls };
  });

test("elements that come and go leave no stream; one that moves keeps its own", async (t) => {
  const page = await framework(t);
  const before = await sessionsOpened(shared.daemon);
  // Twice in a task, as frameworks do in their strict modes.
  await page.evaluate(() => {
    window.mount({ dataset: "tornado" });
    window.unmount();
    window.mount({ dataset: "tornado" });
  });
  await finalOf(page);
  await call(page, "move", "two");
  await finalOf(page);
  assert.equal((await sessionsOpened(shared.daemon)) - before, 1);
  for (let n = 0; n < 5; n++) {
    await call(page, "unmount");
    await call(page, "mount", { dataset: "climate" });
  }
  await finalOf(page);
  await until(page, async () => (await sessions(shared.daemon)) === 1, "one stream is left");
  assert.equal((await seen(page)).view.dataset, "climate");
  await call(page, "unmount");
  await until(page, async () => (await sessions(shared.daemon)) === 0, "no stream is left");
  assert.deepEqual(await toldOf(page, "error"), []);
});

test("the same view again leaves the camera of the user; reset() shows it anew", async (t) => {
  const page = await framework(t);
  const properties = { dataset: "tornado", view: { scalars: [] } };
  await call(page, "mount", properties);
  await finalOf(page);
  const { eye } = await seen(page);
  await page.evaluate(() => document.querySelector("#a").focus());
  await page.keyboard.press("ArrowLeft");
  await until(page, async () => (await seen(page)).eye[0] !== eye[0], "the arrow key turns it");
  const turned = await seen(page);
  await call(page, "render", properties);
  await finalOf(page);
  assert.deepEqual(await seen(page), turned);
  await page.evaluate(() => document.querySelector("#a").reset());
  await finalOf(page);
  assert.deepEqual((await seen(page)).view, { dataset: "tornado", scalars: [] });
  assert.deepEqual((await seen(page)).eye, eye);
});

test("properties change before and after mounting, and null removes them", async (t) => {
  const page = await framework(t);
  await call(page, "mount", { dataset: "climate", view: { scalars: [] }, step: 2, pick: true });
  await event(page, "frame", ({ detail }) => detail.final && detail.step === 2);
  assert.deepEqual((await seen(page)).view, { dataset: "climate", scalars: [], step: 2 });
  assert.equal((await seen(page)).pick, true);
  await page.locator("#a").click({ position: { x: 240, y: 150 } });
  await event(page, "pick");
  await call(page, "render", { view: null, controls: true, pick: false });
  await finalOf(page);
  assert.deepEqual((await seen(page)).view, { dataset: "climate", step: 2 });
  await page.evaluate(() => window.render({ step: undefined, label: undefined, controls: null }));
  await page.evaluate(() => window.render({ interactive: undefined, dataset: undefined }));
  await finalOf(page);
  assert.deepEqual(
    await page.evaluate(() => document.querySelector("#a").getAttributeNames().sort()),
    ["id", "src"],
  );
  assert.deepEqual((await seen(page)).view, { dataset: "climate" }, "it stays");
  assert.deepEqual(await toldOf(page, "error"), []);
});
