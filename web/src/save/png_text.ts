// Text and size in print of PNG files: (bytes of a PNG, keywords and strings) -> bytes with one
// iTXt chunk for each, and back; (bytes, dots per inch) -> bytes with a pHYs chunk. Pure. Source:
// PNG specification (ISO/IEC 15948), chunks 5.3, iTXt 11.3.4.5, pHYs 11.3.5.3, CRC annex D.

export type Bytes = Uint8Array<ArrayBuffer>;

const table = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let bit = 0; bit < 8; bit++) c = (c & 1) !== 0 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c;
});

// The CRC of both PNG and ZIP.
export function crc32(bytes: Uint8Array): number {
  let c = -1;
  for (const byte of bytes) c = table[(c ^ byte) & 255]! ^ (c >>> 8);
  return ~c >>> 0;
}

export function join(...parts: Uint8Array[]): Bytes {
  const whole = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}

export const utf8 = (text: string): Bytes => new TextEncoder().encode(text);

const latin = (bytes: Uint8Array): string => String.fromCharCode(...bytes);

const signature = "\x89PNG\r\n\x1a\n";
const headEnd = 33; // end of the signature and IHDR, the first chunk

function chunk(type: string, data: Uint8Array): Bytes {
  const body = join(utf8(type), data);
  const whole = join(new Uint8Array(4), body, new Uint8Array(4));
  const ends = new DataView(whole.buffer);
  ends.setUint32(0, data.length);
  ends.setUint32(4 + body.length, crc32(body));
  return whole;
}

function check(png: Uint8Array): void {
  if (latin(png.subarray(0, 8)) !== signature || latin(png.subarray(12, 16)) !== "IHDR") {
    throw new Error("This file is not a PNG picture.");
  }
}

// Keywords have 1 to 79 Latin-1 characters; values are stored in UTF-8, uncompressed.
export function withTexts(png: Uint8Array, texts: Record<string, string>): Bytes {
  check(png);
  const chunks = Object.entries(texts).map(([keyword, text]) =>
    // The five zero bytes: end of the keyword, not compressed, method 0, no language, no translated
    // keyword.
    chunk("iTXt", join(utf8(keyword), new Uint8Array(5), utf8(text))),
  );
  return join(png.subarray(0, headEnd), ...chunks, png.subarray(headEnd));
}

const metresToTheInch = 0.0254;

// The file must not have a pHYs chunk: neither the server nor a canvas writes one unasked.
export function withDensity(png: Uint8Array, dotsPerInch: number): Bytes {
  check(png);
  const data = new DataView(new ArrayBuffer(9));
  const perMetre = Math.round(dotsPerInch / metresToTheInch);
  data.setUint32(0, perMetre);
  data.setUint32(4, perMetre);
  data.setUint8(8, 1); // the unit is the metre
  const density = chunk("pHYs", new Uint8Array(data.buffer));
  return join(png.subarray(0, headEnd), density, png.subarray(headEnd));
}

// null: no text has this keyword.
export function textOf(png: Uint8Array, keyword: string): string | null {
  check(png);
  const data = new DataView(png.buffer, png.byteOffset, png.byteLength);
  for (let at = 8; at + 12 <= png.length;) {
    const length = data.getUint32(at);
    const end = at + 8 + length;
    if (end + 4 > png.length) break;
    const body = png.subarray(at + 4, end);
    at = end + 4;
    if (latin(body.subarray(0, 4)) !== "iTXt") continue;
    const nul = body.indexOf(0, 4);
    if (nul < 0 || nul > 84) continue;
    if (latin(body.subarray(4, nul)) !== keyword || body[nul + 1] !== 0) continue;
    if (data.getUint32(end) !== crc32(body)) throw new Error("This picture's text is damaged.");
    const text = body.indexOf(0, body.indexOf(0, nul + 3) + 1) + 1;
    return new TextDecoder().decode(body.subarray(text));
  }
  return null;
}
