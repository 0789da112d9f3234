// Undo and redo: which changes form an entry, and that undo and redo are inverse.
import assert from "node:assert/strict";
import { test } from "node:test";
import { differences, ViewHistory } from "../src/view/history";
import type { View } from "@windsplat/client";
import { mergeView } from "@windsplat/client/parts";

// A user with a view and a clock that is set by the test.
class Desk {
  readonly history = new ViewHistory();
  now = 0;

  constructor(public view: View = { dataset: "storm" }) {}

  // A change by the user, `ms` later.
  change(patch: object, ms = 10): void {
    this.now += ms;
    const before = this.view;
    this.view = mergeView(before, patch);
    this.history.note(before, this.view, this.now);
  }

  // A change not made by the user.
  runs(patch: object): void {
    this.view = mergeView(this.view, patch);
  }

  undo(): string | null {
    const undone = this.history.undo(this.view);
    if (undone !== null) this.view = undone.view;
    return undone?.what ?? null;
  }

  redo(): string | null {
    const redone = this.history.redo(this.view);
    if (redone !== null) this.view = redone.view;
    return redone?.what ?? null;
  }
}

const eye = (x: number) => ({ camera: { eye: [x, -3, 0] } });

test("everything during one pointer press is one entry", () => {
  const desk = new Desk();
  desk.history.begin(true);
  for (let n = 1; n <= 500; n++) desk.change(eye(n), n === 250 ? 5000 : 10);
  desk.change({ vector: { length: 2 } });
  desk.history.end();
  desk.change(eye(501)); // sent with the next display frame
  assert.deepEqual(desk.view.camera!.eye, [501, -3, 0]);
  desk.undo();
  desk.undo();
  assert.deepEqual(desk.view, { dataset: "storm" });
  assert.equal(desk.undo(), null);
});

test("the last patch of a drag joins its entry after release", () => {
  const desk = new Desk();
  desk.history.begin(true);
  desk.change(eye(1));
  desk.history.end();
  desk.change(eye(2), 16);
  assert.equal(desk.undo(), "camera");
  assert.deepEqual(desk.view, { dataset: "storm" });
});

test("a burst of equal keys is one entry, a pause or another key starts a new one", () => {
  const desk = new Desk();
  for (let n = 1; n <= 30; n++) desk.change(eye(n), 590);
  desk.change(eye(100), 601);
  desk.change({ vector: { length: 2 } });
  desk.change({ vector: { opacity: 0.5 } });
  assert.deepEqual([desk.undo(), desk.undo()], ["lines", "lines"]);
  assert.deepEqual(desk.view, { dataset: "storm", ...eye(100) });
});

test("a partial camera change joins a full one", () => {
  const desk = new Desk();
  desk.change({ camera: { eye: [1, -3, 0], target: [0, 0, 0], height: 2 } });
  desk.change({ camera: { eye: [1, -2, 0], target: [0, 0, 0], height: 1 } });
  desk.undo();
  assert.deepEqual(desk.view, { dataset: "storm" });
});

test("another pointer press starts a new entry", () => {
  const desk = new Desk();
  desk.history.begin(false);
  desk.change(eye(1));
  desk.history.begin(false);
  desk.change(eye(2));
  assert.equal(desk.undo(), "camera");
  assert.deepEqual(desk.view.camera!.eye, [1, -3, 0]);
});

test("a gesture that returns to its start leaves no entry", () => {
  const desk = new Desk({ vector: { length: 1 } });
  desk.history.begin(true);
  desk.change({ vector: { length: 2 } });
  desk.change({ vector: { length: 1 } });
  assert.equal(desk.history.canUndo, false);
});

test("redo reverts undo, and a new change clears it", () => {
  const desk = new Desk();
  const seen = [desk.view];
  for (const patch of [eye(1), { scalars: [{ field: "t" }] }, { vector: { field: null } }]) {
    desk.change(patch, 1000);
    seen.push(desk.view);
  }
  assert.deepEqual([desk.undo(), desk.undo(), desk.undo()], ["lines", "volumes", "camera"]);
  assert.deepEqual(desk.view, seen[0]);
  for (let n = 1; n < seen.length; n++) {
    assert.notEqual(desk.redo(), null);
    assert.deepEqual(desk.view, seen[n]);
  }
  assert.equal(desk.redo(), null);
  desk.undo();
  desk.change({ step: 2 });
  assert.deepEqual([desk.history.canRedo, desk.undo()], [false, "time step"]);
});

test("playback and the window size are not undone", () => {
  const desk = new Desk({ step: 0, image: { width: 800, height: 600 } });
  desk.change(eye(1));
  desk.runs({ step: 7, vector: { motion: { time: 3 } } });
  desk.change({ image: { width: 400 } });
  assert.equal(desk.undo(), "camera");
  const image = { width: 400, height: 600 };
  assert.deepEqual(desk.view, { step: 7, image, vector: { motion: { time: 3 } } });
});

test("undo of a gesture during playback keeps the played steps", () => {
  const desk = new Desk({ step: 0 });
  desk.history.begin(true);
  desk.change(eye(1));
  desk.runs({ step: 3 });
  desk.change(eye(2));
  assert.equal(desk.undo(), "camera");
  assert.deepEqual(desk.view, { step: 3 });
});

test("opening a dataset is an entry that restores the previous view", () => {
  const before: View = { dataset: "storm", step: 4, vector: { field: "wind" } };
  const desk = new Desk(before);
  desk.now = 1;
  desk.view = { dataset: "calm" };
  desk.history.note(before, desk.view, desk.now);
  assert.equal(desk.undo(), "dataset");
  assert.deepEqual(desk.view, before);
});

test("entries without effect are skipped", () => {
  const desk = new Desk();
  desk.change(eye(1), 1000);
  const stands = desk.view;
  desk.change({ vector: { length: 99 } }, 1000);
  desk.view = stands; // the server refused the change
  assert.equal(desk.undo(), "camera");
});

test("the history holds two hundred entries", () => {
  const desk = new Desk({ step: 0 });
  for (let n = 1; n <= 250; n++) desk.change({ step: n }, 1000);
  let undone = 0;
  while (desk.undo() !== null) undone += 1;
  assert.deepEqual([undone, desk.view.step], [200, 50]);
});

test("differences are per leaf, arrays are replaced whole", () => {
  const a = { a: { b: 1, c: [1, 2] }, d: 1 };
  const b = { a: { b: 1, c: [1, 3] }, e: null };
  assert.deepEqual(differences(a, b), [
    { path: ["a", "c"], before: [1, 2], after: [1, 3] },
    { path: ["d"], before: 1, after: undefined },
    { path: ["e"], before: undefined, after: null },
  ]);
});

test("a part that is switched on without keys of its own is an entry of its own", () => {
  const desk = new Desk();
  desk.history.begin(false);
  desk.change({ annotations: { axes: true } });
  desk.history.begin(false);
  desk.change({ light: {} });
  assert.equal(desk.undo(), "light");
  assert.deepEqual(desk.view, { dataset: "storm", annotations: { axes: true } });
  assert.equal(desk.undo(), "axes and labels");
});
