// The live widget of the Python package: its module in Chromium, with a model that passes messages
// to Python's side of it (tests/clients/python/relay_stdio.py), which streams from a daemon.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { createInterface } from "node:readline";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import {
  finalPicture,
  freePort,
  openPage,
  patience,
  sharedDaemon,
  shot,
  state,
} from "../support.mjs";

const root = fileURLToPath(new URL("../../../", import.meta.url));
const widget = `${root}clients/python/windsplat/widget.js`;
const dataset = "climate:48x24x8";
const port = await freePort();
const origin = `http://127.0.0.1:${port}`;
const shared = sharedDaemon({ args: [dataset, "--allow-embed", origin] });
let site;

before(async () => {
  const pages = {
    "/": ["text/html", () => "<!doctype html><title>notebook</title><div id=cell></div>"],
    "/widget.js": ["text/javascript", () => readFileSync(widget)],
  };
  site = createServer((request, response) => {
    const [type, content] = pages[request.url] ?? ["text/plain", () => ""];
    response.setHeader("Content-Type", type).end(content());
  });
  site.listen(port, "127.0.0.1");
  await once(site, "listening");
});
after(() => site.close());

// Python's side; `receive` is called with each of its lines.
function pythonSide(receive) {
  const script = `${root}tests/clients/python/relay_stdio.py`;
  const child = spawn("/usr/bin/python3", ["-W", "ignore", script, shared.daemon.url, dataset], {
    stdio: ["pipe", "pipe", "inherit"],
  });
  createInterface({ input: child.stdout }).on("line", (line) => receive(JSON.parse(line)));
  return {
    send: (document) => child.stdin.write(`${JSON.stringify(document)}\n`),
    async end() {
      const ended = once(child, "exit");
      child.stdin.end();
      return (await ended)[0];
    },
  };
}

// A page that shows the widget; `act` gets the page, Python's side, and the messages of the page.
async function withWidget(act) {
  const sent = [];
  const answers = [];
  let deliver = () => {};
  let told;
  const traits = new Promise((resolve) => (told = resolve));
  const python = pythonSide((document) => {
    if (document.steps) told(document);
    else if (document.view) answers.shift()(document.view);
    else deliver(document);
  });
  const page = await openPage(shared.browser, `${origin}/`);
  try {
    await page.exposeFunction("toPython", (message) => {
      sent.push(message);
      python.send(message);
    });
    deliver = (document) =>
      page.evaluate((one) => window.fromPython(one), document).catch(() => {});
    await page.evaluate(
      async (values) => {
        const listeners = new Set();
        const model = {
          get: (name) => values[name],
          send: (message) => window.toPython(message),
          on: (_, listener) => listeners.add(listener),
          off: (_, listener) => listeners.delete(listener),
        };
        window.fromPython = ({ message, buffers }) => {
          const views = buffers.map(
            (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer),
          );
          for (const listener of listeners) listener(message, views);
        };
        const { default: module } = await import("/widget.js");
        window.leave = module.render({ model, el: document.getElementById("cell") });
      },
      { height: 300, ...(await traits) },
    );
    const viewOf = () =>
      new Promise((resolve) => {
        answers.push(resolve);
        python.send({ ask: "view" });
      });
    await act({ page, sent, viewOf });
    assert.deepEqual(page.faults, []);
  } finally {
    await page.context().close();
    assert.equal(await python.end(), 0);
  }
}

const canvas = (page) => page.getByRole("img");

// Waits for a final frame after `seq`; returns its number.
async function finalAfter(page, seq = 0) {
  await page.waitForFunction(
    (before) => {
      const { dataset } = document.querySelector("canvas");
      return Number(dataset.seq) > before && dataset.final === "true";
    },
    seq,
    { timeout: 20_000 * patience },
  );
  return Number(await canvas(page).getAttribute("data-seq"));
}

// Mean and largest value of the pixels, and a text that tells pictures apart.
const pixelsOf = (page) =>
  page.evaluate(() => {
    const picture = document.querySelector("canvas");
    const { data } = picture.getContext("2d").getImageData(0, 0, picture.width, picture.height);
    let bright = 0;
    let sum = 0;
    for (let k = 0; k < data.length; k += 4) {
      const value = Math.max(data[k], data[k + 1], data[k + 2]);
      if (value > 24) bright += 1;
      sum = (sum * 31 + data[k] + 7 * data[k + 1]) % 1_000_000_007;
    }
    return { bright: bright / (data.length / 4), sum, size: [picture.width, picture.height] };
  });

