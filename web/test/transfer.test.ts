// The opacity curve editor and the colour range, without the user interface.
import assert from "node:assert/strict";
import { test } from "node:test";
import type { Range, View } from "@windsplat/client";
import type { Curve } from "../src/panels/media";
import { RangeFollower, type RangeMode, type RangeSource } from "../src/panels/range_choice";
import { UndoControl } from "../src/app/undo_control";
import {
  addPoint,
  curvePath,
  dragShareMax,
  extinctionAt,
  freePosition,
  isRamp,
  movePoint,
  pointsMax,
  pointText,
  removePoint,
  roomyTop,
  shareOf,
  shownPoint,
} from "../src/panels/transfer";

const ramp: Curve = [
  [0, 0],
  [0.2, 0],
  [1, 8],
];

test("a point stays between its neighbours and is not negative", () => {
  assert.deepEqual(movePoint(ramp, 1, 0.5, 3)[1], [0.5, 3]);
  assert.deepEqual(movePoint(ramp, 1, 7, 3)[1], [1, 3], "at its neighbour: a step");
  assert.deepEqual(movePoint(ramp, 1, -7, -3)[1], [0, 0]);
  assert.deepEqual(movePoint(ramp, 2, 9, 1e99)[2], [9, 1e30], "clamped to the protocol limit");
  assert.deepEqual(movePoint(ramp, 0, -1e99, 0)[0], [-1e38, 0]);
  assert.deepEqual(movePoint(ramp, 1, Number.NaN, 3), ramp);
  assert.deepEqual(ramp[1], [0.2, 0], "the old curve is unchanged");
});

test("points are added in order up to the protocol limit, and the last one is kept", () => {
  const added = addPoint(ramp, 0.6, 2)!;
  assert.deepEqual([added.index, added.curve[2], added.curve.length], [2, [0.6, 2], 4]);
  assert.equal(addPoint(ramp, -5, 1)!.index, 0);
  assert.equal(addPoint(ramp, 5, 1)!.index, 3);
  let curve: Curve = [[0, 1]];
  while (curve.length < pointsMax) curve = addPoint(curve, curve.length, 1)!.curve;
  assert.equal(addPoint(curve, 0.5, 1), null);
  assert.deepEqual(removePoint(ramp, 1), [ramp[0], ramp[2]]);
  assert.deepEqual(removePoint([[3, 1]], 0), [[3, 1]]);
});

test("a new table point bisects the widest gap on the curve", () => {
  assert.deepEqual(freePosition(ramp), [0.6, 4]);
  assert.deepEqual(freePosition([[3, 1]]), [3, 1]);
});

test("both scales are invertible", () => {
  for (const log of [false, true]) {
    const scale = { top: 40, log };
    assert.equal(shareOf(40, scale), 1);
    assert.equal(shareOf(0, scale), 0);
    assert.equal(extinctionAt(0, scale), 0);
    assert.equal(extinctionAt(-0.3, scale), 0);
    for (const value of [0.04, 1, 7, 40]) {
      assert.ok(Math.abs(extinctionAt(shareOf(value, scale), scale) / value - 1) < 0.01);
    }
  }
  // The scale spans four decades, so half of the height is a hundredth of the top.
  assert.ok(Math.abs(extinctionAt(0.5, { top: 40, log: true }) - 0.4) < 1e-9);
  assert.equal(extinctionAt(2, { top: 40, log: false }), 80, "above the upper edge");
  assert.ok(extinctionAt(1, { top: 1e30, log: false }) <= 1e30);
});

test("dragging above the plot multiplies the value by a small factor", () => {
  const most = (log: boolean) => extinctionAt(dragShareMax({ top: 40, log }), { top: 40, log });
  assert.deepEqual([most(false), most(true)], [160, 400]);
});

test("the scale extends above any curve", () => {
  assert.equal(roomyTop(ramp, 1), 10);
  assert.equal(roomyTop([[0, 1e-9]], 1), 1.3e-9);
  assert.equal(roomyTop([[0, 1e30]], 1), 1e30);
  assert.equal(roomyTop([[0, 0]], 7), 7, "a transparent medium keeps the scale");
});

const pairs = (path: string): [number, number][] =>
  [...path.matchAll(/[ML](-?[\d.]+) (-?[\d.]+)/g)].map((m) => [Number(m[1]), Number(m[2])]);

