// The page's text for frames: errors, sizes and states from the bytes of their headers, and the
// position of a picture on the canvas.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { errorMetric, errorWord, toggleErrorMetric } from "../src/base/error_text";
import {
  encodingLabel,
  errorLabel,
  FrameRate,
  networkMs,
  markText,
  scaleText,
} from "../src/viewport/frame_text";
import { frameState, pictureRect } from "@windsplat/client/parts";
import { parseFrameHeader, type FrameHeader } from "@windsplat/client";

interface Change {
  flags?: number;
  codec?: number;
  error?: number;
  jpegError?: number;
  rev?: number;
  step?: number;
}

const vectors = JSON.parse(
  readFileSync("../protocol/vectors/valid/frame_headers.json", "utf8"),
) as { hex: string }[];

// The first valid vector, with the changes given by the test.
function header(change: Change = {}): FrameHeader {
  const bytes = Uint8Array.from(Buffer.from(vectors[0]!.hex.replaceAll(" ", ""), "hex"));
  const data = new DataView(bytes.buffer);
  const u32 = { rev: 12, step: 16, flags: 20 } as const;
  for (const [key, at] of Object.entries(u32)) {
    const value = change[key as keyof typeof u32];
    if (value !== undefined) data.setUint32(at, value, true);
  }
  if (change.codec !== undefined) data.setUint8(28, change.codec);
  if (change.error !== undefined) data.setFloat32(32, change.error, true);
  if (change.jpegError !== undefined) data.setFloat32(36, change.jpegError, true);
  return parseFrameHeader(bytes);
}

test("an error is shown with its kind: bit 4 estimated, bit 2 measured", () => {
  const text = (change: Change) => errorLabel(header(change)).text;
  assert.equal(text({ flags: 4, error: 0.011 }), "error 0.011 est.");
  assert.equal(text({ flags: 2, error: 3.2e-4 }), "error 3.2e-4 measured");
  assert.equal(text({ flags: 3, error: 0.5 }), "error 0.5 measured", "of a final frame");
  assert.equal(
    text({ flags: 6, error: 0.5 }),
    "error 0.5 measured",
    "measured takes precedence over estimated",
  );
  assert.equal(text({ flags: 2, error: 0 }), "error 0 measured");
  const said = new Set([
    errorLabel(header({ flags: 4 })).title,
    errorLabel(header({ flags: 2 })).title,
    errorLabel(header({ flags: 0, error: NaN })).title,
  ]);
  assert.equal(said.size, 3, "each kind has its own explanation");
  for (const title of said) assert.match(title, /root mean square/);
});

test("an error above the view's limit is shown with the limit", () => {
  const moving = header({ flags: 4, error: 0.045 });
  assert.equal(errorLabel(moving, 0.01).text, "error 0.045 est., above 0.01");
  assert.match(errorLabel(moving, 0.01).title, /exceeds the limit of the view/);
  for (const limit of [0.045, 0.1, null]) {
    assert.equal(errorLabel(moving, limit).text, "error 0.045 est.");
  }
});

test("an error is also shown in dB, with the limit below it", () => {
  const text = (change: Change, limit: number | null = null) =>
    errorLabel(header({ flags: 4, ...change }), limit, "psnr").text;
  assert.equal(text({ error: 0.1 }), "PSNR 20.0 dB est.");
  assert.equal(text({ error: 1e-4 }), "PSNR 80.0 dB est.");
  assert.equal(text({ error: 0.5, flags: 2 }), "PSNR 6.0 dB measured");
  assert.equal(text({ error: 0, flags: 2 }), "PSNR ∞ dB measured");
  assert.equal(text({ error: 0.1 }, 0.01), "PSNR 20.0 dB est., below 40.0 dB");
  assert.equal(text({ error: NaN }), "error unknown");
  assert.equal(encodingLabel(header({ jpegError: 0.01 }), "psnr").text, "JPEG 40.0 dB");
});

// The slope of sRGB's curve at middle grey gives the light of one of 255 steps.
test("an error has a word: below one step of grey, below five, or more", () => {
  const light = (code: number) => ((code / 255 + 0.055) / 1.055) ** 2.4;
  const step = light(128) - light(127);
  assert.equal(errorWord(0), "indistinguishable");
  assert.equal(errorWord(0.98 * step), "indistinguishable");
  assert.equal(errorWord(1.02 * step), "slight");
  assert.equal(errorWord(4.9 * step), "slight");
  assert.equal(errorWord(5.1 * step), "visible");
  assert.equal(errorWord(1), "visible");
  assert.equal(errorWord(NaN), "");
});

