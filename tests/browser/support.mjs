// Shared parts of the browser tests: the daemon, the browser, and a page whose errors are
// collected.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync, renameSync } from "node:fs";
import { createServer } from "node:net";
import { dirname, join } from "node:path";
import { after, before } from "node:test";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const root = join(dirname(fileURLToPath(import.meta.url)), "..", "..");
const program = process.env.WINDSPLAT_PROGRAM;
export const patience = Number(process.env.WINDSPLAT_PATIENCE ?? 1);
export const screenshots = join(root, "build", "screenshots");
mkdirSync(screenshots, { recursive: true });

export function freePort() {
  return new Promise((resolve, reject) => {
    const server = createServer();
    server.on("error", reject);
    server.listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });
}

// The samples that tests share unless they name datasets, the climate with half of the rows,
// columns and levels: the daemon draws and calibrates it in a fraction of the time. Its file has
// the name of the sample, so that the dataset has its id.
function smallSamples() {
  const folder = join(root, "build", "browser-data");
  const climate = join(folder, "climate.nc");
  if (!existsSync(climate)) {
    mkdirSync(folder, { recursive: true });
    const unfinished = join(folder, `climate-${process.pid}.nc`); // test files run concurrently
    execFileSync(program, ["synth", "climate", "--dims", "160x80x10", "-o", unfinished]);
    renameSync(unfinished, climate);
  }
  return ["tornado", climate, "efield"];
}

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export class Daemon {
  constructor(port, basePath = "/") {
    this.port = port;
    this.basePath = basePath;
    this.log = "";
  }

  get url() {
    return `http://127.0.0.1:${this.port}${this.basePath}`;
  }

  // Without arguments the built-in samples are served.
  async start(...datasets) {
    const child = spawn(
      program,
      ["serve", "--listen", `127.0.0.1:${this.port}`, "--base-path", this.basePath, ...datasets],
      { stdio: ["ignore", "pipe", "pipe"] },
    );
    this.child = child;
    this.exited = new Promise((resolve) => child.on("exit", resolve));
    for (const stream of [child.stdout, child.stderr]) {
      stream.on("data", (text) => (this.log += text));
    }
    const until = Date.now() + 30_000 * patience;
    while (Date.now() < until && child.exitCode === null) {
      // /readyz answers without a token.
      const answer = await fetch(`${this.url}readyz`).catch(() => null);
      if (answer?.ok) return this;
      await sleep(50);
    }
    throw new Error(`the daemon does not answer at ${this.url}:\n${this.log}`);
  }

  async kill(signal = "SIGKILL") {
    if (this.child === undefined) return;
    this.child.kill(signal);
    await this.exited;
  }
}

export const launch = () =>
  chromium.launch({
    executablePath: process.env.WINDSPLAT_CHROMIUM,
    args: [
      "--no-sandbox",
      "--disable-gpu",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
    ],
  });

// Opens a page and collects its console errors, exceptions and violations of the content security
// policy. options: those of a Playwright context; `initScript`, one or several functions to run in
// the page first; `prepare`, called with the page before the navigation.
export async function openPage(browser, url, { initScript, prepare, ...options } = {}) {
  const context = await browser.newContext({
    viewport: { width: 1024, height: 640 },
    colorScheme: "dark",
    ...options,
  });
  for (const script of [initScript ?? []].flat()) await context.addInitScript(script);
  const page = await context.newPage();
  page.setDefaultTimeout(15_000 * patience);
  page.faults = [];
  page.on("console", (message) => {
    if (message.type() === "error") page.faults.push(message.text());
  });
  page.on("pageerror", (error) => page.faults.push(String(error)));
  try {
    await prepare?.(page);
    await page.goto(url, { waitUntil: "load" });
  } catch (fault) {
    await context.close();
    throw fault;
  }
  return page;
}

