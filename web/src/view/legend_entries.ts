// Legend of a drawn view: title, unit, range and ticks of each colour strip.
// Pure: (complete view, dataset) -> entries.
import type { Dataset, Field, ScalarView, SurfaceView, View } from "@windsplat/client";
import {
  compassTicks,
  formatNumber,
  linearTicks,
  unevenTicks,
  type LegendTick,
} from "../base/ticks";
import { clamp } from "@windsplat/client/parts";
import { sectionOfView, sectionText } from "./section_text";
import { unitText } from "./unit_text";

type Axis = Dataset["axes"]["z"];

export interface LegendEntry {
  kind: "lines" | "medium" | "surface";
  title: string;
  units: string;
  range: [number, number] | null; // null: a single colour
  map: string | null;
  color: string | null; // the colour if there is no map
  ticks: LegendTick[];
  extinction: [number, number][]; // (position 0..1, fraction of the maximum), medium only
  note: string;
  beyond: [boolean, boolean]; // whether values lie beyond the left and the right end
  leftOut: string; // text about values that are not drawn; empty: none
}

const fieldNamed = (dataset: Dataset, name: string): Field | undefined =>
  dataset.fields.find((field) => field.name === name);

const titleMax = 40; // characters, as in the server's legend

export function fieldTitle(field: Field | undefined, name: string): string {
  const longName = field?.longName ?? "";
  return longName === "" || longName.length > titleMax ? name.replaceAll("_", " ") : longName;
}

// World heights of the samples under a view's geometry; null unless the geometry only stretches the
// box.
export function sampleHeights(dataset: Dataset, view: View): number[] | null {
  const { vertical = "auto", mapping = "flat", heightField = null } = view.geometry ?? {};
  if (vertical !== "auto" || mapping !== "flat" || heightField !== null) return null;
  const scale = view.geometry?.scale ?? [1, 1, 1];
  const edges = dataset.world.max.map((most, axis) => most - dataset.world.min[axis]!);
  const longest = Math.max(...edges.map((edge, axis) => edge * scale[axis]!));
  const factor = (scale[2] * Math.max(...edges)) / longest;
  return dataset.axes.z.world.map((z) => z * factor);
}

// Interpolates `to` at x between neighbours of `from`, which ascends or descends; linear beyond.
function between(from: number[], to: number[], x: number): number {
  const sign = Math.sign(from.at(-1)! - from[0]!);
  const after = from.findIndex((at, n) => n > 0 && sign * at > sign * x);
  const n = after < 0 ? from.length - 1 : after;
  return to[n - 1]! + ((to[n]! - to[n - 1]!) * (x - from[n - 1]!)) / (from[n]! - from[n - 1]!);
}

// Ticks of a strip over world heights at round coordinates of the vertical axis, only of the data:
// beyond them the colours have no value. heights: of the samples.
function heightTicks(range: [number, number], heights: number[], axis: Axis): LegendTick[] {
  if (heights.length < 2) return [];
  const byLog = axis.kind === "pressure" && axis.coordinates.every((value) => value > 0);
  const values = byLog ? axis.coordinates.map(Math.log) : axis.coordinates;
  const valueAt = (height: number): number => {
    const value = between(heights, values, clamp(height, heights[0]!, heights.at(-1)!));
    return byLog ? Math.exp(value) : value;
  };
  const place = (value: number): number =>
    (between(values, heights, byLog ? Math.log(value) : value) - range[0]) / (range[1] - range[0]);
  const gap = 0.17;
  return unevenTicks([valueAt(range[0]), valueAt(range[1])], gap, place);
}

function heightEntry(dataset: Dataset, view: View, range: [number, number]) {
  const axis = dataset.axes.z;
  const heights = sampleHeights(dataset, view);
  const ticks = heights === null ? [] : heightTicks(range, heights, axis);
  if (ticks.length < 2) {
    return { what: "height", units: "", ticks: [], note: endsText(range, "low", "high") };
  }
  const isNamed = axis.kind === "pressure" || axis.kind === "height" || axis.kind === "depth";
  const what = isNamed ? axis.kind : axis.name.replaceAll("_", " ");
  return { what, units: unitText(axis.units), ticks, note: "" };
}

