// Views to start from, each where the data allow it. Pure: (dataset, shape of the picture) -> views
// whose other keys have the dataset's defaults.
import {
  frameBox,
  type Box,
  type Camera,
  type Dataset,
  type Field,
  type ScalarView,
  type View,
} from "@windsplat/client";
import { isCloud, vectorsTitle } from "./words";

export interface Preset {
  key: string;
  title: string;
  about: string; // one sentence
  view: View; // without dataset, step and size
}

type Vector = NonNullable<View["vector"]>;

// Whether the places of the data on the Earth are known.
const showsTheEarth = ({ mappings }: Dataset): boolean => mappings.includes("sphere");

const noLines: Vector = { field: null };
const streamletLength = 2.5; // of a straight line
const sparser = 1.5; // strides of streamlets, in those of the default view
const strideMax = 64;
const samplesPerStride = 20; // along the longest axis, from which there are lines to spare

const fieldNamed = ({ fields }: Dataset, name: string | null | undefined): Field | undefined =>
  fields.find((field) => field.name === name);

const axes = ["x", "y", "z"] as const;

// Whether every axis has the two samples that surfaces need.
const isSolid = ({ dims }: Dataset): boolean => axes.every((axis) => dims[axis] > 1);

// The magnitude of the default view's vectors as a field, where there is one.
function magnitudeField(dataset: Dataset): Field | undefined {
  const vector = dataset.defaultView?.vector?.field ?? "";
  return fieldNamed(dataset, `${vector}_speed`) ?? fieldNamed(dataset, `${vector}_magnitude`);
}

// The scalar field that a surface cuts: of the default volumes, else the first of the file, else
// the magnitude of the vectors.
const mainScalar = (dataset: Dataset): Field | undefined =>
  fieldNamed(dataset, dataset.defaultView?.scalars?.[0]?.field) ??
  dataset.fields.find(({ kind, dtype }) => kind === "scalar" && dtype !== "derived") ??
  magnitudeField(dataset);

// The middle of the range in which a field is shown; null: not known.
function middleOf(dataset: Dataset, field: Field): number | null {
  const { scalars, vector } = dataset.defaultView ?? {};
  const layer = scalars?.find((one) => one.field === field.name);
  const magnitude = field.dtype === "derived" ? vector?.magnitudeRange : undefined;
  const range = layer?.color?.range ?? field.range ?? magnitude;
  if (!range || range[0] === range[1]) return null;
  return Number((0.5 * (range[0]! + range[1]!)).toPrecision(3));
}

// From above, north up, as a map.
function mapCamera(dataset: Dataset, aspect: number): Partial<Camera> {
  const camera: Camera = {
    projection: "orthographic",
    eye: [0, 0, 4],
    target: [0, 0, 0],
    up: [0, 1, 0],
    fovY: 35,
    height: 2,
  };
  const above = { azimuth: 0, elevation: 90 };
  const { projection, eye, target, up, height } = frameBox(
    camera,
    dataset.world as Box,
    above,
    aspect,
  );
  return { projection, eye, target, up, height };
}

// Longer lines that follow the flow, fewer of them: those of the default view only just stay apart.
function streamlets(dataset: Dataset): Vector {
  const { length, stride: ofLines } = dataset.defaultView?.vector ?? {};
  const stride = ofLines ?? 1;
  const samples = Math.max(...axes.map((axis) => dataset.dims[axis]));
  const isDense = samples >= samplesPerStride * stride;
  return {
    trace: {},
    stride: Math.min(strideMax, isDense ? Math.ceil(sparser * stride) : stride),
    ...(length ? { length: Math.min(10, streamletLength * length) } : {}),
  };
}

// The volumes of the default view with the shading that suits them.
function lit(dataset: Dataset): ScalarView[] {
  return (dataset.defaultView?.scalars ?? []).map(({ field }) => {
    const info = fieldNamed(dataset, field);
    return { field, shading: info && isCloud(info) ? "scatter" : "gradient" };
  });
}

const figure: NonNullable<View["annotations"]> = {
  box: true,
  axes: true,
  north: true,
  scaleBar: true,
  legend: true,
  title: true,
  stepTime: true,
  contourLabels: true,
};

