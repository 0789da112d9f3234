// What a new surface shows: a field that has values, a value between them, and a section that the
// camera does not see edge-on.
import type { FieldRange, Histogram, Dataset, SurfaceView, View } from "@windsplat/client";
import { formatNumber } from "../base/ticks";
import { dot, length, subtract, times, type Vec3 } from "@windsplat/client/parts";
import { unitText } from "../view/unit_text";
import { hasValues, neat, quantile } from "../view/histogram";

export type Axis = "x" | "y" | "z";

const maskedMost = 0.25; // share of samples beyond which another field is preferred
const triedMost = 6; // fields whose values are read

const fieldNamed = (dataset: Dataset, name: string) =>
  dataset.fields.find((field) => field.name === name);

// A value in the middle of most samples; null if all are equal or masked.
export function middleValue(histogram: Histogram): number | null {
  if (!hasValues(histogram)) return null;
  const { range, counts } = histogram;
  const width = range[1] - range[0];
  if (!(width > 0) || !counts.some((count) => count > 0)) return null;
  const low = quantile(histogram, 0.02);
  const high = quantile(histogram, 0.98);
  // of a field that has one value nearly everywhere, the middle of all
  const [from, to] = high - low > width / counts.length ? [low, high] : range;
  return neat((from + to) / 2, range);
}

const maskedShare = ({ masked, counts, below, above }: Histogram): number =>
  masked /
  Math.max(
    1,
    counts.reduce((sum, count) => sum + count, masked + below + above),
  );

// Scalar fields in the order in which they are tried: media of the default view first, those with
// many masked samples last as far as this is known.
export function candidates(dataset: Dataset): string[] {
  const samples = dataset.dims.x * dataset.dims.y * dataset.dims.z;
  const media = (dataset.defaultView?.scalars ?? []).map(({ field }) => field);
  const order = dataset.fields
    .filter(({ kind }) => kind === "scalar")
    .map(({ name, masked }) => {
      const late = (masked ?? 0) > maskedMost * samples ? 2 : 0;
      return { name, at: late + (media.includes(name) ? 0 : 1) };
    });
  return order.sort((a, b) => a.at - b.at).map(({ name }) => name);
}

// The first of the fields of which most samples have values, or the one with the most.
export async function firstIsosurface(
  fields: string[],
  read: (field: string) => Promise<Histogram>,
): Promise<{ field: string; isovalue: number } | null> {
  let best: { field: string; isovalue: number } | null = null;
  let least = Infinity;
  for (const field of fields.slice(0, triedMost)) {
    const histogram = await read(field);
    const isovalue = middleValue(histogram);
    const share = maskedShare(histogram);
    if (isovalue === null || share >= least) continue;
    best = { field, isovalue };
    least = share;
    if (share <= maskedMost) break;
  }
  return best;
}

// Whether a value of one field may be kept for another.
export function keepsValue(
  dataset: Dataset,
  from: string,
  to: string,
  value: number,
  histogram: Histogram,
): boolean {
  const units = (name: string) => unitText(fieldNamed(dataset, name)?.units);
  if (!hasValues(histogram)) return false;
  const [low, high] = histogram.range;
  return units(from) === units(to) && value > low && value < high;
}

// Why an isosurface has no triangles, as far as the range of its field tells.
export function noSurfaceText(dataset: Dataset, surface: SurfaceView, known: FieldRange): string {
  const { field, isovalue } = surface;
  if (typeof isovalue !== "number") return "";
  if (known.range === null) return `Every sample of ${field} is masked at this step.`;
  const [low, high] = known.range;
  if (isovalue >= low && isovalue <= high) return "";
  const units = unitText(fieldNamed(dataset, field)?.units);
  const text = `${formatNumber(low)} to ${formatNumber(high)} ${units}`.trim();
  return `Empty: ${field} is ${text} at this step.`;
}

const normalize = (a: Vec3): Vec3 => times(a, 1 / length(a));

// From the eye to the target, or to a place where the perspective differs; unit.
function sight({ camera }: View, place?: Vec3): Vec3 | null {
  const [eye, target] = [camera?.eye, camera?.target];
  if (!eye || !target) return null;
  const to = place === undefined || camera?.projection === "orthographic" ? target : place;
  const way = subtract(to as Vec3, eye as Vec3);
  return length(way) > 0 ? normalize(way) : null;
}

// The vertical section that faces the camera.
export function facingAxis(view: View): Axis {
  const way = sight(view);
  return way !== null && Math.abs(way[0]) > Math.abs(way[1]) ? "x" : "y";
}

const axisNumber: Record<Axis, 0 | 1 | 2> = { x: 0, y: 1, z: 2 };

// Whether a section is seen nearly edge-on. Of layers only where the view does not bend them.
export function isEdgeOn(dataset: Dataset, view: View, surface: SurfaceView): boolean {
  const { geometry } = view;
  const edge = 0.06; // sine of the angle between section and line of sight
  if ((geometry?.mapping ?? "flat") !== "flat") return false;
  const { slice, plane } = surface;
  const target = view.camera?.target as Vec3 | undefined;
  if (!target) return false;
  if (plane) {
    const way = sight(view, plane.point as Vec3);
    return way !== null && Math.abs(dot(way, normalize(plane.normal as Vec3))) < edge;
  }
  if (!slice) return false;
  const axis = slice.axis as Axis;
  const at = axisNumber[axis];
  const { world } = dataset.axes[axis];
  const place = [...target] as Vec3;
  if ((geometry?.heightField ?? null) !== null && at === 2) return false;
  const scaled = (geometry?.scale ?? [1, 1, 1]).some((scale) => scale !== 1);
  if (!scaled) place[at] = world[Math.round(slice.index)] ?? target[at];
  const way = sight(view, place);
  return way !== null && Math.abs(way[at]) < edge;
}

type Contours = NonNullable<SurfaceView["contours"]>;

// Contours with a change; null: neither an interval nor levels are left.
export function contoursWith(
  before: Contours | null | undefined,
  change: Pick<Contours, "interval" | "levels">,
): Contours | null {
  const next = { ...before, ...change };
  const some = (next.interval ?? null) !== null || (next.levels ?? []).length > 0;
  return some ? next : null;
}

const levelsMax = 64; // of the view's schema

// Values between spaces, commas or semicolons, in ascending order. Throws an Error with a message.
export function levelsIn(text: string): number[] {
  const words = text.split(/[\s,;]+/).filter((word) => word !== "");
  const values = words.map((word) => {
    const value = Number(word.replaceAll("\u2212", "-"));
    if (!Number.isFinite(value)) throw new Error(`“${word}” is not a number.`);
    return value;
  });
  const levels = [...new Set(values)].sort((a, b) => a - b);
  if (levels.length <= levelsMax) return levels;
  throw new Error(`At most ${levelsMax} levels, not ${levels.length}.`);
}
