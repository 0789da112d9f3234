// Attributes and keys of <windsplat-view>.
import assert from "node:assert/strict";
import { test } from "node:test";
import { stepOf, viewOf } from "../src/element/attributes";
import type { Camera } from "../src/view/camera";
import { anglesOf } from "../src/view/camera";
import { moveOfKey } from "../src/viewport/camera_keys";

test("a view is an object or its JSON; anything else is refused with a reason", () => {
  assert.deepEqual(viewOf('{"dataset": "a"}'), { dataset: "a" });
  assert.deepEqual(viewOf({ step: 2 }), { step: 2 });
  assert.deepEqual(viewOf(" "), {});
  assert.throws(() => viewOf("{"), /view is no JSON/);
  for (const wrong of ["[]", "3", '{"camera": 4}', '{"scalars": {}}']) {
    assert.throws(() => viewOf(wrong), /must be an object/, wrong);
  }
});

test("a step is a whole number from 0", () => {
  assert.equal(stepOf("12"), 12);
  assert.equal(stepOf(null), null);
  assert.equal(stepOf(""), null);
  for (const wrong of ["-1", "1.5", "x", "1e999"]) assert.throws(() => stepOf(wrong), /step must/);
});

test("keys move the camera; others do nothing", () => {
  const camera: Camera = {
    projection: "perspective",
    eye: [0, -4, 0],
    target: [0, 0, 0],
    up: [0, 0, 1],
    fovY: 35,
    height: 2,
  };
  const press = (key: string, shiftKey = false) => moveOfKey({ key, shiftKey })?.(camera);
  // The volume follows the key as it follows a drag: to the right turns the eye west.
  assert.ok(Math.abs(anglesOf(press("ArrowRight")!).azimuth + 5) < 1e-9);
  assert.ok(Math.abs(anglesOf(press("ArrowDown")!).elevation - 5) < 1e-9);
  assert.ok(Math.hypot(...press("+")!.eye) < 4);
  assert.deepEqual(
    press("ArrowRight", true)!.target.map((v) => Math.sign(Number(v.toFixed(6)))),
    [-1, 0, 0],
  );
  assert.equal(press("x"), undefined);
});

test("a view is copied, so that its owner may change it later", () => {
  const view = { dataset: "a", camera: { fovY: 30 } };
  const taken = viewOf(view);
  view.camera.fovY = 50;
  assert.equal(taken.camera?.fovY, 30);
  assert.throws(() => viewOf(undefined), /must be an object/);
});
