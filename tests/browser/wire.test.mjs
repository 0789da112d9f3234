// The page's protocol handling: data arriving byte by byte, and recorded sessions replayed at full
// speed.
import assert from "node:assert/strict";
import { connect, createServer } from "node:net";
import { test } from "node:test";
import { drag, finalPicture, openPage, patience, pixels, sharedDaemon, state } from "./support.mjs";

const small = { viewport: { width: 500, height: 420 } };
const shared = sharedDaemon({ page: small });
const { withPage } = shared;

// A proxy that forwards the daemon's data one byte at a time, each in a TCP segment of its own
// unless the system merges unread ones.
async function byteProxy(port) {
  const counts = { segments: 0, reads: 0 };
  const sockets = new Set();
  const server = createServer({ noDelay: true }, (near) => {
    const far = connect({ port, host: "127.0.0.1", noDelay: true });
    sockets.add(near).add(far);
    near.pipe(far);
    for (const socket of [near, far]) {
      socket.on("error", () => [near, far].forEach((each) => each.destroy()));
    }
    (async () => {
      for await (const chunk of far) {
        counts.reads += 1;
        for (let n = 0; n < chunk.length && !near.destroyed; n++) {
          counts.segments += 1;
          await new Promise((resolve) => near.write(chunk.subarray(n, n + 1), resolve));
        }
      }
      near.end();
    })().catch(() => near.destroy());
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return {
    counts,
    port: server.address().port,
    close: () => {
      for (const socket of sockets) socket.destroy();
      server.close();
    },
  };
}

test("page and frames received one byte at a time are unchanged", (t) =>
  withPage(async (whole) => {
    const proxy = await byteProxy(shared.daemon.port);
    t.after(proxy.close);
    const torn = await openPage(shared.browser, `http://127.0.0.1:${proxy.port}/`, {
      ...small,
      prepare: (page) => page.setDefaultTimeout(120_000 * patience),
    });
    t.after(() => torn.context().close());
    await finalPicture(torn);
    assert.deepEqual(await pixels(torn), await pixels(whole));
    assert.ok(proxy.counts.segments > 60_000, `${proxy.counts.segments} single-byte segments`);
    assert.ok(proxy.counts.segments > 100 * proxy.counts.reads, "the daemon sent far fewer chunks");
    for (const page of [whole, torn]) {
      await page.locator("#picture").focus();
      await page.keyboard.press("ArrowRight");
      await finalPicture(page);
      assert.deepEqual(page.faults, []);
    }
    assert.deepEqual(
      await pixels(torn),
      await pixels(whole),
      "the pictures are equal after a camera change",
    );
  }));

// Runs before the page's scripts: records every received message, and the sent messages in order.
const record = () => {
  window.tape = [];
  const Native = window.WebSocket;
  window.WebSocket = class extends Native {
    constructor(...args) {
      super(...args);
      window.tape.length = 0;
      this.addEventListener("message", ({ data }) => {
        if (typeof data === "string") return window.tape.push({ text: data });
        let binary = "";
        for (const byte of new Uint8Array(data)) binary += String.fromCharCode(byte);
        window.tape.push({ base64: btoa(binary) });
      });
    }
    send(text) {
      const { type, rev } = JSON.parse(text);
      if (type === "open" || type === "patch") window.tape.push({ sent: type, rev });
      return super.send(text);
    }
  };
};

// Runs before the page's scripts: a socket that replays the tape: answers to the page's first
// messages once those are sent, everything else without delay. Counts concurrent picture decodes.
const replay = (tape) => {
  window.played = { acks: [], sent: 0, frames: 0, decodes: 0, decodesMost: 0, decoded: 0 };
  const { played } = window;
  const decode = window.createImageBitmap.bind(window);
  window.createImageBitmap = async (...args) => {
    played.decodes += 1;
    played.decodesMost = Math.max(played.decodesMost, played.decodes);
    try {
      return await decode(...args);
    } finally {
      played.decodes -= 1;
      played.decoded += 1;
    }
  };
  window.WebSocket = class {
    constructor() {
      this.readyState = 0;
      this.bufferedAmount = 0;
      this.next = 0;
      setTimeout(() => {
        this.readyState = 1;
        this.play();
      });
    }
    send(text) {
      const message = JSON.parse(text);
      if (message.type === "ack") played.acks.push(message.seq);
      if (message.type === "open" || message.type === "patch") {
        played.sent += 1;
        queueMicrotask(() => this.play());
      }
    }
    close() {
      played.closed = true;
    }
    play() {
      for (; this.next < tape.length; this.next++) {
        const entry = tape[this.next];
        // The tape waits only for the page's first messages; later ones are not awaited.
        if (entry.sent !== undefined) {
          if (entry.first && played.sent < entry.first) return;
          continue;
        }
        if (entry.base64 !== undefined) played.frames += 1;
        const data =
          entry.text ?? Uint8Array.from(atob(entry.base64), (c) => c.charCodeAt(0)).buffer;
        this.onmessage?.({ data });
      }
    }
  };
};

const recorded = (run) =>
  withPage(
    async (page) => {
      await run(page);
      await finalPicture(page);
      const tape = await page.evaluate(() => window.tape);
      let said = 0;
      const opening = tape.findIndex(({ base64 }) => base64 !== undefined);
      tape.forEach((entry, n) => {
        if (entry.sent !== undefined && n < opening) entry.first = ++said;
      });
      return { tape, pixels: await pixels(page), state: await state(page) };
    },
    { initScript: record },
  );

const sessions = {
  "a turn": (page) => drag(page, 150, 60, 80),
  "a course of time": async (page) => {
    await page.keyboard.press("Space");
    await page.waitForFunction(() => Number(document.querySelector("#picture").dataset.step) >= 5);
    await page.keyboard.press("Space");
  },
};

for (const [name, run] of Object.entries(sessions)) {
  test(`${name}, replayed at full speed, ends in the same picture`, async () => {
    const { tape, pixels: expected, state: last } = await recorded(run);
    await withPage(
      async (page) => {
        await page.waitForFunction(
          (seq) => document.querySelector("#picture").dataset.seq === seq,
          last.seq,
        );
        assert.deepEqual(await pixels(page), expected);
        const played = await page.evaluate(() => window.played);
        assert.ok(played.frames > 5, `${played.frames} frames were recorded`);
        assert.ok(played.decodesMost <= 2, `${played.decodesMost} decoded at a time`);
        assert.ok(played.decoded < played.frames, "replaced frames are not decoded");
        // Two pictures are decoded at a time, and the later one may finish first.
        assert.equal(
          Math.max(...played.acks),
          Number(last.seq),
          "the newest frame is acknowledged",
        );
        assert.equal(
          new Set(played.acks).size,
          played.acks.length,
          "each frame is acknowledged at most once",
        );
        assert.equal(played.closed, undefined, "the page detects no protocol error");
      },
      { settle: false, prepare: (page) => page.addInitScript(replay, tape) },
    );
  });
}
