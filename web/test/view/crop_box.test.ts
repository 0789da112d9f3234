// The box of the region: faces, drags along axes and ranges, against closed forms.
import assert from "node:assert/strict";
import { test } from "node:test";
import { project, type Camera, type Dataset, type View } from "@windsplat/client";
import {
  alongAxis,
  cropBox,
  faceCentre,
  faces,
  hasHandle,
  limitsOf,
  rangeWith,
  sampleOfFace,
  towardViewer,
  unitAlong,
  worldAt,
  type Face,
} from "../../src/view/crop_box";
import { add, times, type Vec3 } from "@windsplat/client/parts";
import { described } from "../page";

const near = (value: number | null, wanted: number, slack = 1e-9): void =>
  assert.ok(value !== null && Math.abs(value - wanted) < slack, `${value} is not ${wanted}`);
const nearAll = (values: readonly number[], wanted: readonly number[]): void =>
  wanted.forEach((one, n) => near(values[n]!, one));

const count = (n: number, at: (i: number) => number) => Array.from({ length: n }, (_, i) => at(i));

// Longitudes of the whole globe every 10 degrees, uneven latitudes, and pressures whose heights go
// with their logarithm: 1000 hPa at -0.2, 100 hPa at 0.2.
const pressures = [1000, 700, 400, 200, 100];
const globe = ((): Dataset => {
  const dataset = described("globe");
  const axis = (name: string, kind: string, units: string, coordinates: number[]) => ({
    ...dataset.axes.x,
    ...{ name, kind, units, coordinates },
  });
  const x = axis(
    "longitude",
    "longitude",
    "degrees_east",
    count(36, (i) => 10 * i),
  );
  const y = axis("latitude", "latitude", "degrees_north", [-80, -50, -10, 0, 20, 80]);
  const z = axis("level", "pressure", "hPa", pressures);
  return {
    ...dataset,
    dims: { x: 36, y: 6, z: 5 },
    axes: {
      x: { ...x, world: x.coordinates.map((at) => at / 175 - 1) },
      y: { ...y, world: y.coordinates.map((at) => at / 160) },
      z: { ...z, world: pressures.map((at) => 0.2 - 0.4 * (Math.log10(at) - 2)) },
    },
    world: { min: [-1, -0.5, -0.2], max: [1, 0.5, 0.2] },
  } as unknown as Dataset;
})();

const boxOf = (region: View["region"], more: View = {}) => {
  const box = cropBox(globe, { ...more, region });
  assert.ok(box !== null);
  return box;
};

const perspective: Camera = {
  projection: "perspective",
  eye: [0.7, -3, 1.4],
  target: [0.1, 0.05, -0.02],
  up: [0.2, 0, 1],
  fovY: 35,
  height: 2,
};
const cameras: Camera[] = [perspective, { ...perspective, projection: "orthographic" }];
const aspect = 1.6;

test("without a region the box is that of the data, with all factors of the geometry", () => {
  const box = boxOf({});
  nearAll(box.min, [-1, -0.5, -0.2]);
  nearAll(box.max, [1, 0.5, 0.2]);
  const tall = boxOf({}, { geometry: { scale: [1, 1, 3] } } as View);
  nearAll(tall.max, [1, 0.5, 0.6]);
});

test("ends are at their places on uneven axes, and pressures upside down", () => {
  const box = boxOf({ y: [-10, 50], z: [200, 700] });
  near(box.min[1], -10 / 160);
  near(box.max[1], 50 / 160); // half way between samples at 20 and 80
  near(box.min[2], 0.2 - 0.4 * Math.log10(7));
  near(box.max[2], 0.2 - 0.4 * Math.log10(2));
  nearAll(
    boxOf({ z: [700, 200] }).min,
    box.min.map((at, n) => (n === 2 ? at : -[1, 0.5][n]!)),
  );
});