// What the ends of a strip mean whose values are world units, which say nothing of the data.
const endsText = ([left, right]: readonly [number, number], low: string, high: string): string =>
  `from ${left <= right ? low : high} to ${left <= right ? high : low}`;

const joined = (...notes: string[]): string => notes.filter((note) => note !== "").join(", ");

// Whether values lie beyond the left and the right end of a strip. values: null: not known.
export function beyondEnds(
  [left, right]: readonly [number, number],
  values: readonly [number, number] | null | undefined,
): [boolean, boolean] {
  if (!values) return [false, false];
  const slack = 1e-6 * Math.abs(right - left);
  const less = values[0] < Math.min(left, right) - slack;
  const more = values[1] > Math.max(left, right) + slack;
  return left <= right ? [less, more] : [more, less];
}

const speeds = /^([ckm]?m|mi|ft) ?(s⁻¹|h⁻¹|\/ ?s|\/ ?h)$|^knots?$|^kt$/i;

// Whether a unit of a file is one of speed.
export const isSpeed = (units: string): boolean => speeds.test(unitText(units));

// Text about vectors that are too short to be drawn.
function leftOutText(least: number, units: string): string {
  if (!(least > 0)) return "";
  const what = speeds.test(units) ? "slower" : "weaker";
  return `${what} than ${formatNumber(least)}${units === "" ? "" : ` ${units}`} not drawn`;
}

// Rises from tail to head; heights from the bottom to the top of the box count as the same range.
function riseEntry(entry: LegendEntry, name: string, weight: number): LegendEntry {
  const percent = Math.round(100 * weight);
  const note = `${percent} % rise of a line, ${100 - percent} % height in the box`;
  const range = entry.range ?? [0, 1];
  const [low, high] = weight === 1 ? ["sinking", "rising"] : ["low and sinking", "high and rising"];
  return {
    ...entry,
    title: weight === 1 ? `${name}: rise` : `${name}: height and rise`,
    ticks: [],
    note: joined(endsText(range, low!, high!), weight === 1 ? "" : note, entry.note),
  };
}

// Which end of a line is its head.
function endAhead(vector: NonNullable<View["vector"]>): string {
  const mark = vector.mark ?? {};
  if (mark.shape === "comet") return "bright end ahead";
  if (mark.shape === "taper") return "pointed end ahead";
  if (mark.shape === "arrow") return "";
  const whitened = (vector.headDesaturation ?? 0) > 0 && vector.color?.trueColors !== true;
  if (whitened) return "white end ahead";
  return (mark.tailDarkening ?? 0) > 0 ? "bright end ahead" : "";
}

// How lines differ from the colours of the strip besides their heads; empty: they do not.
function fadingText({ vector, depthCue }: View): string {
  const by = [
    (vector?.magnitudeIntensity ?? 0) > 0 ? "weaker" : "",
    (depthCue?.strength ?? 0) > 0 ? "farther" : "",
  ].filter((word) => word !== "");
  return by.length === 0 ? "" : `${by.join(" and ")} lines are darker`;
}

