// The camera as text, to be copied and pasted: camera -> JSON, and JSON of a camera or of a view
// -> patch. Pure.
import { viewRanges, type Camera } from "@windsplat/client";
import { isObject, length, subtract, type Vec3, type Patch } from "@windsplat/client/parts";

const digits = (v: number): number => Number(v.toFixed(6));

export function cameraText({ projection, eye, target, up, fovY, height }: Camera): string {
  const place = { eye: eye.map(digits), target: target.map(digits), up: up.map(digits) };
  const lens = projection === "perspective" ? { fovY } : { height: digits(height) };
  return JSON.stringify({ projection, ...place, ...lens });
}

const isVec3 = (value: unknown): value is Vec3 =>
  Array.isArray(value) && value.length === 3 && value.every((v) => Number.isFinite(v));

const checks: Record<string, (value: unknown) => string | null> = {
  projection: (value) =>
    value === "perspective" || value === "orthographic" ? null : '"perspective" or "orthographic"',
  eye: (value) => (isVec3(value) ? null : "three numbers"),
  target: (value) => (isVec3(value) ? null : "three numbers"),
  up: (value) => (isVec3(value) && length(value) > 0 ? null : "three numbers, not all zero"),
  fovY: (value) => within(value, "fovY"),
  height: (value) => within(value, "height"),
};

function within(value: unknown, key: string): string | null {
  const [min = 0, max = Infinity] = viewRanges[`/camera/${key}`] ?? [];
  const right = typeof value === "number" && value >= min && value <= max;
  return right ? null : `a number from ${min} to ${max}`;
}

// The whole place of the camera is set, as of a part alone the server would choose the others.
export function cameraChange({ eye, target, up, height }: Camera, part: Partial<Camera>): Patch {
  return { camera: { eye, target, up, height, ...part } };
}

// The change that the text asks for; keys that it does not have stay as in `now`. Throws an Error
// that says what the text should have been.
export function cameraPatch(text: string, now: Camera): Patch {
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch {
    value = null;
  }
  if (isObject(value) && isObject(value.camera)) value = value.camera;
  if (!isObject(value) || Object.keys(value).length === 0) {
    throw new Error('Not a camera: expected {"eye": [x, y, z], "target": [x, y, z], …}.');
  }
  for (const [key, part] of Object.entries(value)) {
    const check = checks[key];
    if (check === undefined) throw new Error(`A camera has no ${key}.`);
    const expected = check(part);
    if (expected !== null) throw new Error(`The camera's ${key} must be ${expected}.`);
  }
  const { eye, target } = { ...now, ...(value as Partial<Camera>) };
  if (!(length(subtract(eye, target)) > 0)) {
    throw new Error("The camera's eye and target must be different points.");
  }
  return cameraChange(now, value);
}
