// Camera input and hover: roll and rotation against closed forms, fingers and wheel, animations
// interrupted by other input, and the requests for the value under the cursor.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  type Probe,
  anglesOf,
  between,
  cameraFrame,
  distanceOf,
  drag,
  lookFrom,
  orbit,
  project,
  roll,
  rollOf,
  withProjection,
  type Camera,
  type Dataset,
  type View,
} from "@windsplat/client";
import { type Vec3, MoveQueue, twist, wheelZoom, Turn } from "@windsplat/client/parts";
import { Hover, type HoverTarget } from "../src/viewport/hover";
import { hoverLines, placeText } from "../src/view/sample_position";

const near = (a: number, b: number, slack = 1e-9): void =>
  assert.ok(Math.abs(a - b) <= slack * Math.max(1, Math.abs(b)), `${a} is not ${b}`);
const nearAll = (a: readonly number[], b: readonly number[], slack = 1e-9): void =>
  a.forEach((value, n) => near(value, b[n]!, slack));

const south: Camera = {
  projection: "perspective",
  eye: [0, -3, 0],
  target: [0, 0, 0],
  up: [0, 0, 1],
  fovY: 40,
  height: 2,
};

// --- roll ------------------------------------------------------------------------------------

test("a roll rotates the picture clockwise", () => {
  const rolled = roll(south, 90);
  nearAll(rolled.up, [-1, 0, 0]);
  const [x, y] = project(rolled, [0, 0, 0.5], 1)!;
  assert.ok(x > 0.6);
  near(y, 0.5);
  near(rollOf(rolled), 90);
  near(rollOf(south), 0);
  nearAll(roll(roll(south, 25), -25).up, south.up);
});

test("orbiting keeps the roll and rotates about the vertical axis", () => {
  const from = lookFrom(south, { azimuth: 30, elevation: 20 });
  const plain = orbit(from, 40, -35);
  const rolled = orbit(roll(from, 33), 40, -35);
  nearAll(rolled.eye, plain.eye);
  near(rollOf(rolled), 33);
  // Orbiting over the pole does not flip: at the vertical, the rotation of the picture counts as
  // azimuth.
  const down = orbit(roll(from, 33), 0, 70);
  near(anglesOf(down).elevation, 90);
  const { right } = cameraFrame(down);
  const upright = cameraFrame(orbit(from, 0, 70));
  near(right[0] * upright.right[0] + right[1] * upright.right[1], Math.cos((33 * Math.PI) / 180));
});

test("changing the projection keeps the roll", () => {
  const flat = withProjection(roll(south, 20), "orthographic");
  near(rollOf(flat), 20);
  near(rollOf(withProjection(flat, "perspective")), 20);
});

test("dragging follows the pointer at any roll", () => {
  const front: Vec3 = [0, -0.2, 0]; // in front of the target, so that an orbit moves it
  for (const angle of [0, 90, -90, 180, 37]) {
    const from = roll(south, angle);
    const [x0, y0] = project(from, front, 1)!;
    const [x1, y1] = project(drag(from, 2, 0), front, 1)!;
    assert.ok(x1 - x0 > 0 && Math.abs(y1 - y0) < 0.1 * (x1 - x0), `to the right at ${angle}`);
    const [x2, y2] = project(drag(from, 0, 2), front, 1)!;
    assert.ok(y2 - y0 > 0 && Math.abs(x2 - x0) < 0.1 * (y2 - y0), `down at ${angle}`);
  }
  // Without roll a drag is a plain orbit.
  assert.deepEqual(drag(south, 5, 3), orbit(south, -5, 3));
});

// --- camera animation ------------------------------------------------------------------------

test("camera interpolation joins its ends by the shorter rotation", () => {
  const from = roll(lookFrom(south, { azimuth: 170, elevation: 10 }, 2), 30);
  const to = lookFrom(south, { azimuth: -170, elevation: 50 }, 8);
  nearAll(between(from, to, 0).eye, from.eye);
  nearAll(between(from, to, 0).up, from.up);
  nearAll(between(from, to, 1).eye, to.eye);
  const middle = between(from, to, 0.5);
  near(Math.abs(anglesOf(middle).azimuth), 180);
  near(anglesOf(middle).elevation, 30);
  near(distanceOf(middle), 4);
  near(rollOf(middle), 15);
});

class Stage {
  camera: Camera = south;
  cameras: Camera[] = [];
  now = 0;
  private frames: (() => void)[] = [];
  readonly requestFrame = (run: () => void): void => void this.frames.push(run);
  readonly queue = new MoveQueue(
    {
      camera: () => this.camera,
      setCamera: (next) => {
        this.camera = next;
        this.cameras.push(next);
      },
      ready: () => true,
    },
    this.requestFrame,
  );