const azimuthOf = ({ eye, target }) => {
  const degrees = (Math.atan2(eye[0] - target[0], target[1] - eye[1]) * 180) / Math.PI;
  return degrees;
};
const distanceOf = ({ eye, target }) => Math.hypot(...eye.map((one, k) => one - target[k]));

test("the widget shows the view in its own size; a drag turns it as far as the pointer moves", () =>
  withWidget(async ({ page, viewOf }) => {
    let seq = await finalAfter(page);
    await page.waitForFunction(() => document.querySelector("canvas").height === 300);
    seq = await finalAfter(page);
    const first = await pixelsOf(page);
    assert.equal(first.size[1], 300);
    assert.ok(first.bright > 0.05, `${first.bright} of the pixels are bright`);
    const box = await canvas(page).boundingBox();
    assert.equal(Math.round(box.width), first.size[0]);
    await page.mouse.move(box.x + 300, box.y + 150);
    await page.mouse.down();
    await page.mouse.move(box.x + 400, box.y + 150, { steps: 8 });
    await page.mouse.up();
    seq = await finalAfter(page, seq);
    const { camera } = await viewOf();
    // 100 pixels of 0.35 degrees; the scene follows the pointer, so the eye goes to the west.
    assert.ok(Math.abs(azimuthOf(camera) + 35) < 0.5, `azimuth ${azimuthOf(camera)}`);
    assert.notEqual((await pixelsOf(page)).sum, first.sum);
    await shot(page, "python-widget");
    await page.mouse.dblclick(box.x + 300, box.y + 150);
    await finalAfter(page, seq);
    assert.equal((await pixelsOf(page)).sum, first.sum);
  }));

test("keys zoom, pan and turn; the slider chooses steps by name", () =>
  withWidget(async ({ page, viewOf }) => {
    let seq = await finalAfter(page);
    await canvas(page).focus();
    await page.keyboard.press("ArrowRight");
    seq = await finalAfter(page, seq);
    const before = (await viewOf()).camera;
    await page.keyboard.press("+");
    seq = await finalAfter(page, seq);
    const closer = (await viewOf()).camera;
    assert.ok(Math.abs(distanceOf(before) / distanceOf(closer) - 1.15) < 1e-6);
    await page.keyboard.press("Shift+ArrowUp");
    seq = await finalAfter(page, seq);
    const panned = (await viewOf()).camera;
    assert.ok(Math.abs(distanceOf(panned) - distanceOf(closer)) < 1e-9);
    assert.ok(panned.target[2] < closer.target[2], "what is shown moves up");
    const slider = page.getByRole("slider", { name: "time step" });
    await slider.focus();
    await page.keyboard.press("End");
    await finalAfter(page, seq);
    assert.equal((await viewOf()).step, 7);
    assert.equal(await slider.getAttribute("aria-valuetext"), "2001-01-02T18:00:00Z");
  }));

test("each frame is answered once it is drawn, and a widget that is removed ends its stream", () =>
  withWidget(async ({ page, sent }) => {
    const seq = await finalAfter(page);
    const shown = sent.filter(({ type }) => type === "shown").map((one) => one.seq);
    assert.equal(sent[0].type, "ready");
    assert.ok(shown.includes(seq));
    assert.equal(new Set(shown).size, shown.length);
    await page.evaluate(() => window.leave());
    await page.waitForTimeout(100);
    assert.equal(sent.at(-1).type, "close");
    const count = sent.length;
    await canvas(page).focus();
    await page.keyboard.press("ArrowLeft");
    await page.waitForTimeout(300);
    assert.equal(sent.filter(({ type }) => type === "shown").length, shown.length);
    assert.ok(sent.length <= count + 1);
  }));

test("view.widget() is a frame of the embedded page, which shows the view", async () => {
  let told;
  const first = new Promise((resolve) => (told = resolve));
  const python = pythonSide(told);
  const { html } = await first;
  const page = await openPage(shared.browser, `${origin}/`);
  try {
    await page.evaluate((text) => (document.getElementById("cell").innerHTML = text), html);
    const box = await page.locator("iframe").boundingBox();
    assert.equal(box.height, 240);
    const frame = page.frames()[1];
    await finalPicture(frame);
    assert.equal((await state(frame)).step, "3");
    // Chromium tells that a frame of another site does not take the focus, which is right here.
    const faults = page.faults.filter((one) => !one.startsWith("Blocked autofocusing"));
    assert.deepEqual(faults, []);
  } finally {
    await page.context().close();
    assert.equal(await python.end(), 0);
  }
});
