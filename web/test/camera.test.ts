// Camera calculations against closed forms.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  anglesOf,
  cameraFrame,
  degree,
  distanceOf,
  frameBox,
  heightAtTarget,
  lookFrom,
  orbit,
  orbitFrame,
  pan,
  scaledBox,
  withProjection,
  zoom,
  type Box,
  type Camera,
} from "@windsplat/client";
import { dot, subtract, type Vec3 } from "@windsplat/client/parts";
import { gizmoArms } from "../src/viewport/gizmo";

const near = (a: number, b: number, message = ""): void =>
  assert.ok(Math.abs(a - b) < 1e-9 * Math.max(1, Math.abs(b)), `${a} is not ${b} ${message}`);
const nearAll = (a: readonly number[], b: readonly number[]): void => {
  assert.equal(a.length, b.length);
  a.forEach((value, n) => near(value, b[n]!, `at ${n} of ${a} and ${b}`));
};

const camera: Camera = {
  projection: "perspective",
  eye: [0, -3, 0],
  target: [0, 0, 0],
  up: [0, 0, 1],
  fovY: 40,
  height: 2,
};

// Position of a world point relative to the centre of the picture: fractions of its height, right
// and up.
function project(view: Camera, point: Vec3): [number, number] {
  const frame = cameraFrame(view);
  const p = subtract(point, view.eye);
  const span =
    view.projection === "perspective"
      ? 2 * dot(p, frame.forward) * Math.tan(0.5 * view.fovY * degree)
      : view.height;
  return [dot(p, frame.right) / span, dot(p, frame.up) / span];
}

test("at azimuth 0 the eye is in the south and looks north with east on the right", () => {
  assert.deepEqual(anglesOf(camera), { azimuth: 0, elevation: 0 });
  const frame = cameraFrame(camera);
  nearAll(frame.forward, [0, 1, 0]);
  nearAll(frame.right, [1, 0, 0]);
  nearAll(frame.up, [0, 0, 1]);
});

test("positive azimuth moves the eye east, elevation above the horizon", () => {
  nearAll(lookFrom(camera, { azimuth: 90, elevation: 0 }).eye, [3, 0, 0]);
  nearAll(lookFrom(camera, { azimuth: 180, elevation: 0 }).eye, [0, 3, 0]);
  const half = Math.SQRT1_2 * 3;
  nearAll(lookFrom(camera, { azimuth: 0, elevation: 45 }).eye, [0, -half, half]);
});

test("from above north is up and the azimuth is kept", () => {
  for (const azimuth of [-120, -30, 0, 45, 170]) {
    for (const elevation of [90, -90]) {
      const view = lookFrom(camera, { azimuth, elevation });
      near(anglesOf(view).azimuth, azimuth);
      near(Math.abs(anglesOf(view).elevation), 90);
    }
  }
  const [x, y] = project(lookFrom(camera, { azimuth: 0, elevation: 90 }), [0, 0.1, 0]);
  near(x, 0);
  assert.ok(y > 0);
});

test("angles are recovered from the eye computed from them", () => {
  for (let azimuth = -175; azimuth <= 175; azimuth += 25) {
    for (let elevation = -85; elevation <= 85; elevation += 17) {
      const angles = anglesOf(lookFrom(camera, { azimuth, elevation }));
      near(angles.azimuth, azimuth);
      near(angles.elevation, elevation);
    }
  }
});

test("orbiting keeps target and distance, accumulates and stops at the poles", () => {
  const off: Camera = { ...camera, target: [0.3, -0.2, 0.1], eye: [1, -2, 1.5] };
  const turned = orbit(orbit(off, 20, 10), 15, -4);
  const once = orbit(off, 35, 6);
  nearAll(turned.eye, once.eye);
  near(distanceOf(turned), distanceOf(off));
  nearAll(turned.target, off.target);
  near(anglesOf(orbit(off, 0, 500)).elevation, 90);
  near(anglesOf(orbit(off, 0, -500)).elevation, -90);
});

