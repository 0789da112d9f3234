// The embedded view (?embed) in a real browser: the picture alone, with a link to the whole page,
// and the frames of other sites that may show it. At the end the page on phones, with touch: the
// panel as a sheet, values by tapping, two fingers.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import {
  assertDrawn,
  drag,
  finalPicture,
  launch,
  openPage,
  ownPage,
  pictureBox,
  pixels,
  sharedDaemon,
  shot,
  state,
} from "./support.mjs";

const size = { width: 640, height: 400 };
const view = { dataset: "tornado", annotations: { title: true, legend: true } };
const hash = `#!${encodeURIComponent(JSON.stringify(view))}`;
const shared = sharedDaemon({ args: ["tornado"], page: { viewport: size } });
const { withPage } = shared;

test("the embedded view is the picture alone, with a link to the whole page", () =>
  withPage(
    async (page) => {
      assertDrawn(await pixels(page));
      assert.deepEqual(await pictureBox(page), { x: 0, y: 0, ...size });
      for (const part of ["header", "footer", "#panel", "#hud", ".corner", "#legend"]) {
        assert.equal(await page.locator(part).isVisible(), false, part);
      }
      await shot(page, "embed");
      const link = page.getByRole("link", { name: "open in windsplat" });
      await drag(page, 90, -30);
      await finalPicture(page);
      const embedded = await state(page);
      const [whole] = await Promise.all([page.context().waitForEvent("page"), link.click()]);
      await whole.waitForLoadState();
      await finalPicture(whole);
      assert.equal(await whole.locator("#panel").isVisible(), true);
      const shown = await state(whole);
      assert.deepEqual([shown.azimuth, shown.elevation], [embedded.azimuth, embedded.elevation]);
      assert.equal(new URL(whole.url()).search, "");
    },
    { path: `?embed${hash}` },
  ));

test("drag, wheel and keys move the embedded view; keys of the whole page do nothing", () =>
  withPage(
    async (page) => {
      const first = await state(page);
      await page.mouse.move(300, 200);
      await page.mouse.wheel(0, -300);
      await page.waitForTimeout(200);
      await finalPicture(page);
      const scrolled = await state(page);
      assert.equal(scrolled.distance, first.distance, "the wheel is left to the page around");
      await drag(page, 60, 20);
      await page.mouse.wheel(0, -300);
      await finalPicture(page);
      const zoomed = await state(page);
      assert.ok(Number(zoomed.distance) < Number(first.distance));
      assert.notEqual(zoomed.azimuth, first.azimuth);
      await page.keyboard.press("ArrowLeft");
      await finalPicture(page);
      assert.notEqual((await state(page)).azimuth, zoomed.azimuth);
      for (const key of ["c", "d", "s", "a", "?", "p", "i", "\\"]) await page.keyboard.press(key);
      assert.equal(await page.locator("dialog[open]").count(), 0);
      assert.deepEqual(await pictureBox(page), { x: 0, y: 0, ...size });
    },
    { path: `?embed${hash}` },
  ));

test("a second picture in the address is left out of the embedded view", () =>
  withPage(
    async (page) => {
      assert.deepEqual(await pictureBox(page), { x: 0, y: 0, ...size });
      assert.equal(await page.locator("#beside").isVisible(), false);
    },
    { path: `?embed${hash}&beside=${encodeURIComponent('{"step":0}')}` },
  ));

test("a dataset that is not there is told, in the embedded view and in the whole page", () =>
  withPage(
    async (page) => {
      const missing = `#!${encodeURIComponent(JSON.stringify({ dataset: "gone" }))}`;
      const told = /there is no dataset “gone” on this server/;
      await page.locator("#empty", { hasText: told }).waitFor();
      await shot(page, "embed-missing");
      assert.equal((await state(page)).seq, undefined, "no other dataset is drawn");
      await page.goto(page.url().replace("?embed", "").split("#")[0] + missing);
      await page.locator("#datasets-note", { hasText: told }).waitFor();
      assert.equal((await state(page)).seq, undefined, "no other dataset is drawn");
      await shot(page, "missing");
      await page.locator(".card").first().click();
      await finalPicture(page);
    },
    { path: `?embed#!${encodeURIComponent('{"dataset":"gone"}')}`, settle: false },
  ));

// A site on localhost, which is another site than 127.0.0.1, with a frame of this address.
async function siteWith(t, framed) {
  const site = createServer((request, response) => {
    response.setHeader("Content-Type", "text/html");
    response.end(`<!doctype html><title>a site</title><iframe src="${framed()}"
      width="600" height="380"></iframe>`);
  });
  await new Promise((listens) => site.listen(0, "localhost", listens));
  t.after(() => site.close());
  return `http://localhost:${site.address().port}`;
}