test("the curve is linear between points and constant beyond them", () => {
  const path = curvePath(ramp, [0, 2], { top: 8, log: false });
  assert.deepEqual(pairs(path).slice(-3), [
    [0, 1],
    [0.1, 1],
    [0.5, 0],
  ]);
  assert.match(path, /H1\.0000$/);
  const bent = pairs(curvePath(ramp, [0, 1], { top: 8, log: true }));
  // Halfway in value the extinction is 4, which is log10(2) of four decades below the top.
  const middle = bent.find(([x]) => Math.abs(x - 0.6) < 1e-9)!;
  assert.ok(Math.abs(middle[1] - Math.log10(2) / 4) < 1e-3);
  const step: Curve = [
    [1, 0],
    [1, 5],
  ];
  assert.deepEqual(pairs(curvePath(step, [0, 2], { top: 5, log: true })).slice(-2), [
    [0.5, 1],
    [0.5, 0],
  ]);
});

test("only a ramp has a threshold to move", () => {
  assert.ok(isRamp(ramp));
  assert.ok(isRamp(ramp.slice(1)));
  assert.ok(!isRamp([...ramp, [2, 8]]));
  assert.ok(!isRamp(movePoint(ramp, 1, 0.2, 1)));
});

test("the table rounds values relative to the domain width", () => {
  assert.deepEqual(shownPoint([101305.2, 0.1 + 0.2], [101300, 101310]), [101305.2, 0.3]);
  assert.deepEqual(shownPoint([Math.fround(0.3), 1e-9], [0, 1]), [0.3, 1e-9]);
  assert.deepEqual(shownPoint([123456.7, 5], [-1e9, 1e9]), [123457, 5]);
});

test("a point is formatted as text", () => {
  assert.equal(pointText([0.2, 4], ""), "0.2 → 7.69 % opaque in 1 % of the box");
  assert.equal(pointText([5e-8, 1e30], "J m⁻³"), "5e-8 J m⁻³ → 100 % opaque in 1 % of the box");
});

// --- ranges -----------------------------------------------------------------------------------

// A view's range with a simulated server: the range of step n is [n, n + 10], of all steps [-3,
// 99].
function source(change: Partial<RangeSource> = {}) {
  const state = {
    range: [0, 1] as Range | null,
    step: 0 as number | null,
    asked: [] as (number | null)[],
    of: "storm u" as string | null,
  };
  const all: RangeSource = {
    range: () => state.range,
    defaultRange: () => [0, 1],
    choose: (range) => (state.range = range ?? [0, 1]),
    quietly: (run) => run(),
    of: () => state.of,
    read: async (step) => {
      state.asked.push(step);
      return step === null ? [-3, 99] : [step, step + 10];
    },
    step: () => state.step,
    modes: new Map<string, RangeMode>(),
    key: "t",
    steps: 8,
    ...change,
  };
  return { state, all, follower: new RangeFollower(all, (text) => assert.fail(text)) };
}

const soon = (): Promise<void> => new Promise((done) => setImmediate(done));

test("the range of a step is read at each step at rest, that of all steps once", async () => {
  const { state, follower } = source();
  follower.set("step");
  await soon();
  assert.deepEqual(state.range, [0, 10]);
  state.step = null;
  follower.follow();
  state.step = 4;
  follower.follow();
  follower.follow();
  await soon();
  assert.deepEqual(state.range, [4, 14]);
  assert.deepEqual(state.asked, [0, 4], "not read during playback, and read once");
  follower.follow();
  assert.equal(follower.mode, "step");
  follower.set("all");
  await soon();
  state.step = 5;
  follower.follow();
  assert.deepEqual([state.range, follower.mode], [[-3, 99], "all"]);
  follower.set("default");
  assert.deepEqual([state.range, follower.mode], [[0, 1], "default"]);
});

test("a range from another source is custom", async () => {
  const { state, all, follower } = source();
  assert.equal(follower.mode, "default");
  state.range = [2, 3];
  follower.follow();
  assert.equal(follower.mode, "custom");
  follower.set("step");
  await soon();
  state.range = [2, 3]; // set by a drag
  follower.follow();
  state.step = 6;
  follower.follow();
  await soon();
  assert.deepEqual([follower.mode, state.range], ["custom", [2, 3]]);
  assert.equal(new RangeFollower(all, () => {}).mode, "custom", "preserved for a rebuilt panel");
});