test("the error metric applies to the page and notifies subscribers", () => {
  const metrics: string[] = [];
  errorMetric.watch((metric) => metrics.push(metric));
  toggleErrorMetric();
  errorMetric.set("psnr"); // the same value again
  toggleErrorMetric();
  assert.deepEqual(metrics, ["psnr", "rmse"]);
});

test("an error without number or kind is unknown", () => {
  for (const change of [
    { flags: 4, error: NaN },
    { flags: 2, error: NaN },
    { flags: 2, error: Infinity },
    { flags: 0, error: NaN },
    { flags: 9, error: 0.25 },
  ]) {
    assert.equal(errorLabel(header(change)).text, "error unknown", JSON.stringify(change));
  }
});

test("the encoding error is separate, and a PNG has none", () => {
  assert.equal(encodingLabel(header({ jpegError: 4.1e-3 })).text, "JPEG 0.0041");
  assert.equal(encodingLabel(header({ jpegError: NaN })).text, "", "an unknown error has no text");
  assert.equal(encodingLabel(header({ codec: 2, jpegError: NaN })).text, "PNG lossless");
});

test("frame size is shown as full, half or a percentage", () => {
  assert.equal(scaleText(1280, 1280), "");
  assert.equal(scaleText(2000, 1280), "");
  assert.equal(scaleText(640, 1280), "1/2");
  for (const odd of [320, 319]) assert.equal(scaleText(odd, 1279), "1/4", "rounded up or down");
  assert.equal(scaleText(896, 1280), "70 %");
  assert.equal(scaleText(1, 1280), "1 %", "at least 1 %");
  // A size is no progress.
  assert.equal(markText("moving", "35 %"), "preview, 35 % size");
  assert.equal(markText("refining", "1/2"), "refining, 1/2 size");
  assert.equal(markText("moving", ""), "moving");
  assert.equal(markText("final", "1/2"), "final");
  assert.equal(markText("offline", "1/2"), "offline");
});

test("a frame refines when it shows a displayed view and is not final", () => {
  const moving = header({ flags: 0, rev: 5, step: 3 });
  assert.equal(frameState(moving, null), "moving");
  assert.equal(frameState(moving, header({ flags: 0, rev: 4, step: 3 })), "moving");
  assert.equal(frameState(moving, header({ flags: 0, rev: 5, step: 2 })), "moving", "another step");
  const again = header({ flags: 2, rev: 5, step: 3 });
  assert.equal(frameState(again, moving), "refining");
  assert.equal(frameState(again, again), "refining");
  assert.equal(frameState(header({ flags: 3, rev: 5, step: 3 }), again), "final");
  // Files changed under a finished picture: the next picture may be worse than the previous one.
  assert.equal(frameState(moving, header({ flags: 1, rev: 5, step: 3 })), "moving");
});

test("pictures fill a canvas of their aspect ratio, others are letterboxed", () => {
  const canvas = { width: 1280, height: 720 };
  const all = [0, 0, 1280, 720];
  for (const share of [1, 0.9, 0.77, 0.5, 0.31, 0.125, 0.03]) {
    const width = Math.max(1, Math.ceil(1280 * share));
    const height = Math.max(1, Math.ceil(720 * share));
    assert.deepEqual(pictureRect(canvas, { width, height }), all, `${width} x ${height}`);
  }
  assert.deepEqual(
    pictureRect(canvas, { width: 20, height: 12 }),
    all,
    "rounding is not another aspect ratio",
  );
  assert.deepEqual(pictureRect(canvas, { width: 360, height: 360 }), [280, 0, 720, 720]);
  assert.deepEqual(pictureRect(canvas, { width: 1280, height: 360 }), [0, 180, 1280, 360]);
});

test("network time excludes server times and is measured once per patch", () => {
  const sent = { t: 1000, queueUs: 1000, renderUs: 20_000, encodeUs: 4000 } as FrameHeader;
  assert.equal(networkMs(sent, 1040, 0), 15);
  assert.equal(networkMs(sent, 1040, 1000), null);
  assert.equal(networkMs(sent, 1010, 0), 0, "never negative");
});

test("the rates count the frames and bytes of the last second", () => {
  const rate = new FrameRate();
  for (let now = 0; now < 2000; now += 100) rate.add(now, 50);
  assert.deepEqual(rate.value(1950), { fps: 10, bytes: 500 });
  assert.deepEqual(rate.value(9000), { fps: 0, bytes: 0 });
});
