// The page's view between a change and its picture.
import assert from "node:assert/strict";
import { test } from "node:test";
import { ViewModel } from "@windsplat/client/parts";
import type { ChosenMessage, Dataset, View } from "@windsplat/client";

const defaults: View = {
  dataset: "a",
  camera: { eye: [0, -4, 1], target: [0, 0, 0] },
  geometry: { scale: [1, 1, 1] },
  vector: { field: "wind", length: 0.1, color: { range: [0, 30] } },
};

// A model whose last picture has these explicit keys, completed by the server.
function drawn(explicit: View, completed: View): ViewModel {
  const model = new ViewModel();
  model.open = { id: "a", defaultView: defaults } as unknown as Dataset;
  const { rev } = model.state.change(explicit as never);
  model.state.settle(rev);
  model.drew({ view: { ...defaults, ...completed } } as unknown as ChosenMessage, true);
  return model;
}

test("a region that undo removes is gone from the view before the next picture", () => {
  const region = { x: [10, 20], y: [-5, 5], where: [] } as unknown as View["region"];
  const model = drawn({ dataset: "a", region }, { region });
  model.state.replace({ dataset: "a" });
  assert.equal(model.view().region, undefined);
  assert.deepEqual(model.view().vector, defaults.vector);
});

test("so is one of its ranges, and what is set anew counts at once", () => {
  const region = { x: [10, 20], y: [-5, 5] } as unknown as View["region"];
  const model = drawn({ dataset: "a", region }, { region: { ...region, where: [] } as never });
  model.state.change({ region: { x: null, y: [0, 5] } });
  assert.deepEqual(model.view().region, { y: [0, 5], where: [] });
});

test("a removed value has that of the dataset's default view", () => {
  const scale: [number, number, number] = [1, 1, 9];
  const vector = { field: "wind", length: 0.5, color: { range: [0, 30] } } as View["vector"];
  const explicit: View = { dataset: "a", geometry: { scale }, vector: { length: 0.5 } };
  const model = drawn(explicit, { geometry: { scale }, vector });
  model.state.replace({ dataset: "a" });
  assert.deepEqual(model.view().geometry, defaults.geometry);
  assert.deepEqual(model.view().vector, defaults.vector);
});

test("values of another field, and a removed camera, are known with the next picture", () => {
  const eye: [number, number, number] = [9, 9, 9];
  const vector = { field: "sea", length: 0.5, color: { range: [1, 2] } } as View["vector"];
  const own = { field: "sea", color: { range: [1, 2] } } as View["vector"];
  const model = drawn({ dataset: "a", camera: { eye }, vector: own }, { camera: { eye }, vector });
  model.state.change({ camera: null, vector: { color: null } });
  assert.deepEqual(model.view().vector, vector);
  assert.deepEqual(model.view().camera!.eye, eye);
});
