// Merge patches, and the view after patches are accepted, refused or replaced.
import assert from "node:assert/strict";
import { test } from "node:test";
import type { View } from "@windsplat/client";
import {
  completeView,
  mergePatch,
  mergeView,
  ViewState,
  withDefaults,
  type Patch,
} from "@windsplat/client/parts";

test("merge patches follow RFC 7396", () => {
  const rows: [unknown, unknown, unknown][] = [
    [{ a: "b" }, { a: "c" }, { a: "c" }],
    [{ a: "b" }, { b: "c" }, { a: "b", b: "c" }],
    [{ a: "b" }, { a: null }, {}],
    [{ a: "b", b: "c" }, { a: null }, { b: "c" }],
    [{ a: ["b"] }, { a: "c" }, { a: "c" }],
    [{ a: "c" }, { a: ["b"] }, { a: ["b"] }],
    [{ a: { b: "c" } }, { a: { b: "d", c: null } }, { a: { b: "d" } }],
    [{ a: [{ b: "c" }] }, { a: [1] }, { a: [1] }],
    [{ e: null }, { a: 1 }, { e: null, a: 1 }],
    [[1, 2], { a: "b", c: null }, { a: "b" }],
    [{}, { a: { bb: { ccc: null } } }, { a: { bb: {} } }],
    [{ a: "foo" }, "bar", "bar"],
  ];
  for (const [target, patch, result] of rows) assert.deepEqual(mergePatch(target, patch), result);
});

test("null at /vector/field is a value, elsewhere it removes", () => {
  const view = { vector: { field: "wind", length: 1 } };
  assert.deepEqual(mergeView(view, { vector: { field: null, length: null } }), {
    vector: { field: null },
  });
  assert.deepEqual(
    mergePatch({ other: { vector: { field: 1 } } }, { other: { vector: { field: null } } }),
    { other: { vector: {} } },
  );
});

test("merging modifies neither argument and no prototype", () => {
  const target = { a: { b: 1 } };
  const patch = JSON.parse('{"a": {"c": 2}, "__proto__": {"polluted": true}}') as Patch;
  const merged = mergePatch(target, patch) as Patch;
  assert.deepEqual(target, { a: { b: 1 } });
  assert.deepEqual(merged, { a: { b: 1, c: 2 } });
  assert.equal((merged as { polluted?: boolean }).polluted, undefined);
  assert.equal(({} as { polluted?: boolean }).polluted, undefined);
});

test("explicit values override defaults, and arrays are replaced whole", () => {
  const defaults = { camera: { fovY: 35, eye: [0, 0, 1] }, scalars: [{ field: "cloud" }], step: 0 };
  const said = { camera: { eye: [1, 2, 3] }, scalars: [] };
  assert.deepEqual(withDefaults(defaults, said), {
    camera: { fovY: 35, eye: [1, 2, 3] },
    scalars: [],
    step: 0,
  });
  assert.deepEqual(withDefaults({ vector: { field: "wind" } }, { vector: { field: null } }), {
    vector: { field: null },
  });
});

test("a refused patch is reverted and the others remain", () => {
  const state = new ViewState();
  state.change({ dataset: "climate" });
  state.settle(1);
  state.change({ vector: { length: 0.1 } });
  const bad = state.change({ vector: { length: 0.2, stride: 9999 } });
  state.change({ step: 3 });
  assert.equal(state.document.vector?.stride, 9999);
  assert.equal(state.refuse(bad.rev), true);
  assert.deepEqual(state.document, { dataset: "climate", vector: { length: 0.1 }, step: 3 });
  assert.equal(state.refuse(bad.rev), false);
  state.settle(4);
  assert.deepEqual(state.document, { dataset: "climate", vector: { length: 0.1 }, step: 3 });
  assert.equal(state.refuse(4), false, "a patch confirmed by a frame cannot be refused");
});

test("revisions grow by one and are never used twice", () => {
  const state = new ViewState();
  const revs = [
    state.change({ step: 1 }),
    state.change({ step: 2 }),
    ...state.replace({ step: 5 }),
    state.restate(),
  ].map((outgoing) => outgoing.rev);
  assert.deepEqual(
    revs,
    revs.map((_, n) => n + 1),
  );
  assert.equal(state.rev, revs.length);
  state.settle(3);
  const refused = state.change({ step: -1 });
  state.refuse(refused.rev);
  assert.equal(state.rev, revs.length, "the view before the refused patch is requested");
  assert.equal(state.change({ step: 1 }).rev, refused.rev + 1);
});

