// Whether what a link, a file or the storage holds has the shape of a view: arrays, objects, texts
// and finite numbers where the page expects them. What they may be is the server's to judge, as are
// keys that are not known here.
import { viewKeys } from "../../generated/view_keys";
import { viewRanges } from "../../generated/view_ranges";
import type { View } from "./protocol";
import { isObject } from "../base/values";

// Numeric keys and their parents come from the ranges.
const samples = new Map<string, unknown>();
for (const pointer of Object.keys(viewRanges)) {
  const [key, ...around] = pointer.split("/").reverse();
  samples.set(key!, 0);
  for (const one of around) samples.set(one, {});
}
for (const [key, sample] of Object.entries(viewKeys)) samples.set(key, sample);

// `sample`: a value of the right shape. Lists of one stand for lists of any length, the keys of an
// object are those that it must have.
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
    // null: the default.
    Object.entries(value).every(
      ([key, one]) => one === null || !samples.has(key) || fits(one, samples.get(key)),
    )
  );
}

export const isView = (value: unknown): value is View => fits(value, {});
