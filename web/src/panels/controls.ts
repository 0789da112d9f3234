// Rules of the panel's controls: which of them apply to a view, the options that a dataset offers,
// and patches that keep dependent values consistent. Pure: (dataset, view) -> options, text,
// patches.
import { unitText } from "../view/unit_text";
import type { Dataset, Field, View } from "@windsplat/client";
import { formatNumber } from "../base/ticks";
import type { Patch } from "@windsplat/client/parts";

export type Options = Record<string, string>; // label -> value in the view document
export type SliceAxis = "x" | "y" | "z";

// One-line explanations of the compositing methods.
export const compositingHints: Readonly<Record<string, string>> = {
  analytic: "Line and medium are mixed exactly along their common piece.",
  cd: "Colour times density added, corrected: no seams around lines.",
  simple: "A line is composited behind its whole piece of medium.",
  "cd-naive": "Colour times density added uncorrected: seams around lines.",
  "cd-euler": "Rates of cd in one explicit step: unstable where the medium is dense.",
};

export const compositingOptions: Options = {
  analytic: "analytic",
  "cd (corrected)": "cd",
  simple: "simple",
  "cd-naive (seamed)": "cd-naive",
  "cd-euler (unstable)": "cd-euler",
};

export const methodHints: Readonly<Record<string, string>> = {
  kernel: "One kernel after another, in the order of visibility.",
  slab: "Slabs of constant depth gather the parts of the kernels within them.",
};

// `reference` is not offered, because the server refuses it for streams.
export const methodOptions: Options = { kernel: "kernel", slab: "slab" };

export const detailHints: Readonly<Record<string, string>> = {
  auto: "Pairs of samples that fit in a pixel are merged.",
  full: "Every sample is drawn.",
};

export const detailOptions: Options = { auto: "auto", full: "full" };

// Options of a field picker.
export function fieldOptions(dataset: Dataset, kind: Field["kind"]): Options {
  return optionsOf(dataset.fields.filter((field) => field.kind === kind));
}

function optionsOf(fields: Field[]): Options {
  return Object.fromEntries(
    fields.map((field) => {
      const unit = unitText(field.units);
      return [unit === "" ? field.name : `${field.name} (${unit})`, field.name];
    }),
  );
}

const mappingLabels: Readonly<Record<Dataset["mappings"][number], string>> = {
  flat: "flat",
  sphere: "sphere (globe)",
  curvilinear: "curvilinear map",
};

// Mappings that the dataset supports.
export function mappingOptions(dataset: Dataset): Options {
  return Object.fromEntries(dataset.mappings.map((mapping) => [mappingLabels[mapping], mapping]));
}

export const ownHeight = ""; // the option for no height field

// Scalars that can serve as height field; those in units of length first.
export function heightOptions(dataset: Dataset): Options {
  const measuresHeight = (field: Field): boolean =>
    /height|altitude/.test(field.standardName) || /^(k?m|d[ak]m|gpm|feet)$/.test(field.units);
  const scalars = dataset.fields.filter((field) => field.kind === "scalar");
  const sorted = [...scalars].sort((a, b) => Number(measuresHeight(b)) - Number(measuresHeight(a)));
  return { "the vertical axis": ownHeight, ...optionsOf(sorted) };
}

export const wholeVolume = "all";

export const obliquePlane = "plane";

const sliceAxes: readonly SliceAxis[] = ["x", "y", "z"];

const isBent = ({ geometry = {} }: View): boolean =>
  (geometry.mapping ?? "flat") !== "flat" || (geometry.heightField ?? null) !== null;

// Another shape or height field. It ends an oblique plane if the grid is no longer flat.
export function shapePatch(
  view: View,
  shape: Pick<NonNullable<View["geometry"]>, "mapping" | "heightField">,
): Patch {
  const bent = isBent({ geometry: { ...view.geometry, ...shape } });
  return { geometry: bent && view.geometry?.plane ? { ...shape, plane: null } : shape };
}