test("ranges beyond the data end with them", () => {
  const box = boxOf({ y: [-90, 90], z: [1, 2000] });
  assert.deepEqual(box.axes[1].ends, [-80, 80]);
  assert.deepEqual(box.axes[2].ends, [1000, 100]);
  nearAll(box.min, [-1, -0.5, -0.2]);
  nearAll(box.max, [1, 0.5, 0.2]);
});

test("longitudes across the seam count on beyond the eastern edge", () => {
  for (const range of [
    [340, 30],
    [-20, 30],
    [340, 390],
  ] as [number, number][]) {
    const box = boxOf({ x: range });
    near(box.min[0], 340 / 175 - 1);
    near(box.max[0], 390 / 175 - 1);
  }
  const within = boxOf({ x: [-300, -200] });
  near(within.min[0], 60 / 175 - 1);
  near(within.max[0], 160 / 175 - 1);
  near(boxOf({ x: [-180, 180] }).min[0], -1);
  near(boxOf({ x: [-180, 180] }).max[0], 1);
});

test("a regional axis of longitudes has no seam", () => {
  const x = {
    ...globe.axes.x,
    coordinates: count(9, (i) => -30 + 10 * i),
    world: count(9, (i) => i / 4 - 1),
  };
  const regional = { ...globe, axes: { ...globe.axes, x } } as Dataset;
  const at = (range: [number, number]) => cropBox(regional, { region: { x: range } })!;
  near(at([-60, 20]).min[0], -1);
  near(at([-60, 20]).max[0], 0.25);
  near(at([340, 400]).min[0], -0.75);
  near(at([340, 400]).max[0], 0.75);
});

test("mapped grids and height fields have no box", () => {
  for (const geometry of [{ mapping: "sphere" }, { heightField: "z" }, { vertical: "linear" }]) {
    assert.equal(cropBox(globe, { geometry } as View), null, JSON.stringify(geometry));
  }
});

test("the centre of a face seen straight on is at its place in the picture", () => {
  const box = boxOf({ x: [90, 260], y: [-50, 20], z: [1000, 100] });
  const centre = faceCentre(box, { axis: 2, end: 1 });
  nearAll(centre, [0, -15 / 160, 0.2]);
  const above: Camera = { ...perspective, eye: [0, 0, 4], target: [0, 0, 0], up: [0, 1, 0] };
  const height = 2 * 3.8 * Math.tan((17.5 * Math.PI) / 180); // at the distance of the face
  nearAll(project(above, centre, aspect)!, [0.5, 0.5 + 15 / 160 / height]);
});

test("a drag by the projection of a displacement gives that displacement", () => {
  const box = boxOf({ x: [30, 250], y: [-50, 20], z: [700, 200] });
  for (const camera of cameras) {
    for (const face of faces) {
      const from = faceCentre(box, face);
      for (const shift of [-0.7, -0.01, 0, 0.02, 0.4]) {
        const to = add(from, times(unitAlong(face.axis), shift));
        const at = project(camera, to, aspect)!;
        near(alongAxis(camera, aspect, from, face.axis, at), shift);
      }
    }
  }
});

test("of a drag beside the axis the part along its picture counts", () => {
  // Seen from the south, x is horizontal: how high the pointer is does not matter.
  const south: Vec3 = [0, -4, 0];
  for (const camera of cameras.map((c) => ({ ...c, eye: south, target: [0, 0, 0] as Vec3 }))) {
    const upright: Camera = { ...camera, up: [0, 0, 1] };
    const from: Vec3 = [0.3, -0.5, 0.1];
    const [x, y] = project(upright, [0.8, -0.5, 0.1], aspect)!;
    near(alongAxis(upright, aspect, from, 0, [x, y - 0.3]), 0.5);
  }
});

