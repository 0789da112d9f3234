// The second picture: its view, its place in the address, and what can be compared.
import assert from "node:assert/strict";
import { test } from "node:test";
import { besideSuffix, besideView, swapped, takeBeside } from "../../src/view/beside";
import { hashOfView, viewOfHash } from "../../src/view/link";
import { otherDatasets } from "../../src/view/others";
import type { Dataset, View } from "../../src/wire/protocol";

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
  assert.deepEqual(swapped(first, { dataset: "b", step: 0 }), [
    { ...first, dataset: "b", step: 0, image: { background: "#102030" } },
    { dataset: "a", step: 3 },
  ]);
  const plain = { dataset: "a", image: { width: 8, height: 8 } };
  assert.deepEqual(swapped(plain, { step: 2 }), [{ dataset: "a", step: 2 }, { step: 0 }]);
});

test("the address keeps the second picture behind any view", () => {
  for (const beside of [{}, { step: 0 }, { dataset: "a&b=1, number=3", step: 7 }]) {
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
