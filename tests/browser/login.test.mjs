// A daemon that asks for a token: the login page leads to the page, whose stream and requests then
// go by the cookie. A shared link's view survives the login; without scripts the form works, too.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import {
  Daemon,
  finalPicture,
  freePort,
  launch,
  openPage,
  pixels,
  shot,
  state,
} from "./support.mjs";

const token = "a-token-for-the-browser-tests";
const folder = mkdtempSync(join(tmpdir(), "windsplat-login-"));
const file = join(folder, "token");
let browser;
let daemon;

before(async () => {
  writeFileSync(file, `${token}\n`, { mode: 0o600 });
  browser = await launch();
  daemon = await new Daemon(await freePort()).start("--token-file", file, "tornado");
});

after(async () => {
  await browser?.close();
  await daemon?.kill();
  rmSync(folder, { recursive: true });
});

async function logIn(page, text) {
  await page.locator("#token").fill(text);
  await Promise.all([page.waitForLoadState("load"), page.locator("button").click()]);
}

// The 401 of the first page is one, as the browser sees it.
const faultsBut401 = (page) => page.faults.filter((fault) => !/status of 401/.test(fault));

test("the login leads to the page, and its stream works by the cookie", async () => {
  const page = await openPage(browser, daemon.url);
  assert.equal(await page.title(), "windsplat: log in");
  await shot(page, "login");
  await logIn(page, "not-the-token-at-all");
  await page.locator("[role=alert]").waitFor();
  assert.match(await page.locator("[role=alert]").innerText(), /not the token/);
  await logIn(page, token);
  await page.waitForURL((url) => url.pathname === "/");
  await finalPicture(page);
  assert.ok((await pixels(page)).colors > 100, "a picture came over the stream");
  assert.deepEqual(faultsBut401(page), [], "no policy was violated");

  const [cookie] = await page.context().cookies();
  assert.match(cookie.name, /^windsplat-\d+$/);
  assert.equal(cookie.httpOnly, true);
  assert.equal(cookie.sameSite, "Strict");
  assert.ok(!cookie.value.includes(token));
  assert.ok(!page.url().includes(token));
  const kept = await page.evaluate(async () => {
    const headers = { "Content-Type": "application/json" };
    return (await fetch("v1/views", { method: "POST", headers, body: "{}" })).status;
  });
  assert.equal(kept, 201, "what the page itself posts is allowed");

  await page.reload();
  await finalPicture(page);
  await page.context().close();
});

test("the view of a shared link survives the login", async () => {
  const first = await openPage(browser, daemon.url);
  await logIn(first, token);
  await finalPicture(first);
  await first.keyboard.press("3");
  await finalPicture(first);
  await first.waitForFunction(() => location.hash.length > 1);
  const link = first.url();
  const { hash } = await pixels(first);
  await first.context().close();

  const second = await openPage(browser, link);
  assert.equal(await second.title(), "windsplat: log in");
  await logIn(second, token);
  await second.locator("#picture").waitFor();
  await finalPicture(second);
  assert.equal((await pixels(second)).hash, hash, "the same picture");
  await second.context().close();
});

test("without scripts the form works, too", async () => {
  const page = await openPage(browser, daemon.url, { javaScriptEnabled: false });
  await logIn(page, token);
  assert.equal(new URL(page.url()).pathname, "/");
  assert.notEqual(await page.title(), "windsplat: log in");
  await page.context().close();
});

test("another site cannot use the cookie", async () => {
  const page = await openPage(browser, daemon.url);
  await logIn(page, token);
  await finalPicture(page);
  // The same machine by another name is another site, whose page asks for the stream.
  const other = await openPage(browser, daemon.url.replace("127.0.0.1", "localhost"));
  const outcome = await other.evaluate(
    (url) =>
      new Promise((done) => {
        const socket = new WebSocket(url, "windsplat.v1");
        socket.onopen = () => done("open");
        socket.onerror = () => done("refused");
      }),
    `${daemon.url.replace("http", "ws")}v1/stream`,
  );
  assert.equal(outcome, "refused");
  assert.equal((await state(page)).state, "final", "the first page goes on");
  await page.context().close();
  await other.context().close();
});
