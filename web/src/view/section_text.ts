// Where a section lies, in the coordinates of the data and the words of the server's legend:
// "section at 500 hPa", "section at 45°N", "vertical section through 10°E, 45°N". Pure.
import { formatNumber } from "../base/ticks";
import { clamp, add, dot, subtract, times, type Vec3 } from "@windsplat/client/parts";
import type { Dataset, SurfaceView, View } from "@windsplat/client";
import { axisNames, worldFactors } from "./sample_position";
import { unitText } from "./unit_text";

type Slice = NonNullable<SurfaceView["slice"]>;
type Plane = NonNullable<SurfaceView["plane"]>;

const rounding = 1e-9; // of the components of a normal
const far = 1e5; // m, from which coordinates of a map projection are in km

const withMinus = (text: string): string => text.replace(/^-/, "−");

// In as few decimals as a number of degrees has, at most three.
function degreesNumber(value: number): string {
  const decimals = [0, 1, 2].find((count) => {
    const scaled = value * 10 ** count;
    return Math.abs(scaled - Math.round(scaled)) <= 1e-6;
  });
  const text = Math.abs(value).toFixed(decimals ?? 3);
  return Number(text) === 0 ? "0" : text;
}

function degreesText(kind: "longitude" | "latitude", value: number): string {
  const place = kind === "longitude" ? value - 360 * Math.round(value / 360) : value;
  const number = degreesNumber(place);
  const seam = kind === "longitude" && number === "180";
  const sides = kind === "longitude" ? "WE" : "SN";
  return `${number}°${number === "0" || seam ? "" : sides[place < 0 ? 0 : 1]}`;
}

// "500 hPa", "45°N", "y = 12 km".
function placeText(dataset: Dataset, n: number, value: number): string {
  const axis = dataset.axes[axisNames[n]!];
  const { kind } = axis;
  if (kind === "longitude" || kind === "latitude") return degreesText(kind, value);
  const unit = unitText(axis.units);
  const inKilometres =
    unit === "m" && kind === "cartesian" && axis.coordinates.some((at) => Math.abs(at) >= far);
  const shown = withMinus(formatNumber(inKilometres ? value / 1000 : value, 5));
  const number = `${shown} ${inKilometres ? "km" : unit}`.trim();
  if (kind === "pressure") return unit === "" ? `pressure ${number}` : number;
  if (kind === "height" || kind === "depth") return `${kind} ${number}`;
  return `${(axis.name || axisNames[n]!).replaceAll("_", " ")} = ${number}`;
}

// Whether pressures are placed by their logarithm.
function isLogarithmic(dataset: Dataset, view: View, n: number): boolean {
  const { kind, coordinates } = dataset.axes[axisNames[n]!];
  const { vertical = "auto", mapping = "flat" } = view.geometry ?? {};
  const byLog = mapping !== "sphere" && ["auto", "logp", "metric"].includes(vertical);
  return n === 2 && kind === "pressure" && byLog && coordinates.every((at) => at > 0);
}

// The coordinate at an index that need not be whole, as the box places it between samples.
function coordinateAt(dataset: Dataset, view: View, n: number, index: number): number {
  const { coordinates } = dataset.axes[axisNames[n]!];
  const at = clamp(index, 0, coordinates.length - 1);
  const [low, part] = [Math.floor(at), at - Math.floor(at)];
  const [a, b] = [coordinates[low]!, coordinates[low + 1] ?? coordinates[low]!];
  if (part === 0) return a;
  if (isLogarithmic(dataset, view, n)) return a * (b / a) ** part;
  return a + part * (b - a);
}

// Whether columns of the grid, and not its rows and columns, have longitudes and latitudes.
const hasColumns = (dataset: Dataset, n: number): boolean =>
  n < 2 && dataset.mappings.includes("curvilinear");

function sliceText(dataset: Dataset, view: View, { axis, index }: Slice): string {
  const n = axisNames.indexOf(axis);
  if (hasColumns(dataset, n)) {
    return `section at ${n === 0 ? "column i" : "row j"} = ${formatNumber(index, 5)}`;
  }
  return `section at ${placeText(dataset, n, coordinateAt(dataset, view, n, index))}`;
}

