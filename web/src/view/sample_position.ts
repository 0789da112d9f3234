// World positions of samples in a view, and the sample nearest to a position. Pure.
import type { Position, Probe, Value, Dataset, View } from "@windsplat/client";
import type { Vec3 } from "@windsplat/client/parts";
import { unitText } from "./unit_text";
import { formatNumber } from "../base/ticks";

export const axisNames = ["x", "y", "z"] as const;
export type Sample = Vec3; // indices along x, y, z

export const middleSample = (dataset: Dataset): Sample =>
  axisNames.map((axis) => Math.floor((dataset.dims[axis] - 1) / 2)) as Sample;

export const sampleWithin = (dataset: Dataset, sample: Sample): Sample =>
  axisNames.map((axis, n) => Math.min(sample[n]!, dataset.dims[axis] - 1)) as Sample;

// Coordinates of a sample, each in the unit of its axis.
export const coordinatesOf = (dataset: Dataset, sample: Sample): Vec3 =>
  axisNames.map((axis, n) => dataset.axes[axis].coordinates[sample[n]!] ?? 0) as Vec3;

export function nearestIndex(coordinates: number[], value: number): number {
  let best = 0;
  coordinates.forEach((coordinate, index) => {
    if (Math.abs(coordinate - value) < Math.abs(coordinates[best]! - value)) best = index;
  });
  return best;
}

// Factors from the dataset's world coordinates to the view's; null for a mapped grid or another
// vertical axis, as the page cannot compute those positions.
export function worldFactors(dataset: Dataset, view: View): Vec3 | null {
  const { vertical = "auto", mapping = "flat", heightField = null, scale } = view.geometry ?? {};
  if (vertical !== "auto" || mapping !== "flat" || heightField !== null) return null;
  const edges = dataset.world.max.map((most, axis) => most - dataset.world.min[axis]!);
  const stretch = scale ?? [1, 1, 1];
  const longest = Math.max(...edges.map((edge, axis) => edge * stretch[axis]!));
  return stretch.map((factor) => (factor * Math.max(...edges)) / longest) as Vec3;
}

export function worldOf(dataset: Dataset, view: View, sample: Sample): Vec3 | null {
  const factors = worldFactors(dataset, view);
  if (factors === null) return null;
  return axisNames.map(
    (axis, n) => (dataset.axes[axis].world[sample[n]!] ?? 0) * factors[n]!,
  ) as Vec3;
}

// The sample nearest to a world position; null outside the box.
export function sampleAt(dataset: Dataset, view: View, point: Vec3): Sample | null {
  const factors = worldFactors(dataset, view);
  if (factors === null) return null;
  const sample: number[] = [];
  for (const [n, axis] of axisNames.entries()) {
    const place = point[n]! / factors[n]!;
    const slack = 1e-6;
    const outside = place < dataset.world.min[n]! - slack || place > dataset.world.max[n]! + slack;
    if (outside) return null;
    sample.push(nearestIndex(dataset.axes[axis].world, place));
  }
  return sample as Sample;
}

export const magnitude = (value: Value): number | null => {
  if (!Array.isArray(value)) return value;
  return value.some((v) => v === null) ? null : Math.hypot(...(value as number[]));
};

export function valueText(value: Value, units: string): string {
  const unit = unitText(units);
  const size = magnitude(value);
  if (size === null) return "masked";
  const shown = Array.isArray(value)
    ? `(${value.map((v) => formatNumber(v ?? NaN)).join(", ")}), |v| ${formatNumber(size)}`
    : formatNumber(size);
  return unit === "" ? shown : `${shown} ${unit}`;
}

export const axisUnit = (units: string): string =>
  ({ degrees_east: "°E", degrees_north: "°N" })[units] ?? unitText(units);

// A coordinate with its unit: "23.5 °W", "12 km".
export function valueOnAxis(value: number, units: string): string {
  const unit = axisUnit(units);
  // Longitudes of columns may go on beyond a whole turn.
  const place = unit === "°E" && Math.abs(value) > 360 ? value % 360 : value;
  const opposite = place < 0 ? { "°E": "°W", "°N": "°S" }[unit] : undefined;
  const shown = opposite === undefined ? place : -place;
  return `${formatNumber(shown)} ${opposite ?? unit}`.trim();
}

// A coordinate as text: "23.5 °W", "x 12 km". own: its unit if it is not that of the axis.
export function coordinateText(
  dataset: Dataset,
  n: number,
  value: number,
  called?: string,
  own?: string,
): string {
  const { name } = dataset.axes[axisNames[n]!];
  const units = own ?? dataset.axes[axisNames[n]!].units;
  const text = valueOnAxis(value, units);
  if (called !== undefined) return `${called} ${text}`;
  return axisUnit(units).startsWith("°") ? text : `${name} ${text}`;
}

// A position in the coordinates and units of an answer.
export const positionText = (dataset: Dataset, position: Position): string =>
  axisNames
    .map((axis, n) => coordinateText(dataset, n, position[axis], undefined, position.units[axis]))
    .join(", ");

// Where a probe was read, if other coordinates than those of the axes tell: longitude and latitude
// of a column, and the height of the sample where a field of heights places it.
export function placeText(dataset: Dataset, { position }: Probe): string {
  const { units } = position;
  const others = axisNames.filter((name) => units[name] !== dataset.axes[name].units);
  const parts = others.map((name) => {
    const n = axisNames.indexOf(name);
    const called = name === "z" ? "height" : undefined;
    return coordinateText(dataset, n, position[name], called, units[name]);
  });
  return parts.length === 0 ? "" : `at ${parts.join(", ")}`;
}

// Lines of a probe beside the cursor: the drawn fields, or all fields if none is drawn, and the
// position; `axis` is normal to the plane in which the position was sought.
export function hoverLines(dataset: Dataset, view: View, probe: Probe, axis: number): string[] {
  const drawn = [view.vector?.field, ...(view.scalars ?? []).map(({ field }) => field)];
  const { values } = probe;
  const wanted = drawn.filter((name, n) => name && values[name] && drawn.indexOf(name) === n);
  const names = wanted.length > 0 ? (wanted as string[]) : Object.keys(values);
  const parts = names.map(
    (name) => `${name} ${valueText(magnitude(values[name]!.value), values[name]!.units)}`,
  );
  const at = axisNames.map((name) => probe.position[name]);
  const unitsAt = axisNames.map((name) => probe.position.units[name]);
  const called = axis === 2 ? "level" : "section";
  const across = coordinateText(dataset, axis, at[axis]!, called, unitsAt[axis]);
  const along = at.flatMap((value, n) =>
    n === axis ? [] : [coordinateText(dataset, n, value, undefined, unitsAt[n])],
  );
  return [parts.join(" · "), `${along.join(", ")} · ${across}`];
}
