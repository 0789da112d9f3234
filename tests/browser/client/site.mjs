// A site of another origin than the daemon's, whose pages use the client package.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { fileURLToPath } from "node:url";
import { Daemon, freePort, launch, openPage, patience, pixels } from "../support.mjs";

const root = fileURLToPath(new URL("../../..", import.meta.url));

export function buildPackage(folder) {
  const script = join(root, "web", "scripts", "package.mjs");
  execFileSync(process.execPath, [script, "--no-types", "--dist", folder], { stdio: "inherit" });
}

// Serves the package below /client/, and `html` at every other address with `headers`.
class Site {
  html = "";
  css = "";
  headers = {};

  async start() {
    this.folder = mkdtempSync(join(tmpdir(), "windsplat-site-"));
    buildPackage(this.folder);
    this.server = createServer((request, response) => {
      if (request.url === "/style.css") {
        response.setHeader("Content-Type", "text/css");
        response.end(this.css);
        return;
      }
      const name = /^\/client\/([\w./-]+\.js)$/.exec(request.url)?.[1];
      response.setHeader("Content-Type", name === undefined ? "text/html" : "text/javascript");
      // As strict as a site may be: neither inline styles nor evaluated scripts.
      response.setHeader(
        "Content-Security-Policy",
        "default-src 'self'; script-src 'self' 'unsafe-inline'; connect-src *",
      );
      for (const one of Object.entries(this.headers)) response.setHeader(...one);
      response.end(name === undefined ? this.html : readFileSync(join(this.folder, name)));
    });
    await new Promise((listens) => this.server.listen(0, "127.0.0.1", listens));
    return this;
  }

  get origin() {
    return `http://127.0.0.1:${this.server.address().port}`;
  }

  stop() {
    this.server?.close();
    this.server?.closeAllConnections();
    if (this.folder !== undefined) rmSync(this.folder, { recursive: true, force: true });
  }
}

const small = "windsplat-view { width: 480px; height: 300px; }";
const head = `<!doctype html><html lang="en"><meta charset="utf-8"><title>Another site</title>
<link rel="stylesheet" href="/style.css">
`;

// One site, browser and daemon for all tests of a file. The daemon allows the site unless
// `allowed` is false; `args` are its further arguments.
export function sharedSite({ args = ["tornado"], allowed = true } = {}) {
  const shared = { pageWith };
  before(async () => {
    shared.site = await new Site().start();
    shared.browser = await launch();
    shared.daemon = new Daemon(await freePort());
    const origin = allowed ? ["--allow-origin", shared.site.origin] : [];
    await shared.daemon.start(...origin, ...args);
  });
  after(async () => {
    await shared.browser?.close();
    await shared.daemon?.kill();
    shared.site?.stop();
  });

  // Opens a page of the site; it is closed when the test ends. defined: whether it defines the
  // element; headers: of the page; body: HTML in which SRC is the address of the daemon. Events of
  // the elements are collected in window.told.
  async function pageWith(t, body, { css = small, defined = true, headers = {}, ...options } = {}) {
    Object.assign(shared.site, { css, headers });
    shared.site.html = `${head}<script>
      window.told = [];
      for (const name of ["frame", "view", "error", "pick"]) {
        addEventListener("windsplat-" + name, ({ detail, target }) =>
          window.told.push({ name, id: target.id, detail: JSON.parse(JSON.stringify(detail)) }));
      }
    </script>
    ${defined ? '<script type="module" src="/client/element.js"></script>' : ""}
    <body>${body.replaceAll("SRC", shared.daemon.url)}</body></html>`;
    const page = await openPage(shared.browser, `${shared.site.origin}/`, options);
    t.after(() => page.context().close());
    return page;
  }
  return shared;
}

// The details of the events of a kind that the page has received.
export const toldOf = (page, name) =>
  page.evaluate((kind) => window.told.filter((one) => one.name === kind), name);

// Waits for an event that `accepts` takes.
export async function event(page, name, accepts = () => true) {
  const until = Date.now() + 15_000 * patience;
  for (;;) {
    const found = (await toldOf(page, name)).find(accepts);
    if (found !== undefined) return found;
    if (Date.now() > until)
      throw new Error(`no ${name}: ${JSON.stringify(await toldOf(page, name))}`);
    await page.waitForTimeout(30);
  }
}

// Waits until `holds` gives true; `what` is what it stands for.
export async function until(page, holds, what) {
  const late = Date.now() + 15_000 * patience;
  while (!(await holds())) {
    if (Date.now() > late) throw new Error(`not in time: ${what}`);
    await page.waitForTimeout(30);
  }
}

// The final picture of the newest view. Input is sent with the next display frame.
export const finalOf = (page, selector = "windsplat-view") =>
  page.evaluate(
    async ([which, ms]) => {
      await customElements.whenDefined("windsplat-view");
      const late = new Promise((_, reject) => setTimeout(() => reject(new Error("no final")), ms));
      await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
      return Promise.race([late, document.querySelector(which).final()]);
    },
    [selector, 15_000 * patience],
  );

// Statistics of the element's picture, as those of the page's.
export const pixelsOf = (page, selector = "windsplat-view") =>
  pixels(page, [selector, "[part=picture]"]);

const metric = async ({ url }, name) => {
  const text = await (await fetch(`${url}metrics`)).text();
  return Number(new RegExp(`^${name} (\\d+)`, "m").exec(text)?.[1]);
};

// How many streams the daemon has, and how many it has had.
export const sessions = (daemon) => metric(daemon, "windsplat_sessions");
export const sessionsOpened = (daemon) => metric(daemon, "windsplat_sessions_opened_total");
