import assert from "node:assert/strict";
import test from "node:test";
import { embeddedKeys, isEmbedded } from "../../src/app/embed";

test("the embedded view is asked for by a parameter of the address", () => {
  for (const search of ["?embed", "?embed=1", "?from=mail&embed"]) {
    assert.equal(isEmbedded(search), true, search);
  }
  for (const search of ["", "?", "?embedded", "?view=embed"]) {
    assert.equal(isEmbedded(search), false, search);
  }
});

test("keys of the camera and of time stay, those that open other parts go", () => {
  const keys = [["ArrowLeft"], ["+", "="], [" "], ["Mod+z"], ["s"], ["d"], ["c"], ["?"], ["p"]];
  const bindings = keys.map((names) => ({ keys: names, shown: "", does: "", run: () => {} }));
  const kept = embeddedKeys(bindings).map((binding) => binding.keys[0]);
  assert.deepEqual(kept, ["ArrowLeft", "+", " ", "Mod+z"]);
});
