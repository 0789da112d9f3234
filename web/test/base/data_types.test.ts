// The client's types of uploads and values have the keys of the schema, neither more nor less: a
// sample that TypeScript accepts is one that the schema accepts, and the schema knows no other key.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { Ajv2020 } from "ajv/dist/2020.js";
import type { Upload, Values, ValuesAxis } from "@windsplat/client";

const axis: Required<ValuesAxis> = {
  ...{ name: "lon", units: "degrees_east", index: 3, stride: 2, count: 5, turn: 90 },
  ...{ first: 0, last: 16 },
};
const samples: {
  upload: Upload;
  valuesAxis: ValuesAxis;
  values: Omit<Required<Values>, "values">;
} = {
  upload: {
    ...{ id: "a.nc", bytes: 3, expires: "2026-01-01T14:00:00Z" },
    digest: `sha-256=:${"A".repeat(43)}=:`,
  },
  valuesAxis: axis,
  values: {
    ...{ field: "wind", step: 1, time: { value: 6, text: "6 h" }, units: "m s-1" },
    ...{ componentUnits: ["m s-1", "Pa s-1"], dims: ["component", "x"], shape: [2, 5] },
    axes: { x: axis, y: axis, z: axis },
  },
};
const ofJsonOnly = ["coordinates", "longitudes", "latitudes"]; // of values.json

test("the types of uploads and values are those of the schema", () => {
  const schemas = ["messages", "view"].map((name): Record<string, any> =>
    JSON.parse(readFileSync(`../protocol/${name}.schema.json`, "utf8")),
  );
  const ajv = new Ajv2020({ schemas, strict: false });
  for (const [name, sample] of Object.entries(samples)) {
    assert.ok(ajv.validate(`messages.schema.json#/$defs/${name}`, sample), ajv.errorsText());
    const known = Object.keys(schemas[0]!.$defs[name].properties);
    const expected = known.filter((key) => !ofJsonOnly.includes(key));
    assert.deepEqual(Object.keys(sample).sort(), expected.sort(), name);
  }
});
