// Formats of saved pictures: their size in print, what the server is asked for, and the legend of
// documents.
import assert from "node:assert/strict";
import { test } from "node:test";
import { exportSize, millimetres, scaleOf } from "../../src/save/export_views";
import { withJpegDensity } from "../../src/save/jpeg_density";
import { withServerLegend } from "../../src/save/picture_formats";
import { drawFrame } from "@windsplat/client/parts";
import { server } from "../server";

// The marker segments of a JPEG up to its scan, by the structure in ITU-T T.81, annex B.
function segments(jpeg: Uint8Array): [marker: number, content: number[]][] {
  const out: [number, number[]][] = [];
  assert.deepEqual([...jpeg.subarray(0, 2)], [0xff, 0xd8]);
  for (let at = 2; at < jpeg.length;) {
    assert.equal(jpeg[at], 0xff);
    const length = (jpeg[at + 2]! << 8) | jpeg[at + 3]!;
    out.push([jpeg[at + 1]!, [...jpeg.subarray(at + 4, at + 2 + length)]]);
    at += 2 + length;
  }
  return out;
}

const name = [0x4a, 0x46, 0x49, 0x46, 0]; // "JFIF"
const quantisation = [0xff, 0xdb, 0, 4, 7, 7];

test("a JPEG tells its dots per inch, whether it had a JFIF header or not", () => {
  const header = [0xff, 0xe0, 0, 16, ...name, 1, 1, 0, 0, 1, 0, 1, 0, 0];
  for (const [given, version] of [
    [[0xff, 0xd8, ...header, ...quantisation], 1],
    [[0xff, 0xd8, ...quantisation], 2],
  ] as const) {
    // 600 = 2 * 256 + 88
    assert.deepEqual(segments(withJpegDensity(new Uint8Array(given), 600)), [
      [0xe0, [...name, 1, version, 1, 2, 88, 2, 88, 0, 0]],
      [0xdb, [7, 7]],
    ]);
  }
  assert.throws(() => withJpegDensity(new Uint8Array([0x89, 0x50]), 300), /not a JPEG/);
});

test("a width in millimetres at a number of dots per inch is so many pixels", () => {
  // 170 mm are 6.693 inches, at 300 dots to the inch 2007.9 pixels
  const scale = scaleOf(170, "mm", 300, 900);
  assert.deepEqual(exportSize(900, 600, scale, 1e8), { width: 2008, height: 1338, scale });
  assert.equal(exportSize(907, 613, scaleOf(1200, "px", 300, 907), 1e8).width, 1200);
  assert.ok(Math.abs(millimetres(2008, 300) - 170.01) < 0.01);
});

test("a document has a legend, title and time unless its view leaves them out", () => {
  assert.deepEqual(withServerLegend({ dataset: "x" }), {
    dataset: "x",
    annotations: { title: true, stepTime: true, legend: true },
  });
  const annotations = { title: false, box: true, legend: false };
  assert.deepEqual(withServerLegend({ annotations }).annotations, {
    title: false,
    stepTime: true,
    box: true,
    legend: true,
  });
});

test("a document is asked for with its type and dots per inch", async () => {
  const { asked, fetch } = server(() => new Response("%PDF-"));
  const never = new AbortController().signal;
  const type = "application/pdf";
  await drawFrame(fetch, "http://host/a/", { dataset: "x" }, never, { type, dotsPerInch: 150 });
  assert.equal(asked[0]!.url, "http://host/a/v1/frames?dpi=150");
  assert.equal((asked[0]!.options.headers as Record<string, string>).Accept, type);
});
