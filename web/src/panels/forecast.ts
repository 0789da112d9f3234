// Geometry of the plot of error against time: logarithmic axes, their ticks, and text of points.
// Pure.
import { errorName, errorText, type ErrorMetric } from "../base/error_text";
import { formatNumber } from "../base/ticks";
import { clamp } from "@windsplat/client/parts";
import type { ForecastPoint } from "@windsplat/client";

export interface Axis {
  low: number; // > 0
  high: number;
}

const usable = (value: number): boolean => Number.isFinite(value) && value > 0;

// An axis over all usable values with a margin, spanning at least a factor of `ratio`.
export function axisOver(values: number[], ratio: number): Axis {
  const known = values.filter(usable);
  if (known.length === 0) return { low: 1, high: ratio };
  const low = known.reduce((a, b) => Math.min(a, b)) / 1.3;
  const high = known.reduce((a, b) => Math.max(a, b)) * 1.3;
  const wider = Math.max(1, Math.sqrt((ratio * low) / high));
  return { low: low / wider, high: high * wider };
}

// Position 0..1; values beyond an end are placed at that end.
export function positionOn({ low, high }: Axis, value: number): number {
  if (!(value > low)) return 0;
  return Math.min(1, Math.log(value / low) / Math.log(high / low));
}

export const valueOn = ({ low, high }: Axis, place: number): number =>
  low * (high / low) ** clamp(place, 0, 1);

// 1, 2 and 5 times powers of ten; if those are too many, only powers of ten, or some of them.
export function logTicks({ low, high }: Axis, most: number): number[] {
  const first = Math.floor(Math.log10(low));
  const last = Math.ceil(Math.log10(high));
  const ticks = (digits: number[], every: number): number[] => {
    const found: number[] = [];
    for (let power = first; power <= last; power++) {
      if (power % every !== 0) continue;
      found.push(...digits.map((digit) => Number(`${digit}e${power}`)));
    }
    return found.filter((tick) => tick >= low && tick <= high);
  };
  const all = ticks([1, 2, 5], 1);
  if (all.length <= most) return all;
  for (let every = 1; ; every++) {
    const some = ticks([1], every);
    if (some.length <= most) return some;
  }
}

export const msText = (ms: number): string => `${formatNumber(ms, ms < 10 ? 2 : 3)} ms`;

export const spotText = (ms: number, error: number, metric: ErrorMetric): string =>
  `${msText(ms)}, ${errorName(metric)} ${errorText(error, metric)}`;

export function pointText(point: ForecastPoint, metric: ErrorMetric): string {
  const { method, slabThickness, width, height, coarser, errorLow, errorHigh } = point;
  const slabs = slabThickness === null ? "" : ` of ${formatNumber(slabThickness, 3)} cells`;
  const data = coarser === 0 ? "" : `, data 1/${2 ** coarser}`;
  const [from, to] = [errorLow, errorHigh].map((error) => errorText(error, metric));
  return (
    `${method}${slabs}, ${width}×${height}${data}: ` +
    `${spotText(point.ms, point.error, metric)} (${from} to ${to}), ${point.kind}`
  );
}

// The error limit after an arrow key: changed by a tenth, or if `fine` by a hundredth.
export function limitAfter(error: number, way: 1 | -1, fine: boolean): number {
  return Number((error * (fine ? 1.01 : 1.1) ** way).toPrecision(fine ? 3 : 2));
}

// The budget after an arrow key: changed by a twentieth, or if `fine` by a millisecond.
export function budgetAfter(budget: number, way: 1 | -1, fine: boolean): number {
  const by = fine ? 1 : Math.max(1, Math.round(0.05 * budget));
  return clamp(Math.round(budget) + way * by, 1, 10_000);
}