test("the orbit's frame is right-handed and orthonormal", () => {
  for (const azimuth of [0, 33, 120, 260]) {
    for (const elevation of [-90, -40, 0, 70, 90]) {
      const { right, up, forward } = orbitFrame({ azimuth, elevation });
      near(dot(right, right), 1);
      near(dot(up, up), 1);
      near(dot(forward, forward), 1);
      near(dot(right, up), 0);
      near(dot(right, forward), 0);
      near(dot(up, forward), 0);
      nearAll([right[1] * up[2] - right[2] * up[1]], [-forward[0]]);
    }
  }
});

test("panning moves the target by the pointer distance", () => {
  for (const projection of ["perspective", "orthographic"] as const) {
    const view = orbit({ ...camera, projection }, 25, 30);
    const moved = pan(view, 0.2, -0.1);
    nearAll(project(moved, view.target), [0.2, 0.1]); // down is negative in the picture
    near(distanceOf(moved), distanceOf(view));
  }
});

test("zooming scales the picture about the target", () => {
  for (const projection of ["perspective", "orthographic"] as const) {
    const view: Camera = { ...camera, projection };
    near(heightAtTarget(zoom(view, 2)), heightAtTarget(view) / 2);
    near(zoom(view, 2).height, 1);
    near(distanceOf(zoom(view, 2)), 1.5);
    const back = zoom(zoom(view, 1.7), 1 / 1.7);
    nearAll(back.eye, view.eye);
  }
  assert.ok(distanceOf(zoom(camera, 1e12)) > 0, "the eye never reaches the target");
});

test("changing the projection keeps the size of the target", () => {
  const ortho = withProjection(camera, "orthographic");
  near(ortho.height, 2 * 3 * Math.tan(20 * degree));
  near(heightAtTarget(ortho), heightAtTarget(camera));
  const zoomed = zoom(ortho, 3);
  const back = withProjection(zoomed, "perspective");
  near(heightAtTarget(back), heightAtTarget(zoomed));
  near(distanceOf(back), 1);
});

test("framing a box leaves a margin of 4 %", () => {
  const box: Box = { min: [-1, -0.5, -0.15], max: [1, 0.5, 0.15] };
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n): Vec3 => [
    (n & 1 ? box.max : box.min)[0],
    (n & 2 ? box.max : box.min)[1],
    (n & 4 ? box.max : box.min)[2],
  ]);
  for (const projection of ["perspective", "orthographic"] as const) {
    for (const aspect of [0.5, 1, 2]) {
      const view = frameBox({ ...camera, projection }, box, { azimuth: 40, elevation: 35 }, aspect);
      const reach = Math.max(
        ...corners.map((corner) => {
          const [x, y] = project(view, corner);
          return Math.max(Math.abs(x) / (0.5 * aspect), Math.abs(y) / 0.5);
        }),
      );
      near(reach, 1 / 1.04, `${projection} ${aspect}`);
      nearAll(view.target, [0, 0, 0]);
    }
  }
});

test("stretching a box keeps its longest edge at 2", () => {
  const box: Box = { min: [-1, -0.5, -0.15], max: [1, 0.5, 0.15] };
  nearAll(scaledBox(box, [1, 1, 1]).max, [1, 0.5, 0.15]);
  nearAll(scaledBox(box, [1, 1, 2]).max, [1, 0.5, 0.3]);
  nearAll(scaledBox(box, [1, 1, 20]).max, [1 / 3, 0.5 / 3, 1]);
  nearAll(scaledBox(box, [1, 1, 20]).min, [-1 / 3, -0.5 / 3, -1]);
});

test("the gizmo shows the axes as in the picture, farthest first", () => {
  const view = lookFrom(camera, { azimuth: 0, elevation: 30 });
  const arms = gizmoArms(view);
  assert.deepEqual(
    arms.map((arm) => arm.axis),
    ["y", "x", "z"],
  );
  const at = Object.fromEntries(arms.map((arm) => [arm.axis, [arm.x, arm.y]]));
  nearAll(at.x!, [1, 0]);
  nearAll(at.y!, [0, 0.5]); // sin 30
  nearAll(at.z!, [0, Math.cos(30 * degree)]);
});
