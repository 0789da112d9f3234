// WebM files, read again by an EBML reader of this test (RFC 8794, RFC 9559).
import assert from "node:assert/strict";
import { test } from "node:test";
import { pictureMs, webmFile, type EncodedPicture, type VideoTrack } from "../../src/save/webm";

const containers = new Set([
  0x1a45dfa3, 0x18538067, 0x1549a966, 0x1654ae6b, 0xae, 0xe0, 0x55b0, 0x1f43b675, 0x1c53bb6b, 0xbb,
  0xb7,
]);

interface Found {
  id: number;
  at: number; // of the element's first byte
  data: Uint8Array;
  inside: Found[];
}

// Number of leading zero bits decides the length; `keep`: the marker bit belongs to an id.
function variable(bytes: Uint8Array, at: number, keep: boolean): [value: number, length: number] {
  const length = Math.clz32(bytes[at]!) - 24 + 1;
  let value = keep ? bytes[at]! : bytes[at]! & (0xff >> length);
  for (let n = 1; n < length; n++) value = value * 256 + bytes[at + n]!;
  return [value, length];
}

function read(bytes: Uint8Array, from = 0, to = bytes.length): Found[] {
  const found: Found[] = [];
  for (let at = from; at < to;) {
    const [id, idLength] = variable(bytes, at, true);
    const [size, sizeLength] = variable(bytes, at + idLength, false);
    const start = at + idLength + sizeLength;
    assert.ok(start + size <= to, `element ${id.toString(16)} ends within its parent`);
    found.push({
      id,
      at,
      data: bytes.subarray(start, start + size),
      inside: containers.has(id) ? read(bytes, start, start + size) : [],
    });
    at = start + size;
  }
  return found;
}

const all = (found: Found[], id: number): Found[] =>
  found.flatMap((one) => [...(one.id === id ? [one] : []), ...all(one.inside, id)]);
const value = (one: Found): number => one.data.reduce((sum, byte) => sum * 256 + byte, 0);
const valueOf = (found: Found[], id: number): number => value(all(found, id)[0]!);

interface Block {
  ms: number;
  key: boolean;
  data: number[];
}

function blocksOf(found: Found[]): Block[] {
  return all(found, 0x1f43b675).flatMap((cluster) => {
    const start = valueOf(cluster.inside, 0xe7);
    return all(cluster.inside, 0xa3).map(({ data }) => {
      assert.equal(data[0], 0x81, "track 1");
      const relative = new DataView(data.buffer, data.byteOffset).getInt16(1);
      assert.ok(relative >= 0);
      return { ms: start + relative, key: (data[3]! & 0x80) !== 0, data: [...data.subarray(4)] };
    });
  });
}

const track: VideoTrack = {
  codec: "V_VP9",
  width: 901,
  height: 600,
  fps: 24,
  color: { matrix: "bt709", primaries: "bt709", transfer: "bt709", fullRange: false },
};

const pictures = (count: number, keyEvery: number): EncodedPicture[] =>
  Array.from({ length: count }, (_, n) => ({
    key: n % keyEvery === 0,
    data: Uint8Array.from([n & 255, n >> 8, 7]),
  }));

const made = async (more: Partial<VideoTrack>, list: EncodedPicture[]): Promise<Found[]> =>
  read(new Uint8Array(await webmFile({ ...track, ...more }, list).arrayBuffer()));

test("every picture is in the file once, in order, at its time", async () => {
  for (const fps of [1, 5, 12, 24, 29, 60]) {
    const found = await made({ fps }, pictures(300, 48));
    const blocks = blocksOf(found);
    assert.equal(blocks.length, 300);
    blocks.forEach(({ ms, key, data }, n) => {
      assert.equal(ms, Math.round((1000 * n) / fps), `picture ${n} at ${fps} fps`);
      assert.equal(key, n % 48 === 0);
      assert.deepEqual(data, [n & 255, n >> 8, 7]);
    });
    const duration = all(found, 0x4489)[0]!.data;
    assert.equal(
      new DataView(duration.buffer, duration.byteOffset).getFloat64(0),
      (1000 * 300) / fps,
    );
    assert.equal(valueOf(found, 0x23e383), Math.round(1e9 / fps), "duration of a picture in ns");
  }
});

test("the header names type, codec, size and colours", async () => {
  const found = await made({}, pictures(2, 2));
  const text = (id: number) => Buffer.from(all(found, id)[0]!.data).toString();
  assert.equal(text(0x4282), "webm");
  assert.equal(text(0x86), "V_VP9");
  assert.deepEqual([valueOf(found, 0xb0), valueOf(found, 0xba)], [901, 600]);
  assert.equal(valueOf(found, 0x2ad7b1), 1e6, "times are in milliseconds");
  const colors = [0x55b1, 0x55b9, 0x55ba, 0x55bb].map((id) => valueOf(found, id));
  assert.deepEqual(colors, [1, 1, 1, 1]);
  assert.deepEqual(all(await made({ color: undefined }, pictures(1, 1)), 0x55b0), []);
});

test("cues lead to the clusters, each of which begins with a key picture", async () => {
  const found = await made({}, pictures(200, 48));
  const [segment] = all(found, 0x18538067);
  const clusters = all(found, 0x1f43b675);
  assert.equal(clusters.length, 5);
  const begin = segment!.inside[0]!.at;
  const cues = all(found, 0xbb).map(({ inside }) => [valueOf(inside, 0xb3), valueOf(inside, 0xf1)]);
  assert.deepEqual(
    cues,
    clusters.map(({ at, inside }) => [valueOf(inside, 0xe7), at - begin]),
  );
});

test("without key pictures times still fit their 16 bits", async () => {
  const blocks = blocksOf(await made({ fps: 1 }, pictures(100, 1000)));
  assert.deepEqual(
    blocks.map(({ ms }) => ms),
    Array.from({ length: 100 }, (_, n) => 1000 * n),
  );
});

test("errors of rounding do not add up", () => {
  assert.equal(pictureMs(24_000, 24), 1_000_000);
  assert.ok(Math.abs(pictureMs(1001, 24) - 1001 * (1000 / 24)) <= 0.5);
});
