// Who may use <windsplat-view> and the client in a page of another origin: origins and tokens.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { assertDrawn, shot } from "../support.mjs";
import { event, finalOf, pixelsOf, sessions, sharedSite, toldOf } from "./site.mjs";

const token = "a-token-for-the-client/tests==";
const folder = mkdtempSync(join(tmpdir(), "windsplat-client-"));
const file = join(folder, "token");
writeFileSync(file, `${token}\n`, { mode: 0o600 });
after(() => rmSync(folder, { recursive: true }));

const open = sharedSite();
const closed = sharedSite({ allowed: false });
const locked = sharedSite({ args: ["--token-file", file, "tornado"] });
const tornado = `<windsplat-view id="a" src="SRC" dataset="tornado" pick></windsplat-view>`;

// Whether the daemon lets pages of other origins read its answers.
async function shares({ daemon, site }) {
  const answer = await fetch(`${daemon.url}v1`, { headers: { Origin: site.origin } });
  return answer.headers.get("Access-Control-Allow-Origin") === site.origin;
}

const setToken = (page, text) =>
  page.evaluate((secret) => {
    window.told.length = 0;
    document.querySelector("#a").token = secret;
  }, text);

test("an origin that is not allowed is told so, and how to allow it", async (t) => {
  const page = await closed.pageWith(t, tornado);
  const { detail } = await event(page, "error");
  assert.equal(detail.kind, "connection");
  const { origin } = new URL(closed.daemon.url);
  assert.equal(
    detail.message,
    `${origin} answers, but not for pages of ${closed.site.origin}: ` +
      "it does not allow them (--allow-origin), or a proxy answers in its place",
  );
  assert.equal(await page.locator("[part=message]").innerText(), detail.message);
  await shot(page, "foreign-page-refused");
  await page.waitForTimeout(1500);
  assert.equal((await toldOf(page, "error")).length, 1, "once for an outage");
  assert.deepEqual(await toldOf(page, "frame"), []);
  assert.equal(await sessions(closed.daemon), 0);
});

test("the token is a property, and goes to the stream as a subprotocol", async (t) => {
  const page = await locked.pageWith(t, tornado);
  const without = await event(page, "error");
  assert.ok(["login", "connection"].includes(without.detail.kind));
  await setToken(page, "not-the-token-of-this-server");
  const wrong = await event(page, "error");
  assert.ok(["login", "connection"].includes(wrong.detail.kind));
  const urls = [];
  page.on("websocket", (socket) => urls.push(socket.url()));
  await setToken(page, token);
  await finalOf(page);
  assertDrawn(await pixelsOf(page));
  assert.deepEqual(await toldOf(page, "error"), []);
  assert.ok(urls.length > 0 && urls.every((url) => !url.includes("token")));
  const html = await page.evaluate(() => document.documentElement.outerHTML);
  assert.ok(!html.includes(token));
});

test("a missing or wrong token is told as such where answers can be read", async (t) => {
  if (!(await shares(locked))) return t.skip("the daemon shares no answers with other origins");
  const page = await locked.pageWith(t, tornado);
  const without = await event(page, "error");
  assert.deepEqual(
    [without.detail.kind, /set the property/.test(without.detail.message)],
    ["login", true],
  );
  await setToken(page, "not-the-token-of-this-server");
  const wrong = await event(page, "error");
  assert.deepEqual(
    [wrong.detail.kind, wrong.detail.message],
    ["login", "the server refuses the token"],
  );
});

test("a click tells what is seen there", async (t) => {
  if (!(await shares(locked))) return t.skip("the daemon shares no answers with other origins");
  const page = await locked.pageWith(t, tornado);
  await setToken(page, token);
  await finalOf(page);
  await page.locator("#a").click();
  const { detail } = await event(page, "pick");
  assert.ok(Math.abs(detail.x - 0.5) < 0.02 && Math.abs(detail.y - 0.5) < 0.02);
  assert.match(detail.feature.field, /^(wind|cloud)$/);
});

test("the client reads resources of another origin, and problems as such", async (t) => {
  if (!(await shares(locked))) return t.skip("the daemon shares no answers with other origins");
  const page = await locked.pageWith(t, "");
  const found = await page.evaluate(
    async ([url, secret]) => {
      const { Client, ProblemError } = await import("/client/index.js");
      const server = new Client(url, { token: secret });
      const datasets = (await server.datasets()).map(({ id }) => id);
      const picture = await server.frame({ dataset: "tornado", image: { width: 64, height: 48 } });
      const saved = await server.saveView({ dataset: "tornado" });
      const changed = await server.changeView(saved.id, { step: 0 });
      await server.deleteView(saved.id);
      const failure = await server.describe("gone").catch((error) => error);
      return [
        datasets,
        picture.type,
        changed.view.dataset,
        failure instanceof ProblemError,
        failure.status,
        failure.problem.status,
      ];
    },
    [locked.daemon.url, token],
  );
  assert.deepEqual(found, [["tornado"], "image/png", "tornado", true, 404, 404]);
});

test("REST without a token is refused with its status", async (t) => {
  if (!(await shares(locked))) return t.skip("the daemon shares no answers with other origins");
  const page = await locked.pageWith(t, "");
  const status = await page.evaluate(async (url) => {
    const { Client } = await import("/client/index.js");
    return (await new Client(url).datasets().catch((error) => error)).status;
  }, locked.daemon.url);
  assert.equal(status, 401);
});

test("a stream that the server ends is opened again with the view as it is", async (t) => {
  const page = await open.pageWith(t, tornado);
  await finalOf(page);
  await page.evaluate(() => document.querySelector("#a").change({ scalars: [] }));
  await finalOf(page);
  await page.evaluate(() => (window.told.length = 0));
  await open.daemon.kill();
  const { detail } = await event(page, "error");
  assert.equal(detail.kind, "connection");
  await open.daemon.start("--allow-origin", open.site.origin, "tornado");
  const shown = await event(page, "frame", (one) => one.detail.final);
  assert.deepEqual(shown.detail.view.scalars, []);
  assert.equal(await page.locator("[part=message]").innerText(), "");
});
