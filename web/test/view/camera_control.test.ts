// The camera's patches: a camera that the server chose stays as it is when it is moved.
import assert from "node:assert/strict";
import { test } from "node:test";
import type { Camera, ChosenMessage, Dataset, View } from "@windsplat/client";
import { CameraControl, ViewModel, type Patch } from "@windsplat/client/parts";

const chosen: Camera = {
  projection: "orthographic",
  eye: [0, 0, 3],
  target: [0, 0, 0],
  up: [0, 1, 0],
  fovY: 35,
  height: 2,
};

// A control whose server has drawn that view with the chosen camera, and the patches that it sends.
function controlOf(explicit: View, camera: Camera): [CameraControl, Patch[]] {
  const model = new ViewModel();
  const sent: Patch[] = [];
  model.open = { id: "a", defaultView: {} } as Dataset;
  const { rev } = model.state.change({ dataset: "a", ...explicit });
  model.state.settle(rev);
  model.drew({ view: { dataset: "a", ...explicit, camera } } as ChosenMessage, true);
  const change = (patch: Patch): void => {
    sent.push(patch);
    model.state.change(patch);
  };
  const host = { change, size: (): [number, number] => [640, 360], ready: () => true };
  return [new CameraControl(model, host), sent];
}

test("a moved camera stays parallel where the server faced a slice in parallel", () => {
  const [control, sent] = controlOf({ geometry: { slice: { axis: "z", index: 2 } } }, chosen);
  control.setCamera({ ...chosen, target: [0.5, 0, 0], eye: [0.5, 0, 3] });
  assert.equal((sent[0]!.camera as Patch).projection, "orthographic");
  control.setCamera({ ...chosen, target: [0.6, 0, 0], eye: [0.6, 0, 3] });
  assert.equal((sent[1]!.camera as Patch).projection, undefined, "stated before");
});

test("the projection can be changed both ways, and is stated where it is not the default", () => {
  const [control, sent] = controlOf({}, { ...chosen, projection: "perspective" });
  const projections = [0, 1].map((n) => {
    control.toggleProjection();
    return (sent[n]!.camera as Patch).projection;
  });
  assert.deepEqual(projections, ["orthographic", "perspective"]);
});