test("a new session is sent the whole view in one patch", () => {
  const state = new ViewState();
  state.change({ dataset: "climate", camera: { fovY: 20 } });
  state.settle(1);
  state.change({ step: 7 });
  const { patch } = state.restate();
  assert.deepEqual(mergeView({}, patch), state.document);
  assert.deepEqual(state.document, { dataset: "climate", camera: { fovY: 20 }, step: 7 });
});

test("playback moves the step without a patch", () => {
  const state = new ViewState();
  state.change({ dataset: "climate", step: 2 });
  state.settle(1);
  const { rev } = state;
  state.follow(3);
  assert.equal(state.document.step, 3);
  assert.equal(state.rev, rev);
});

test("without answers pending patches stay bounded and the view correct", () => {
  const state = new ViewState();
  for (let step = 0; step < 1000; step++) state.change({ step });
  assert.equal(state.document.step, 999);
  assert.equal(state.refuse(1), false, "the oldest patches count as accepted");
});

// Small random views with the cases that complicate replacement: added and removed keys, values
// that become objects, and /vector/field.
function randomView(random: () => number): View {
  const pick = <T>(...choices: T[]): T => choices[Math.floor(random() * choices.length)]!;
  const view: View = { dataset: pick("climate", "tornado") };
  if (random() < 0.5) view.step = Math.floor(random() * 5);
  if (random() < 0.6)
    view.camera = { eye: [random(), 1, 2], ...(random() < 0.5 ? { fovY: 20 } : {}) };
  if (random() < 0.7) {
    view.vector = {};
    if (random() < 0.6) view.vector.field = pick(null, "wind", "flow");
    if (random() < 0.5) view.vector.length = random();
    if (random() < 0.5) view.vector.color = random() < 0.5 ? { by: "rise" } : { map: "magma" };
  }
  if (random() < 0.5) view.scalars = pick<View["scalars"]>([], [{ field: "cloud" }]);
  return view;
}

test("replacement transforms any view into any other", () => {
  let seed = 7;
  const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
  for (let n = 0; n < 500; n++) {
    const before = randomView(random);
    const after = randomView(random);
    const state = new ViewState();
    state.change(before as Patch);
    const patches = state.replace(after).map((outgoing) => outgoing.patch);
    assert.deepEqual(state.document, after);
    for (const known of [before, {}, { dataset: after.dataset }]) {
      const reached = patches.reduce<View>((view, patch) => mergeView(view, patch), known);
      assert.deepEqual(reached, after, JSON.stringify({ before, after, known }));
    }
  }
});

test("colours of a surface are completed while it shows the same fields", () => {
  const slice = { axis: "z", index: 3 } as const;
  const drawn: View = {
    surfaces: [
      {
        field: "cloud",
        isovalue: 0.5,
        slice: null,
        plane: null,
        color: { field: null, map: "magma", range: [0, 1], constant: "#d8d8d8" },
      },
    ],
  };
  const complete = (surface: NonNullable<View["surfaces"]>[number]) =>
    completeView(drawn, { surfaces: [surface] }).surfaces![0]!.color;
  assert.deepEqual(complete({ field: "cloud", isovalue: 0.7 })?.range, [0, 1]);
  const unset = { range: null };
  assert.deepEqual(complete({ field: "cloud", isovalue: 0.7, color: unset })?.range, [0, 1]);
  assert.deepEqual(complete({ field: "cloud", isovalue: 0.7, color: { range: [2, 3] } }), {
    ...drawn.surfaces![0]!.color,
    range: [2, 3],
  });
  assert.equal(complete({ field: "cloud", slice }), undefined, "a section");
  assert.equal(complete({ field: "wet", isovalue: 0.7 }), undefined, "another field");
  const other = { field: "wet", range: null };
  assert.deepEqual(complete({ field: "cloud", isovalue: 0.7, color: other }), other);
});
