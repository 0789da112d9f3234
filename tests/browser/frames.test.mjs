// Frames of every kind that the protocol allows: a proxy between daemon and page inserts synthetic
// frames with known pixels.
import assert from "node:assert/strict";
import { deflateSync } from "node:zlib";
import { test } from "node:test";
import { pictureBox, sharedDaemon, shot } from "./support.mjs";

const shared = sharedDaemon();

// --- synthetic pictures and frames ---------------------------------------------------------------

function crc(bytes) {
  let sum = ~0;
  for (const byte of bytes) {
    sum ^= byte;
    for (let bit = 0; bit < 8; bit++) sum = (sum >>> 1) ^ (sum & 1 ? 0xedb88320 : 0);
  }
  return ~sum >>> 0;
}

function chunk(type, data) {
  const body = Buffer.concat([Buffer.from(type), data]);
  const ends = Buffer.alloc(8);
  ends.writeUInt32BE(data.length, 0);
  ends.writeUInt32BE(crc(body), 4);
  return Buffer.concat([ends.subarray(0, 4), body, ends.subarray(4)]);
}

// An RGB picture with 8 bits per channel; color(x, y) -> [r, g, b].
function png(width, height, color) {
  const rows = Buffer.alloc(height * (3 * width + 1));
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) rows.set(color(x, y), y * (3 * width + 1) + 1 + 3 * x);
  }
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 2, 0, 0, 0], 8);
  const parts = [chunk("IHDR", head), chunk("IDAT", deflateSync(rows)), chunk("IEND", Buffer.of())];
  return Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), ...parts]);
}

const corners = [
  [
    [200, 40, 40],
    [40, 200, 40],
  ],
  [
    [60, 60, 220],
    [230, 210, 50],
  ],
];
// A picture of four quadrants with distinct colours.
const quarters = (width, height) =>
  png(width, height, (x, y) => corners[y < height / 2 ? 0 : 1][x < width / 2 ? 0 : 1]);

// A frame with a PNG payload; flags: 1 final, 2 error measured, 4 estimated.
function frame(picture, { seq, rev, flags, width, height, error = NaN, jpegError = NaN }) {
  const header = Buffer.alloc(64);
  header.write("WSPL", 0);
  header.set([1, 1, 64, 0], 4);
  for (const [at, value] of [seq, rev, 0, flags].entries()) header.writeUInt32LE(value, 8 + 4 * at);
  header.writeUInt16LE(width, 24);
  header.writeUInt16LE(height, 26);
  header.set([2, 0, 1, 0], 28);
  header.writeFloatLE(error, 32);
  header.writeFloatLE(jpegError, 36);
  header.writeUInt32LE(picture.length, 52);
  return Buffer.concat([header, picture]);
}

// A proxy between the page and the daemon. While `closed` it withholds the daemon's frames.
class Between {
  closed = false;
  patches = 0;
  acks = [];
  seq = 0;

  async stand(page) {
    await page.routeWebSocket(/v1\/stream/, (socket) => {
      this.socket = socket;
      const server = socket.connectToServer();
      socket.onMessage((text) => {
        const message = JSON.parse(text);
        if (message.type === "ack") this.acks.push(message.seq);
        if (message.type === "patch") this.patches += 1;
        // Acknowledgements of inserted frames are not passed on.
        if (message.type !== "ack" || message.seq <= this.seq) server.send(text);
      });
      server.onMessage((message) => {
        if (typeof message !== "string") this.seq = message.readUInt32LE(8);
        if (!this.closed) socket.send(message);
      });
    });
  }

  // Inserts a frame, of the newest view unless `rev` is given.
  async show(page, { width, height, picture = quarters(width, height), flags = 0, ...header }) {
    this.closed = true;
    this.last = (this.last ?? this.seq + 1000) + 1;
    const rev = await page.evaluate(() =>
      Number(document.querySelector("#picture").dataset.wanted),
    );
    const own = { seq: this.last, rev, flags, width, height, ...header };
    this.socket.send(frame(picture, own));
    await page.waitForFunction(
      (seq) => Number(document.querySelector("#picture").dataset.seq) === seq,
      this.last,
      { polling: 20 },
    );
  }
}

function withPage(run) {
  const between = new Between();
  return shared.withPage(
    async (page) => {
      const { width, height } = await page.evaluate(() => {
        const { width, height } = document.querySelector("#picture");
        return { width, height };
      });
      await run(page, between, { width, height });
    },
    { prepare: (page) => between.stand(page) },
  );
}

// The colours of the canvas at fractions of its width and height, and its number of distinct
// colours.
const looks = (page, places) =>
  page.evaluate((wanted) => {
    const canvas = document.querySelector("#picture");
    const { width, height } = canvas;
    const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
    const at = ([x, y]) => {
      const n = 4 * (Math.floor(y * height) * width + Math.floor(x * width));
      return [data[n], data[n + 1], data[n + 2]];
    };
    return {
      at: wanted.map(at),
      colors: new Set(new Uint32Array(data.buffer)).size,
    };
  }, places);

const middles = [
  [0.25, 0.25],
  [0.75, 0.25],
  [0.25, 0.75],
  [0.75, 0.75],
];

// --- tests --------------------------------------------------------------------------------------

test("a PNG frame is drawn pixel by pixel", () =>
  withPage(async (page, between, { width, height }) => {
    await between.show(page, { width, height, flags: 1 });
    const shown = await looks(page, middles);
    assert.deepEqual(shown.at, corners.flat());
    assert.equal(shown.colors, 4, "nothing was scaled or compressed");
    assert.match(await page.locator("#hud-head").textContent(), / png /);
    assert.equal(await page.locator("#hud-encoding").textContent(), " · PNG lossless");
    assert.ok(between.acks.includes(between.last), "the frame was acknowledged");
  }));

