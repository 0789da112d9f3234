// Quality requested and displayed by the page: choices of the server do not become the user's, and
// a removed setting takes effect at once.
import assert from "node:assert/strict";
import { test } from "node:test";
import { controlStates, hasErrorLimit, qualityHint } from "../src/panels/controls";
import { hashOfView, viewOfHash } from "../src/view/link";
import type { View } from "@windsplat/client";
import { described, Page } from "./page";

function shown(): Page {
  const page = new Page([described("storm")]);
  page.opened(described("storm"));
  page.draws({ view: { method: { name: "slab", slabThickness: 1 } } });
  return page;
}

test("the method of a moving frame does not change the view", () => {
  const page = shown();
  page.app.change({ camera: { fovY: 40 } });
  page.draws({ final: false, view: { method: { name: "kernel", slabThickness: 4 } } });
  assert.deepEqual(page.app.view().method, { name: "slab", slabThickness: 1 });
  page.app.change({ method: { name: "kernel" } });
  assert.equal(page.app.view().method?.name, "kernel", "an explicit choice changes the view");
  page.app.change({ method: { name: null } });
  page.draws({ view: { method: { name: "slab", slabThickness: 2 } } });
  assert.deepEqual(
    page.app.view().method,
    { name: "slab", slabThickness: 2 },
    "a final frame sets the default",
  );
});

test("quality shows the requested values regardless of older frames", () => {
  const page = shown();
  page.app.change({ quality: { maxError: 0.01, lossless: true } });
  page.draws({ view: { quality: { budgetMs: null, maxError: 0.01, lossless: true } } });
  assert.deepEqual(page.app.view().quality, { maxError: 0.01, lossless: true });
  page.app.change({ quality: { maxError: null } });
  assert.equal(hasErrorLimit(page.app.view()), false, "takes effect before the next frame");
  const [patch] = page.sent("patch").slice(-1);
  assert.deepEqual(patch!.patch, { quality: { maxError: null } });
});

test("the link keeps the quality, and the limit control appears only with a limit", () => {
  const view: View = { quality: { budgetMs: 66, maxError: 0.002, lossless: true } };
  assert.deepEqual(viewOfHash(hashOfView(view)), view);
  assert.equal(controlStates(view).errorLimit, true);
  assert.equal(controlStates({ quality: { maxError: null } }).errorLimit, false);
  assert.equal(controlStates({}).errorLimit, false);
  assert.notEqual(qualityHint(view), qualityHint({}));
});

test("a frame is acknowledged when decoded, before and without display", () => {
  const page = shown();
  page.app.acknowledge(7, 2.5);
  assert.deepEqual(page.sent("ack").at(-1), { type: "ack", seq: 7, decodeMs: 2.5 });
  const before = page.sent("ack").length;
  page.draws();
  assert.equal(page.sent("ack").length, before, "no second acknowledgement when shown");
});

test("the server is notified when the page is hidden or shown", () => {
  const page = shown();
  page.hide(true);
  assert.deepEqual(page.sent("visibility").at(-1), { type: "visibility", hidden: true });
  page.hide(false);
  assert.deepEqual(page.sent("visibility").at(-1), { type: "visibility", hidden: false });
});

test("a new session is sent the whole view in one patch", () => {
  const page = shown();
  page.app.change({ camera: { fovY: 50 }, quality: { maxError: 0.003 } });
  page.app.change({ vector: { length: 0.2 } });
  page.again();
  const patches = page.sent("patch");
  assert.equal(patches.length, 1);
  const { dataset, camera, quality, vector } = patches[0]!.patch as View;
  assert.equal(dataset, "storm");
  assert.deepEqual([camera, quality, vector], [{ fovY: 50 }, { maxError: 0.003 }, { length: 0.2 }]);
  assert.equal(page.sent("open").length, 1);
  assert.deepEqual(page.sent("visibility"), [], "sessions are visible by default");
});

test("a new session is told that the page is hidden", () => {
  const page = shown();
  page.hide(true);
  page.again();
  assert.deepEqual(page.sent("visibility"), [{ type: "visibility", hidden: true }]);
});

test("a camera patch waits for earlier unsent patches", () => {
  const page = shown();
  assert.equal(page.app.cameras.ready(), true);
  page.holdUp(100_000);
  assert.equal(page.app.cameras.ready(), false);
  page.holdUp(0);
  assert.equal(page.app.cameras.ready(), true);
});
