// Measures the latency from a mouse movement to the picture on the screen: a drag in chromium
// against a local daemon, climate at 1280x720, split into stages. Prints a table. Usage:
// tests/browser/run latency [--quick]
import { Daemon, finalPicture, freePort, launch, openPage, pictureBox } from "./support.mjs";

const size = { width: 1280, height: 720 };
const viewport = { width: 1440, height: 900 }; // the picture and the panel beside it
const quick = process.argv.includes("--quick");
const counts = quick
  ? { visits: 2, single: 5, drag: 30, echo: 5 }
  : { visits: 11, single: 60, drag: 300, echo: 50 };

// Runs in the page before its own scripts. Times are in ms of the page's clock. Wraps every browser
// function that handles a picture, so that the page's code needs no changes.
const watchWay = () => {
  const way = { events: [], patches: [], frames: [] };
  window.way = way;
  const now = () => performance.now();
  const note = (event) => {
    if (event.buttons !== 0) way.events.push({ born: event.timeStamp, handled: now() });
  };
  window.addEventListener("pointermove", note, true);

  const NativeSocket = window.WebSocket;
  window.WebSocket = class extends NativeSocket {
    constructor(...args) {
      super(...args);
      this.addEventListener("message", ({ data }) => {
        if (!(data instanceof ArrayBuffer)) return;
        const header = new DataView(data);
        const u32 = (at) => header.getUint32(at, true);
        way.frames.push({
          received: now(),
          rev: u32(12),
          final: (u32(20) & 1) !== 0,
          width: header.getUint16(24, true),
          queue: u32(40) / 1e3,
          render: u32(44) / 1e3,
          encode: u32(48) / 1e3,
          bytes: u32(52),
          t: header.getFloat64(56, true),
        });
      });
    }

    send(text) {
      const message = JSON.parse(text);
      if (message.type === "patch") way.patches.push({ rev: message.rev, sent: now() });
      super.send(text);
    }
  };

  const frameOf = new WeakMap(); // by bitmap
  const decode = window.createImageBitmap;
  window.createImageBitmap = async (...args) => {
    const frame = way.frames.at(-1);
    const bitmap = await decode.apply(window, args);
    frame.decoded = now();
    frameOf.set(bitmap, frame);
    return bitmap;
  };
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (bitmap, ...place) {
    draw.call(this, bitmap, ...place);
    const frame = frameOf.get(bitmap);
    if (frame === undefined) return;
    frame.drawn = now();
    queueMicrotask(() => (frame.updated = now())); // when legend, panels and HUD have been updated
    requestAnimationFrame(() => (frame.shown = now()));
  };
};

// Round-trip time of a refused patch in ms, without any rendering.
const echoes = (page, count) =>
  page.evaluate(async (wanted) => {
    const address = new URL("v1/stream", document.baseURI.replace(/^http/, "ws"));
    const socket = new WebSocket(address, "windsplat.v1");
    const next = () => new Promise((done) => (socket.onmessage = done));
    await next(); // hello
    const times = [];
    for (let n = 0; n < wanted; n++) {
      const sent = performance.now();
      socket.send(`{"type":"patch","rev":${n},"t":0,"patch":{"step":-1}}`);
      await next();
      times.push(performance.now() - sent);
    }
    socket.close();
    return times;
  }, count);

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

// The log of the events caused by `act`.
async function watched(page, act) {
  await finalPicture(page);
  await page.evaluate(() => Object.values(window.way).forEach((list) => (list.length = 0)));
  await act();
  await finalPicture(page);
  return page.evaluate(() => window.way);
}

// Moves the mouse along a small circle with its button down.
async function moves(page, count, pauseMs) {
  const box = await pictureBox(page);
  const at = (n) => [
    box.x + box.width / 2 + 90 * Math.sin(n / 15),
    box.y + box.height / 2 + 45 * Math.cos(n / 15),
  ];
  await page.mouse.move(...at(0));
  await page.mouse.down();
  for (let n = 1; n <= count; n++) {
    const until = performance.now() + pauseMs;
    await page.mouse.move(...at(n));
    await sleep(Math.max(0, until - performance.now()));
  }
  await page.mouse.up();
}