// One browser and one daemon for all tests of a file. `args` are the daemon's arguments, usually
// its datasets (default: small samples); `page` holds the default page options of the file. Browser
// and daemon are started when the tests run, not before.
export function sharedDaemon({ basePath = "/", args, page: usual = {} } = {}) {
  const shared = { withPage };
  before(async () => {
    shared.browser = await launch();
    // stored before start() so that a daemon that fails to start is stopped too
    shared.daemon = new Daemon(await freePort(), basePath);
    await shared.daemon.start(...(args ?? smallSamples()));
  });
  after(async () => {
    await shared.browser?.close();
    await shared.daemon?.kill();
  });

  // Runs a test on a new page and returns its result; afterwards the page must have no errors.
  // options: those of openPage; `path`, appended to the daemon's URL; `settle: false`, not to wait
  // for the final picture first; `unfolded`, panel folders to open; `alert` and `faulty`, if the
  // test expects an alert or console errors.
  async function withPage(run, options) {
    const {
      path = "",
      settle = true,
      unfolded = [],
      alert = false,
      faulty = false,
      ...opening
    } = { ...usual, ...options };
    const page = await openPage(shared.browser, shared.daemon.url + path, opening);
    try {
      if (settle) await finalPicture(page);
      await unfold(page, ...unfolded);
      const result = await run(page);
      const alerts = await page.locator("#alert:visible").allTextContents();
      if (!alert) assert.deepEqual(alerts, [], "no alert is shown");
      if (!faulty) assert.deepEqual(page.faults, [], "no errors in the browser's console");
      return result;
    } finally {
      // A route that still waits for its answer must not outlive the page.
      await page.unrouteAll({ behavior: "ignoreErrors" });
      await page.context().close();
    }
  }
  return shared;
}

// A daemon and a page for one test; both are closed when it ends. options: those of openPage, and
// the daemon's and `path` as above.
export async function ownPage(t, browser, { basePath, args = [], path = "", ...options } = {}) {
  const daemon = new Daemon(await freePort(), basePath);
  t.after(() => daemon.kill());
  await daemon.start(...args);
  const page = await openPage(browser, daemon.url + path, options);
  t.after(() => page.context().close());
  return { daemon, page };
}

// Waits until any frame has been drawn.
export const somePicture = (page, timeout = 15_000 * patience) =>
  page.waitForFunction(() => Number(document.querySelector("#picture").dataset.seq) > 0, null, {
    timeout,
    polling: 20,
  });

// Waits until the final frame of the requested view has been drawn. Input is sent with the next
// display frame, so two of those are awaited first.
export async function finalPicture(page) {
  await page.evaluate(
    () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))),
  );
  await page.waitForFunction(
    () => {
      const { rev, wanted, state } = document.querySelector("#picture").dataset;
      return state === "final" && rev === wanted;
    },
    null,
    { polling: 20 },
  );
}

// Statistics of the canvas pixels: mean and deviation of the brightness (0..255), fraction of
// pixels that differ from the most frequent colour, and a hash of all pixels. path: the canvas,
// with the elements in whose shadow trees it is.
export const pixels = (page, path = ["#picture"]) =>
  page.evaluate((selectors) => {
    const canvas = selectors.reduce(
      (node, selector) => (node.shadowRoot ?? node).querySelector(selector),
      document,
    );
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const words = new Uint32Array(data.buffer);
    const counts = new Map();
    let sum = 0;
    let squares = 0;
    let hash = 0x811c9dc5;
    for (let n = 0; n < words.length; n++) {
      const word = words[n];
      const brightness = (data[4 * n] + data[4 * n + 1] + data[4 * n + 2]) / 3;
      sum += brightness;
      squares += brightness * brightness;
      hash = Math.imul(hash ^ word, 0x01000193) >>> 0;
      counts.set(word, (counts.get(word) ?? 0) + 1);
    }
    const mean = sum / words.length;
    let most = 0;
    for (const count of counts.values()) most = Math.max(most, count);
    return {
      width: canvas.width,
      height: canvas.height,
      mean,
      deviation: Math.sqrt(Math.max(0, squares / words.length - mean * mean)),
      covered: 1 - most / words.length,
      colors: counts.size,
      hash,
    };
  }, path);

// Asserts that the picture is neither empty nor uniform.
export function assertDrawn(stats) {
  assert.ok(stats.covered > 0.02, `only ${stats.covered} of the picture is drawn`);
  assert.ok(stats.deviation > 3, `the picture is uniform: deviation ${stats.deviation}`);
  assert.ok(stats.colors > 100, `only ${stats.colors} colours`);
}

export const state = (page) =>
  page.evaluate(() => ({ ...document.querySelector("#picture").dataset }));

export const pictureBox = (page) => page.locator("#picture").boundingBox();

