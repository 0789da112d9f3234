// The text of a GeoJSON file -> the polygon of a region. Pure.
import type { RegionView } from "@windsplat/client";

export type RegionPolygon = NonNullable<RegionView["polygon"]>;
type Rings = number[][][];

export const positionsMax = 2000; // limit of the server, in all rings

// Polygons of a geometry, a feature or a collection of either (RFC 7946). Others are left out.
function polygonsOf(node: unknown, found: Rings[]): void {
  if (typeof node !== "object" || node === null) return;
  const { type, coordinates, geometry, features, geometries } = node as Record<string, unknown>;
  if (type === "Polygon") found.push(coordinates as Rings);
  if (type === "MultiPolygon" && Array.isArray(coordinates))
    found.push(...(coordinates as Rings[]));
  if (type === "Feature") polygonsOf(geometry, found);
  const parts = type === "FeatureCollection" ? features : geometries;
  if (Array.isArray(parts)) parts.forEach((part) => polygonsOf(part, found));
}

const isPosition = (value: unknown): boolean =>
  Array.isArray(value) && value.length >= 2 && value.slice(0, 2).every(Number.isFinite);

// Throws an error for the user if there is no polygon, or one that the server would refuse.
export function polygonFrom(text: string): RegionPolygon {
  let document: unknown;
  try {
    document = JSON.parse(text);
  } catch {
    throw new Error("the file is not JSON");
  }
  const polygons: Rings[] = [];
  polygonsOf(document, polygons);
  if (polygons.length === 0) throw new Error("the file has no Polygon or MultiPolygon");
  let positions = 0;
  const flat = polygons.map((rings) => {
    if (!Array.isArray(rings)) throw new Error("a polygon of the file has no rings");
    return rings.map((ring) => {
      if (!Array.isArray(ring) || !ring.every(isPosition)) {
        throw new Error("a ring of the file has something else than positions");
      }
      positions += ring.length;
      return ring.map(([x, y]) => [x!, y!]); // without heights
    });
  });
  if (positions > positionsMax) {
    throw new Error(`the polygons have ${positions} positions, more than ${positionsMax}`);
  }
  const one = flat.length === 1;
  const polygon = one
    ? { type: "Polygon", coordinates: flat[0] }
    : { type: "MultiPolygon", coordinates: flat };
  return polygon as RegionPolygon;
}
