// Camera maths in world space: x east, y north, z up. Angles in degrees: azimuth 0 has the eye
// south of the target, positive azimuth moves it eastward; elevation is above the horizon.
// Pure functions: camera in, camera out.

export type Vec3 = [number, number, number];

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
const uprightElevation = 89.9; // beyond it `up` cannot be the world's
const distanceMin = 1e-3;
const distanceMax = 1e4;
const margin = 1.04; // the picture is this much wider than the box

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const times = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

const clamp = (x: number, low: number, high: number): number => Math.min(Math.max(x, low), high);

const unit = (a: Vec3): Vec3 => times(a, 1 / length(a));

export function orbitFrame({ azimuth, elevation }: Angles): Frame3 {
  const a = azimuth * degree;
  const e = clamp(elevation, -90, 90) * degree;
  const right: Vec3 = [Math.cos(a), Math.sin(a), 0];
  const forward: Vec3 = [-Math.sin(a) * Math.cos(e), Math.cos(a) * Math.cos(e), -Math.sin(e)];
  return { right, up: cross(right, forward), forward };
}

// Right, up and forward of the camera as the server draws it.
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
  // Straight up or down the line of sight tells no azimuth; `up` does.
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

export function orbit(camera: Camera, dAzimuth: number, dElevation: number): Camera {
  const { azimuth, elevation } = anglesOf(camera);
  return lookFrom(camera, { azimuth: azimuth + dAzimuth, elevation: elevation + dElevation });
}

// World units that the picture's height spans at the target.
export const heightAtTarget = (camera: Camera): number =>
  camera.projection === "orthographic"
    ? camera.height
    : 2 * distanceOf(camera) * Math.tan(0.5 * camera.fovY * degree);

// Moves the picture by fractions of its height, to the right and down, as a finger would.
export function pan(camera: Camera, dx: number, dy: number): Camera {
  const frame = cameraFrame(camera);
  const scale = heightAtTarget(camera);
  const shift = add(times(frame.right, -dx * scale), times(frame.up, dy * scale));
  return { ...camera, eye: add(camera.eye, shift), target: add(camera.target, shift) };
}

// factor > 1: nearer, larger. Distance and height go together, so that changing the projection
// keeps the size.
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

// The other projection, with the target's surroundings at the same size.
export function withProjection(camera: Camera, projection: Camera["projection"]): Camera {
  if (camera.projection === projection) return camera;
  const height = heightAtTarget(camera);
  if (projection === "orthographic") return { ...camera, projection, height };
  const distance = clamp(
    (0.5 * height) / Math.tan(0.5 * camera.fovY * degree),
    distanceMin,
    distanceMax,
  );
  return lookFrom({ ...camera, projection }, anglesOf(camera), distance);
}

// Looks at the box's centre from these angles so that all of it is in the picture. Every corner p
// (relative to the centre) needs distance >= |p.x| / slope - p.forward, and height >= 2 |p.y|.
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

// geometry.scale stretches each edge, then the whole is scaled so that the longest edge is 2.
export function scaledBox(box: Box, scale: Vec3): Box {
  const edges = subtract(box.max, box.min).map((edge, axis) => edge * scale[axis]!);
  const half = edges.map((edge) => edge / Math.max(...edges)) as Vec3;
  return { min: times(half, -1), max: half };
}
