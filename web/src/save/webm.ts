// Encoded pictures with their times -> the bytes of a WebM file. Pure. Sources: RFC 8794 (EBML),
// RFC 9559 (Matroska: elements by their ids), the WebM container guidelines (times in milliseconds,
// cues), ITU-T H.273 (numbers of colour spaces).
import { join, utf8, type Bytes } from "./png_text";

export interface EncodedPicture {
  key: boolean; // needs no other picture
  data: Uint8Array;
}

export interface VideoTrack {
  codec: "V_VP9" | "V_VP8";
  width: number; // pixels
  height: number;
  fps: number;
  color?: Partial<VideoColorSpaceInit>; // as the encoder reports it
}

const millisecond = 1_000_000; // ns: the unit of times
const clusterMsMax = 30_000; // times within a cluster have 16 bits with a sign

// The n-th picture begins at n / fps, rounded to milliseconds; the errors do not add up.
export const pictureMs = (n: number, fps: number): number => Math.round((1000 * n) / fps);

// Big-endian, in `bytes` or as many bytes as the number needs.
function unsigned(value: number, bytes = 0): Uint8Array {
  const out: number[] = [];
  for (let rest = value; rest > 0 || out.length < Math.max(1, bytes);) {
    out.unshift(rest % 256);
    rest = Math.floor(rest / 256);
  }
  return Uint8Array.from(out);
}

function double(value: number): Uint8Array {
  const bytes = new DataView(new ArrayBuffer(8));
  bytes.setFloat64(0, value);
  return new Uint8Array(bytes.buffer);
}

// A size as eight bytes: 1, then 56 bits.
function sized(bytes: number): Uint8Array {
  const out = unsigned(bytes, 8);
  out[0] = 1;
  return out;
}

const element = (id: number, ...content: Uint8Array[]): Bytes =>
  join(unsigned(id), sized(content.reduce((sum, part) => sum + part.length, 0)), ...content);

const number = (id: number, value: number, bytes = 0): Bytes => element(id, unsigned(value, bytes));
const text = (id: number, value: string): Bytes => element(id, utf8(value));

const matrices: Record<string, number> = { rgb: 0, bt709: 1, bt470bg: 5, smpte170m: 6 };
const primaries: Record<string, number> = { bt709: 1, bt470bg: 5, smpte170m: 6 };
const transfers: Record<string, number> = { bt709: 1, smpte170m: 6, "iec61966-2-1": 13 };

function color(space: Partial<VideoColorSpaceInit> | undefined): Uint8Array[] {
  const parts: Uint8Array[] = [];
  const add = (id: number, value: number | undefined) => {
    if (value !== undefined) parts.push(number(id, value));
  };
  add(0x55b1, matrices[space?.matrix ?? ""]);
  if (typeof space?.fullRange === "boolean") add(0x55b9, space.fullRange ? 2 : 1);
  add(0x55ba, transfers[space?.transfer ?? ""]);
  add(0x55bb, primaries[space?.primaries ?? ""]);
  return parts.length === 0 ? [] : [element(0x55b0, ...parts)];
}

function trackEntry({ codec, width, height, fps, color: space }: VideoTrack): Bytes {
  return element(
    0xae,
    number(0xd7, 1), // number of the track
    number(0x73c5, 1), // its UID
    number(0x83, 1), // video
    number(0x9c, 0), // no lacing
    number(0x23e383, Math.round(1e9 / fps)), // duration of a picture, ns
    text(0x86, codec),
    element(0xe0, number(0xb0, width), number(0xba, height), ...color(space)),
  );
}

interface Cluster {
  ms: number;
  bytes: Bytes;
}

// A cluster begins at every key picture, so that players can seek to each.
function clustersOf(pictures: EncodedPicture[], fps: number): Cluster[] {
  const clusters: Cluster[] = [];
  let blocks: Uint8Array[] = [];
  let start = 0;
  const close = (): void => {
    if (blocks.length === 0) return;
    clusters.push({ ms: start, bytes: element(0x1f43b675, number(0xe7, start), ...blocks) });
    blocks = [];
  };
  pictures.forEach(({ key, data }, n) => {
    const ms = pictureMs(n, fps);
    if (key || ms - start > clusterMsMax) close();
    if (blocks.length === 0) start = ms;
    const head = Uint8Array.from([0x81, ...unsigned(ms - start, 2), key ? 0x80 : 0]);
    blocks.push(element(0xa3, head, data));
  });
  close();
  return clusters;
}

// `before`: bytes of the segment before the cues, which precede the clusters.
function cuesOf(clusters: Cluster[], before: number): Bytes {
  const cues = (at: number): Bytes =>
    element(
      0x1c53bb6b,
      ...clusters.map(({ ms, bytes }) => {
        const position = number(0xf1, at, 8); // eight bytes, so that the size is known before
        at += bytes.length;
        return element(0xbb, number(0xb3, ms, 8), element(0xb7, number(0xf7, 1), position));
      }),
    );
  return cues(before + cues(0).length);
}

// All pictures in their order; the first is a key picture.
export function webmFile(track: VideoTrack, pictures: EncodedPicture[]): Blob {
  const head = element(
    0x1a45dfa3,
    number(0x4286, 1),
    number(0x42f7, 1),
    number(0x42f2, 4),
    number(0x42f3, 8),
    text(0x4282, "webm"),
    number(0x4287, 4),
    number(0x4285, 2),
  );
  const info = element(
    0x1549a966,
    number(0x2ad7b1, millisecond),
    element(0x4489, double((1000 * pictures.length) / track.fps)),
    text(0x4d80, "windsplat"),
    text(0x5741, "windsplat"),
  );
  const tracks = element(0x1654ae6b, trackEntry(track));
  const clusters = clustersOf(pictures, track.fps);
  const cues = cuesOf(clusters, info.length + tracks.length);
  const parts = [info, tracks, cues, ...clusters.map(({ bytes }) => bytes)];
  const size = parts.reduce((sum, part) => sum + part.length, 0);
  return new Blob([head, join(unsigned(0x18538067), sized(size)), ...parts], {
    type: "video/webm",
  });
}
