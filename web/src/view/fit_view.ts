// Adapts a view to files that changed while displayed: (view, new description) -> the same view as
// far as the new files support it.
import type { Dataset, View } from "../wire/protocol";

type Vector = NonNullable<View["vector"]>;
type Geometry = NonNullable<View["geometry"]>;

// Keys that no longer apply return to their defaults; all others are preserved.
export function fitView(view: View, dataset: Dataset): View {
  const fitted: View = { ...view };
  const last = Math.max(0, dataset.steps.count - 1);
  if (view.step !== undefined) fitted.step = Math.min(view.step, last);
  if (view.vector) fitted.vector = fitVector(view.vector, dataset);
  if (view.geometry) fitted.geometry = fitGeometry(view.geometry, dataset);
  const media = view.scalars?.filter(({ field }) => has(dataset, "scalar", field));
  if (media && media.length < view.scalars!.length) {
    if (media.length > 0) fitted.scalars = media as View["scalars"];
    else delete fitted.scalars;
  }
  return fitted;
}

// The part of a description that determines the panels.
export const shapeOf = ({ id, dims, axes, mappings, fields, steps }: Dataset): string =>
  JSON.stringify([
    id,
    dims,
    axes,
    mappings,
    steps.count,
    fields.map(({ name, kind, units }) => [name, kind, units]),
  ]);

const has = (dataset: Dataset, kind: "scalar" | "vector", name: string): boolean =>
  dataset.fields.some((field) => field.kind === kind && field.name === name);

function fitVector(vector: Vector, dataset: Dataset): Vector {
  const fitted: Vector = { ...vector };
  if (vector.color) fitted.color = { ...vector.color };
  const color = fitted.color ?? {};
  if (vector.field && !has(dataset, "vector", vector.field)) {
    delete fitted.field;
    delete fitted.magnitudeRange; // the replacing field has other magnitudes
    delete fitted.minMagnitude;
    if (color.by === "magnitude") delete color.range;
  }
  if (color.field && !has(dataset, "scalar", color.field)) {
    delete color.field;
    if (color.by === "scalar") {
      delete color.by;
      delete color.range;
    }
  }
  return fitted;
}

function fitGeometry(geometry: Geometry, dataset: Dataset): Geometry {
  const fitted: Geometry = { ...geometry };
  const { mapping, heightField, slice, plane } = geometry;
  if (mapping && !dataset.mappings.includes(mapping)) delete fitted.mapping;
  if (heightField && !has(dataset, "scalar", heightField)) delete fitted.heightField;
  if (slice) {
    const last = Math.max(0, dataset.dims[slice.axis] - 1);
    fitted.slice = { ...slice, index: Math.min(slice.index, last) };
  }
  // Through a point of the box, so that the plane does not miss it.
  if (plane) {
    const { min, max } = dataset.world;
    const inside = (at: 0 | 1 | 2) => Math.min(Math.max(plane.point[at], min[at]), max[at]);
    fitted.plane = { ...plane, point: [inside(0), inside(1), inside(2)] };
  }
  return fitted;
}
