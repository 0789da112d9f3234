// Distances and bearings against closed forms, and polygons of GeoJSON files.
import assert from "node:assert/strict";
import { test } from "node:test";
import { earthRadiusKm, greatCircleKm, initialBearing, wayText } from "../../src/view/distance";
import { offersDegrees } from "../../src/panels/panel_region";
import { polygonFrom, positionsMax } from "../../src/view/geo_polygon";
import type { Dataset } from "@windsplat/client";
import { described } from "../page";

const near = (value: number | null, wanted: number, slack = 1e-9): void =>
  assert.ok(value !== null && Math.abs(value - wanted) < slack, `${value} is not ${wanted}`);

const quarter = (Math.PI / 2) * earthRadiusKm;

test("the sphere has the mean radius of WGS84", () => {
  const [a, b] = [6378.137, 6356.752314245]; // semi-axes, km
  near(earthRadiusKm, (2 * a + b) / 3, 1e-4);
});

test("great circles of known angles have the length of their angle", () => {
  near(greatCircleKm([0, 0], [90, 0]), quarter, 1e-6);
  near(greatCircleKm([17, 0], [17, 90]), quarter, 1e-6);
  near(greatCircleKm([-179, 0], [179, 0]), (2 * quarter) / 90, 1e-6);
  near(greatCircleKm([350, 0], [370, 0]), (20 * quarter) / 90, 1e-6);
  near(greatCircleKm([0, 0], [180, 0]), 2 * quarter, 1e-3);
  near(greatCircleKm([0, 60], [180, 60]), (60 * quarter) / 90, 1e-6); // over the pole
  near(greatCircleKm([12, 34], [12, 34]), 0);
  const short = 1e-7; // degrees; the cosine formula would give 0
  near(greatCircleKm([10, 50], [10, 50 + short]) / ((short * quarter) / 90), 1, 1e-6);
});

// By the spherical law of cosines: the angle between two unit vectors.
test("distances are those of the angle between the places", () => {
  const unit = (east: number, north: number): [number, number, number] => {
    const [l, b] = [(east * Math.PI) / 180, (north * Math.PI) / 180];
    return [Math.cos(b) * Math.cos(l), Math.cos(b) * Math.sin(l), Math.sin(b)];
  };
  for (let n = 0; n < 200; ++n) {
    const a: [number, number] = [(n * 47) % 360, ((n * 31) % 178) - 89];
    const b: [number, number] = [(n * 113) % 360, ((n * 59) % 178) - 89];
    const [u, v] = [unit(...a), unit(...b)];
    const cosine = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    near(greatCircleKm(a, b), earthRadiusKm * Math.acos(Math.max(-1, Math.min(1, cosine))), 1e-2);
  }
});

test("bearings are those of meridians, the equator and a triangle of right angles", () => {
  near(initialBearing([5, 10], [5, 20]), 0);
  near(initialBearing([5, 10], [5, -20]), 180);
  near(initialBearing([0, 0], [10, 0]), 90);
  near(initialBearing([-175, 0], [175, 0]), 270);
  // Napier: tan(45) = tan(bearing) sin(45 degrees of the equator).
  near(initialBearing([0, 0], [45, 45]), (Math.atan(Math.SQRT1_2) * 180) / Math.PI, 1e-9);
  assert.equal(initialBearing([0, 90], [10, 20]), null);
  assert.equal(initialBearing([3, 4], [3, 4]), null);
});

test("distances are in kilometres, or in the unit of the axes", () => {
  const geographic = { x: "degrees_east", y: "degrees_north", z: "hPa" };
  const dataset = described("storm");
  const index = { x: 0, y: 0, z: 0 };
  assert.equal(
    wayText(
      dataset,
      { x: 0, y: 0, z: 1000, units: geographic, index },
      { x: 90, y: 0, z: 500, units: geographic, index },
    ),
    "10008 km towards 90° (great circle), vertically −500 hPa",
  );
  const metres = { x: "m", y: "m", z: "m" };
  assert.equal(
    wayText(
      dataset,
      { x: 0, y: 0, z: 0, units: metres, index },
      { x: 3, y: 4, z: 0, units: metres, index },
    ),
    "5 m",
  );
  const mixed = { x: "km", y: "s", z: "m" };
  assert.equal(
    wayText(
      dataset,
      { x: 0, y: 0, z: 0, units: mixed, index },
      { x: 3, y: 4, z: 2, units: mixed, index },
    ),
    "x 3 km, y 4 s, vertically +2 m",
  );
});

const square = [
  [
    [0, 0],
    [1, 0],
    [1, 1],
    [0, 0],
  ],
];

test("polygons of geometries, features and collections are united", () => {
  const polygon = { type: "Polygon", coordinates: square };
  assert.deepEqual(polygonFrom(JSON.stringify(polygon)), polygon);
  const feature = { type: "Feature", properties: { name: "A" }, geometry: polygon };
  assert.deepEqual(polygonFrom(JSON.stringify(feature)), polygon);
  const point = { type: "Feature", geometry: { type: "Point", coordinates: [0, 0] } };
  const several = { type: "MultiPolygon", coordinates: [square, square] };
  const collection = {
    type: "FeatureCollection",
    features: [feature, point, { type: "Feature", geometry: several }],
  };
  assert.deepEqual(polygonFrom(JSON.stringify(collection)), {
    type: "MultiPolygon",
    coordinates: [square, square, square],
  });
  const high = {
    type: "Polygon",
    coordinates: [
      [
        [0, 0, 9],
        [1, 0, 9],
        [1, 1, 9],
        [0, 0, 9],
      ],
    ],
  };
  assert.deepEqual(polygonFrom(JSON.stringify(high)), polygon);
});

test("files without polygons, or with too many positions, are refused with the reason", () => {
  assert.throws(() => polygonFrom("{"), /not JSON/);
  assert.throws(() => polygonFrom('{"type":"Point","coordinates":[0,0]}'), /no Polygon/);
  assert.throws(() => polygonFrom('{"type":"Polygon","coordinates":[[["a"]]]}'), /positions/);
  const ring = Array.from({ length: positionsMax + 1 }, (_, n) => [n, 0]);
  const large = JSON.stringify({ type: "Polygon", coordinates: [ring] });
  assert.throws(() => polygonFrom(large), new RegExp(`${positionsMax + 1} positions`));
});

test("a region in degrees is offered where the axes are not, but the columns are", () => {
  const earth = described("gcm");
  const on = (kind: "longitude" | "cartesian", mappings: Dataset["mappings"]) =>
    offersDegrees({ ...earth, mappings, axes: { ...earth.axes, x: { ...earth.axes.x, kind } } });
  assert.equal(on("cartesian", ["flat", "sphere"]), true);
  assert.equal(on("longitude", ["flat", "sphere"]), false);
  assert.equal(on("cartesian", ["flat"]), false);
});
