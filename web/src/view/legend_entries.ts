// Legend of a drawn view: title, unit, range and ticks of each colour strip.
// Pure: (complete view, dataset) -> entries.
import type { Dataset, Field, ScalarView, View } from "../wire/protocol";
import { axisTicks, compassTicks, formatNumber, linearTicks, type LegendTick } from "../base/ticks";
import { clamp } from "../base/values";

export interface LegendEntry {
  kind: "lines" | "medium";
  title: string;
  units: string;
  range: [number, number] | null; // null: a single colour
  map: string | null;
  color: string | null; // the colour if there is no map
  ticks: LegendTick[];
  extinction: [number, number][]; // (position 0..1, fraction of the maximum), medium only
  note: string;
  leftOut: string; // text about values that are not drawn; empty: none
}

const fieldNamed = (dataset: Dataset, name: string): Field | undefined =>
  dataset.fields.find((field) => field.name === name);

const titleMax = 30; // characters; longer titles do not fit over a strip

export function fieldTitle(field: Field | undefined, name: string): string {
  const text = field?.longName ? field.longName : name.replaceAll("_", " ");
  return text.length > titleMax ? name : text;
}

const raised: Record<string, string> = { "-": "⁻" };
[..."⁰¹²³⁴⁵⁶⁷⁸⁹"].forEach((sign, digit) => (raised[String(digit)] = sign));

// "m s-1", "m s**-1", "m s^-1" -> "m s⁻¹". In CF, "1" means dimensionless, as "(0 - 1)" of ECMWF.
export function unitText(units: string | undefined): string {
  if (units === undefined || units === "1" || units === "(0 - 1)") return "";
  return units.replace(/(?<=[A-Za-z])(?:\*\*|\^)?(-?\d+)(?=$|[ ./*])/g, (_, power: string) =>
    [...power].map((sign) => raised[sign]).join(""),
  );
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

const verticalTitles: Record<string, string> = {
  pressure: "pressure level",
  height: "height",
  depth: "depth",
  level: "level",
};

function heightEntry(dataset: Dataset, view: View, range: [number, number]) {
  const axis = dataset.axes.z;
  const heights = axis.kind === "cartesian" ? null : sampleHeights(dataset, view);
  const ticks = heights === null ? [] : axisTicks(range, heights, axis.coordinates);
  if (ticks.length < 2) {
    return { what: "height", units: "world units", ticks: linearTicks(range) };
  }
  return { what: verticalTitles[axis.kind] ?? axis.name, units: unitText(axis.units), ticks };
}

const speeds = /^([ckm]?m|mi|ft) ?(s⁻¹|h⁻¹|\/ ?s|\/ ?h)$|^knots?$|^kt$/i;

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
  return {
    ...entry,
    title: weight === 1 ? `${name}: rise` : `${name}: height and rise`,
    units: "world units",
    note: weight === 1 ? entry.note : [note, entry.note].filter((part) => part !== "").join(", "),
  };
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
  const longest = top === undefined ? "" : `longest line ${formatNumber(top)} ${units}`.trim();
  const heads = (vector.headDesaturation ?? 0) > 0 ? "white end ahead" : "";
  const entry: LegendEntry = {
    kind: "lines",
    title: name,
    units: "",
    range,
    map: color.map ?? "viridis",
    color: null,
    ticks: linearTicks(range),
    extinction: [],
    note: [longest, heads].filter((part) => part !== "").join(", "),
    leftOut: leftOutText(vector.minMagnitude ?? 0, units),
  };
  switch (color.by) {
    case "worldZ": {
      const height = heightEntry(dataset, view, range);
      return {
        ...entry,
        title: `${name}: ${height.what}`,
        units: height.units,
        ticks: height.ticks,
      };
    }
    case "screenZ":
      return { ...entry, title: `${name}: distance from the eye`, units: "world units" };
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
      };
    }
    case "constant":
      return { ...entry, range: null, map: null, color: color.constant ?? "#ffffff", ticks: [] };
    default:
      return { ...entry, title: `${name}: magnitude`, units };
  }
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
    note: most > 0 ? `opacity up to ${formatNumber(most, 3)} per world unit` : "clear",
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

// Empty if the server draws the legend into the picture.
export function legendEntries(dataset: Dataset, view: View): LegendEntry[] {
  if (view.annotations?.legend === true) return [];
  const lines = linesEntry(dataset, view);
  const media = (view.scalars ?? []).map((layer) => mediumEntry(dataset, layer));
  return lines === null ? media : [lines, ...media];
}