  turn(still = false): Turn {
    const { requestFrame } = this;
    return new Turn(this.queue, { now: () => this.now, requestFrame, still: () => still });
  }

  play(ms: number): void {
    for (const end = this.now + ms; this.now < end; this.now += 16) {
      for (const run of this.frames.splice(0)) run();
    }
  }
}

const east = lookFrom(south, { azimuth: 90, elevation: 0 });

test("a preset is reached by a short animation, one camera per display frame", () => {
  const stage = new Stage();
  stage.turn().to(east);
  stage.play(600);
  assert.deepEqual(stage.camera, east);
  assert.ok(
    stage.cameras.length > 8 && stage.cameras.length <= 250 / 16 + 4,
    `${stage.cameras.length}`,
  );
  const ways = stage.cameras.map((camera) => anglesOf(camera).azimuth);
  for (let n = 1; n < ways.length; n++) assert.ok(ways[n]! >= ways[n - 1]! - 1e-9);
});

test("with reduced motion a preset is applied at once", () => {
  const stage = new Stage();
  stage.turn(true).to(east);
  stage.play(600);
  assert.deepEqual(stage.cameras, [east]);
});

test("pointer input, undo or another preset ends an animation", () => {
  const stage = new Stage();
  stage.turn().to(east);
  stage.play(100);
  const undone = { ...south, eye: [0, -7, 0] as Vec3 };
  stage.camera = undone;
  stage.play(600);
  assert.deepEqual(stage.camera, undone);
  const turn = stage.turn();
  turn.to(east);
  stage.play(64);
  turn.to(south);
  stage.play(600);
  assert.deepEqual(stage.camera, south);
});

// --- fingers and wheel -----------------------------------------------------------------------

test("twisting rolls by the angle while panning and pinching", () => {
  const fingers = (angle: number, size: number, x: number, n = 2) =>
    Array.from({ length: n }, (_, k) => {
      const at = ((angle + (360 / n) * k) * Math.PI) / 180;
      return { x: x + size * Math.cos(at), y: 9 + size * Math.sin(at) };
    });
  near(twist(fingers(10, 50, 0), fingers(35, 90, 40)), 25);
  near(twist(fingers(179, 50, 0), fingers(-171, 50, 0)), 10);
  near(twist(fingers(0, 50, 0, 3), fingers(-20, 70, 5, 3)), -20);
  assert.equal(twist([{ x: 1, y: 2 }], [{ x: 7, y: 9 }]), 0);
});

test("wheel zoom is proportional to the scroll in any unit and bounded", () => {
  const wheel = (deltaY: number, deltaMode = 0, ctrlKey = false) =>
    wheelZoom({ deltaY, deltaMode, ctrlKey } as WheelEvent);
  near(wheel(100) * wheel(-100), 1);
  near(wheel(-100), 1.0015 ** 100);
  near(wheel(3, 1), wheel(90));
  near(wheel(-9999), wheel(-400));
  assert.ok(wheel(-5, 0, true) > wheel(-5), "a pinch has a greater zoom per unit");
  assert.ok(wheel(-9999, 0, true) < 1.3);
});

// --- the value under the cursor --------------------------------------------------------------

// A picture whose samples are tenths of its width, and a server that answers when the test calls
// for it.
class Glass {
  now = 1000;
  busy = false;
  step = 0;
  asked: number[] = [];
  aborted = 0;
  shown: string[] = [];
  private answers: ((fails: boolean) => void)[] = [];
  private timers: { at: number; run: () => void }[] = [];
  readonly hover = new Hover<number>({
    now: () => this.now,
    setTimeout: (run, ms) => this.timers.push({ at: this.now + ms, run }),
    clearTimeout: (timer) => (this.timers[timer - 1]!.run = () => {}),
    busy: () => this.busy,
    find: ([x]): HoverTarget<number> | null => {
      const sample = Math.round(10 * x);
      return x > 1 ? null : { sample, key: `${sample} ${this.step}` };
    },
    request: (sample, signal) =>
      new Promise((resolve, reject) => {
        this.asked.push(sample);
        signal.addEventListener("abort", () => (this.aborted += 1));
        this.answers.push((fails) =>
          fails ? reject(new Error("no")) : resolve([`${sample} at ${this.step}`]),
        );
      }),
    show: (lines) => (this.shown = lines),
  });

  async answer(fails = false): Promise<void> {
    this.answers.shift()!(fails);
    await new Promise((resolve) => setImmediate(resolve));
  }

