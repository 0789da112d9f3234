// What a pixel of the picture shows: its position and text, and the requests that ask for it.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Api, type Feature, type Dataset, type View } from "@windsplat/client";
import { featureLines, ringAt, sampleOf } from "../src/view/feature";
import { pixelAt } from "@windsplat/client/parts";

const axis = (name: string, units: string) => ({ name, units });
const grid = {
  axes: {
    x: axis("lon", "degrees_east"),
    y: axis("lat", "degrees_north"),
    z: axis("lev", "hPa"),
  },
} as unknown as Dataset;
const view = { dataset: "climate", image: { width: 640, height: 400 } } as View;
const feature: Feature = {
  layer: "lines",
  field: "wind",
  value: 57.2512,
  depth: 3,
  units: "m s-1",
  position: {
    x: -23.5,
    y: 41,
    z: 250,
    units: { x: "degrees_east", y: "degrees_north", z: "hPa" },
    index: { x: 5, y: 3, z: 2 },
  },
  share: 0.8,
  at: [320, 100],
};

test("a position on the picture is the middle of its pixel, also at the edges", () => {
  assert.deepEqual(pixelAt(view, [0.5, 0.25]), [320.5, 100.5]);
  assert.deepEqual(pixelAt(view, [0, 0]), [0.5, 0.5]);
  assert.deepEqual(pixelAt(view, [1, 1]), [639.5, 399.5]);
  assert.deepEqual(pixelAt({} as View, [0.5, 0.5]), [640.5, 360.5]);
});

test("the ring is where the sample is, if that is in the picture", () => {
  assert.deepEqual(ringAt(view, feature), [0.5, 0.25]);
  assert.equal(ringAt(view, { ...feature, at: [-3, 100] }), null);
  assert.deepEqual(sampleOf(feature.position), [5, 3, 2]);
});

test("the text has value, unit and place, and the share where it is small", () => {
  assert.deepEqual(featureLines(grid, feature), [
    "wind 57.25 m s⁻¹",
    "23.5 °W, 41 °N, level 250 hPa",
  ]);
  const thin = { ...feature, field: "cloud", value: 0.25, units: "1", share: 0.034 };
  assert.equal(featureLines(grid, thin)[0], "cloud 0.25 · 3.4 % of this point");
  const section: Feature = { ...feature, layer: "surface", field: "ta", value: 251.2, units: "K" };
  assert.equal(featureLines(grid, section)[0], "ta 251.2 K");
  assert.equal(featureLines(grid, { ...section, value: null })[0], "ta masked");
});

test("a pick posts the view with the pixel; null is an answer, anything else none", async () => {
  const asked: { url: string; body: unknown }[] = [];
  let answer: unknown = { feature: null };
  const api = new Api("http://x/w/", async (url, init) => {
    asked.push({ url, body: JSON.parse(String(init?.body)) });
    return { ok: true, status: 200, json: async () => answer, blob: async () => new Blob() };
  });
  assert.equal(await api.pick(view, [320.5, 100.5]), null);
  assert.deepEqual(asked, [{ url: "http://x/w/v1/picks?x=320.5&y=100.5", body: view }]);
  answer = { feature };
  assert.deepEqual(await api.pick(view, [1, 1]), feature);
  answer = { features: [] };
  await assert.rejects(api.pick(view, [1, 1]), /could not be understood/);
});