function linesEntry(dataset: Dataset, view: View): LegendEntry | null {
  const vector = view.vector;
  if (!vector?.field) return null;
  const field = fieldNamed(dataset, vector.field);
  const name = vector.field.replaceAll("_", " "); // the quantity of the colour is appended
  const color = vector.color ?? {};
  const range = (color.range ?? [0, 1]) as [number, number];
  const units = unitText(field?.units);
  const top = vector.magnitudeRange?.[1];
  // Lines through seeds have other lengths, and no weak part of them is left out.
  const seeded = (vector.trace?.seeds ?? null) !== null;
  const longest =
    seeded || top === undefined ? "" : `longest line ${formatNumber(top)} ${units}`.trim();
  const least = seeded ? 0 : (vector.minMagnitude ?? 0);
  const mapped = color.trueColors !== true;
  const heads = endAhead(vector);
  const darker = mapped && color.by !== "constant" ? fadingText(view) : "";
  const entry: LegendEntry = {
    kind: "lines",
    title: name,
    units: "",
    range,
    map: color.map ?? "viridis",
    color: null,
    ticks: linearTicks(range),
    extinction: [],
    note: joined(longest, heads, darker),
    beyond: [false, false],
    leftOut: leftOutText(least, units),
  };
  switch (color.by) {
    case "worldZ": {
      const height = heightEntry(dataset, view, range);
      return {
        ...entry,
        title: `${name}: ${height.what}`,
        units: height.units,
        ticks: height.ticks,
        note: joined(height.note, entry.note),
      };
    }
    case "screenZ":
      return {
        ...entry,
        title: `${name}: distance from the eye`,
        ticks: [],
        note: joined(endsText(range, "near", "far"), entry.note),
      };
    case "rise":
      return riseEntry(entry, name, color.riseWeight ?? 0.5);
    case "direction":
      return {
        ...entry,
        title: `${name}: direction`,
        units: "towards",
        ticks: compassTicks(range),
      };
    case "scalar": {
      const scalar = fieldNamed(dataset, color.field ?? "");
      return {
        ...entry,
        title: `${name}: ${fieldTitle(scalar, color.field ?? "")}`,
        units: unitText(scalar?.units),
        beyond: beyondEnds(range, scalar?.range),
      };
    }
    case "constant":
      return { ...entry, range: null, map: null, color: color.constant ?? "#ffffff", ticks: [] };
    default:
      return {
        ...entry,
        title: `${name}: magnitude`,
        units,
        beyond: beyondEnds(range, drawnMagnitudes(field, least)),
      };
  }
}

function drawnMagnitudes(field: Field | undefined, least: number): [number, number] | null {
  return field?.range ? [Math.max(field.range[0]!, least), field.range[1]!] : null;
}

// Without the values that are transparent at an end of the opacity curve.
function drawnValues(field: Field | undefined, curve: [number, number][]): [number, number] | null {
  if (!field?.range) return null;
  const [first, last] = [curve[0], curve.at(-1)];
  const clear = (point: [number, number] | undefined) => point !== undefined && point[1] <= 0;
  return [
    clear(first) ? Math.max(field.range[0]!, first![0]) : field.range[0]!,
    clear(last) ? Math.min(field.range[1]!, last![0]) : field.range[1]!,
  ];
}

function mediumEntry(dataset: Dataset, layer: ScalarView): LegendEntry {
  const field = fieldNamed(dataset, layer.field);
  const range = (layer.color?.range ?? field?.range ?? [0, 1]) as [number, number];
  const points = (layer.extinction ?? []) as [number, number][];
  const most = Math.max(0, ...points.map(([, extinction]) => extinction));
  const width = range[1] - range[0];
  return {
    kind: "medium",
    title: fieldTitle(field, layer.field),
    units: unitText(field?.units),
    range,
    map: layer.color?.map ?? "grays",
    color: null,
    ticks: linearTicks(range),
    extinction: points.map(([value, extinction]) => [
      (value - range[0]) / width,
      most > 0 ? extinction / most : 0,
    ]),
    note: most > 0 ? "curve: opacity, from none to the greatest" : "transparent",
    beyond: beyondEnds(range, drawnValues(field, points)),
    leftOut: "",
  };
}

// The field whose values colour a surface; null: one colour.
export const surfaceColors = ({ field, isovalue, color }: SurfaceView): string | null =>
  color?.field ?? ((isovalue ?? null) === null ? field : null);

// Whether anything of a surface is drawn.
const isSeen = ({ opacity = 1, contours = null }: SurfaceView): boolean =>
  opacity > 0 || contours !== null;

