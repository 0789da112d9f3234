// Numbers for display: round ticks of a range, and values as text.

// About `count` round values within [low, high], spaced by 1, 2 or 5 times a power of ten.
export function niceTicks(low: number, high: number, count: number): number[] {
  if (!Number.isFinite(low) || !Number.isFinite(high) || low === high) return [];
  const least = Math.min(low, high);
  const most = Math.max(low, high);
  const rough = (most - least) / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((s) => s >= rough * 0.999)!;
  const ticks: number[] = [];
  // Multiples of the step instead of repeated additions, which would give 0.30000000000000004.
  const slack = 1e-9;
  for (let n = Math.ceil(least / step - slack); n <= most / step + slack; n++) {
    ticks.push(Number((n * step).toPrecision(12)));
  }
  return ticks;
}

export function formatNumber(value: number, digits = 4): string {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
    return value
      .toExponential(digits - 2)
      .replace(/\.?0+e/, "e")
      .replace("e+", "e");
  }
  return String(Number(value.toPrecision(digits)));
}

// A value with as many decimals as a step between neighbouring values has.
export function stepNumber(value: number, step: number): string {
  if (value === 0 || !(step > 0)) return formatNumber(value);
  const first = Math.floor(Math.log10(Math.abs(value)) + 1e-9);
  const last = Math.floor(Math.log10(step) + 1e-9);
  const digits = Math.max(first - last + 1, 1);
  if (first >= 6 || last < -5) return formatNumber(value, Math.max(digits, 2) + 1);
  return String(Number(value.toFixed(Math.max(-last, 0))));
}

// Texts of distinct values: in four digits, or as many as tell them apart.
export function distinctNumbers(values: number[]): string[] {
  const texts = (digits: number) => values.map((value) => formatNumber(value, digits));
  const count = new Set(values).size;
  for (let digits = 4; digits < 15; digits++) {
    if (new Set(texts(digits)).size === count) return texts(digits);
  }
  return values.map(String);
}

export function formatBytes(bytes: number): string {
  if (bytes < 1000) return `${bytes} B`;
  if (bytes < 1e6) return `${(bytes / 1e3).toFixed(bytes < 1e4 ? 1 : 0)} kB`;
  return bytes < 1e9 ? `${(bytes / 1e6).toFixed(1)} MB` : `${(bytes / 1e9).toFixed(2)} GB`;
}

export interface LegendTick {
  at: number; // position along the strip, 0..1
  text: string;
}

// Ticks of a strip from range[0] (left) to range[1] (right).
export function linearTicks(range: readonly [number, number], count = 5): LegendTick[] {
  const [low, high] = range;
  const values = niceTicks(low, high, count);
  const step = Math.abs((values[1] ?? 0) - (values[0] ?? 0));
  return values.map((value) => ({
    at: (value - low) / (high - low),
    text: values.length > 1 ? stepNumber(value, step) : formatNumber(value),
  }));
}

const quarters = ["N", "E", "S", "W"] as const;

// Ticks of a strip over compass bearings, in degrees clockwise from north. If the range contains
// fewer than two cardinal directions, the ticks are in degrees.
export function compassTicks(range: readonly [number, number]): LegendTick[] {
  const [low, high] = range;
  const first = Math.ceil(Math.min(low, high) / 90 - 1e-9);
  const last = Math.floor(Math.max(low, high) / 90 + 1e-9);
  if (last - first < 1 || last - first > 8) {
    return linearTicks(range).map(({ at, text }) => ({ at, text: `${text}°` }));
  }
  return Array.from({ length: last - first + 1 }, (_, n) => ({
    at: (90 * (first + n) - low) / (high - low),
    text: quarters[(((first + n) % 4) + 4) % 4]!,
  }));
}

// The step of 1, 2 or 5 times a power of ten that divides a positive range into at most `most`
// parts.
function roundStep(range: number, most: number): number {
  const rough = range / most;
  const power = 10 ** Math.floor(Math.log10(rough) + 1e-9);
  return [1, 2, 5, 10].map((digit) => digit * power).find((s) => s >= rough * (1 - 1e-9))!;
}

// Round values within a range, in either order, at the positions that `place` gives them, the
// roundest first, none nearer than `gap` to another: for axes that are not even, as the server's
// legend has them. In order of value.
export function unevenTicks(
  [one, other]: readonly [number, number],
  gap: number,
  place: (value: number) => number,
): LegendTick[] {
  const [least, most] = [Math.min(one, other), Math.max(one, other)];
  // Over a wide ratio, a value of few digits is rounder: 300 before 320.
  const multipleMost = least > 0 && most > 3 * least ? 10 : Infinity;
  const found: (LegendTick & { value: number })[] = [];
  const finest = 100; // parts
  for (let parts = 1; parts <= finest && most > least; parts *= 2) {
    const step = roundStep(most - least, parts);
    const first = Math.ceil(least / step - 1e-9);
    for (let n = first; n <= first + parts && n <= multipleMost; n++) {
      const value = Number((n * step).toPrecision(12));
      if (value > most + 1e-9 * step) break;
      const at = place(value);
      if (!Number.isFinite(at) || found.some((tick) => Math.abs(tick.at - at) < gap)) continue;
      found.push({ value, at, text: stepNumber(value, step) });
    }
  }
  return found.sort((a, b) => a.value - b.value).map(({ at, text }) => ({ at, text }));
}
