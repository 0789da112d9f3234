// The camera as text that is copied and pasted.
import assert from "node:assert/strict";
import { test } from "node:test";
import type { Camera } from "@windsplat/client";
import { cameraPatch, cameraText } from "../../src/view/camera_text";
import { pictureCaption } from "../../src/view/caption";
import { described } from "../page";

const camera: Camera = {
  projection: "perspective",
  eye: [0.5, -3, 1.25],
  target: [0, 0.1, 0],
  up: [0, 0, 1],
  fovY: 40,
  height: 2,
};

const other: Camera = { ...camera, eye: [9, 9, 9], target: [1, 1, 1], fovY: 20 };

test("the text of a camera gives that camera", () => {
  const { camera: pasted } = cameraPatch(cameraText(camera), other) as { camera: Camera };
  assert.deepEqual({ ...other, ...pasted }, camera);
  const flat: Camera = { ...camera, projection: "orthographic", height: 0.75 };
  const { camera: second } = cameraPatch(cameraText(flat), other) as { camera: Camera };
  assert.deepEqual({ ...other, ...second }, { ...flat, fovY: other.fovY });
});

test("a view's camera is taken, and keys that are not given stay", () => {
  const text = '{"dataset": "x", "camera": {"eye": [1, 2, 3]}}';
  const { camera: pasted } = cameraPatch(text, camera) as { camera: Camera };
  assert.deepEqual(pasted.eye, [1, 2, 3]);
  assert.deepEqual(pasted.target, camera.target);
  assert.equal("fovY" in pasted, false);
});

test("what is no camera is refused with the reason", () => {
  const refused: [string, RegExp][] = [
    ["", /Not a camera/],
    ["{}", /Not a camera/],
    ["[1, 2, 3]", /Not a camera/],
    ['{"eye": [1, 2]}', /eye must be three numbers/],
    ['{"eye": [1, 2, "3"]}', /eye must be three numbers/],
    ['{"up": [0, 0, 0]}', /up must be three numbers, not all zero/],
    ['{"fovY": 180}', /fovY must be a number from 0.001 to 179/],
    ['{"height": -1}', /height must be a number/],
    ['{"projection": "fisheye"}', /projection must be/],
    ['{"roll": 3}', /no roll/],
    ['{"eye": [0, 0.1, 0]}', /different points/],
  ];
  for (const [text, reason] of refused) {
    assert.throws(() => cameraPatch(text, camera), reason, text);
  }
});

test("the caption of a picture has dataset, step and time; of a single step no count", () => {
  assert.equal(
    pictureCaption(described("storm", { steps: 3 }), 1),
    "The storm · step 2 of 3 · 2001-01-01 01:00Z",
  );
  assert.equal(pictureCaption(described("calm", { steps: 1 }), 0), "The calm · 2001-01-01 00:00Z");
});
