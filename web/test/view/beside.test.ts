// The second picture: its view, its place in the address, and what can be compared.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  besideOf,
  besideSuffix,
  besideView,
  ownSettings,
  swapped,
  takeBeside,
  withOwnSettings,
} from "../../src/view/beside";
import { hashOfView, viewOfHash } from "../../src/view/link";
import { otherDatasets } from "../../src/view/others";
import type { Dataset, View } from "@windsplat/client";

const first: View = {
  dataset: "a",
  step: 3,
  camera: { eye: [0, -4, 1], target: [0, 0, 0] },
  image: { width: 640, height: 480, background: "#102030" },
  quality: { budgetMs: 20 },
  vector: { magnitudeRange: [0, 30], color: { range: [5, 30] } },
  scalars: [{ field: "t", color: { range: [-2, 2] } }],
};

test("the second picture has the camera and ranges of the first, and its own place", () => {
  const view = besideView(first, { step: 0 }, [300, 200]);
  assert.deepEqual(view, {
    ...{ dataset: "a", step: 0, camera: first.camera, vector: first.vector },
    scalars: first.scalars,
    image: { width: 300, height: 200, background: "#102030" },
  });
  assert.equal(besideView(first, { dataset: "b" }, [8, 8]).step, 3, "the step follows");
  assert.equal(besideView(first, { dataset: "b" }, [8, 8]).dataset, "b");
});

test("settings of its own stay, except for the camera", () => {
  const own: View = { ...first, camera: {}, vector: { opacity: 0.3 } };
  const view = besideView(first, {}, [8, 8], own);
  assert.deepEqual(view.vector, { opacity: 0.3 });
  assert.deepEqual(view.camera, first.camera);
});

test("swapped pictures keep the background and gain no defaults", () => {
  const own = null;
  assert.deepEqual(swapped({ explicit: first, first, beside: { dataset: "b", step: 0 }, own }), [
    { ...first, dataset: "b", step: 0, image: { background: "#102030" } },
    { dataset: "a", step: 3 },
    null,
  ]);
  const plain = { dataset: "a", image: { width: 8, height: 8 } };
  assert.deepEqual(swapped({ explicit: plain, first, beside: { step: 2 }, own }), [
    { dataset: "a", step: 2 },
    { step: 0 },
    null,
  ]);
});

test("swapped twice, pictures with settings and cameras of their own are as they were", () => {
  const own: View = { image: { background: "#000000" }, vector: { opacity: 0.3 } };
  const beside = { step: 1, camera: { eye: [4, 0, 0], target: [0, 0, 0] } } as const;
  const before = { explicit: first, first, beside: { ...beside } as never, own };
  const [view, second, settings] = swapped(before);
  assert.deepEqual(view.camera, beside.camera);
  assert.deepEqual(view.vector, own.vector);
  assert.deepEqual(second, { step: 3, camera: first.camera });
  assert.deepEqual(settings!.vector, first.vector);
  const [again, last, back] = swapped({
    ...{ explicit: view, first: view, beside: second, own: settings },
  });
  assert.deepEqual(again, { ...first, image: { background: "#102030" } });
  assert.deepEqual(last, beside);
  assert.deepEqual(back, own);
});

test("a camera of its own stays whatever the first picture does", () => {
  const camera: View["camera"] = { eye: [4, 0, 0], target: [0, 0, 0] };
  const view = besideView({ ...first, camera: { eye: [9, 9, 9] } }, { camera }, [8, 8]);
  assert.deepEqual(view.camera, camera);
  assert.deepEqual(view.vector, first.vector);
});

test("settings of its own are kept as what departs from the first picture", () => {
  const { dataset: _, step: _step, camera: _camera, quality: _quality, ...settings } = first;
  const own: View = {
    ...settings,
    image: { background: "#102030" },
    vector: { magnitudeRange: [0, 30], field: null, color: { range: [5, 20] } },
    scalars: [],
  };
  const kept = ownSettings({ ...first, surfaces: null } as never, own);
  assert.deepEqual(kept, { vector: { field: null, color: { range: [5, 20] } }, scalars: [] });
  assert.deepEqual(withOwnSettings(first, kept), own);
  assert.deepEqual(ownSettings(first, first), {});
});

test("the address keeps the second picture behind any view", () => {
  for (const beside of [
    {},
    { step: 0 },
    { dataset: "a&b=1, number=3", step: 7 },
    { settings: {}, camera: { eye: [1, 2, 3] as [number, number, number] } },
    { settings: { vector: { field: null, opacity: 0.4 }, scalars: [] } },
  ]) {
    const [rest, kept] = takeBeside(hashOfView({ dataset: "x&beside=" }) + besideSuffix(beside));
    assert.deepEqual(kept, beside);
    assert.deepEqual(viewOfHash(rest), { dataset: "x&beside=" });
  }
  assert.deepEqual(takeBeside("#!view=abc" + besideSuffix({ step: 1 })), [
    "#!view=abc",
    { step: 1 },
  ]);
  assert.deepEqual(takeBeside(hashOfView(first))[1], null);
  assert.equal(besideSuffix(null), "");
});

test("what is no second picture in an address is left out", () => {
  assert.deepEqual(takeBeside("#!{}&beside=%7B"), ["#!{}", null]);
  assert.deepEqual(takeBeside("#!{}&beside=3"), ["#!{}", null]);
  assert.deepEqual(takeBeside('#!{}&beside={"step":-1,"dataset":7}'), ["#!{}", {}]);
  assert.deepEqual(besideOf({ settings: { vector: 3 }, camera: { eye: [1] } }), {});
  assert.deepEqual(besideOf({ settings: [], camera: "north" }), {});
});

test("other datasets and other members can be compared", () => {
  const listed = [
    { id: "e", title: "Ensemble", state: "ready" },
    { id: "w", title: "", state: "ready" },
    { id: "lost", title: "", state: "failed" },
  ] as const;
  const open = {
    id: "e,number=5",
    choices: [{ name: "number", length: 3, values: ["0", "2", "5"], chosen: "5" }],
  } as unknown as Dataset;
  assert.deepEqual(
    [...otherDatasets(open, listed as never)],
    [
      ["e,number=0", "number 0"],
      ["e,number=2", "number 2"],
      ["e", "Ensemble"],
      ["w", "w"],
    ],
  );
});
