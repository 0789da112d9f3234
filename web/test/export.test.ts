// Export: text in PNG, ZIP files, sizes and views of pictures and animations, repeated requests.
// The formats are checked against their specifications and by python's own readers.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { getEventListeners } from "node:events";
import { test } from "node:test";
import { deflateSync } from "node:zlib";
import { anglesOf, distanceOf, type Camera, type View } from "@windsplat/client";
import {
  exportSize,
  frameCount,
  frameView,
  pictureView,
  progressText,
  type Animation,
} from "../src/save/export_views";
import { drawFrame, inOrder, waitFor, type FetchLike } from "@windsplat/client/parts";
import { layoutCards, wrapNote } from "../src/save/legend_picture";
import type { LegendEntry } from "../src/view/legend_entries";
import { crc32, textOf, utf8, withDensity, withTexts, type Bytes } from "../src/save/png_text";
import { parseView } from "../src/save/saved_picture";
import { Zip } from "../src/save/zip";
import { problem, server } from "./server";

// --- PNG ------------------------------------------------------------------------------------

// A PNG of one red pixel, assembled according to the specification.
function tinyPng(...between: [string, string][]): Bytes {
  const chunk = (type: string, data: Uint8Array): Buffer => {
    const body = Buffer.concat([Buffer.from(type, "latin1"), data]);
    const ends = Buffer.alloc(8);
    ends.writeUInt32BE(data.length, 0);
    ends.writeUInt32BE(crc32(body), 4);
    return Buffer.concat([ends.subarray(0, 4), body, ends.subarray(4)]);
  };
  const head = Buffer.from([0, 0, 0, 1, 0, 0, 0, 1, 8, 2, 0, 0, 0]);
  const parts = [
    Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]),
    chunk("IHDR", head),
    ...between.map(([type, text]) => chunk(type, Buffer.from(text, "latin1"))),
    chunk("IDAT", deflateSync(Buffer.from([0, 255, 0, 0]))),
    chunk("IEND", Buffer.alloc(0)),
  ];
  return new Uint8Array(Buffer.concat(parts));
}

// Reads a PNG's iTXt chunks and checks every CRC, with python's zlib.
const pythonReader = `
import json, struct, sys, zlib
data = open(sys.argv[1], "rb").read()
assert data[:8] == b"\\x89PNG\\r\\n\\x1a\\n"
at, kinds, texts = 8, [], {}
while at < len(data):
    (length,) = struct.unpack(">I", data[at:at + 4])
    body = data[at + 4:at + 8 + length]
    (crc,) = struct.unpack(">I", data[at + 8 + length:at + 12 + length])
    assert zlib.crc32(body) == crc, body[:4]
    kinds.append(body[:4].decode())
    if body[:4] == b"iTXt":
        keyword, rest = body[4:].split(b"\\0", 1)
        assert rest[:2] == b"\\0\\0"
        language, translated, text = rest[2:].split(b"\\0", 2)
        assert language == translated == b""
        texts[keyword.decode("latin-1")] = text.decode("utf-8")
    if body[:4] == b"pHYs":
        texts["pHYs"] = list(struct.unpack(">IIB", body[4:]))
    at += 12 + length
json.dump({"kinds": kinds, "texts": texts}, sys.stdout)
`;

function python(program: string, content: Uint8Array, name: string): unknown {
  const folder = mkdtempSync(join(tmpdir(), "windsplat-"));
  try {
    writeFileSync(join(folder, name), content);
    return JSON.parse(
      execFileSync("python3", ["-c", program, join(folder, name)], { encoding: "utf8" }),
    );
  } finally {
    rmSync(folder, { recursive: true });
  }
}

test("checksums match the specifications", () => {
  assert.equal(crc32(utf8("IEND")), 0xae426082); // the last four bytes of every PNG
  assert.equal(crc32(utf8("123456789")), 0xcbf43926); // the usual check value
  assert.equal(crc32(utf8("")), 0);
});

test("text chunks of a PNG survive a round trip and are read by another program", () => {
  const text = '{"dataset":"climate","title":"Wolken über 東京 🌪"}';
  const png = withTexts(tinyPng(), { Software: "windsplat", "windsplat-view": text });
  assert.deepEqual(python(pythonReader, png, "a.png"), {
    kinds: ["IHDR", "iTXt", "iTXt", "IDAT", "IEND"],
    texts: { Software: "windsplat", "windsplat-view": text },
  });
  assert.equal(textOf(png, "windsplat-view"), text);
  assert.equal(textOf(png, "Software"), "windsplat");
  assert.equal(textOf(png, "windsplat"), null);
  assert.equal(textOf(tinyPng(), "windsplat-view"), null);
});

