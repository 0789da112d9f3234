// The line motion: its pace, its waiting for frames, and its end.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Flow, flowFps, laterTime } from "../src/view/flow";

// A page with a clock that the test advances.
class Page {
  clock = 0;
  isHidden = false;
  isWanted = true;
  at = 0;
  sent: number[] = []; // times in ms at which a patch was sent
  ends: boolean[] = []; // for each reported end: whether the motion was still running
  rev = 0;
  private timers = new Map<number, { due: number; run: () => void }>();
  private lastTimer = 0;
  readonly flow = new Flow({
    now: () => this.clock,
    setTimeout: (run, ms) => {
      this.timers.set(++this.lastTimer, { due: this.clock + ms, run });
      return this.lastTimer;
    },
    clearTimeout: (timer) => this.timers.delete(timer),
    hidden: () => this.isHidden,
    wanted: () => this.isWanted,
    time: () => this.at,
    send: (time) => {
      this.at = time;
      this.sent.push(this.clock);
      return ++this.rev;
    },
    ended: () => this.ends.push(this.flow.running),
  });

  get waiting(): number {
    return this.timers.size;
  }

  // Requested frames arrive after `frameMs`; null: never.
  run(ms: number, frameMs: number | null): void {
    const end = this.clock + ms;
    const frames: { due: number; rev: number }[] = [];
    let seen = this.rev;
    for (; this.clock < end; this.clock++) {
      for (const [timer, { due, run }] of [...this.timers]) {
        if (due > this.clock) continue;
        this.timers.delete(timer);
        run();
      }
      if (frameMs !== null && this.rev > seen) {
        seen = this.rev;
        frames.push({ due: this.clock + frameMs, rev: seen });
      }
      while (frames.length > 0 && frames[0]!.due <= this.clock) {
        this.flow.answered(frames.shift()!.rev);
      }
    }
  }
}

test("lines move one step per second at any frame rate", () => {
  for (const frameMs of [5, 60, 150]) {
    const page = new Page();
    page.flow.start();
    page.run(4000, frameMs);
    assert.ok(Math.abs(page.at - 4) < 0.3, `${page.at} steps after 4 s of ${frameMs} ms frames`);
  }
});

test("fast frames are requested at most 15 times a second", () => {
  const page = new Page();
  page.flow.start();
  page.run(2000, 5);
  assert.ok(page.sent.length <= 2 * flowFps + 1, `${page.sent.length}`);
  assert.ok(page.sent.length >= 2 * flowFps - 4, `${page.sent.length}`);
});

test("slow frames are awaited with at most one pending request", () => {
  const page = new Page();
  page.flow.start();
  page.run(3000, 400);
  for (let n = 1; n < page.sent.length; n++) {
    assert.ok(page.sent[n]! - page.sent[n - 1]! >= 400);
  }
  assert.ok(page.sent.length >= 6 && page.sent.length <= 8, `${page.sent.length}`);
  const silent = new Page();
  silent.flow.start();
  silent.run(5000, null);
  assert.equal(silent.sent.length, 1, "without an answer no further frame is requested");
  assert.equal(silent.waiting, 0);
  silent.flow.seen();
  silent.flow.answered(silent.rev - 1);
  silent.run(1000, null);
  assert.equal(silent.sent.length, 1, "nor when the page is shown or an older frame arrives");
});

test("a hidden page requests nothing and continues without a jump", () => {
  const page = new Page();
  page.flow.start();
  page.run(1000, 5);
  page.isHidden = true;
  const [moves, at] = [page.sent.length, page.at];
  page.run(10_000, 5);
  assert.equal(page.sent.length, moves);
  assert.equal(page.waiting, 0, "no timer runs for a hidden page");
  page.isHidden = false;
  page.flow.seen();
  page.run(1000, 5);
  assert.ok(page.at > at + 0.5 && page.at < at + 1.5, `${at} -> ${page.at}`);
});

test("stop, an error or static lines end the motion", () => {
  const stops: ((page: Page) => void)[] = [
    (page) => page.flow.stop(),
    (page) => page.flow.refused(page.rev),
    (page) => (page.isWanted = false),
  ];
  for (const stop of stops) {
    const page = new Page();
    page.flow.start();
    page.run(500, 5);
    const moves = page.sent.length;
    assert.ok(moves > 3);
    stop(page);
    page.run(1000, 5);
    assert.equal(page.flow.running, false);
    assert.equal(page.sent.length, moves);
    assert.equal(page.waiting, 0);
  }
  const page = new Page();
  page.flow.start();
  page.run(500, 5);
  page.flow.refused(page.rev + 1);
  assert.equal(page.flow.running, true, "the refusal of another patch does not end the motion");
});

test("the page is notified once of an end that it did not request", () => {
  const ends = (end: (page: Page) => void): boolean[] => {
    const page = new Page();
    page.flow.start();
    page.run(500, 5);
    assert.deepEqual(page.ends, []);
    end(page);
    page.run(1000, 5);
    page.flow.refused(page.rev);
    return page.ends;
  };
  assert.deepEqual(
    ends((page) => (page.isWanted = false)),
    [false],
  );
  assert.deepEqual(
    ends((page) => page.flow.refused(page.rev)),
    [false],
  );
  assert.deepEqual(
    ends((page) => page.flow.stop()),
    [],
  );
});

test("motion stopped while a frame is due restarts at once", () => {
  const page = new Page();
  page.flow.start();
  page.run(500, null);
  page.flow.stop();
  page.flow.start();
  page.run(500, 5);
  assert.ok(page.sent.length > 4, `${page.sent.length}`);
});

test("a stall does not advance the phase, which stays within the protocol limit", () => {
  assert.equal(laterTime(2, 100), 2.1);
  assert.equal(laterTime(2, 60_000), 2.25);
  assert.equal(laterTime(2, -50), 2);
  assert.equal(laterTime(999_999.99, 200), 0);
});