function ofParts(dataset: Dataset): Preset[] {
  const lines = (dataset.defaultView?.vector?.field ?? null) !== null;
  const volumes = lit(dataset).length > 0;
  const clouds = lit(dataset).every(({ shading }) => shading === "scatter");
  const [winds, cloud] = [vectorsTitle(dataset), clouds ? "Clouds" : "Volumes"];
  const whole: Preset = {
    key: "default",
    title: lines && volumes ? `${winds} and ${cloud.toLowerCase()}` : lines ? winds : cloud,
    about: "The view that the dataset opens with",
    view: {},
  };
  const found = [whole];
  if (lines && volumes) {
    found.push(
      { key: "lines", title: winds, about: "Lines alone", view: { scalars: [] } },
      { key: "volumes", title: cloud, about: "Volumes alone", view: { vector: noLines } },
    );
  }
  if (lines) {
    const view: View = { scalars: [], vector: streamlets(dataset) };
    found.push({
      key: "streamlets",
      title: "Streamlets",
      about: "Lines that follow the flow",
      view,
    });
  }
  if (volumes && isSolid(dataset)) {
    found.push({
      key: "light",
      title: `Sunlit ${cloud.toLowerCase()}`,
      about: "Volumes in the light of a sun",
      view: { vector: noLines, scalars: lit(dataset) as View["scalars"], light: {} },
    });
  }
  return found;
}

// An upright section, long because across the shorter horizontal axis, and a low level.
function sections(dataset: Dataset, { name }: Field): Preset {
  const axis = dataset.dims.x < dataset.dims.y ? "x" : "y";
  const at = (one: "x" | "y" | "z", part: number) => ({
    field: name,
    slice: { axis: one, index: Math.floor(part * (dataset.dims[one] - 1)) },
  });
  return {
    key: "sections",
    title: "Sections",
    about: `${name} along an upright section and on a low level`,
    view: { scalars: [], vector: noLines, surfaces: [at(axis, 0.5), at("z", 0.25)] },
  };
}

function ofSurfaces(dataset: Dataset): Preset[] {
  const field = mainScalar(dataset);
  if (field === undefined || !isSolid(dataset)) return [];
  const found: Preset[] = [];
  const alone: View = { scalars: [], vector: noLines };
  const isovalue = middleOf(dataset, field);
  if (isovalue !== null) {
    const magnitude = magnitudeField(dataset);
    const coloured = magnitude !== undefined && magnitude !== field;
    const color = coloured ? { color: { field: magnitude.name } } : {};
    const colors = coloured ? `, in colours of ${magnitude.name}` : "";
    found.push({
      key: "isosurface",
      title: "Isosurface",
      about: `Where ${field.name} is ${isovalue}${colors}`,
      view: { ...alone, surfaces: [{ field: field.name, isovalue, ...color }] },
    });
  }
  found.push(sections(dataset, magnitudeField(dataset) ?? field));
  return found;
}

function ofPlace(dataset: Dataset, aspect: number): Preset[] {
  const found: Preset[] = [];
  const { dims } = dataset;
  const earth = showsTheEarth(dataset);
  if (isSolid(dataset)) {
    found.push({
      key: "above",
      title: "From above",
      about: earth ? "A map over land and sea, north up" : "Seen from above",
      view: {
        camera: mapCamera(dataset, aspect) as View["camera"],
        ...(earth ? { ground: { show: "on" } } : {}),
      },
    });
    const index = Math.floor((dims.z - 1) / 2);
    found.push({
      key: "level",
      title: "One level",
      about: "The middle level as a map",
      view: { geometry: { slice: { axis: "z", index } } },
    });
  }
  if (earth && (dataset.defaultView?.geometry?.mapping ?? "flat") !== "sphere") {
    const view: View = { geometry: { mapping: "sphere" } };
    found.push({ key: "globe", title: "Globe", about: "The data on a globe", view });
  }
  return found;
}

// aspect: width of the picture over its height.
export const presetsOf = (dataset: Dataset, aspect: number): Preset[] => [
  ...ofParts(dataset),
  ...ofSurfaces(dataset),
  ...ofPlace(dataset, aspect),
  {
    key: "figure",
    title: "Figure",
    about: "With box, axes, legend and title, for a paper",
    // Colours that can be read on the strip, as with --figure of the command line.
    view: { annotations: figure, vector: { color: { trueColors: true } } },
  },
];

// The view of a preset: it keeps the data that are shown, their region, the size of the picture and
// how it is drawn.
export function presetView(preset: Preset, dataset: Dataset, now: View): View {
  const { step = 0, image, region, method, quality } = now;
  const kept = { image, region, method, quality };
  const set = Object.entries(kept).filter(([, value]) => value !== undefined);
  return { dataset: dataset.id, step, ...Object.fromEntries(set), ...preset.view };
}
