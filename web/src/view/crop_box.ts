// The box of a region in the world: its faces, and how they move along the axes. Only for flat
// grids, whose axes are straight. Pure.
import { cameraFrame, degree, type Camera, type Dataset, type View } from "@windsplat/client";
import { axisNames, nearestIndex, worldFactors } from "./sample_position";
import { clamp, add, dot, subtract, times, type Vec3 } from "@windsplat/client/parts";

export type Ends = [number, number];

// Samples along an axis in the order of the world: ascending world positions. Behind the last one
// those follow that a region across the seam of longitudes adds; they count on by 360 degrees.
export interface Rail {
  coordinates: number[];
  world: number[];
}

export interface CropAxis extends Rail {
  size: number; // samples of the data; those behind them are beyond the seam
  ends: Ends; // coordinates of the region, the one of the lower world position first
}

export interface CropBox {
  axes: [CropAxis, CropAxis, CropAxis];
  min: Vec3; // world
  max: Vec3;
}

export interface Face {
  axis: 0 | 1 | 2;
  end: 0 | 1; // 0: of the lower world position
}

export const faces: Face[] = ([0, 1, 2] as const).flatMap((axis) => [
  { axis, end: 0 } satisfies Face,
  { axis, end: 1 } satisfies Face,
]);

const turn = 360; // degrees
const rounding = 1e-9; // of coordinates, relative to the length of their axis
// A face may turn away from the viewer by so much, as seen from above those at the sides do.
const awayMax = Math.sin(30 * degree);
// An axis closer to the view direction is too short in the picture to be followed.
const endOnMax = Math.sin(8 * degree);

export const unitAlong = (axis: number): Vec3 => [0, 1, 2].map((n) => Number(n === axis)) as Vec3;

const isAscending = (values: number[]): boolean =>
  values.every((value, n) => n === 0 || value > values[n - 1]!);

// Interpolates linearly between samples; ends are kept beyond them.
export function worldAt({ coordinates, world }: Rail, coordinate: number): number {
  const last = coordinates.length - 1;
  const sign = coordinates[last]! < coordinates[0]! ? -1 : 1;
  const after = coordinates.findIndex((at) => sign * at >= sign * coordinate);
  if (after === 0) return world[0]!;
  if (after < 0) return world[last]!;
  const [a, b] = [coordinates[after - 1]!, coordinates[after]!];
  return world[after - 1]! + ((coordinate - a) / (b - a)) * (world[after]! - world[after - 1]!);
}

// A range of longitudes on its rail, from west to east.
function eastward(rail: Omit<CropAxis, "ends">, [west, east]: Ends): CropAxis {
  const { coordinates, world, size } = rail;
  const [first, last] = [coordinates[0]!, coordinates.at(-1)!];
  const slack = rounding * turn;
  const gap = turn - (last - first);
  const isClosed = gap < (1.5 * (last - first)) / (coordinates.length - 1);
  let span = east - west;
  if (span < 0) span += turn * Math.ceil(-span / turn);
  if (span >= turn - slack) return { ...rail, ends: [first, last] };
  let from = west - turn * Math.floor((west - first + slack) / turn);
  if (!isClosed && from > last + slack) from -= turn;
  const to = from + span;
  if (!isClosed || to < first + turn - slack) {
    const within = (at: number): number => clamp(at, first, last);
    return { ...rail, ends: [within(from), within(to)] };
  }
  const beyond = coordinates.filter((at) => at + turn <= to + slack && at + turn > last);
  const length = (turn * (world.at(-1)! - world[0]!)) / (last - first);
  return {
    size,
    coordinates: [...coordinates, ...beyond.map((at) => at + turn)],
    world: [...world, ...beyond.map((_, n) => world[n]! + length)],
    ends: [from, to],
  };
}

function cropAxis(dataset: Dataset, view: View, n: number, factor: number): CropAxis | null {
  const name = axisNames[n]!;
  const { coordinates, kind } = dataset.axes[name];
  const world = dataset.axes[name].world.map((at) => at * factor);
  const backward = coordinates.map((at) => -at);
  if (coordinates.length === 0 || !isAscending(world)) return null;
  if (!isAscending(coordinates) && !isAscending(backward)) return null;
  const range = view.region?.[name] ?? null;
  const [first, last] = [coordinates[0]!, coordinates.at(-1)!];
  const rail = { size: coordinates.length, coordinates, world };
  if (range === null || rail.size < 2) return { ...rail, ends: [first, last] };
  if (kind === "longitude" && last > first) return eastward(rail, range);
  const [low, high] = [Math.min(first, last), Math.max(first, last)];
  const [a, b] = [clamp(Math.min(...range), low, high), clamp(Math.max(...range), low, high)];
  return { ...rail, ends: last > first ? [a, b] : [b, a] };
}

