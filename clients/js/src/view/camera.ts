// Camera maths in world space: x east, y north, z up. Angles in degrees: azimuth 0 has the eye
// south of the target, positive azimuth moves it eastward; elevation is above the horizon.
// Pure functions: camera in, camera out.
import { clamp } from "../base/values";
import { add, cross, dot, length, subtract, times, type Vec3 } from "../base/vec3";

export interface Camera {
  projection: "perspective" | "orthographic";
  eye: Vec3;
  target: Vec3;
  up: Vec3;
  fovY: number; // degrees, perspective
  height: number; // world units at the target, orthographic
}

export interface Angles {
  azimuth: number;
  elevation: number;
}

export interface Frame3 {
  right: Vec3;
  up: Vec3;
  forward: Vec3;
}

export interface Box {
  min: Vec3;
  max: Vec3;
}

export const degree = Math.PI / 180;
const uprightElevation = 89.9; // at greater elevations `up` cannot be the world's vertical
const distanceMin = 1e-3;
const distanceMax = 1e4;
const margin = 1.04; // the picture is this much wider than the box

const unit = (a: Vec3): Vec3 => times(a, 1 / length(a));

export function orbitFrame({ azimuth, elevation }: Angles): Frame3 {
  const a = azimuth * degree;
  const e = clamp(elevation, -90, 90) * degree;
  const right: Vec3 = [Math.cos(a), Math.sin(a), 0];
  const forward: Vec3 = [-Math.sin(a) * Math.cos(e), Math.cos(a) * Math.cos(e), -Math.sin(e)];
  return { right, up: cross(right, forward), forward };
}

/** Right, up and forward vectors of the camera, as the server computes them. */
export function cameraFrame(camera: Camera): Frame3 {
  const forward = unit(subtract(camera.target, camera.eye));
  const right = unit(cross(forward, camera.up));
  return { right, up: cross(right, forward), forward };
}

export const distanceOf = (camera: Camera): number => length(subtract(camera.eye, camera.target));

export function anglesOf(camera: Camera): Angles {
  const [x, y, z] = subtract(camera.eye, camera.target);
  const elevation = Math.atan2(z, Math.hypot(x, y)) / degree;
  if (Math.abs(elevation) < uprightElevation) {
    return { azimuth: Math.atan2(x, -y) / degree, elevation };
  }
  // For a vertical view direction the azimuth follows from `up` alone.
  const sign = elevation > 0 ? 1 : -1;
  return { azimuth: Math.atan2(-sign * camera.up[0], sign * camera.up[1]) / degree, elevation };
}

export function lookFrom(camera: Camera, angles: Angles, distance = distanceOf(camera)): Camera {
  const elevation = clamp(angles.elevation, -90, 90);
  const frame = orbitFrame({ azimuth: angles.azimuth, elevation });
  const upright = Math.abs(elevation) < uprightElevation;
  return {
    ...camera,
    eye: subtract(camera.target, times(frame.forward, distance)),
    up: upright ? [0, 0, 1] : frame.up,
  };
}

/** Turns the picture clockwise in its plane. */
export function roll(camera: Camera, degrees: number): Camera {
  if (degrees === 0) return camera;
  const { right, up } = cameraFrame(camera);
  const angle = degrees * degree;
  return { ...camera, up: subtract(times(up, Math.cos(angle)), times(right, Math.sin(angle))) };
}

/**
 * Clockwise rotation of the picture from upright, -180..180. For a vertical view direction upright
 * is undefined, and the rotation counts as azimuth.
 */
export function rollOf(camera: Camera): number {
  const angles = anglesOf(camera);
  if (Math.abs(angles.elevation) >= uprightElevation) return 0;
  const frame = orbitFrame(angles);
  return Math.atan2(-dot(camera.up, frame.right), dot(camera.up, frame.up)) / degree;
}

/** Orbits about the world's vertical axis and in elevation; the roll is preserved. */
export function orbit(camera: Camera, dAzimuth: number, dElevation: number): Camera {
  const { azimuth, elevation } = anglesOf(camera);
  const next = { azimuth: azimuth + dAzimuth, elevation: elevation + dElevation };
  return roll(lookFrom(camera, next), rollOf(camera));
}

/** Orbits as in a drag: degrees by which the near side moves right and down on the screen. */
export function drag(camera: Camera, right: number, down: number): Camera {
  const angle = rollOf(camera) * degree;
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  // The volume follows the pointer: moving it right moves the eye west.
  return orbit(camera, -(right * c + down * s), down * c - right * s);
}

/** Interpolates two cameras at t from 0 to 1: the shorter way round, linear in the angles. */
export function between(from: Camera, to: Camera, t: number): Camera {
  const mix = (a: number, b: number): number => a + (b - a) * t;
  const mixAngle = (a: number, b: number): number =>
    a + (((((b - a + 540) % 360) + 360) % 360) - 180) * t;
  const [a, b] = [anglesOf(from), anglesOf(to)];
  const target = from.target.map((value, axis) => mix(value, to.target[axis]!)) as Vec3;
  const angles = {
    azimuth: mixAngle(a.azimuth, b.azimuth),
    elevation: mix(a.elevation, b.elevation),
  };
  const distance = distanceOf(from) * (distanceOf(to) / distanceOf(from)) ** t;
  const height = from.height * (to.height / from.height) ** t;
  return roll(
    lookFrom({ ...to, target, height }, angles, distance),
    mixAngle(rollOf(from), rollOf(to)),
  );
}