// Axes with one sample are omitted, because their slice would be the whole volume, and the plane
// where the server refuses it.
export function sliceOptions(dataset: Dataset, view: View): Options {
  const options: Options = { "off: whole volume": wholeVolume };
  for (const axis of sliceAxes) {
    const { name } = dataset.axes[axis];
    if (dataset.dims[axis] < 2) continue;
    options[name === axis ? `across ${axis}` : `across ${axis}: ${name}`] = axis;
  }
  if (!isBent(view)) options["oblique plane"] = obliquePlane;
  return options;
}

export const sliceIndexMax = (dataset: Dataset, axis: SliceAxis): number =>
  Math.max(0, dataset.dims[axis] - 1);

// A new slice starts in the middle of the axis, a new plane is diagonal through the centre.
export function slicePatch(dataset: Dataset, axis: string): Patch {
  if (axis === obliquePlane) {
    return { geometry: { slice: null, plane: { point: [0, 0, 0], normal: [1, 1, 0] } } };
  }
  const known = sliceAxes.find((one) => one === axis);
  if (known === undefined) return { geometry: { slice: null, plane: null } };
  const index = Math.floor(sliceIndexMax(dataset, known) / 2);
  return { geometry: { slice: { axis: known, index }, plane: null } };
}

// Streamlets end where a slice or plane begins, on which the server refuses them.
export function endTrace(view: View, patch: Patch): Patch {
  const { slice, plane } = (patch as View).geometry ?? {};
  const whole = (slice ?? null) === null && (plane ?? null) === null;
  const traced = (view.vector?.trace ?? null) !== null;
  return whole || !traced ? patch : { ...patch, vector: { trace: null } };
}

// One number of the plane changed; null where its normal would have no direction.
export function planePatch(view: View, key: "point" | "normal", at: number, to: number) {
  const plane = view.geometry?.plane;
  if (!plane) return null;
  const values: [number, number, number] = [...plane[key]];
  values[at] = to;
  if (key === "normal" && Math.hypot(...values) < 0.01) return null;
  return { geometry: { plane: { ...plane, [key]: values } } };
}

// Position of the slice in the coordinate of its axis, or why there is no oblique plane.
export function sliceText(dataset: Dataset, view: View): string {
  const slice = view.geometry?.slice;
  if (!slice && isBent(view)) {
    return "An oblique plane needs a flat shape, and heights from the vertical axis.";
  }
  if (!slice) return "";
  const axis = dataset.axes[slice.axis];
  const low = Math.floor(slice.index);
  const [below, above] = [axis.coordinates[low], axis.coordinates[low + 1]];
  const layer = `Layer ${slice.index} of 0 to ${sliceIndexMax(dataset, slice.axis)}`;
  if (below === undefined) return `${layer}.`;
  const place =
    slice.index === low || above === undefined
      ? formatNumber(below)
      : `between ${formatNumber(below)} and ${formatNumber(above)}`;
  return `${layer}: ${axis.name} ${place} ${unitText(axis.units)}`.trim() + ".";
}

// How heights are exaggerated in a box; empty: unknown.
export function exaggerationText(dataset: Dataset, view: View): string {
  const { vertical = "auto", mapping = "flat", heightField = null, scale } = view.geometry ?? {};
  if (mapping !== "flat" || heightField !== null || vertical === "index") return "";
  const byPressure = dataset.axes.z.kind === "pressure"; // drawn by its logarithm unless linear
  const base = vertical === "metric" ? 1 : dataset.verticalExaggeration;
  if (base === undefined || (byPressure && vertical === "linear")) return "";
  const across = dataset.dims.y > 1 ? 1 : 0;
  const times = (base * (scale?.[2] ?? 1)) / (scale?.[across] ?? 1);
  if (!byPressure && Math.abs(times - 1) < 0.005) return "Heights are drawn to scale.";
  const shown = byPressure ? `about ${formatNumber(times, 2)}` : formatNumber(times, 3);
  const stretch = formatNumber(scale?.[2] ?? 1, 3);
  return `A vertical stretch of ${stretch} draws heights ${shown} times as high as to scale.`;
}