test("the size in print of a PNG is read by another program", () => {
  // 300 dots per inch are 300 / 0.0254 = 11811 pixels per metre
  assert.deepEqual(python(pythonReader, withDensity(tinyPng(), 300), "a.png"), {
    kinds: ["IHDR", "pHYs", "IDAT", "IEND"],
    texts: { pHYs: [11811, 11811, 1] },
  });
});

test("an international text chunk is read, a compressed one is not", () => {
  const other = tinyPng(["iTXt", "a\0\0\0de\0Ding\0wert"], ["iTXt", "b\0\x01\0\0\0xyz"]);
  assert.equal(textOf(other, "a"), "wert");
  assert.equal(textOf(other, "b"), null);
});

test("a text chunk without a keyword end is skipped", () => {
  const png = tinyPng(["iTXt", "x".repeat(1e6)], ["iTXt", `${"k".repeat(200)}\0\0\0\0\0no`]);
  assert.equal(textOf(withTexts(png, { a: "value" }), "a"), "value");
  assert.equal(textOf(png, "a"), null);
});

test("an invalid or truncated PNG is an error", () => {
  assert.throws(() => textOf(utf8("GIF89a and more than that"), "a"), /not a PNG/);
  assert.throws(() => textOf(new Uint8Array(0), "a"), /not a PNG/);
  assert.throws(() => withTexts(utf8("\x89PNG\r\n\x1a\n"), {}), /not a PNG/);
  const png = withTexts(tinyPng(), { a: "value" });
  for (let length = 33; length < png.length; length++) {
    const found = textOf(png.slice(0, length), "a");
    assert.equal(found, length < 33 + 12 + 6 + 5 ? null : "value");
  }
  png[png.indexOf(0x76, 33)]! ^= 1; // the first letter of "value"
  assert.throws(() => textOf(png, "a"), /damaged/);
});

test("a view in a picture must be an object", () => {
  assert.deepEqual(parseView('{"step":3}'), { step: 3 });
  for (const text of ["", "[]", "null", "3", "{"]) assert.throws(() => parseView(text), /view/);
});

// --- ZIP ------------------------------------------------------------------------------------

const pythonZip = `
import json, sys, zipfile
z = zipfile.ZipFile(sys.argv[1])
assert z.testzip() is None
json.dump([[i.filename, z.read(i).decode("utf-8"), i.compress_type, list(i.date_time)]
           for i in z.infolist()], sys.stdout)
`;

test("every file of the ZIP archive is read unchanged by Python", async () => {
  const zip = new Zip(new Date(2026, 10, 22, 13, 4, 26));
  const files: [string, string][] = [
    ["a.txt", ""],
    ["Höhe 東.txt", "wörter"],
    ["b.txt", "x".repeat(70_000)],
  ];
  for (const [name, content] of files) zip.add(name, utf8(content));
  const bytes = new Uint8Array(await zip.finish().arrayBuffer());
  assert.deepEqual(
    python(pythonZip, bytes, "a.zip"),
    files.map(([name, content]) => [name, content, 0, [2026, 11, 22, 13, 4, 26]]),
  );
});

test("too many files for a ZIP archive are refused", () => {
  const zip = new Zip(new Date());
  const empty = utf8("");
  assert.throws(() => {
    for (let n = 0; n < 70_000; n++) zip.add(String(n), empty);
  }, /do not fit/);
});

// --- sizes and views --------------------------------------------------------------------------

test("a picture is n times its displayed size within the limits", () => {
  assert.deepEqual(exportSize(1136, 818, 2, 35_389_440), { width: 2272, height: 1636, scale: 2 });
  for (const [w, h, most] of [
    [1136, 818, 35_389_440],
    [1136, 818, 1_000_000],
    [3840, 2160, 35_389_440],
    [5000, 20, 35_389_440],
    [20, 5000, 35_389_440],
    [1, 1, 35_389_440],
  ] as const) {
    for (const wanted of [1, 2, 3, 4]) {
      const { width, height, scale } = exportSize(w, h, wanted, most);
      assert.ok(width <= 8192 && height <= 8192 && width * height <= most);
      assert.ok(scale <= wanted && width >= 1 && height >= 1);
      const fits = w * wanted <= 8192 && h * wanted <= 8192 && w * h * wanted ** 2 <= most;
      assert.equal(scale === wanted, fits);
      if (fits) assert.deepEqual([width, height], [w * wanted, h * wanted]);
      else
        assert.ok(
          Math.max(width, height) > 8000 || width * height > 0.99 * most,
          "the picture is as large as the limits permit",
        );
    }
  }
});

