// What the panels call the parts of a dataset.
import assert from "node:assert/strict";
import { test } from "node:test";
import { isCloud, vectorsTitle, volumesTitle } from "../../src/view/words";
import { described } from "../page";

const field = (kind: "vector" | "scalar", more: object) => ({
  ...described("any").fields[0]!,
  kind,
  ...more,
});

const vectors = (more: object) =>
  vectorsTitle({ ...described("any"), fields: [field("vector", { name: "v", ...more })] });

test("vectors are called by their names in the file, otherwise by their units", () => {
  assert.equal(vectors({ units: "m s-1", longName: "wind" }), "Winds");
  assert.equal(vectors({ units: "Pa s-1", standardName: "eastward_wind" }), "Winds");
  assert.equal(
    vectors({ units: "m s-1", standardName: "eastward_sea_water_velocity" }),
    "Currents",
  );
  assert.equal(vectors({ units: "cm/s", longName: "velocity" }), "Flow");
  assert.equal(vectors({ units: "V m-1", longName: "electric field" }), "Vectors");
  assert.equal(vectors({ units: "m s-1", longName: "windowed mean" }), "Flow");
});

test("vectors that are derived from others do not name them", () => {
  const derived = field("vector", {
    longName: "vorticity of wind",
    dtype: "derived",
    units: "s-1",
  });
  const stored = field("vector", { name: "E", longName: "electric field", units: "V m-1" });
  assert.equal(vectorsTitle({ ...described("any"), fields: [stored, derived] }), "Vectors");
});

test("volumes are clouds if a field is one", () => {
  const titled = (more: object) =>
    volumesTitle({ ...described("any"), fields: [field("scalar", { name: "q", ...more })] });
  assert.equal(titled({ longName: "electric energy density" }), "Volumes");
  assert.equal(
    titled({ standardName: "cloud_area_fraction_in_atmosphere_layer" }),
    "Clouds and volumes",
  );
  assert.equal(
    isCloud(field("scalar", { standardName: "mass_fraction_of_cloud_ice_in_air" })),
    true,
  );
  assert.equal(isCloud(field("scalar", { name: "temperature" })), false);
});
