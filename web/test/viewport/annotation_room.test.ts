// The room that the page's overlays leave for annotations in the picture.
import assert from "node:assert/strict";
import { test } from "node:test";
import { annotationSize } from "../../src/viewport/annotation_room";

test("overlays leave room for the largest of the annotations beside them", () => {
  assert.equal(annotationSize(undefined), 1);
  assert.equal(annotationSize({ size: 1.5, boxStyle: { size: 3 } }), 1.5);
  assert.equal(annotationSize({ size: 1.5, titleStyle: { size: 2 } }), 3);
  assert.equal(annotationSize({ size: 3, titleStyle: { size: 2 } }), 4, "the server's limit");
});