test("the view of a picture is that of the page with its size and no budget", () => {
  const said: View = {
    dataset: "gcm",
    image: { width: 10, height: 20, background: "#102030" },
    quality: { budgetMs: 33, maxError: 0.1 },
    vector: { field: null },
  };
  assert.deepEqual(pictureView(said, { width: 4, height: 8, scale: 2 }), {
    dataset: "gcm",
    step: 0,
    image: { width: 4, height: 8, background: "#102030" },
    vector: { field: null },
  });
});

const camera: Camera = {
  projection: "perspective",
  eye: [0, -3, 1],
  target: [0, 0, 0],
  up: [0, 0, 1],
  fovY: 35,
  height: 2,
};
const animation: Animation = { over: "steps", from: 1, to: 8, every: 3, frames: 12, fps: 10 };

test("an animation over steps takes every n-th, in either direction", () => {
  const steps = (one: Animation) =>
    Array.from({ length: frameCount(one) }, (_, n) => frameView({}, camera, one, n).step);
  assert.deepEqual(steps(animation), [1, 4, 7]);
  assert.deepEqual(steps({ ...animation, from: 8, to: 1 }), [8, 5, 2]);
  assert.deepEqual(steps({ ...animation, from: 4, to: 4 }), [4]);
});

test("an orbit is one closed turn at constant elevation", () => {
  const turn: Animation = { ...animation, over: "turn" };
  assert.equal(frameCount(turn), 12);
  const start = anglesOf(camera);
  for (let n = 0; n <= 12; n++) {
    const view = frameView({ camera: { fovY: 20 } }, camera, turn, n);
    const seen = { ...camera, ...(view.camera as Partial<Camera>) };
    assert.equal(seen.fovY, 20, "the view's explicit camera keys are preserved");
    assert.ok(Math.abs(anglesOf(seen).elevation - start.elevation) < 1e-9);
    assert.ok(Math.abs(distanceOf(seen) - distanceOf(camera)) < 1e-9);
    const turned = (anglesOf(seen).azimuth - start.azimuth - 30 * n) / 360;
    assert.ok(Math.abs(turned - Math.round(turned)) < 1e-9, `frame ${n}`);
  }
});

test("line motion advances one step per second", () => {
  const view: View = { vector: { field: "wind", motion: { mode: "phase", time: 2 } } };
  const flow: Animation = { ...animation, over: "flow", fps: 8 };
  for (const n of [0, 1, 8, 11]) {
    assert.deepEqual(frameView(view, camera, flow, n).vector, {
      field: "wind",
      motion: { mode: "phase", time: 2 + n / 8 },
    });
  }
});

test("progress estimates the time left from the frames that are done", () => {
  assert.equal(progressText(0, 48, 900), "frame 0 of 48");
  assert.equal(progressText(12, 48, 6000), "frame 12 of 48, 18 s left");
  assert.equal(progressText(48, 48, 6000), "frame 48 of 48, 0 s left");
});

// --- requests ---------------------------------------------------------------------------------

const never = new AbortController().signal;

test("a frame is requested as PNG below the base path", async () => {
  const { asked, fetch } = server(() => new Response("picture"));
  const blob = await drawFrame(fetch, "http://host/a/b/", { dataset: "x" }, never);
  assert.equal(await blob.text(), "picture");
  assert.equal(asked[0]!.url, "http://host/a/b/v1/frames");
  const { method, headers, body } = asked[0]!.options;
  assert.equal(method, "POST");
  assert.deepEqual(headers, { "Content-Type": "application/json", Accept: "image/png" });
  assert.deepEqual(JSON.parse(body as string), { dataset: "x" });
});

test("a busy server is retried after its Retry-After time, other errors are final", async () => {
  const waits: number[] = [];
  const wait = (ms: number) => Promise.resolve(void waits.push(ms));
  const busy = server(
    () => problem(429, "busy", { "Retry-After": "3" }),
    () => problem(503, "draining", { "Retry-After": "Sun, 22 Nov 2026 13:00:00 GMT" }),
    () => problem(429, "busy", { "Retry-After": "9999" }),
    () => new Response("picture"),
  );
  await drawFrame(busy.fetch, "http://host/", {}, never, { wait });
  assert.deepEqual(waits, [3000, 1000, 60_000]);
  const broken = server(() => problem(507, "needs 9 GB"));
  await assert.rejects(
    drawFrame(broken.fetch, "http://host/", {}, never, { wait }),
    /^ProblemError: needs 9/,
  );
  assert.equal(broken.asked.length, 1);
  const always = server(() => problem(429, "busy for ever"));
  await assert.rejects(
    drawFrame(always.fetch, "http://host/", {}, never, { wait }),
    /busy for ever/,
  );
  assert.ok(always.asked.length <= 20);
  const html = server(() => new Response("<html>", { status: 502 }));
  await assert.rejects(drawFrame(html.fetch, "http://host/", {}, never, { wait }), /HTTP 502/);
  const gone: FetchLike = () => Promise.reject(new TypeError("Failed to fetch"));
  await assert.rejects(drawFrame(gone, "http://host/", {}, never, { wait }), /cannot be reached/);
});

