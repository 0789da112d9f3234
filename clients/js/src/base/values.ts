// Type checks and clamping of values.

// Whether a JSON value is an object, not a list or null.
export const isObject = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null && !Array.isArray(value);

export const clamp = (value: number, low: number, high: number): number =>
  Math.min(Math.max(value, low), high);