// "contours every 5 K and at 273.15 K".
function contoursText(
  { interval = null, levels = [] }: NonNullable<SurfaceView["contours"]>,
  units: string,
): string {
  const named = (text: string): string => `${text} ${units}`.trim();
  const every = interval === null ? "" : named(`every ${formatNumber(interval)}`);
  const numbers = levels.map((level) => formatNumber(level, 6));
  const few = numbers.length <= 4;
  const list = few
    ? numbers.join(", ")
    : `${numbers.length} levels from ${numbers[0]} to ${numbers.at(-1)}`;
  const at = numbers.length === 0 ? "" : named(`at ${list}`);
  return `contours ${[every, at].filter((part) => part !== "").join(" and ")}`;
}

// In the words of the server's legend.
function surfaceEntry(dataset: Dataset, view: View, surface: SurfaceView): LegendEntry {
  const cut = fieldNamed(dataset, surface.field);
  const cutTitle = fieldTitle(cut, surface.field);
  const name = surfaceColors(surface);
  const field = name === null ? undefined : fieldNamed(dataset, name);
  const units = unitText(field?.units);
  const range = (surface.color?.range ?? field?.range ?? [0, 1]) as [number, number];
  const { isovalue = null, contours = null } = surface;
  const where = name === null ? "it" : cutTitle;
  // On an isosurface its own field has one value.
  const values =
    isovalue !== null && name === surface.field ? ([isovalue, isovalue] as const) : field?.range;
  return {
    kind: "surface",
    title: name === null ? cutTitle : fieldTitle(field, name),
    units,
    range: name === null ? null : range,
    map: name === null ? null : (surface.color?.map ?? "viridis"),
    color: name === null ? (surface.color?.constant ?? "#d8d8d8") : null,
    ticks: name === null ? [] : linearTicks(range),
    extinction: [],
    note: joined(
      isovalue === null
        ? sectionText(dataset, view, surface)
        : `surface where ${where} is ${formatNumber(isovalue)} ${unitText(cut?.units)}`.trim(),
      contours === null ? "" : contoursText(contours, units),
    ),
    beyond: name === null ? [false, false] : beyondEnds(range, values),
    leftOut: "",
  };
}

// The extinction curve of a medium on its strip, as fractions of the strip's width and of its
// height from the top.
export function curvePoints(points: [number, number][]): [x: number, y: number][] {
  const inside = points.map(([at, share]) => [clamp(at, -1, 2), share] as const);
  const first = inside[0]!;
  const last = inside[inside.length - 1]!;
  return [
    [Math.min(0, first[0]), first[1]] as const,
    ...inside,
    [Math.max(1, last[0]), last[1]] as const,
  ].map(([x, share]) => [x, 0.94 - 0.88 * share]);
}

// The ranges of the dataset are those of its fields, not of their differences.
function differenceEntries(dataset: Dataset, view: View): LegendEntry[] {
  const fields = dataset.fields.map(({ range: _range, ...field }) => field as Field);
  const entries = legendEntries({ ...dataset, fields }, { ...view, difference: null });
  return entries.map((entry) => ({ ...entry, title: `difference of ${entry.title}` }));
}

// Empty if the server draws the legend into the picture.
export function legendEntries(dataset: Dataset, view: View): LegendEntry[] {
  if (view.annotations?.legend === true) return [];
  if (view.difference) return differenceEntries(dataset, view);
  const lines = linesEntry(dataset, view);
  const media = (view.scalars ?? []).map((layer) => mediumEntry(dataset, layer));
  const surfaces = (view.surfaces ?? [])
    .filter(isSeen)
    .map((surface) => surfaceEntry(dataset, view, surface));
  const section = sectionOfView(dataset, view);
  const cut = [...(lines === null ? [] : [lines]), ...media].map((entry) => ({
    ...entry,
    note: joined(section, entry.note),
  }));
  return [...cut, ...surfaces];
}
