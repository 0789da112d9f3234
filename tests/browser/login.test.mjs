// A daemon that asks for a token: the login page leads to the page, whose stream and requests then
// go by the cookie. A shared link's view survives the login; without scripts the form works, too.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { finalPicture, openPage, pixels, sharedDaemon, shot, state } from "./support.mjs";

const token = "a-token-for-the-browser-tests";
const folder = mkdtempSync(join(tmpdir(), "windsplat-login-"));
const file = join(folder, "token");
writeFileSync(file, `${token}\n`, { mode: 0o600 });
const shared = sharedDaemon({
  args: ["--token-file", file, "tornado"],
  // The browser itself reports that the first page is a 401.
  page: { settle: false, faulty: true },
});
const { withPage } = shared;
after(() => rmSync(folder, { recursive: true }));

async function logIn(page, text) {
  await page.locator("#token").fill(text);
  await Promise.all([page.waitForLoadState("load"), page.locator("button").click()]);
}

// The 401 of the first page is one, as the browser sees it.
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
  }));

test("the view of a shared link survives the login", async () => {
  const { path, hash } = await withPage(async (page) => {
    await logIn(page, token);
    await finalPicture(page);
    await page.keyboard.press("3");
    // The camera turns for a while, and the address follows the view a little later: until it holds
    // the view from the east, neither it nor a final picture is that of the key.
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
    // The same machine by another name is another site, whose page asks for the stream.
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
    assert.equal((await state(page)).state, "final", "the first page goes on");
    await other.context().close();
  }));