test("cancelling a wait rejects at once", async () => {
  const job = new AbortController();
  const waiting = waitFor(3_600_000, job.signal);
  job.abort();
  await assert.rejects(waiting, { name: "AbortError" });
  await assert.rejects(waitFor(3_600_000, job.signal), { name: "AbortError" });
  const other = new AbortController();
  await waitFor(0, other.signal);
  assert.equal(getEventListeners(other.signal, "abort").length, 0, "no listener remains");
});

test("at most two frames are pending, and they are handled in order", async () => {
  let under = 0;
  let most = 0;
  const taken: number[] = [];
  await inOrder(
    9,
    async (n) => {
      most = Math.max(most, (under += 1));
      for (let ticks = 0; ticks < (n % 2 === 0 ? 20 : 1); ticks++) await Promise.resolve();
      return n;
    },
    (value, n) => {
      under -= 1;
      assert.equal(value, n);
      taken.push(n);
    },
  );
  assert.equal(most, 2);
  assert.deepEqual(taken, [0, 1, 2, 3, 4, 5, 6, 7, 8]);
});

test("no further frame is requested after a failure", async () => {
  const begun: number[] = [];
  const draw = (n: number): Promise<number> => {
    begun.push(n);
    return n === 2 ? Promise.reject(new Error("no")) : Promise.resolve(n);
  };
  await assert.rejects(
    inOrder(9, draw, () => {}),
    /no/,
  );
  assert.deepEqual(begun, [0, 1, 2, 3]);
});

// --- the legend in the picture ------------------------------------------------------------------

const entry = (notes: number, range: [number, number] | null = [0, 1]): LegendEntry => ({
  kind: "lines",
  title: "wind",
  units: "",
  beyond: [false, false],
  range,
  map: "viridis",
  color: null,
  ticks: [],
  extinction: [],
  note: notes > 0 ? "note" : "",
  leftOut: notes > 1 ? "more" : "",
});

test("legend cards never overlap or leave the picture", () => {
  for (const [width, height] of [
    [1136, 818],
    [390, 420],
    [320, 200],
    [2560, 300],
    [100, 60],
  ] as const) {
    for (let count = 0; count <= 5; count++) {
      const entries = Array.from({ length: count }, (_, n) =>
        entry(n % 3, n === 1 ? null : [0, 1]),
      );
      const { cards, shrink } = layoutCards(entries, 268, width, height);
      assert.equal(cards.length, count + 1);
      cards.forEach((a, n) => {
        assert.ok(a.x >= 0 && (a.x + a.width) * shrink <= width, "within the width");
        assert.ok(a.y * shrink >= 0 && (a.y + a.height) * shrink <= height, "within the height");
        for (const b of cards.slice(n + 1)) {
          const apart =
            a.x + a.width <= b.x ||
            b.x + b.width <= a.x ||
            a.y + a.height <= b.y ||
            b.y + b.height <= a.y;
          assert.ok(apart, `${width} x ${height}: two of ${count} overlap`);
        }
      });
      assert.ok(
        cards.every((card) => card.y * shrink >= 0.39 * height),
        "most of the picture is uncovered",
      );
      if (width === 1136) assert.equal(shrink, 1);
    }
  }
});

test("notes of a saved legend are wrapped, after commas where that fits", () => {
  const widthOf = (text: string): number => text.length;
  const note = "longest line 50 m s⁻¹, white end ahead, weaker and farther lines are darker";
  assert.deepEqual(wrapNote(note, 40, widthOf), [
    "longest line 50 m s⁻¹, white end ahead,",
    "weaker and farther lines are darker",
  ]);
  assert.deepEqual(wrapNote(note, 23, widthOf), [
    "longest line 50 m s⁻¹,",
    "white end ahead,",
    "weaker and farther",
    "lines are darker",
  ]);
  assert.deepEqual(wrapNote("short", 3, widthOf), ["short"], "a word is not broken");
  assert.deepEqual(wrapNote(note, 100, widthOf), [note]);

  // A card with one more line is one line higher.
  const high = (notes: string[]) =>
    layoutCards([entry(0, [0, 1])], 268, 1136, 818, [notes]).cards[1]!.height;
  assert.equal(high(["one", "two"]) - high(["one"]), 18);
});