// Colours the lines by a different quantity: the old range has the wrong unit and is removed, and a
// scalar field is named.
export function colorByPatch(dataset: Dataset, view: View, by: string): Patch {
  const color: Patch = { by, range: null };
  if (by === "scalar" && !view.vector?.color?.field) {
    color.field = dataset.fields.find((field) => field.kind === "scalar")?.name ?? null;
  }
  // Direction needs a cyclic map, so that north has one colour from both sides; for other
  // quantities a cyclic map would be ambiguous.
  if (by === "direction") color.map = "compass";
  else if (view.vector?.color?.map === "compass") color.map = null;
  return { vector: { color } };
}

// The field that colours the lines; for a vector its magnitude; null: none.
export function colorField(view: View): string | null {
  const { field = null, color } = view.vector ?? {};
  if (field === null) return null;
  if (color?.by === "magnitude") return field;
  return color?.by === "scalar" ? (color.field ?? null) : null;
}

// Keeps at least `gap` between near and far: the changed end moves the other one if necessary.
export function depthCuePatch(view: View, end: "near" | "far", value: number): Patch {
  const gap = 0.01;
  const { near = 0, far = 1 } = view.depthCue ?? {};
  const depthCue =
    end === "near"
      ? { near: value, far: Math.max(far, value + gap) }
      : { near: Math.min(near, value - gap), far: value };
  return { depthCue };
}

export const hasErrorLimit = (view: View): boolean => (view.quality?.maxError ?? null) !== null;

// Describes what moving frames are optimized for.
export const qualityHint = (view: View): string =>
  hasErrorLimit(view)
    ? "Moving frames: the fastest expected to meet the error limit, within the budget."
    : "Moving frames: the least error that the budget allows.";

// The choices of ground.show.
export const groundOptions: Options = { automatic: "auto", always: "on", never: "off" };

// Whether the view may draw a ground: by default the server decides.
export const showsGround = (view: View): boolean => (view.ground?.show ?? "auto") !== "off";

// Whether the places of a dataset on the Earth are known: then it can be drawn as a globe.
export const showsTheEarth = (dataset: Dataset): boolean => dataset.mappings.includes("sphere");

// Which controls apply to a view; the others are hidden or disabled.
export function controlStates(view: View) {
  const vector = view.vector ?? {};
  const by = vector.color?.by;
  const jitter = vector.jitter ?? {};
  const lines = vector.field !== null;
  return {
    lines,
    ranged: by !== "constant", // coloured along a range by a map
    counted: colorField(view) !== null,
    constant: by === "constant",
    rise: by === "rise",
    colorField: by === "scalar",
    span: lines && jitter.overlap !== false,
    pattern: lines && (jitter.center !== 0 || jitter.stride !== 0),
    motion: lines && vector.motion?.mode === "phase",
    minusStep: (view.difference?.step ?? null) !== null,
    minusDataset: (view.difference?.dataset ?? null) !== null,
    slab: view.method?.name === "slab",
    slice: (view.geometry?.slice ?? null) !== null,
    plane: (view.geometry?.plane ?? null) !== null,
    traced: lines && (vector.trace ?? null) !== null,
    // A slice or plane has straight lines only.
    traceable: lines && (view.geometry?.slice ?? view.geometry?.plane ?? null) === null,
    arrow: lines && vector.mark?.shape === "arrow",
    whitened: lines && vector.mark?.shape !== "comet",
    combined: lines && (view.geometry?.slice ?? view.geometry?.plane ?? null) !== null,
    ground: showsGround(view),
    tint: view.ground?.tint !== false,
    fovY: view.camera?.projection !== "orthographic",
    errorLimit: hasErrorLimit(view),
    depthCue: lines && view.depthCue?.strength !== 0,
    light: (view.light ?? null) !== null,
    sunByAngles: (view.light ?? null) !== null && (view.light?.sunAt ?? null) === null,
    sunAt: (view.light?.sunAt ?? null) !== null,
  };
}

export type ControlStates = ReturnType<typeof controlStates>;
