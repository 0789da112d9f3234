// The legend of lines.
import assert from "node:assert/strict";
import { test } from "node:test";
import { legendEntries } from "../../src/view/legend_entries";
import { described } from "../page";

test("the legend names the end of a line that is ahead", () => {
  const note = (lines: object) =>
    legendEntries(described("gcm"), {
      vector: { field: "wind", magnitudeRange: [0, 60], ...lines },
      scalars: [],
    })[0]!.note;
  const white = { headDesaturation: 0.7 };
  assert.match(note(white), /, white end ahead$/);
  assert.match(note({ ...white, mark: { shape: "taper" } }), /, pointed end ahead$/);
  assert.match(note({ ...white, mark: { shape: "comet" } }), /, bright end ahead$/);
  assert.doesNotMatch(note({ ...white, mark: { shape: "arrow" } }), /ahead/);
  assert.match(note({ headDesaturation: 0, mark: { tailDarkening: 0.5 } }), /, bright end ahead$/);
});
