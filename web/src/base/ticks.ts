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

// Rank of a number's roundness: 1, 10, 100 before 5, then 2, then all others.
function roughness(value: number): number {
  if (value === 0) return 0;
  const mantissa = Number(
    (Math.abs(value) / 10 ** Math.floor(Math.log10(Math.abs(value)))).toFixed(6),
  );
  const order = [1, 5, 2].indexOf(mantissa);
  return order < 0 ? 3 : order;
}

// Ticks of a strip over world heights, labelled with the coordinates of the vertical axis: samples
// within the range, the roundest first, no two closer than `gap`.
export function axisTicks(
  range: readonly [number, number],
  places: number[],
  coordinates: number[],
  gap = 0.16,
): LegendTick[] {
  const [low, high] = range;
  const samples = coordinates
    .map((value, n) => ({ value, at: (places[n]! - low) / (high - low) }))
    .filter(({ at }) => at >= -1e-6 && at <= 1 + 1e-6)
    .sort((a, b) => roughness(a.value) - roughness(b.value));
  const chosen: { value: number; at: number }[] = [];
  for (const sample of samples) {
    if (chosen.some(({ at }) => Math.abs(at - sample.at) < gap)) continue;
    chosen.push(sample);
  }
  chosen.sort((a, b) => a.at - b.at);
  const texts = distinctNumbers(chosen.map(({ value }) => value));
  return chosen.map(({ at }, n) => ({ at, text: texts[n]! }));
}