const folder = mkdtempSync(join(tmpdir(), "windsplat-embed-"));
const token = join(folder, "token");
writeFileSync(token, "a-token-for-the-frame-tests\n", { mode: 0o600 });
let browser;
before(async () => (browser = await launch()));
after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true });
});

// The frame of a site that is allowed by `origins`, on a daemon with further options.
async function frameOf(t, path, { allowed = true, args = [] } = {}) {
  let url = "";
  const site = await siteWith(t, () => url);
  const options = allowed ? ["--allow-embed", site] : [];
  const { daemon, page } = await ownPage(t, browser, { args: ["tornado", ...options, ...args] });
  url = `${daemon.url}${path}`;
  await page.goto(site);
  const frame = page.frames().find((one) => one !== page.mainFrame());
  return { page, frame };
}

test("an allowed site shows the embedded view in a frame", async (t) => {
  const { page, frame } = await frameOf(t, `?embed${hash}`);
  await finalPicture(frame);
  assertDrawn(await pixels(frame));
  await shot(page, "embed-frame");
});

test("other sites show nothing, and the whole page is shown in no frame", async (t) => {
  const denied = await frameOf(t, "?embed", { allowed: false });
  assert.equal(await denied.frame.locator("#picture").count(), 0);
  const whole = await frameOf(t, "");
  assert.equal(await whole.frame.locator("#picture").count(), 0);
  assert.match(whole.page.faults.join(), /frame-ancestors/);
});

test("with a token a frame says that it needs a login, and has no form", async (t) => {
  const { page, frame } = await frameOf(t, `?embed${hash}`, { args: ["--token-file", token] });
  await frame.getByText("needs a login").waitFor();
  assert.equal(await frame.locator("input").count(), 0);
  const link = frame.getByRole("link", { name: "Open in windsplat" });
  const href = await link.evaluate((element) => element.href);
  assert.equal(new URL(href).hash, hash, "the view goes with the link");
  assert.equal(new URL(href).search, "");
  await shot(page, "embed-login");
});

// --- phones

const phones = [
  { width: 390, height: 844 },
  { width: 360, height: 640 },
];
const phone = { hasTouch: true, isMobile: true };

for (const viewport of phones) {
  const named = `${viewport.width} x ${viewport.height}`;
  test(`the open panel leaves half of the screen to the picture at ${named}`, () =>
    withPage(
      async (page) => {
        const open = await pictureBox(page);
        assert.ok(open.height >= viewport.height / 2, `${open.height} pixels`);
        const panel = page.locator("#panel");
        assert.ok((await panel.boundingBox()).height > 60, "the panel can be used");
        await shot(page, `phone-${viewport.width}`);
        const handle = await page.locator("#panel-handle").boundingBox();
        const [x, y] = [handle.x + handle.width / 2, handle.y + handle.height / 2];
        await page.mouse.move(x, y);
        await page.mouse.down();
        await page.mouse.move(x, y + 60, { steps: 4 });
        await page.mouse.up();
        await panel.waitFor({ state: "hidden" });
        assert.ok((await pictureBox(page)).height > open.height);
        await page.locator("#panel-button").tap();
        await panel.waitFor();
        await page.locator("#panel-handle").tap();
        await panel.waitFor({ state: "hidden" });
      },
      { ...phone, viewport },
    ));
}

test("a tap shows the value of what is seen, and the next touch hides it", () =>
  withPage(
    async (page) => {
      const box = await pictureBox(page);
      const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
      await page.touchscreen.tap(x, y);
      const value = page.locator("#hover");
      await value.waitFor();
      assert.match(await value.textContent(), /(wind|cloud) [\d.]+/);
      await shot(page, "phone-tap");
      await page.touchscreen.tap(x, y);
      await value.waitFor({ state: "hidden" });
    },
    { ...phone, viewport: phones[0] },
  ));

test("two fingers zoom and pan", () =>
  withPage(
    async (page) => {
      const before = await state(page);
      const box = await pictureBox(page);
      const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
      const client = await page.context().newCDPSession(page);
      const touch = (type, apart, down = 0) =>
        client.send("Input.dispatchTouchEvent", {
          type,
          touchPoints:
            type === "touchEnd"
              ? []
              : [
                  { x: x - apart, y: y + down, id: 0 },
                  { x: x + apart, y: y + down, id: 1 },
                ],
        });
      await touch("touchStart", 30);
      for (let n = 1; n <= 6; n++) await touch("touchMove", 30 + 8 * n);
      await touch("touchEnd", 0);
      await finalPicture(page);
      const after = await state(page);
      assert.ok(Number(after.distance) < Number(before.distance), "fingers apart: nearer");
      assert.equal(await page.locator("#hover").isVisible(), false);
    },
    { ...phone, viewport: phones[0] },
  ));