test("smaller frames fill the canvas smoothly", () =>
  withPage(async (page, between, { width, height }) => {
    for (const share of [0.71, 0.5, 0.25, 0.06]) {
      const size = { width: Math.ceil(share * width), height: Math.ceil(share * height) };
      await between.show(page, size);
      const shown = await looks(page, [...middles, [0.001, 0.001], [0.999, 0.999]]);
      assert.deepEqual(shown.at, [...corners.flat(), corners[0][0], corners[1][1]], `${share}`);
      assert.ok(shown.colors > 4, `${shown.colors} colours: borders are soft`);
    }
  }));

test("frames at rest refine the view until the final one", () =>
  withPage(async (page, between, { width, height }) => {
    const mark = () => page.locator("#mark").textContent();
    const half = { width: Math.ceil(width / 2), height: Math.ceil(height / 2) };
    between.closed = true;
    const { patches } = between;
    await page.keyboard.press("ArrowRight");
    while (between.patches === patches) await page.waitForTimeout(20);
    assert.equal(
      (await mark()).split(" ")[0],
      "moving",
      "the final picture belongs to another view",
    );
    await between.show(page, { ...half, flags: 4, error: 0.031 });
    assert.equal(await mark(), "preview, 1/2 size");
    const error = page.locator("#hud-error");
    assert.equal(await error.textContent(), "error 0.031 est.");
    const estimated = await error.getAttribute("title");
    assert.equal(await page.locator("#hud-word").textContent(), " · visible");
    await between.show(page, { ...half, flags: 2, error: 0.012, jpegError: 3.2e-4 });
    assert.equal(await mark(), "refining, 1/2 size");
    assert.equal(await error.textContent(), "error 0.012 measured");
    assert.equal(await page.locator("#hud-word").textContent(), " · slight");
    assert.notEqual(await error.getAttribute("title"), estimated);
    await between.show(page, { width, height, flags: 2, error: 0.004 });
    assert.equal(await mark(), "refining");
    await shot(page, "refining");
    await between.show(page, { width, height, flags: 3, error: 3.2e-4 });
    assert.equal(await mark(), "final");
    assert.equal(await error.textContent(), "error 3.2e-4 measured");
    await between.show(page, { width, height, flags: 1 });
    assert.equal(await error.textContent(), "error unknown");
    assert.equal(await page.locator("#alert").isVisible(), false);
  }));

test("the HUD has no live region", () =>
  withPage(async (page) => {
    const live = await page.locator("#hud").evaluate((hud) => {
      // The notice that a requested reference is ready is the one exception.
      const parts = [hud, ...hud.querySelectorAll("*:not(#reference-words)")];
      const loud = (one) => one.ariaLive !== null || /status|alert|log/.test(one.role ?? "");
      return [parts.some(loud), hud.closest("[aria-live], [role=status], [role=alert]") !== null];
    });
    assert.deepEqual(live, [false, false]);
  }));

test("the canvas is never empty between frames of different sizes", () =>
  withPage(async (page, between, { width, height }) => {
    await between.show(page, { width, height });
    // Records the darkest of a few pixels at each display frame.
    await page.evaluate(() => {
      const canvas = document.querySelector("#picture");
      const context = canvas.getContext("2d");
      window.darkest = 255;
      window.seen = 0;
      const look = () => {
        for (const [x, y] of [
          [0.1, 0.1],
          [0.9, 0.2],
          [0.2, 0.9],
          [0.4, 0.6],
        ]) {
          const [px, py] = [Math.floor(x * canvas.width), Math.floor(y * canvas.height)];
          const { data } = context.getImageData(px, py, 1, 1);
          window.darkest = Math.min(window.darkest, Math.max(data[0], data[1], data[2]));
        }
        window.seen += 1;
        requestAnimationFrame(look);
      };
      look();
    });
    for (let n = 0; n < 12; n++) {
      const share = 1 - 0.075 * n;
      if (n % 4 === 3) {
        await page.setViewportSize({ width: 1440 - 30 * n, height: 900 - 20 * n });
      }
      const box = await pictureBox(page);
      await between.show(page, {
        width: Math.ceil(share * box.width),
        height: Math.ceil(share * box.height),
      });
    }
    const { seen, darkest } = await page.evaluate(() => ({ seen, darkest }));
    assert.ok(seen > 12, `${seen} display frames`);
    assert.ok(darkest >= 190, `darkest pixel ${darkest}`);
  }));

test("a picture keeps its aspect ratio in a window of another shape", () =>
  withPage(async (page, between, { width, height }) => {
    await between.show(page, { width, height, flags: 1 });
    const before = await pictureBox(page);
    await page.setViewportSize({ width: 1000, height: 900 });
    const box = await pictureBox(page);
    assert.ok(
      box.width / box.height < 0.8 * (before.width / before.height),
      "the aspect ratio has changed",
    );
    // Checks the screen instead of the canvas: an empty band above the picture.
    const image = (await page.screenshot({ clip: box })).toString("base64");
    const [band, inside] = await page.evaluate(async (data) => {
      const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes]));
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
      context.drawImage(bitmap, 0, 0);
      const at = (x, y) => [
        ...context.getImageData(x * bitmap.width, y * bitmap.height, 1, 1).data.slice(0, 3),
      ];
      return [at(0.3, 0.02), at(0.3, 0.4)];
    }, image);
    assert.deepEqual(band, [0, 0, 0]);
    assert.deepEqual(inside, corners[0][0]);
  }));