// The index, which need not be whole, at a position along a world axis; linear beyond its ends.
function indexAt(world: number[], position: number): number {
  if (world.length < 2) return 0;
  const after = world.findIndex((at) => at >= position);
  const low = clamp(after < 0 ? world.length - 2 : after - 1, 0, world.length - 2);
  return low + (position - world[low]!) / (world[low + 1]! - world[low]!);
}

// Null: the axes of the grid do not tell it.
function worldText(dataset: Dataset, view: View, n: number, position: number): string | null {
  const factors = worldFactors(dataset, view);
  if (factors === null || hasColumns(dataset, n)) return null;
  const index = indexAt(dataset.axes[axisNames[n]!].world, position / factors[n]!);
  return placeText(dataset, n, coordinateAt(dataset, view, n, index));
}

// Where a plane meets the edges of a box.
function pointsInBox(min: Vec3, max: Vec3, point: Vec3, normal: Vec3): Vec3[] {
  const corner = (bits: number): Vec3 =>
    [0, 1, 2].map((n) => (((bits >> n) & 1) === 1 ? max[n]! : min[n]!)) as Vec3;
  const found: Vec3[] = [];
  for (let bits = 0; bits < 8; bits++) {
    for (let n = 0; n < 3; n++) {
      if (((bits >> n) & 1) === 1) continue;
      const [from, to] = [corner(bits), corner(bits | (1 << n))];
      const before = dot(normal, subtract(from, point));
      const after = dot(normal, subtract(to, point));
      if (before * after > 0 || before === after) continue;
      found.push(add(from, times(subtract(to, from), before / (before - after))));
    }
  }
  return found;
}

// The place of a plane nearest to the middle of the box, among those where it meets the box; null:
// the page does not know the box.
function middleOf(dataset: Dataset, view: View, point: Vec3, normal: Vec3): Vec3 | null {
  const factors = worldFactors(dataset, view);
  const { where: _, ...limits } = view.region ?? {};
  const whole = Object.values(limits).every((limit) => (limit ?? null) === null);
  if (factors === null || !whole) return null;
  const end = (side: "min" | "max"): Vec3 =>
    factors.map((factor, n) => factor * dataset.world[side][n]!) as Vec3;
  const [min, max] = [end("min"), end("max")];
  const centre = times(add(min, max), 0.5);
  const nearest = subtract(centre, times(normal, dot(subtract(centre, point), normal)));
  const inside = nearest.every((at, n) => at >= min[n]! && at <= max[n]!);
  const corners = pointsInBox(min, max, point, normal);
  if (inside || corners.length === 0) return nearest;
  return times(
    corners.reduce((sum, at) => add(sum, at)),
    1 / corners.length,
  );
}

function planeText(dataset: Dataset, view: View, plane: Plane): string {
  const length = Math.hypot(...plane.normal);
  const normal = plane.normal.map((part) => part / length) as Vec3;
  const isVertical = Math.abs(normal[2]) <= rounding;
  const along = normal.findIndex((part) => Math.abs(part) >= 1 - rounding);
  const kind = isVertical ? "vertical section" : along === 2 ? "section" : "oblique section";
  if (along >= 0) {
    const text = worldText(dataset, view, along, plane.point[along]!);
    return text === null ? kind : `section at ${text}`;
  }
  const middle = middleOf(dataset, view, plane.point as Vec3, normal);
  if (middle === null) return kind;
  const texts = middle
    .slice(0, isVertical ? 2 : 3)
    .map((position, n) => worldText(dataset, view, n, position));
  return texts.includes(null) ? kind : `${kind} through ${texts.join(", ")}`;
}

type Cut = { slice?: Slice | null; plane?: Plane | null };

// Empty: neither a slice nor a plane.
export function sectionText(dataset: Dataset, view: View, { slice, plane }: Cut): string {
  if (plane) return planeText(dataset, view, plane);
  return slice ? sliceText(dataset, view, slice) : "";
}

// Of the slice or plane that cuts the whole view; empty: none.
export const sectionOfView = (dataset: Dataset, view: View): string =>
  sectionText(dataset, view, view.geometry ?? {});
