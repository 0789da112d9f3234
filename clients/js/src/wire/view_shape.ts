// Checks whether a value from a link, a file or the storage has the shape of a view: arrays,
// objects, strings and finite numbers where the page expects them. Permitted values and unknown
// keys are checked by the server.
import { viewKeys } from "../generated/view_keys";
import { viewRanges } from "../generated/view_ranges";
import type { View } from "./protocol";
import { isObject } from "../base/values";

// Numeric keys and their parents are taken from the ranges.
const samples = new Map<string, unknown>();
for (const pointer of Object.keys(viewRanges)) {
  const [key, ...around] = pointer.split("/").reverse();
  samples.set(key!, 0);
  for (const one of around) samples.set(one, {});
}
for (const [key, sample] of Object.entries(viewKeys)) samples.set(key, sample);

// `sample` is a value of the right shape. A list of one element represents lists of any length; the
// keys of an object are the required ones.
function fits(value: unknown, sample: unknown): boolean {
  if (Array.isArray(sample)) {
    return (
      Array.isArray(value) &&
      (sample.length === 1 || value.length === sample.length) &&
      value.every((one) => fits(one, sample[0]))
    );
  }
  if (!isObject(sample)) {
    return typeof value === typeof sample && (typeof value !== "number" || isFinite(value));
  }
  return (
    isObject(value) &&
    Object.keys(sample).every((key) => (value[key] ?? null) !== null) &&
    // null stands for the default.
    Object.entries(value).every(
      ([key, one]) => one === null || !samples.has(key) || fits(one, samples.get(key)),
    )
  );
}

export const isView = (value: unknown): value is View => fits(value, {});