  wait(ms: number): void {
    this.now += ms;
    for (const timer of this.timers) {
      if (timer.at > this.now) continue;
      timer.at = Infinity;
      timer.run();
    }
  }
}

test("one hover request at a time for the newest position, at most eight a second", async () => {
  const glass = new Glass();
  for (const x of [0.1, 0.2, 0.3, 0.4]) glass.hover.move([x, 0]);
  assert.deepEqual(glass.asked, [1], "later positions wait for the answer");
  glass.now += 20;
  await glass.answer();
  assert.deepEqual(glass.asked, [1]);
  glass.wait(104);
  assert.deepEqual(glass.asked, [1]);
  glass.wait(1);
  assert.deepEqual(glass.asked, [1, 4]);
  await glass.answer();
  assert.deepEqual(glass.shown, ["4 at 0"]);
  glass.wait(1000);
  glass.hover.move([0.41, 0]);
  assert.deepEqual(glass.asked, [1, 4], "the same sample is not requested again");
});

test("leaving the picture cancels the hover request", async () => {
  const glass = new Glass();
  glass.hover.move([0.1, 0]);
  glass.hover.leave();
  assert.equal(glass.aborted, 1);
  await glass.answer();
  assert.deepEqual(glass.shown, []);
  glass.hover.move([0.2, 0]);
  glass.wait(200);
  await glass.answer();
  assert.deepEqual(glass.shown, ["2 at 0"]);
  glass.hover.move([1.5, 0]); // outside the box
  glass.wait(200);
  assert.deepEqual([glass.shown, glass.asked], [[], [1, 2]]);
});

test("no hover values during motion, current ones afterwards", async () => {
  const glass = new Glass();
  glass.hover.move([0.1, 0]);
  await glass.answer();
  glass.busy = true;
  glass.hover.poke();
  assert.deepEqual(glass.shown, []);
  glass.wait(1000);
  glass.hover.move([0.3, 0]);
  assert.deepEqual(glass.asked, [1]);
  glass.busy = false;
  glass.step = 4;
  glass.hover.poke();
  assert.deepEqual(glass.asked, [1], "not before the view is at rest");
  glass.wait(150);
  await glass.answer();
  assert.deepEqual([glass.asked, glass.shown], [[1, 3], ["3 at 4"]]);
});

test("a failed request is not shown and not repeated", async () => {
  const glass = new Glass();
  glass.hover.move([0.1, 0]);
  await glass.answer(true);
  assert.deepEqual(glass.shown, []);
  for (let n = 0; n < 5; n++) {
    glass.wait(200);
    glass.hover.poke();
    glass.hover.move([0.1, 0]);
  }
  assert.deepEqual(glass.asked, [1]);
});

const axis = (name: string, units: string) => ({ name, units });
const grid = {
  axes: {
    x: axis("lon", "degrees_east"),
    y: axis("lat", "degrees_north"),
    z: axis("lev", "hPa"),
  },
} as unknown as Dataset;
const units = { x: "degrees_east", y: "degrees_north", z: "hPa" };
const index = { x: 0, y: 0, z: 0 };
const probe: Probe = {
  position: { x: -23.5, y: 41, z: 500, units, index },
  step: 0,
  values: {
    cloud: { value: null, units: "1" },
    heat: { value: 280.26, units: "K" },
    wind: { value: [3, 4, 0], units: "m s-1" },
  },
};

test("places are told in the units of the answer where the axes have others", () => {
  assert.equal(placeText(grid, probe), "");
  const rows = { axes: { ...grid.axes, x: axis("west_east", ""), y: axis("south_north", "") } };
  const position = { x: -23.5, y: 41, z: 2300, units: { ...units, z: "m" }, index };
  const curved = rows as unknown as Dataset;
  assert.equal(placeText(curved, { ...probe, position }), "at 23.5 °W, 41 °N, height 2300 m");
  const view = { vector: { field: "wind" } } as View;
  const [, place] = hoverLines(curved, view, { ...probe, position }, 2);
  assert.equal(place, "23.5 °W, 41 °N · level 2300 m");
});

test("the hover text names field, position and level", () => {
  const view = { vector: { field: "wind" }, scalars: [{ field: "cloud" }] } as View;
  assert.deepEqual(hoverLines(grid, view, probe, 2), [
    "wind 5 m s⁻¹ · cloud masked",
    "23.5 °W, 41 °N · level 500 hPa",
  ]);
  const [values, place] = hoverLines(grid, { vector: { field: null } } as View, probe, 1);
  assert.equal(values, "cloud masked · heat 280.3 K · wind 5 m s⁻¹");
  assert.equal(place, "23.5 °W, lev 500 hPa · section 41 °N");
});
