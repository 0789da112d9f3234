// Histogram calculations: bars, quantiles, and ranges chosen by dragging. Pure.
import type { Histogram, Range } from "@windsplat/client";
import { formatNumber } from "../base/ticks";
import { clamp } from "@windsplat/client/parts";

/** A histogram of a field that has values. */
export type Counted = Histogram & { range: Range };

export const hasValues = (histogram: Histogram): histogram is Counted => histogram.range !== null;

// What was counted, in words. unit: with a space before it, or empty.
export function countedText(histogram: Histogram, unit: string): string {
  const { masked } = histogram;
  const rest = masked === 0 ? "" : ` · ${formatNumber(masked, 6)} masked`;
  if (!hasValues(histogram)) return `no values${rest}`;
  const [low, high] = histogram.range.map((end) => formatNumber(end));
  return `${low} to ${high}${unit}${rest}`;
}

// Outline of the bars as an SVG path; each bar is one unit wide and at most 1 high, y downward.
export function barPath(counts: number[], log: boolean): string {
  const size = (count: number): number => (log ? Math.log1p(count) : count);
  const most = size(counts.reduce((a, b) => Math.max(a, b), 0));
  if (most <= 0) return "";
  const bars = counts.map((count) => `V${(1 - size(count) / most).toFixed(4)}h1`);
  return `M0 1${bars.join("")}V1Z`;
}

// The value below which the fraction `share` of the unmasked samples lies; samples are assumed
// uniform within a bin.
export function quantile({ range, counts, below, above }: Counted, share: number): number {
  const width = (range[1] - range[0]) / counts.length;
  const total = counts.reduce((sum, count) => sum + count, below + above);
  let left = share * total - below;
  if (left <= 0) return range[0];
  for (let bin = 0; bin < counts.length; bin++) {
    const count = counts[bin]!;
    if (left <= count && count > 0) return range[0] + (bin + left / count) * width;
    left -= count;
  }
  return range[1];
}

// The range without the fraction `tail` of the samples at either end; null if it would be empty.
export function clipRange(histogram: Histogram, tail: number): Range | null {
  if (!hasValues(histogram)) return null;
  const low = neat(quantile(histogram, tail), histogram.range);
  const high = neat(quantile(histogram, 1 - tail), histogram.range);
  return low < high ? [low, high] : null;
}

// Rounds to the digits that a range of this width needs: a thousandth of the width.
export function neat(value: number, range: Range): number {
  const width = Math.abs(range[1] - range[0]);
  if (!(width > 0) || !Number.isFinite(value)) return value;
  const digits = Math.ceil(3 - Math.log10(width));
  return digits > 0 ? Number(value.toFixed(Math.min(digits, 100))) : Math.round(value);
}

export const positionOf = (value: number, range: Range): number =>
  range[1] === range[0] ? 0 : (value - range[0]) / (range[1] - range[0]);

export const valueAt = (place: number, range: Range): number =>
  neat(range[0] + clamp(place, 0, 1) * (range[1] - range[0]), range);

// A drag over the bars, in positions 0..1: near an end of the chosen range it moves that end,
// elsewhere it draws a new range; a click moves the nearer end. An inverted range (first end
// greater) remains inverted.
export class RangeDrag {
  private readonly fixed: number; // the end that does not move
  private readonly held: 0 | 1 | null; // the dragged end
  private moved = false;

  constructor(
    private readonly start: number,
    private readonly chosen: Range,
    near: number,
  ) {
    const [a, b] = chosen.map((end) => Math.abs(end - start)) as Range;
    const held = Math.min(a, b) > near ? null : a < b ? 0 : 1;
    this.held = held;
    this.fixed = held === null ? start : chosen[held === 0 ? 1 : 0];
  }

  to(place: number): Range | null {
    if (!this.moved && Math.abs(place - this.start) < 0.005) return null;
    this.moved = true;
    return this.ordered(place, this.fixed);
  }

  // Ends the drag; returns the range chosen by a click without movement.
  end(): Range | null {
    if (this.moved || this.held !== null) return null;
    const [a, b] = this.chosen;
    const first = Math.abs(a - this.start) < Math.abs(b - this.start);
    return this.ordered(this.start, first ? b : a);
  }

  private ordered(one: number, other: number): Range | null {
    if (one === other) return null;
    const [low, high] = [Math.min(one, other), Math.max(one, other)];
    return this.chosen[0] > this.chosen[1] ? [high, low] : [low, high];
  }
}
