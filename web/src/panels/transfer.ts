// Model of a medium's opacity curve editor: points moved, added and removed, their positions on a
// linear or logarithmic scale, and the curve as a path. Pure.
import type { Range } from "@windsplat/client";
import { neat } from "../view/histogram";
import { densityOf, type Curve } from "./media";
import { formatNumber } from "../base/ticks";
import { clamp } from "@windsplat/client/parts";

export const pointsMax = 64;
const valueMax = 1e38; // limits of the protocol
const extinctionMax = 1e30;
const decades = 4; // range of the logarithmic scale below its top

export interface Scale {
  top: number; // extinction at the upper edge, > 0
  log: boolean;
}

// Vertical position: 0 at the lower edge, 1 at the upper edge.
export function shareOf(extinction: number, { top, log }: Scale): number {
  if (!log) return extinction / top;
  return extinction > 0 ? Math.max(0, 1 + Math.log10(extinction / top) / decades) : 0;
}

// The lower edge means zero extinction, on a logarithmic scale too.
export function extinctionAt(share: number, { top, log }: Scale): number {
  if (!(share > 0)) return 0;
  const value = log ? top * 10 ** (decades * (share - 1)) : top * share;
  return Number(Math.min(value, extinctionMax).toPrecision(3));
}

// How far above the plot a drag may extend; the scale continues unchanged there.
export const dragShareMax = ({ log }: Scale): number => (log ? 1.25 : 4);

// The top of a scale with a margin above the curve; `last` if the curve is zero throughout.
export function roomyTop(curve: Curve, last: number): number {
  const most = densityOf(curve);
  return most > 0 ? Math.min(Number((1.25 * most).toPrecision(2)), extinctionMax) : last;
}

// The point stays between its neighbours; at the value of a neighbour it forms a step.
export function movePoint(curve: Curve, index: number, value: number, extinction: number): Curve {
  if (curve[index] === undefined || Number.isNaN(value + extinction)) return curve;
  const low = curve[index - 1]?.[0] ?? -valueMax;
  const high = curve[index + 1]?.[0] ?? valueMax;
  const moved: [number, number] = [clamp(value, low, high), clamp(extinction, 0, extinctionMax)];
  return curve.map((point, n) => (n === index ? moved : point));
}

// The curve with one more point, and the index of that point; null: the maximum is reached.
export function addPoint(
  curve: Curve,
  value: number,
  extinction: number,
): { curve: Curve; index: number } | null {
  if (curve.length >= pointsMax) return null;
  const after = curve.findIndex((point) => point[0] > value);
  const index = after < 0 ? curve.length : after;
  const next: Curve = [...curve.slice(0, index), [value, 0], ...curve.slice(index)];
  return { curve: movePoint(next, index, value, extinction), index };
}

// The last point cannot be removed: a curve has at least one.
export const removePoint = (curve: Curve, index: number): Curve =>
  curve.length < 2 ? curve : curve.filter((_, n) => n !== index);

// The middle of the widest gap between points, on the curve.
export function freePosition(curve: Curve): [number, number] {
  let widest = 1;
  const gap = (n: number): number => curve[n]![0] - curve[n - 1]![0];
  for (let n = 2; n < curve.length; n++) if (gap(n) > gap(widest)) widest = n;
  if (curve.length < 2) return [curve[0]?.[0] ?? 0, curve[0]?.[1] ?? 0];
  const [a, b] = [curve[widest - 1]!, curve[widest]!];
  return [neat((a[0] + b[0]) / 2, [a[0], b[0]]), (a[1] + b[1]) / 2];
}

// The curve over a domain of values, both axes 0..1, y downward. Linear segments are curved on a
// logarithmic scale.
export function curvePath(curve: Curve, domain: [number, number], scale: Scale): string {
  const x = (value: number): number => (value - domain[0]) / (domain[1] - domain[0]);
  const y = (extinction: number): string => clamp(1 - shareOf(extinction, scale), -1, 1).toFixed(4);
  const parts = [`M${Math.min(0, x(curve[0]![0])).toFixed(4)} ${y(curve[0]![1])}`];
  const pieces = scale.log ? 16 : 1;
  curve.forEach(([value, extinction], n) => {
    const [from, before] = curve[n - 1] ?? [value, extinction];
    for (let piece = 1; piece <= (value === from ? 1 : pieces); piece++) {
      const t = piece / (value === from ? 1 : pieces);
      const at = x(from + t * (value - from)).toFixed(4);
      parts.push(`L${at} ${y(before + t * (extinction - before))}`);
    }
  });
  parts.push(`H${Math.max(1, x(curve.at(-1)![0])).toFixed(4)}`);
  return parts.join("");
}

// Whether the curve is zero up to one value and a ramp from there: the shape that the control
// "transparent below" edits.
export const isRamp = (curve: Curve): boolean =>
  (curve.length === 2 || curve.length === 3) &&
  curve.every(([, extinction], n) => extinction > 0 === (n === curve.length - 1));

// The numbers in the table: a value to about a millionth of the domain, whatever its magnitude.
export const shownPoint = ([value, extinction]: Curve[0], [low, high]: Range): Curve[0] => [
  neat(value, [0, (high - low) / 1000]),
  Number(extinction.toPrecision(6)),
];

// What an extinction does over a hundredth of the longest edge of the box, which is 2 world units.
export function opacityText(extinction: number): string {
  const percent = -100 * Math.expm1(-0.02 * extinction);
  const text =
    percent > 99.9 && percent < 100 ? "99.9" : formatNumber(percent, percent < 1 ? 1 : 3);
  return `${text} % opaque in 1 % of the box`;
}

export const pointText = ([value, extinction]: [number, number], units: string): string =>
  `${formatNumber(value)}${units === "" ? "" : ` ${units}`} → ` + opacityText(extinction);