export async function drag(page, dx, dy, steps = 12) {
  const box = await pictureBox(page);
  const x = box.x + box.width / 2;
  const y = box.y + box.height / 2;
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let n = 1; n <= steps; n++) {
    await page.mouse.move(x + (dx * n) / steps, y + (dy * n) / steps);
    await page.waitForTimeout(16);
  }
  await page.mouse.up();
}

// The element of a panel control, by the labels of its folder and its own.
export const control = (page, label, tag = "select") =>
  page
    .locator("#panel .lil-controller", {
      has: page.locator(".lil-name", { hasText: new RegExp(`^${label}$`) }),
    })
    .first()
    .locator(tag)
    .first();

// Runs in a page before its own scripts (initScript): records outgoing patches with their times.
export const watchPatches = () => {
  window.patches = [];
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (text) {
    const message = JSON.parse(text);
    if (message.type === "patch") window.patches.push({ at: performance.now(), ...message });
    return send.call(this, text);
  };
};

// Records received data in the same way: frame headers with their `chosen` messages.
export const watchFrames = () => {
  const chosen = new Map();
  window.frameHeaders = [];
  const codecs = { 1: "jpeg", 2: "png" };
  const methods = { 1: "kernel", 2: "slab", 3: "reference" };
  const Native = window.WebSocket;
  window.WebSocket = class extends Native {
    constructor(...args) {
      super(...args);
      this.addEventListener("message", ({ data }) => {
        if (typeof data === "string") {
          const message = JSON.parse(data);
          if (message.type === "chosen") chosen.set(message.seq, message);
          return;
        }
        const header = new DataView(data);
        const u32 = (at) => header.getUint32(at, true);
        window.frameHeaders.push({
          seq: u32(8),
          rev: u32(12),
          step: u32(16),
          final: (u32(20) & 1) !== 0,
          measured: (u32(20) & 2) !== 0,
          estimated: (u32(20) & 4) !== 0,
          width: header.getUint16(24, true),
          height: header.getUint16(26, true),
          codec: codecs[header.getUint8(28)],
          quality: header.getUint8(29),
          method: methods[header.getUint8(30)],
          level: header.getUint8(31),
          error: header.getFloat32(32, true),
          jpegError: header.getFloat32(36, true),
          renderUs: u32(44),
          chosen: chosen.get(u32(8)),
        });
      });
    }
  };
};

// The headers of the frames received while `act` ran and until the view is at rest.
export async function framesOf(page, act) {
  await finalPicture(page);
  await page.evaluate(() => (window.frameHeaders.length = 0));
  await act();
  await finalPicture(page);
  return page.evaluate(() => window.frameHeaders);
}

// The moving frames among them: a slow final frame is preceded by frames that refine an already
// displayed view, which are excluded.
export const movingOf = (frames) =>
  frames.filter(
    ({ final, rev }, n) => !final && frames.findIndex((frame) => frame.rev === rev) === n,
  );

// Opens folders of the panel with those around them. A folder whose title others have, too, is
// named after one around it: "Winds > More".
export async function unfold(page, ...titles) {
  for (const title of titles) {
    // The title of the outermost closed folder around it.
    const closed = () =>
      page.evaluateHandle((parts) => {
        let folder = document.querySelector("#panel");
        for (const part of parts) {
          const found = [...folder.querySelectorAll(".lil-title")].find(
            ({ textContent }) => textContent === part,
          );
          if (found === undefined) throw new Error(`no folder ${part}`);
          folder = found.closest(".lil-gui");
        }
        let outermost = null;
        for (let at = folder; at !== null; at = at.parentElement.closest(".lil-gui")) {
          const title = at.querySelector(".lil-title");
          if (title.ariaExpanded !== "true") outermost = title;
        }
        return outermost;
      }, title.split(" > "));
    for (let at = await closed(); at.asElement() !== null; at = await closed()) {
      await at.asElement().click();
    }
  }
}

// Selects the first option whose text matches.
export async function choose(page, label, text) {
  const select = control(page, label);
  const options = await select.locator("option").allTextContents();
  const wanted = options.find((option) => text.test(option));
  if (wanted === undefined) throw new Error(`${label} offers ${options.join(", ")}`);
  await select.selectOption({ label: wanted });
}

// Types a value into the number box of a control.
export async function type(page, label, value) {
  const input = control(page, label, 'input:not([type="range"])');
  await input.fill(String(value));
  await input.press("Enter");
}

export const shot = (page, name) => page.screenshot({ path: join(screenshots, `${name}.png`) });