// The box of the region in a view, or of the whole data; null where the page cannot place it: in
// mapped grids, with another vertical axis, or with a height field.
export function cropBox(dataset: Dataset, view: View): CropBox | null {
  const factors = worldFactors(dataset, view);
  if (factors === null) return null;
  const found = factors.map((factor, n) => cropAxis(dataset, view, n, factor));
  if (found.includes(null)) return null;
  const axes = found as CropBox["axes"];
  const at = (end: 0 | 1): Vec3 => axes.map((axis) => worldAt(axis, axis.ends[end])) as Vec3;
  return { axes, min: at(0), max: at(1) };
}

export function faceCentre(box: CropBox, { axis, end }: Face): Vec3 {
  const centre = times(add(box.min, box.max), 0.5);
  centre[axis] = (end === 0 ? box.min : box.max)[axis];
  return centre;
}

// Sine of the angle by which a face is turned towards the viewer, seen at its centre; negative:
// away.
export function towardViewer(camera: Camera, box: CropBox, face: Face): number {
  const { forward } = cameraFrame(camera);
  const way =
    camera.projection === "perspective"
      ? subtract(camera.eye, faceCentre(box, face))
      : times(forward, -1);
  const outward = face.end === 0 ? -1 : 1;
  return (outward * way[face.axis]) / Math.hypot(...way);
}

// Whether a face has a handle: it faces the viewer or is seen nearly edge-on, and the axis along
// which it moves does not point at the viewer.
export function hasHandle(camera: Camera, box: CropBox, face: Face): boolean {
  if (box.axes[face.axis].coordinates.length < 3) return false;
  const toward = towardViewer(camera, box, face);
  return toward > -awayMax && Math.abs(toward) < Math.sqrt(1 - endOnMax ** 2);
}

// The displacement along a world axis of the point whose picture, starting from `point`, comes
// closest to a position of the picture (fractions of its width and height). With p the point and a
// the axis in the frame of the camera, right, up and forward, the picture of p + t a is
// (p + t a).xy / (k depth) in heights of the picture. It moves along the straight line of direction
// d = a.xy p.depth - p.xy a.depth, and t follows from (picture - position) . d = 0, which is linear
// in t. Orthographic: depth is constant, k depth the height. null: there is no such point in front
// of the eye.
export function alongAxis(
  camera: Camera,
  aspect: number,
  point: Vec3,
  axis: 0 | 1 | 2,
  [x, y]: [number, number],
): number | null {
  const { right, up, forward } = cameraFrame(camera);
  const from = subtract(point, camera.eye);
  const way = unitAlong(axis);
  const perspective = camera.projection === "perspective";
  const p = [dot(from, right), dot(from, up)] as const;
  const a = [dot(way, right), dot(way, up)] as const;
  const depth = perspective ? dot(from, forward) : 1;
  const deeper = perspective ? dot(way, forward) : 0;
  const k = perspective ? 2 * Math.tan(0.5 * camera.fovY * degree) : camera.height;
  if (!(depth > 0)) return null;
  const d = [a[0] * depth - p[0] * deeper, a[1] * depth - p[1] * deeper] as const;
  const wanted = k * ((x - 0.5) * aspect * d[0] + (0.5 - y) * d[1]);
  const t =
    (wanted * depth - (p[0] * d[0] + p[1] * d[1])) / (a[0] * d[0] + a[1] * d[1] - wanted * deeper);
  return Number.isFinite(t) && depth + t * deeper > 0 ? t : null;
}

// The first and last sample to which a face can move. Two samples are left between the faces, or
// as many as there are if these are fewer. The eastern face passes the seam of longitudes only as
// far as the region does, the western one not at all.
export function limitsOf(box: CropBox, { axis, end }: Face): Ends {
  const { world, size } = box.axes[axis];
  const last = world.length - 1;
  const slack = rounding * (world[last]! - world[0]!);
  if (end === 0) {
    const below = world.filter((at) => at <= box.max[axis] + slack).length - 1;
    return [0, clamp(below - 1, 0, size - 1)];
  }
  const above = world.findIndex((at) => at >= box.min[axis] - slack);
  return [Math.min(last, above + 1), last];
}

// The sample nearest to a world position among those to which the face can move.
export function sampleOfFace(box: CropBox, face: Face, world: number): number {
  return clamp(nearestIndex(box.axes[face.axis].world, world), ...limitsOf(box, face));
}

// The range of the axis once a face is at a sample; null: the whole axis.
export function rangeWith(box: CropBox, face: Face, sample: number): Ends | null {
  const { coordinates, ends, size } = box.axes[face.axis];
  const next: Ends = [ends[0], ends[1]];
  next[face.end] = coordinates[sample]!;
  if (next[0] === coordinates[0] && next[1] === coordinates[size - 1]) return null;
  return next[0] <= next[1] ? next : [next[1], next[0]];
}