/** World units that the picture's height spans at the target. */
export const heightAtTarget = (camera: Camera): number =>
  camera.projection === "orthographic"
    ? camera.height
    : 2 * distanceOf(camera) * Math.tan(0.5 * camera.fovY * degree);

/** Moves the picture right and down by fractions of its height, as in a drag. */
export function pan(camera: Camera, dx: number, dy: number): Camera {
  const frame = cameraFrame(camera);
  const scale = heightAtTarget(camera);
  const shift = add(times(frame.right, -dx * scale), times(frame.up, dy * scale));
  return { ...camera, eye: add(camera.eye, shift), target: add(camera.target, shift) };
}

/**
 * factor > 1: closer, larger. Distance and height change together, so that switching the projection
 * preserves the size.
 */
export function zoom(camera: Camera, factor: number): Camera {
  const before = distanceOf(camera);
  const distance = clamp(before / factor, distanceMin, distanceMax);
  const applied = distance / before;
  const away = subtract(camera.eye, camera.target);
  return {
    ...camera,
    eye: add(camera.target, times(away, applied)),
    height: camera.height * applied,
  };
}

/**
 * Position of a point on the picture as fractions of its width and height from the upper left
 * corner; null behind the eye.
 */
export function project(camera: Camera, point: Vec3, aspect: number): [number, number] | null {
  const frame = cameraFrame(camera);
  const p = subtract(point, camera.eye);
  const depth = dot(p, frame.forward);
  if (depth <= 0) return null;
  const perspective = camera.projection === "perspective";
  const height = perspective ? 2 * depth * Math.tan(0.5 * camera.fovY * degree) : camera.height;
  return [0.5 + dot(p, frame.right) / (height * aspect), 0.5 - dot(p, frame.up) / height];
}

/**
 * The point that is visible at this position of the picture and lies in the plane where the world
 * coordinate `axis` equals `value`; null: there is none in front of the eye.
 */
export function pointInPlane(
  camera: Camera,
  [x, y]: [number, number],
  aspect: number,
  axis: 0 | 1 | 2,
  value: number,
): Vec3 | null {
  const frame = cameraFrame(camera);
  const height = heightAtTarget(camera);
  const side = times(frame.right, (x - 0.5) * height * aspect);
  const shift = add(side, times(frame.up, (0.5 - y) * height));
  const perspective = camera.projection === "perspective";
  const way = perspective ? add(subtract(camera.target, camera.eye), shift) : frame.forward;
  const from = perspective ? camera.eye : add(camera.eye, shift);
  const distance = (value - from[axis]) / way[axis];
  if (!(distance > 0) || !Number.isFinite(distance)) return null;
  return add(from, times(way, distance));
}

/** Changes the projection; objects at the target keep their size. */
export function withProjection(camera: Camera, projection: Camera["projection"]): Camera {
  if (camera.projection === projection) return camera;
  const height = heightAtTarget(camera);
  if (projection === "orthographic") return { ...camera, projection, height };
  const distance = clamp(
    (0.5 * height) / Math.tan(0.5 * camera.fovY * degree),
    distanceMin,
    distanceMax,
  );
  const moved = lookFrom({ ...camera, projection }, anglesOf(camera), distance);
  return roll(moved, rollOf(camera));
}

/**
 * Views the centre of the box from these angles so that the whole box is in the picture. Each
 * corner p (relative to the centre) requires distance >= |p.x| / slope - p.forward and height >= 2
 * |p.y|.
 */
export function frameBox(camera: Camera, box: Box, angles: Angles, aspect: number): Camera {
  const target = times(add(box.min, box.max), 0.5);
  const frame = orbitFrame(angles);
  const slopeY = Math.tan(0.5 * camera.fovY * degree) / margin;
  const slopeX = slopeY * aspect;
  const nearest = 0.01 * length(subtract(box.max, box.min));
  let distance = 0;
  let height = 0;
  for (let n = 0; n < 8; n++) {
    const corner: Vec3 = [
      (n & 1) !== 0 ? box.max[0] : box.min[0],
      (n & 2) !== 0 ? box.max[1] : box.min[1],
      (n & 4) !== 0 ? box.max[2] : box.min[2],
    ];
    const p = subtract(corner, target);
    const x = Math.abs(dot(p, frame.right));
    const y = Math.abs(dot(p, frame.up));
    distance = Math.max(
      distance,
      Math.max(x / slopeX, y / slopeY, nearest) - dot(p, frame.forward),
    );
    height = Math.max(height, 2 * margin * y, (2 * margin * x) / aspect);
  }
  return lookFrom({ ...camera, target, height }, angles, clamp(distance, distanceMin, distanceMax));
}

/**
 * geometry.scale stretches each edge; then the whole box is scaled so that its longest edge is 2.
 */
export function scaledBox(box: Box, scale: Vec3): Box {
  const edges = subtract(box.max, box.min).map((edge, axis) => edge * scale[axis]!);
  const half = edges.map((edge) => edge / Math.max(...edges)) as Vec3;
  return { min: times(half, -1), max: half };
}
