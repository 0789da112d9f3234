// The announcement of video: withdrawn after a failure of the decoder, and tried again.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { offerVideo, videoUse } from "../src/view/video_setting";

const minute = 60_000;

class Page {
  announced: string[][] = [];
  notes: string[] = [];
  private now = 0;
  private timers = new Map<number, { due: number; run: () => void }>();
  private last = 0;
  readonly offer = offerVideo(
    {
      setTimeout: (run, ms) => {
        this.timers.set(++this.last, { due: this.now + ms, run });
        return this.last;
      },
      clearTimeout: (timer) => this.timers.delete(timer),
      random: () => 0.5,
    },
    {
      send: (message) => {
        if (message.type === "video") this.announced.push(message.codecs);
      },
      note: (text) => this.notes.push(text),
    },
  );

  async wait(ms: number): Promise<void> {
    this.now += ms;
    for (const [timer, { due, run }] of [...this.timers]) {
      if (due > this.now) continue;
      this.timers.delete(timer);
      run();
    }
    await new Promise((done) => setImmediate(done)); // the browser tells what it decodes
  }

  async greeted(): Promise<void> {
    this.offer.greet();
    await this.wait(0);
  }

  get offers(): number {
    return this.announced.filter((codecs) => codecs.length > 0).length;
  }
}

beforeEach(() => {
  videoUse.set("auto");
  Object.assign(globalThis, {
    isSecureContext: true,
    VideoDecoder: { isConfigSupported: async () => ({ supported: true }) },
  });
});

test("a failed decoder withdraws the announcement, is told once and tried again", async () => {
  const page = new Page();
  await page.greeted();
  assert.deepEqual(page.announced, [["avc1.640033"]]);
  page.offer.failed();
  assert.deepEqual(page.announced.at(-1), []);
  assert.equal(page.notes.length, 1);
  await page.wait(minute - 1);
  assert.equal(page.offers, 1);
  await page.wait(1);
  assert.equal(page.offers, 2);
  page.offer.failed();
  assert.equal(page.notes.length, 1);
  await page.wait(minute);
  assert.equal(page.offers, 2, "the next wait is longer");
  await page.wait(minute);
  assert.equal(page.offers, 3);
});

test("another failure before the next attempt changes nothing", async () => {
  const page = new Page();
  await page.greeted();
  page.offer.failed();
  page.offer.failed();
  assert.equal(page.announced.length, 2);
  await page.wait(minute);
  assert.equal(page.offers, 2);
});

test("a new connection tries video again at once, and once only", async () => {
  const page = new Page();
  await page.greeted();
  page.offer.failed();
  await page.greeted();
  assert.equal(page.offers, 2);
  await page.wait(60 * minute);
  assert.equal(page.offers, 2);
});

test("waits between attempts are an hour at most", async () => {
  const page = new Page();
  await page.greeted();
  for (let n = 0; n < 12; n++) {
    page.offer.failed();
    await page.wait(60 * minute);
    assert.equal(page.offers, n + 2);
  }
});

test("video that the user forbids is not tried again", async () => {
  const page = new Page();
  await page.greeted();
  page.offer.failed();
  videoUse.set("never");
  await page.wait(60 * minute);
  await page.greeted();
  assert.equal(page.offers, 1);
  videoUse.set("auto");
  await page.wait(0);
  assert.equal(page.offers, 2);
});
