// Distance and direction between two positions of probes. Pure.
import type { Position, Dataset } from "@windsplat/client";
import { formatNumber } from "../base/ticks";
import { axisUnit } from "./sample_position";

export const earthRadiusKm = 6371.0088; // mean radius (2 a + b) / 3 of WGS84
const radians = Math.PI / 180;

// Kilometres along the great circle of a sphere between two places in degrees, by the haversine
// formula (Sinnott, Sky and Telescope 68, 1984), which keeps short distances exact.
export function greatCircleKm(
  [east1, north1]: readonly [number, number],
  [east2, north2]: readonly [number, number],
): number {
  const half = (degrees: number): number => Math.sin((degrees * radians) / 2) ** 2;
  const h =
    half(north2 - north1) +
    Math.cos(north1 * radians) * Math.cos(north2 * radians) * half(east2 - east1);
  return 2 * earthRadiusKm * Math.asin(Math.sqrt(Math.min(1, h)));
}

// Degrees clockwise from north, below 360, of the great circle at its first place; null where it
// has none: at a pole, of one place to itself and of opposite ones.
export function initialBearing(
  [east1, north1]: readonly [number, number],
  [east2, north2]: readonly [number, number],
): number | null {
  const [a, b, turn] = [north1 * radians, north2 * radians, (east2 - east1) * radians];
  const x = Math.sin(turn) * Math.cos(b);
  const y = Math.cos(a) * Math.sin(b) - Math.sin(a) * Math.cos(b) * Math.cos(turn);
  const rounding = 1e-12;
  if (Math.hypot(x, y) < rounding || Math.cos(a) < rounding) return null;
  const degrees = Math.atan2(x, y) / radians;
  const from0 = degrees < 0 ? degrees + 360 : degrees;
  return from0 === 360 ? 0 : from0;
}

const withUnit = (value: number, unit: string): string =>
  unit === "" ? formatNumber(value) : `${formatNumber(value)} ${unit}`;

// "1234 km towards 56° (great circle), 5500 m up": the way from one position to another. Without
// longitudes and latitudes the straight distance, where the axes have one unit.
export function wayText({ axes }: Dataset, from: Position, to: Position): string {
  const { units } = from;
  const parts: string[] = [];
  const alongAxes = axes.x.kind === "longitude" && axes.y.kind === "latitude";
  if (alongAxes || (units.x === "degrees_east" && units.y === "degrees_north")) {
    const [a, b] = [from, to].map(({ x, y }) => [x, y] as const) as [
      readonly [number, number],
      readonly [number, number],
    ];
    const bearing = initialBearing(a, b);
    const towards = bearing === null ? "" : ` towards ${formatNumber(bearing, 3)}°`;
    parts.push(`${formatNumber(greatCircleKm(a, b), 5)} km${towards} (great circle)`);
  } else if (units.x === units.y) {
    parts.push(withUnit(Math.hypot(to.x - from.x, to.y - from.y), axisUnit(units.x)));
  } else {
    parts.push(`x ${withUnit(to.x - from.x, axisUnit(units.x))}`);
    parts.push(`y ${withUnit(to.y - from.y, axisUnit(units.y))}`);
  }
  const rise = to.z - from.z;
  if (rise !== 0) {
    parts.push(`vertically ${rise > 0 ? "+" : "−"}${withUnit(Math.abs(rise), axisUnit(units.z))}`);
  }
  return parts.join(", ");
}
