// Model of the media panel: which media are on, and the opacity curve with its two parameters,
// density and threshold. Pure.
import type { ScalarView } from "@windsplat/client";
import { clamp } from "@windsplat/client/parts";

export type Curve = [number, number][]; // (value, extinction per world unit), values ascending

export const curveOf = (layer: ScalarView): Curve => (layer.extinction ?? []) as Curve;

// The greatest extinction of the curve.
export const densityOf = (curve: Curve): number => Math.max(0, ...curve.map(([, e]) => e));

// The value up to which the medium is transparent; null if the curve does not start transparent.
export function thresholdOf(curve: Curve): number | null {
  let clear: number | null = null;
  for (const [value, extinction] of curve) {
    if (extinction > 0) break;
    clear = value;
  }
  return clear;
}

// A ramp from `threshold` to the top of the range.
export function rampCurve(range: [number, number], threshold: number, density: number): Curve {
  const [low, high] = [Math.min(...range), Math.max(...range)];
  const knee = clamp(threshold, low, low + 0.999 * (high - low));
  const ramp: Curve = [
    [knee, 0],
    [high, density],
  ];
  return knee > low ? [[low, 0], ...ramp] : ramp;
}

export function withDensity(curve: Curve, range: [number, number], density: number): Curve {
  const most = densityOf(curve);
  if (most <= 0) return rampCurve(range, thresholdOf(curve) ?? range[0], density);
  return curve.map(([value, extinction]) => [value, (extinction / most) * density]);
}

export interface Layer {
  view: ScalarView;
  on: boolean;
}

// Updates the panel's layers after a change of the view's media: layers that are on follow the
// view; layers that are off keep their position and settings.
export function followMedia(layers: Layer[], media: ScalarView[]): Layer[] {
  const next: Layer[] = [];
  let taken = 0;
  for (const layer of layers) {
    if (!layer.on) next.push(layer);
    else if (taken < media.length) next.push({ view: media[taken++]!, on: true });
  }
  while (taken < media.length) next.push({ view: media[taken++]!, on: true });
  // A disabled layer is dropped if its medium is in the view again, for example by a link.
  const shown = new Set(media.map((medium) => medium.field));
  return next.filter((layer) => layer.on || !shown.has(layer.view.field));
}

export const mediaOf = (layers: Layer[]): ScalarView[] =>
  layers.filter((layer) => layer.on).map((layer) => layer.view);