// Splits the latency of each event into stages, in ms, from the event to the first picture that
// shows it. The event belongs to the first patch sent afterwards. Queue, render and encode times
// are reported by the server; time in which the server was still drawing the previous frame counts
// as "frame before"; the rest between patch and frame is the transport.
function stages({ events, patches, frames }, echo) {
  return events.flatMap(({ born, handled }) => {
    const patch = patches.find(({ sent }) => sent >= handled);
    const number = frames.findIndex(({ rev, shown }) => rev >= patch?.rev && shown !== undefined);
    if (patch === undefined || number < 0) return [];
    const frame = frames[number];
    const { queue, render, encode } = frame;
    const outside = frame.received - frame.t - queue - render - encode;
    const before = frames[number - 1]?.received ?? 0;
    const wait = Math.min(Math.max(0, before - frame.t - echo), Math.max(0, outside));
    return [
      {
        "event to handler": handled - born,
        "handler to patch": patch.sent - handled,
        "newer patch instead": frame.t - patch.sent,
        "frame before": wait,
        queue,
        render,
        encode,
        transport: outside - wait,
        decode: frame.decoded - frame.received,
        draw: frame.drawn - frame.decoded,
        "to the display": frame.shown - frame.drawn,
        total: frame.shown - born,
      },
    ];
  });
}

function quantile(values, share) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
}

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

const ms = (value) => value.toFixed(2).padStart(9);
const columns = [(all) => quantile(all, 0.5), (all) => quantile(all, 0.95), mean];
const line = (name, values) =>
  `  ${name.padEnd(20)}${columns.map((column) => ms(column(values))).join("")}`;

function report(title, log, echo) {
  const all = stages(log, echo);
  if (all.length === 0) throw new Error(`${title}: no event has a picture`);
  const column = (name) => all.map((one) => one[name]);
  console.log(`\n${title}: ${all.length} events, ${log.frames.length} frames`);
  console.log(
    `  ${"ms".padEnd(20)}${["median", "p95", "mean"].map((w) => w.padStart(9)).join("")}`,
  );
  for (const name of Object.keys(all[0])) console.log(line(name, column(name)));
  const known = 100 * (1 - mean(column("transport")) / mean(column("total")));
  console.log(`  all stages but the transport are ${known.toFixed(0)} % of the mean`);
  const moving = log.frames.filter(({ final, updated }) => !final && updated !== undefined);
  if (moving.length === 0) return;
  const widths = [...new Set(moving.map(({ width }) => width))].sort((a, b) => a - b);
  const kB = mean(moving.map(({ bytes }) => bytes)) / 1e3;
  console.log(`  moving frames: ${widths.join(", ")} px wide, ${kB.toFixed(0)} kB`);
  const updated = moving.map((frame) => frame.updated - frame.drawn);
  console.log(line("panels and HUD", updated));
}

// New visitors one after the other, each with an empty cache: ms from the start of the navigation
// to the load event, the first displayed picture, and the final one.
async function visits(count) {
  const times = [];
  for (let n = 0; n < count; n++) {
    const page = await openPage(browser, daemon.url, { initScript: watchWay, viewport });
    await finalPicture(page);
    times.push(
      await page.evaluate(() => {
        const shown = window.way.frames.filter((frame) => frame.shown !== undefined);
        const final = shown.find((frame) => frame.final) ?? shown.at(-1);
        const [{ loadEventEnd: load }] = performance.getEntriesByType("navigation");
        return { load, first: shown[0].shown, final: final.shown };
      }),
    );
    await page.context().close();
  }
  return times;
}

const daemon = new Daemon(await freePort());
const browser = await launch();
try {
  await daemon.start();
  const page = await openPage(browser, daemon.url, { initScript: watchWay, viewport });
  await finalPicture(page);
  const box = await pictureBox(page);
  const window = page.viewportSize();
  await page.setViewportSize({
    width: Math.round(window.width + size.width - box.width),
    height: Math.round(window.height + size.height - box.height),
  });
  await page.waitForFunction(({ width, height }) => {
    const canvas = document.querySelector("#picture");
    return canvas.width === width && canvas.height === height;
  }, size);
  const seen = await visits(counts.visits);
  const echo = await echoes(page, counts.echo);
  console.log(`climate, ${size.width}x${size.height}, ${await browser.version()}, loopback`);
  for (const [name, key] of [
    ["page loaded", "load"],
    ["first picture", "first"],
    ["final picture", "final"],
  ]) {
    console.log(
      line(
        name,
        seen.map((visit) => visit[key]),
      ),
    );
  }
  console.log(line("round trip", echo));
  for (const [title, count, pauseMs] of [
    ["one move at a time", counts.single, 400],
    ["a drag at 60 events a second", counts.drag, 16.7],
  ]) {
    const log = await watched(page, () => moves(page, count, pauseMs));
    report(title, log, quantile(echo, 0.5));
  }
} finally {
  await browser.close();
  await daemon.kill();
}
