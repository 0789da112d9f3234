// Adapts a view to files that changed while displayed: (view, new description) -> the same view as
// far as the new files support it.
import { clamp } from "../base/values";
import { dot, subtract, type Vec3 } from "../base/vec3";
import { scaledBox, type Box } from "./camera";
import type { Dataset, RegionView, View } from "../wire/protocol";

type Vector = NonNullable<View["vector"]>;
type Geometry = NonNullable<View["geometry"]>;
type Plane = NonNullable<Geometry["plane"]>;

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
  if (view.region) fitted.region = fitRegion(view.region, dataset);
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

function fitRegion(region: RegionView, dataset: Dataset): RegionView {
  const where = region.where?.filter(({ field }) => has(dataset, "scalar", field));
  return where === undefined ? region : { ...region, where: where as RegionView["where"] };
}

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

// Whether the box has corners on both sides of the plane or on it.
function meets({ point, normal }: Plane, { min, max }: Box): boolean {
  const sides = [min[0], max[0]].flatMap((x) =>
    [min[1], max[1]].flatMap((y) =>
      [min[2], max[2]].map((z) => dot(normal as Vec3, subtract([x, y, z], point as Vec3))),
    ),
  );
  return Math.min(...sides) <= 0 && Math.max(...sides) >= 0;
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
  // A plane that misses the box is moved through its nearest point.
  if (plane) {
    const box = scaledBox(dataset.world, geometry.scale ?? [1, 1, 1]);
    if (!meets(plane, box)) {
      const inside = (at: 0 | 1 | 2) => clamp(plane.point[at], box.min[at], box.max[at]);
      fitted.plane = { ...plane, point: [inside(0), inside(1), inside(2)] };
    }
  }
  return fitted;
}
