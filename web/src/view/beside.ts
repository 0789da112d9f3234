// What a second picture beside the first one shows: the view of the first with another dataset or
// step, and with settings or a camera of its own; and how the page's address keeps that.
import type { View } from "@windsplat/client";
import { isView, isObject, departure, mergeView, type Patch } from "@windsplat/client/parts";

export interface Beside {
  dataset?: string; // undefined: that of the first picture
  step?: number; // undefined: that of the first picture
  settings?: Patch; // how its own depart from those of the first; undefined: they follow the first
  camera?: NonNullable<View["camera"]>; // its own; undefined: that of the first picture
}

const mark = "&beside="; // the part of the address before it has no unescaped "&"

// The part of an address that keeps the second picture; empty: there is none.
export const besideSuffix = (beside: Beside | null): string =>
  beside === null ? "" : mark + encodeURIComponent(JSON.stringify(beside));

// A second picture from an address or the storage, without what is none. null: there is none.
export function besideOf(kept: unknown): Beside | null {
  if (!isObject(kept)) return null;
  const { dataset, step, settings, camera } = kept;
  const beside: Beside = {};
  if (typeof dataset === "string" && dataset !== "") beside.dataset = dataset;
  if (Number.isInteger(step) && (step as number) >= 0) beside.step = step as number;
  if (isObject(settings) && isView(settings)) beside.settings = settings as Patch;
  const view = { camera };
  if (isObject(camera) && isView(view)) beside.camera = view.camera!;
  return beside;
}

// The part of the address after `#` without the second picture, and that picture.
export function takeBeside(hash: string): [rest: string, beside: Beside | null] {
  const at = hash.indexOf(mark);
  if (at < 0) return [hash, null];
  const rest = hash.slice(0, at);
  try {
    return [rest, besideOf(JSON.parse(decodeURIComponent(hash.slice(at + mark.length))))];
  } catch {
    return [rest, null];
  }
}

// The settings of a view: without its place, camera, size and what concerns the connection.
function settingsOf(view: View): View {
  const { dataset: _, step: _step, camera: _camera, quality: _quality, image, ...settings } = view;
  const background = image?.background;
  return background === undefined ? settings : { ...settings, image: { background } };
}

// How the settings of the second picture depart from those of the first, and back. Both views with
// all known values.
export const ownSettings = (first: View, own: View): Patch =>
  departure(settingsOf(first), settingsOf(own));

export const withOwnSettings = (first: View, settings: Patch): View =>
  mergeView(settingsOf(first), settings);

interface Pictures {
  explicit: View; // of the first picture, without defaults
  first: View; // of the first picture, with all known values
  beside: Beside;
  own: View | null; // settings of the second picture, with all known values; null: of the first
}

// Both pictures after they have changed places: the view of the first one, the second one, and its
// own settings.
export function swapped({
  explicit,
  first,
  beside,
  own,
}: Pictures): [view: View, beside: Beside, own: View | null] {
  const { dataset, step, camera } = beside;
  const now = explicit.step ?? 0;
  const view: View = {
    ...settingsOf(own ?? explicit),
    ...(explicit.quality === undefined ? {} : { quality: explicit.quality }),
    dataset: dataset ?? explicit.dataset,
    step: step ?? now,
  };
  const shown = camera ?? explicit.camera;
  if (shown !== undefined) view.camera = shown;
  const next: Beside = {
    ...(dataset === undefined ? {} : { dataset: explicit.dataset }),
    ...(step === undefined ? {} : { step: now }),
    ...(camera === undefined ? {} : { camera: first.camera ?? {} }),
  };
  return [view, next, own === null ? null : settingsOf(first)];
}

// The view of the second picture. first: that of the first one, with all known values, so that both
// have the same ranges and lengths. own: the settings of the second if they do not follow those of
// the first.
export function besideView(
  first: View,
  beside: Beside,
  [width, height]: [number, number],
  own: View | null = null,
): View {
  const settings = settingsOf(own ?? first);
  return {
    ...settings,
    camera: beside.camera ?? first.camera,
    dataset: beside.dataset ?? first.dataset,
    step: beside.step ?? first.step ?? 0,
    image: { ...settings.image, width, height },
  };
}
