// What a page of another origin says of a server that gives it no answer: that it is down, or that
// it, or a proxy in its place, does not allow the page.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { freePort } from "../support.mjs";
import { event, sharedSite } from "./site.mjs";

const token = "a-token-for-refused-pages";
const folder = mkdtempSync(join(tmpdir(), "windsplat-refusal-"));
const file = join(folder, "token");
writeFileSync(file, `${token}\n`, { mode: 0o600 });
after(() => rmSync(folder, { recursive: true }));

const closed = sharedSite({ allowed: false });
const locked = sharedSite({ allowed: false, args: ["--token-file", file, "tornado"] });
const viewOf = (src) => `<windsplat-view id="a" src="${src}" dataset="tornado"></windsplat-view>`;

const refusal = (server, { site }) =>
  `${server} answers, but not for pages of ${site.origin}: ` +
  "it does not allow them (--allow-origin), or a proxy answers in its place";
const originOf = ({ url }) => new URL(url).origin;

// The message of the element's first error, which it also shows.
async function shownBy(page) {
  const { detail } = await event(page, "error");
  assert.equal(detail.kind, "connection");
  assert.equal(await page.locator("[part=message]").innerText(), detail.message);
  return detail.message;
}

// How requests of the client to a server fail: a plain one, and one that needs a preflight.
const failures = (page, url, options = {}) =>
  page.evaluate(
    async ([address, given]) => {
      const { Client, UnreachableError } = await import("/client/index.js");
      const server = new Client(address, given);
      const asks = [server.datasets(), server.frame({ dataset: "tornado" })];
      const errors = await Promise.all(asks.map((ask) => ask.catch((error) => error)));
      return errors.map((error) => [
        error instanceof UnreachableError,
        error.foreign,
        error.message,
      ]);
    },
    [url, options],
  );

const twice = (...failure) => [failure, failure];

test("the client tells a server that does not allow the page", async (t) => {
  const page = await closed.pageWith(t, "");
  const { url } = closed.daemon;
  assert.deepEqual(await failures(page, url), twice(true, true, refusal(url, closed)));
});

test("a server that is down gives no answer, to the client and the element", async (t) => {
  const down = `http://127.0.0.1:${await freePort()}`;
  const page = await closed.pageWith(t, viewOf(down));
  assert.equal(await shownBy(page), `no answer from ${down}`);
  const text = `no answer from ${down}/ (Failed to fetch)`;
  assert.deepEqual(await failures(page, down), twice(true, false, text));
});

// The address of a proxy that gives one answer after a time, by default that of one without its
// server.
async function proxyWith(t, { afterMs = 0, status = 502, headers = {} } = {}) {
  const answer = (_, response) =>
    setTimeout(() => response.writeHead(status, headers).end(), afterMs);
  const proxy = createServer(answer);
  await new Promise((listens) => proxy.listen(0, "127.0.0.1", listens));
  t.after(() => {
    proxy.close();
    proxy.closeAllConnections();
  });
  return `http://127.0.0.1:${proxy.address().port}`;
}

test("a proxy whose server is down may be why the page is refused", async (t) => {
  const url = await proxyWith(t);
  const page = await closed.pageWith(t, viewOf(url));
  const shown = await shownBy(page);
  assert.equal(shown, refusal(url, closed));
  assert.match(shown, /a proxy answers in its place/);
  assert.deepEqual(await failures(page, url), twice(true, true, refusal(`${url}/`, closed)));
});

test("on a slow link the element tells what the answer is, not that there is none", async (t) => {
  const afterMs = 2200; // longer than the time between attempts
  const url = await proxyWith(t, { afterMs });
  const page = await closed.pageWith(t, viewOf(url));
  assert.equal(await shownBy(page), refusal(url, closed));
  const headers = { "Access-Control-Allow-Origin": "*" };
  const asking = await proxyWith(t, { afterMs, status: 401, headers });
  const { detail } = await event(await closed.pageWith(t, viewOf(asking)), "error");
  assert.deepEqual([detail.kind, /asks for a token/.test(detail.message)], ["login", true]);
});

test("a server with a token tells pages that it does not allow the same", async (t) => {
  const page = await locked.pageWith(t, viewOf("SRC"));
  const { url } = locked.daemon;
  assert.equal(await shownBy(page), refusal(originOf(locked.daemon), locked));
  const told = twice(true, true, refusal(url, locked));
  assert.deepEqual(await failures(page, url), told);
  assert.deepEqual(await failures(page, url, { token }), told);
});

test("an isolated page, which embeds only what permits it, is told so too", async (t) => {
  const headers = {
    "Cross-Origin-Embedder-Policy": "require-corp",
    "Cross-Origin-Opener-Policy": "same-origin",
  };
  const page = await closed.pageWith(t, viewOf("SRC"), { headers });
  assert.ok(await page.evaluate(() => window.crossOriginIsolated));
  assert.equal(await shownBy(page), refusal(originOf(closed.daemon), closed));
});

test("a document without an address names the origin that the server sees", async (t) => {
  const page = await closed.pageWith(t, "");
  await page.evaluate((src) => {
    const frame = document.createElement("iframe");
    frame.srcdoc =
      `<script type="module" src="/client/element.js"></script>` +
      `<windsplat-view src="${src}" dataset="tornado"></windsplat-view>`;
    document.body.append(frame);
  }, closed.daemon.url);
  const message = page.frameLocator("iframe").locator("[part=message]", { hasText: "answers" });
  assert.equal(await message.innerText(), refusal(originOf(closed.daemon), closed));
});