test("a late answer does not override a later choice, and ends stay reversed", async () => {
  const answers: ((range: Range) => void)[] = [];
  const { state, follower } = source({ read: () => new Promise((done) => answers.push(done)) });
  follower.set("all");
  follower.set("custom");
  state.range = [5, 6];
  answers[0]!([-3, 99]);
  await soon();
  assert.deepEqual([state.range, follower.mode], [[5, 6], "custom"]);
  state.range = [6, 5];
  follower.set("step");
  answers[1]!([1, 2]);
  await soon();
  assert.deepEqual(state.range, [2, 1]);
});

// A view with undo, with the range of its medium in mode "step" and its density.
async function undoable() {
  let view: View = { step: 0, scalars: [{ field: "u" }] };
  const said: string[] = [];
  const undoControl = new UndoControl({
    document: () => view,
    edited: () => {},
    busy: () => false,
    show: (next) => (view = next),
    announce: (text) => said.push(text),
  });
  const page = new EventTarget();
  undoControl.watch(page);
  // Each edit is a separate gesture.
  const edit = (change: View) => {
    page.dispatchEvent(new Event("pointerdown"));
    undoControl.edit(() => (view = { ...view, ...change }));
    page.dispatchEvent(new Event("pointerup"));
  };
  const medium = () => view.scalars![0]!;
  const setMedium = (change: object) => edit({ scalars: [{ ...medium(), ...change }] });
  const range = () => (medium().color?.range ?? [0, 1]) as Range;
  const { follower } = source({
    range,
    choose: (next) => setMedium({ color: { range: next } }),
    quietly: (run) => undoControl.quietly(run),
    step: () => view.step!,
  });
  const rest = async () => {
    follower.follow();
    await soon();
    follower.follow();
    return [view.step, ...range(), follower.mode];
  };
  return {
    undoControl,
    follower,
    said,
    rest,
    setMedium,
    medium,
    seek: (step: number) => edit({ step }),
  };
}

test("a range that follows the step is not undone, its selection is", async () => {
  const { undoControl, follower, said, rest, seek } = await undoable();
  follower.set("step");
  assert.deepEqual(await rest(), [0, 0, 10, "step"]);
  for (const step of [1, 2]) {
    seek(step);
    assert.deepEqual(await rest(), [step, step, step + 10, "step"]);
  }
  undoControl.undo();
  assert.deepEqual(await rest(), [1, 1, 11, "step"]);
  undoControl.redo();
  assert.deepEqual(await rest(), [2, 2, 12, "step"], "a range read meanwhile does not clear redo");
  undoControl.undo();
  undoControl.undo();
  assert.deepEqual(await rest(), [0, 0, 10, "step"]);
  undoControl.undo();
  assert.deepEqual(await rest(), [0, 0, 1, "default"]);
  undoControl.undo();
  assert.equal(said.at(-1), "nothing to undo");
});

test("undo and redo of a range restore its mode and read it again", async () => {
  const { undoControl, follower, rest, setMedium, medium, seek } = await undoable();
  follower.set("step");
  await rest();
  setMedium({ stride: 2 });
  seek(3);
  assert.deepEqual(await rest(), [3, 3, 13, "step"]);
  setMedium({ stride: 4 });
  seek(5);
  await rest();
  undoControl.undo();
  undoControl.undo();
  undoControl.undo();
  undoControl.redo();
  undoControl.redo();
  assert.deepEqual(await rest(), [3, 3, 13, "step"]);
  assert.equal(medium().stride, 4);
});

test("outdated answers change nothing", async () => {
  const answers: ((range: Range) => void)[] = [];
  const { state, follower } = source({ read: () => new Promise((done) => answers.push(done)) });
  for (const of of ["calm u", "storm v", null]) {
    state.of = "storm u";
    follower.set("step");
    state.of = of;
    answers.at(-1)!([-3, 99]);
    await soon();
    assert.deepEqual(state.range, [0, 1], `${of}`);
  }
  follower.set("step");
  assert.equal(answers.length, 3, "without a field no range is read");
  state.of = "storm u";
  follower.set("all");
  state.range = [2, 3]; // set by a drag
  follower.follow();
  answers.at(-1)!([-3, 99]);
  await soon();
  assert.deepEqual([state.range, follower.mode], [[2, 3], "custom"]);
});

test("the default is loaded later if the dataset has none", () => {
  const { state, follower } = source({ defaultRange: () => null });
  state.range = [7, 9]; // range drawn by the first frame
  follower.follow();
  assert.equal(follower.mode, "default");
});
