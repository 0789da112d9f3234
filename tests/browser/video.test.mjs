// Video over a slow link in a real browser: a proxy between daemon and page delays frames as such a
// link does; the browser's own decoder draws them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { assertDrawn, control, drag, finalPicture, pixels, sharedDaemon } from "./support.mjs";

const shared = sharedDaemon({ page: { unfolded: ["Quality"] } });

const bytesPerMs = 150;
const codecs = { 1: "jpeg", 2: "png", 3: "h264" };

// Passes messages on one after the other, at the rate of the link. While `holds`, it keeps final
// frames.
class SlowLink {
  holds = false;
  frames = []; // headers of frames passed on
  announced = []; // codecs of each announcement of the page
  acked = 0;
  held = [];
  free = 0;
  socket = null; // of the page

  async stand(page) {
    await page.routeWebSocket(/v1\/stream/, (socket) => {
      const server = socket.connectToServer();
      this.socket = socket;
      socket.onMessage((text) => {
        const message = JSON.parse(text);
        if (message.type === "video") this.announced.push(message.codecs);
        if (message.type === "ack") this.acked = Math.max(this.acked, message.seq);
        server.send(text);
      });
      server.onMessage((message) => {
        const now = performance.now();
        this.free = Math.max(this.free, now) + message.length / bytesPerMs;
        setTimeout(() => this.pass(socket, message), this.free - now);
      });
    });
  }

  pass(socket, message) {
    if (typeof message !== "string") {
      const flags = message.readUInt32LE(20);
      const frame = { final: (flags & 1) !== 0, key: (flags & 16) !== 0 };
      frame.codec = codecs[message[28]];
      frame.seq = message.readUInt32LE(8);
      if (frame.final && this.holds) {
        this.held.push(() => socket.send(message));
        return;
      }
      this.frames.push(frame);
    }
    socket.send(message);
  }

  release() {
    this.holds = false;
    for (const send of this.held.splice(0)) send();
  }

  moving(codec) {
    return this.frames.filter((frame) => !frame.final && frame.codec === codec);
  }
}

function withLink(run, options = {}) {
  const link = new SlowLink();
  return shared.withPage((page) => run(page, link), {
    ...options,
    prepare: (page) => link.stand(page),
  });
}

async function dragUntil(page, done) {
  for (let n = 0; n < 12 && !done(); n++) await drag(page, n % 2 === 0 ? 120 : -120, 0, 30);
  assert.ok(done(), "frames of that kind were received");
}

const until = async (done) => {
  for (let n = 0; n < 500 && !(await done()); n++) {
    await new Promise((next) => setTimeout(next, 20));
  }
  assert.ok(await done());
};

test("moving frames of a slow link are video, and look like the final picture", () =>
  withLink(async (page, link) => {
    assert.deepEqual(link.announced, [["avc1.640033"]]);
    await dragUntil(page, () => link.moving("h264").length >= 8);
    assert.ok(link.moving("h264")[0].key, "the first frame is a key frame");
    await finalPicture(page);
    link.holds = true;
    await drag(page, 60, 20, 20);
    await until(() => link.held.length > 0 || link.acked >= link.frames.at(-1).seq);
    const last = link.frames.at(-1);
    assert.equal(last.codec, "h264");
    await page.waitForFunction(
      (seq) => Number(document.querySelector("#picture").dataset.seq) === seq,
      last.seq,
      { polling: 20 },
    );
    const video = await pixels(page);
    link.release();
    await finalPicture(page);
    const final = await pixels(page);
    assertDrawn(video);
    // The last moving frame may be of a view a little earlier.
    assert.ok(Math.abs(video.mean - final.mean) < 3, `${video.mean}, ${final.mean}`);
    assert.ok(Math.abs(video.deviation - final.deviation) < 4);
    assert.ok(
      link.frames.at(-1).seq > last.seq && link.frames.every((f) => !f.final || f.codec !== "h264"),
    );
    assert.deepEqual(link.announced, [["avc1.640033"]], "the decoder did not fail");
  }));

test("every frame of video returns its credit, also after its decoder failed", () =>
  withLink(
    async (page, link) => {
      await dragUntil(page, () => link.announced.length === 2);
      assert.deepEqual(link.announced, [["avc1.640033"], []]);
      const failed = link.frames.length;
      await dragUntil(page, () => link.frames.length > failed + 6);
      await finalPicture(page);
      assert.ok(
        link.frames.slice(failed + 3).every(({ codec }) => codec === "jpeg"),
        "JPEG, but for frames in flight",
      );
      assert.equal(link.acked, link.frames.at(-1).seq);
    },
    {
      initScript: () => {
        let units = 0;
        const { decode } = VideoDecoder.prototype;
        VideoDecoder.prototype.decode = function (chunk) {
          units += 1;
          if (units === 4) throw new DOMException("no memory", "EncodingError");
          return decode.call(this, chunk);
        };
      },
    },
  ));

test("a failed decoder is told to the user, and video is tried again on a new connection", () =>
  withLink(
    async (page, link) => {
      const told = () => page.evaluate(() => window.told.length);
      await dragUntil(page, () => link.announced.length === 2);
      await until(async () => (await told()) === 1);
      await dragUntil(page, () => link.frames.at(-1).codec === "jpeg");
      await link.socket.close({ code: 1012 });
      await until(() => link.announced.length === 3);
      assert.deepEqual(link.announced[2], ["avc1.640033"]);
      const before = link.moving("h264").length;
      await dragUntil(page, () => link.moving("h264").length >= before + 8);
      assert.equal(link.announced.length, 3, "the decoder did not fail again");
      assert.equal(await told(), 1);
    },
    {
      initScript: () => {
        let units = 0;
        const { decode } = VideoDecoder.prototype;
        VideoDecoder.prototype.decode = function (chunk) {
          units += 1;
          if (units === 4) throw new DOMException("no memory", "EncodingError");
          return decode.call(this, chunk);
        };
        window.told = [];
        addEventListener("DOMContentLoaded", () => {
          const line = document.querySelector("#status");
          new MutationObserver(() => {
            if (line.textContent.includes("failed to decode video")) window.told.push(1);
          }).observe(line, { childList: true, characterData: true, subtree: true });
        });
      },
    },
  ));

test("a decoder that returns no pictures does not stop the stream", () =>
  withLink(
    async (page, link) => {
      await dragUntil(page, () => link.moving("h264").length >= 1);
      await until(() => link.announced.length === 2);
      assert.deepEqual(link.announced[1], []);
      await finalPicture(page);
      await dragUntil(page, () => link.frames.at(-1).codec === "jpeg");
      assert.ok(link.acked >= link.moving("h264").at(-1).seq);
    },
    { initScript: () => (VideoDecoder.prototype.decode = () => {}) },
  ));

test("a browser without the decoder announces nothing", () =>
  withLink(
    async (page, link) => {
      await dragUntil(page, () => link.moving("jpeg").length >= 10);
      assert.deepEqual(link.announced, []);
      assert.deepEqual(link.moving("h264"), []);
    },
    { initScript: () => delete window.VideoDecoder },
  ));

test("the setting 'never' gives JPEG, also after a reload", () =>
  withLink(async (page, link) => {
    await control(page, "video for slow links").selectOption("never");
    await until(() => link.announced.length === 2);
    assert.deepEqual(link.announced[1], []);
    await dragUntil(page, () => link.moving("jpeg").length >= 10);
    assert.deepEqual(link.moving("h264"), []);
    await page.reload();
    await finalPicture(page);
    assert.equal(link.announced.length, 2, "nothing is announced");
    assert.equal(await control(page, "video for slow links").inputValue(), "never");
  }));
