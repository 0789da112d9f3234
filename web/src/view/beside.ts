// What a second picture beside the first one shows: the view of the first with another dataset or
// step, and how the page's address keeps that.
import type { View } from "../wire/protocol";
import { isObject } from "../base/values";

export interface Beside {
  dataset?: string; // undefined: that of the first picture
  step?: number; // undefined: that of the first picture
}

const mark = "&beside="; // the part of the address before it has no unescaped "&"

// The part of an address that keeps the second picture; empty: there is none.
export const besideSuffix = (beside: Beside | null): string =>
  beside === null ? "" : mark + encodeURIComponent(JSON.stringify(beside));

// The part of the address after `#` without the second picture, and that picture.
export function takeBeside(hash: string): [rest: string, beside: Beside | null] {
  const at = hash.indexOf(mark);
  if (at < 0) return [hash, null];
  const rest = hash.slice(0, at);
  try {
    const kept: unknown = JSON.parse(decodeURIComponent(hash.slice(at + mark.length)));
    if (!isObject(kept)) return [rest, null];
    const { dataset, step } = kept;
    const beside: Beside = {};
    if (typeof dataset === "string" && dataset !== "") beside.dataset = dataset;
    if (Number.isInteger(step) && (step as number) >= 0) beside.step = step as number;
    return [rest, beside];
  } catch {
    return [rest, null];
  }
}

// The first picture's view and the second picture after both have changed places. view: without
// defaults.
export function swapped(view: View, { dataset, step }: Beside): [view: View, beside: Beside] {
  const { image, ...settings } = view;
  const background = image?.background;
  const now = view.step ?? 0;
  return [
    {
      ...settings,
      ...(background === undefined ? {} : { image: { background } }),
      dataset: dataset ?? view.dataset,
      step: step ?? now,
    },
    {
      ...(dataset === undefined ? {} : { dataset: view.dataset }),
      ...(step === undefined ? {} : { step: now }),
    },
  ];
}

// The view of the second picture. first: that of the first one, with all known values, so that both
// have the same camera, ranges and lengths. own: what the second keeps apart from its camera, if
// its settings do not follow the first.
export function besideView(
  first: View,
  beside: Beside,
  [width, height]: [number, number],
  own: View | null = null,
): View {
  const { quality: _quality, ...settings } = own ?? first;
  return {
    ...settings,
    camera: first.camera,
    dataset: beside.dataset ?? first.dataset,
    step: beside.step ?? first.step ?? 0,
    image: { ...settings.image, width, height },
  };
}
