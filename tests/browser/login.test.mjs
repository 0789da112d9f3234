// A daemon that requires a token: the login page leads to the page, whose stream and requests are
// then authenticated by the cookie. The view of a shared link survives the login, and the form
// works without scripts.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import {
  drag,
  finalPicture,
  openPage,
  ownPage,
  patience,
  pixels,
  sharedDaemon,
  shot,
  state,
} from "./support.mjs";

const token = "a-token-for-the-browser-tests";
const folder = mkdtempSync(join(tmpdir(), "windsplat-login-"));
const file = join(folder, "token");
writeFileSync(file, `${token}\n`, { mode: 0o600 });
const shared = sharedDaemon({
  args: ["--token-file", file, "tornado"],
  // the browser logs the 401 of the first page
  page: { settle: false, faulty: true },
});
const { withPage } = shared;
after(() => rmSync(folder, { recursive: true }));

async function logIn(page, text) {
  await page.locator("#token").fill(text);
  await Promise.all([page.waitForLoadState("load"), page.locator("button").click()]);
}

// Errors of the page except the 401 of the first page.
const faultsBut401 = (page) => page.faults.filter((fault) => !/status of 401/.test(fault));

test("login opens the page, and its stream is authenticated by the cookie", () =>
  withPage(async (page) => {
    assert.equal(await page.title(), "windsplat: log in");
    await shot(page, "login");
    await logIn(page, "not-the-token-at-all");
    await page.locator("[role=alert]").waitFor();
    assert.match(await page.locator("[role=alert]").innerText(), /Invalid token/);
    await logIn(page, token);
    await page.waitForURL((url) => url.pathname === "/");
    await finalPicture(page);
    assert.ok((await pixels(page)).colors > 100, "a picture was received over the stream");
    assert.deepEqual(faultsBut401(page), [], "no content security policy violation");

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
    assert.equal(kept, 201, "requests of the page itself are allowed");

    await page.reload();
    await finalPicture(page);
  }));

test("the view of a shared link survives the login", async () => {
  const { path, hash } = await withPage(async (page) => {
    await logIn(page, token);
    await finalPicture(page);
    await page.keyboard.press("3");
    // The camera animates for a while, and the address is updated later. Until the address contains
    // the view from the east, neither the address nor a final picture belongs to the pressed key.
    await page.waitForFunction(() => {
      const { camera } = JSON.parse(decodeURIComponent(location.hash.slice(2)) || "{}");
      return camera?.eye[0] > 0 && camera.eye[1] === 0 && camera.eye[2] === 0;
    });
    await finalPicture(page);
    return { path: new URL(page.url()).hash, hash: (await pixels(page)).hash };
  });
  await withPage(
    async (page) => {
      assert.equal(await page.title(), "windsplat: log in");
      await logIn(page, token);
      await page.locator("#picture").waitFor();
      await finalPicture(page);
      assert.equal((await pixels(page)).hash, hash, "the same picture");
    },
    { path },
  );
});

test("the login form works without scripts", () =>
  withPage(
    async (page) => {
      await logIn(page, token);
      assert.equal(new URL(page.url()).pathname, "/");
      assert.notEqual(await page.title(), "windsplat: log in");
    },
    { javaScriptEnabled: false },
  ));

test("another site cannot use the cookie", () =>
  withPage(async (page) => {
    await logIn(page, token);
    await finalPicture(page);
    // The same host under another name is another site; its page tries to open the stream.
    const url = shared.daemon.url.replace("127.0.0.1", "localhost");
    const other = await openPage(shared.browser, url);
    const outcome = await other.evaluate(
      (stream) =>
        new Promise((done) => {
          const socket = new WebSocket(stream, "windsplat.v1");
          socket.onopen = () => done("open");
          socket.onerror = () => done("refused");
        }),
      `${shared.daemon.url.replace("http", "ws")}v1/stream`,
    );
    assert.equal(outcome, "refused");
    assert.equal((await state(page)).state, "final", "the first page still works");
    await other.context().close();
  }));

test("after the token was changed the page asks for it and keeps the view", async (t) => {
  const own = join(folder, "changed");
  const next = "another-token-for-the-browser-tests";
  writeFileSync(own, `${token}\n`, { mode: 0o600 });
  const { daemon, page } = await ownPage(t, shared.browser, {
    args: ["--token-file", own, "tornado"],
  });
  await logIn(page, token);
  await finalPicture(page);
  await drag(page, 90, 30);
  await finalPicture(page);
  const before = await pixels(page);
  writeFileSync(own, `${next}\n`, { mode: 0o600 });
  daemon.child.kill("SIGHUP");
  const dialog = page.locator("#login");
  await dialog.waitFor();
  assert.equal((await pixels(page)).hash, before.hash, "the picture remains");
  await shot(page, "login-again");
  await page.locator("#login-token").fill(token);
  await page.keyboard.press("Enter");
  await page.locator("#login-error:visible").waitFor();
  assert.match(await page.locator("#login-error").innerText(), /Invalid token/);
  // It can be put off.
  await page.locator("#login-later").click();
  assert.match(await page.locator("#offline").innerText(), /asks for its token/);
  assert.equal(await page.locator("#retry-button").isVisible(), false);
  await page.locator("#login-button").click();
  await page.locator("#login-token").fill(next);
  await page.keyboard.press("Enter");
  await dialog.waitFor({ state: "hidden" });
  await page.waitForFunction(() => document.documentElement.dataset.connection === "live");
  await finalPicture(page);
  assert.equal((await pixels(page)).hash, before.hash, "the same view");
  assert.ok(!page.url().includes(next));
});

test("a server that returns after an outage is found within the longest delay", async (t) => {
  const { daemon, page } = await ownPage(t, shared.browser, { args: ["tornado"] });
  await finalPicture(page);
  await daemon.kill();
  await page.waitForFunction(() => document.documentElement.dataset.connection === "waiting");
  // Each attempt fails at once; only the delays between them are counted here.
  await page.evaluate(() => {
    window.delays = [];
    new MutationObserver(() => {
      const left = /in (\d+) s/.exec(document.querySelector("#offline-text").textContent);
      if (left !== null) window.delays.push(Number(left[1]));
    }).observe(document.querySelector("#offline-text"), { childList: true });
  });
  await page.waitForFunction(() => window.delays.length >= 10, null, {
    timeout: 60_000 * patience,
  });
  assert.ok(Math.max(...(await page.evaluate(() => window.delays))) <= 2);
  await daemon.start("tornado");
  await page.waitForFunction(() => document.documentElement.dataset.connection === "live");
  await finalPicture(page);
});