test("the displacement is that of the nearest point of the picture of the axis", () => {
  const from: Vec3 = [0.3, -0.2, 0.1];
  for (const camera of cameras) {
    for (const axis of [0, 1, 2] as const) {
      const along = (t: number): [number, number] => {
        const [x, y] = project(camera, add(from, times(unitAlong(axis), t)), aspect)!;
        return [x * aspect, y]; // in heights of the picture
      };
      const [a, b] = [along(0), along(0.35)];
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
      const beside: [number, number] = [(b[0] - 0.8 * dy) / aspect, b[1] + 0.8 * dx];
      near(alongAxis(camera, aspect, from, axis, beside), 0.35);
    }
  }
});

test("an axis that points at the viewer, and what is behind the eye, give no displacement", () => {
  const camera: Camera = { ...perspective, eye: [0, -4, 0], target: [0, 0, 0], up: [0, 0, 1] };
  const end = alongAxis(
    { ...camera, projection: "orthographic" },
    aspect,
    [0, 0, 0],
    1,
    [0.7, 0.5],
  );
  assert.equal(end, null);
  assert.equal(alongAxis(camera, aspect, [0, -5, 0], 0, [0.5, 0.5]), null);
  // The vanishing point of an axis is infinitely far; beyond it there is nothing.
  const from: Vec3 = [0.5, 0, 0];
  assert.equal(alongAxis(camera, aspect, from, 1, [0.4, 0.5]), null);
});

test("faces towards the viewer have handles, and those at the sides seen from above", () => {
  const box = boxOf({});
  const handled = (camera: Camera) =>
    faces
      .filter((face) => hasHandle(camera, box, face))
      .map(({ axis, end }) => `${"xyz"[axis]}${end}`)
      .join(" ");
  const look = (eye: Vec3, up: Vec3 = [0, 0, 1]): Camera[] =>
    cameras.map((camera) => ({ ...camera, eye, target: [0, 0, 0], up }));
  for (const camera of look([3, -3, 3])) assert.equal(handled(camera), "x1 y0 z1");
  for (const camera of look([-3, 3, -3])) assert.equal(handled(camera), "x0 y1 z0");
  for (const camera of look([0, 0, 5], [0, 1, 0])) assert.equal(handled(camera), "x0 x1 y0 y1");
  const [eyed] = look([3, 0, 0]);
  near(towardViewer(eyed!, box, { axis: 0, end: 1 }), 1);
  near(towardViewer(eyed!, box, { axis: 2, end: 1 }), -0.2 / Math.hypot(3, 0.2));
});

test("a face moves from sample to sample, two of which are left between the faces", () => {
  const box = boxOf({ z: [200, 700] });
  const bottom: Face = { axis: 2, end: 0 };
  const top: Face = { axis: 2, end: 1 };
  assert.deepEqual(limitsOf(box, bottom), [0, 2]);
  assert.deepEqual(limitsOf(box, top), [2, 4]);
  const at = (hPa: number) => worldAt(box.axes[2], hPa);
  assert.equal(sampleOfFace(box, bottom, at(950)), 0);
  assert.equal(sampleOfFace(box, bottom, at(100)), 2);
  assert.equal(sampleOfFace(box, top, at(900)), 2);
  assert.deepEqual(rangeWith(box, bottom, 2), [200, 400]);
  assert.deepEqual(rangeWith(box, top, 4), [100, 700]);
  assert.equal(rangeWith(boxOf({ z: [100, 700] }), bottom, 0), null, "the whole axis");
});

test("across the seam the eastern face goes as far as the region, the western to the seam", () => {
  const box = boxOf({ x: [340, 30] });
  assert.deepEqual(limitsOf(box, { axis: 0, end: 0 }), [0, 35]);
  assert.deepEqual(limitsOf(box, { axis: 0, end: 1 }), [35, 39]);
  assert.deepEqual(rangeWith(box, { axis: 0, end: 1 }, 38), [340, 380]);
  assert.deepEqual(rangeWith(box, { axis: 0, end: 0 }, 33), [330, 390]);
  assert.deepEqual(limitsOf(boxOf({ x: [20, 50] }), { axis: 0, end: 1 }), [3, 35]);
});
