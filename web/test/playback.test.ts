// Playback in the page: the messages sent and the end of playback; the text of its pace; and the
// media of a view completed from the rendered view.
import assert from "node:assert/strict";
import { test } from "node:test";
import { paceText, stepsText } from "../src/viewport/frame_text";
import { Playback } from "../src/app/playback";
import type { ClientMessage, StatsMessage } from "@windsplat/client";
import { completeView } from "@windsplat/client/parts";

class Page {
  sent: ClientMessage[] = [];
  live = true;
  step = 3;
  settings = { steps: 10, fps: 24, loop: true, drop: true };
  readonly playback: Playback = new Playback({
    send: (message) => {
      if (this.live) this.sent.push(message);
      return this.live;
    },
    settings: () => this.settings,
    seek: (step) => {
      this.playback.pause();
      this.step = step;
    },
    changed: () => undefined,
  });

  frame(step: number): void {
    this.playback.shown(step, this.step);
    this.step = step;
  }

  said(): string[] {
    return this.sent.map((message) =>
      message.type === "play" ? `${message.from}>${message.to}@${message.fps}` : message.type,
    );
  }
}

test("play sends the whole range, backward from its end", () => {
  const page = new Page();
  page.settings = { steps: 10, fps: 12, loop: false, drop: false };
  page.playback.play(1);
  page.playback.play(-1);
  assert.deepEqual(page.sent, [
    { type: "play", from: 0, to: 9, fps: 12, loop: false, drop: false },
    { type: "play", from: 9, to: 0, fps: 12, loop: false, drop: false },
  ]);
  assert.equal(page.playback.direction, -1);
});

test("a single step or a lost connection plays nothing", () => {
  const page = new Page();
  page.settings.steps = 1;
  page.playback.play(1);
  assert.equal(page.playback.running, false);
  page.settings.steps = 10;
  page.live = false;
  page.playback.play(1);
  assert.equal(page.playback.running, false);
  assert.deepEqual(page.sent, []);
});

test("a new speed is sent only during playback", () => {
  const page = new Page();
  page.playback.again();
  page.playback.play(-1);
  page.settings.fps = 60;
  page.playback.again();
  page.playback.pause();
  page.playback.again();
  page.playback.pause();
  assert.deepEqual(page.said(), ["9>0@24", "9>0@60", "pause"]);
});

test("dragging the slider pauses playback and continues in the same direction", () => {
  const page = new Page();
  page.playback.play(-1);
  for (const step of [5, 6, 7]) page.playback.scrub(step);
  assert.equal(page.playback.running, false);
  page.playback.scrubbed();
  assert.deepEqual(page.said(), ["9>0@24", "pause", "9>0@24"]);
  assert.equal(page.step, 7);
  page.playback.pause();
  page.playback.scrub(2);
  page.playback.scrubbed();
  assert.equal(page.playback.running, false, "without playback, dragging the slider starts none");
});

test("without loop playback ends at its last step", () => {
  for (const [direction, end] of [
    [1, 9],
    [-1, 0],
  ] as const) {
    const page = new Page();
    page.settings.loop = false;
    page.playback.play(direction);
    page.frame(3 + direction);
    page.frame(9 - end);
    assert.equal(page.playback.running, true, "the opposite end does not stop playback");
    page.frame(end);
    assert.equal(page.playback.running, false);
  }
});

test("an earlier frame of the last step does not end a restarted playback", () => {
  const page = new Page();
  page.settings.loop = false;
  page.step = 9;
  page.playback.play(1);
  page.frame(9);
  assert.equal(page.playback.running, true);
  page.frame(0);
  page.frame(9);
  assert.equal(page.playback.running, false);
});

const stats = (change: Partial<StatsMessage>): StatsMessage => ({
  type: "stats",
  frames: 1,
  dropped: 0,
  cancelled: 0,
  bytes: 0,
  playFps: null,
  stepsDropped: 0,
  stepsNotReady: 0,
  ...change,
});

test("the pace is formatted as text", () => {
  assert.equal(paceText(23.96), "24 steps/s");
  assert.equal(paceText(0.5), "0.5 steps/s");
  assert.equal(stepsText(stats({})), "");
  assert.equal(
    stepsText(stats({ stepsDropped: 7, stepsNotReady: 2 })),
    "steps: 7 dropped · 2 loaded late",
  );
});

test("a partial medium is completed by the rendered one of its field", () => {
  const drawn = { scalars: [{ field: "a", stride: 2, color: { map: "ice" } }, { field: "b" }] };
  const said = { step: 4, scalars: [{ field: "a", color: { range: [0, 1] } }, { field: "c" }] };
  assert.deepEqual(completeView(drawn as never, said as never), {
    step: 4,
    scalars: [{ field: "a", stride: 2, color: { map: "ice", range: [0, 1] } }, { field: "c" }],
  });
  assert.deepEqual(completeView(drawn as never, {}), drawn);
});
