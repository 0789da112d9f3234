// Size in print of JPEG files: (bytes of a JPEG, dots per inch) -> bytes with a JFIF header that
// tells them. Pure. Source: JPEG File Interchange Format (ECMA TR/98), 10.1.
import { join, type Bytes } from "./png_text";

const start = [0xff, 0xd8]; // SOI
const jfif = [0xff, 0xe0, 0, 16, 0x4a, 0x46, 0x49, 0x46, 0]; // APP0, its length, "JFIF" and zero
const unitsAt = 13; // of the density, after the version
const dotsToTheInch = 1;

const startsWith = (bytes: Uint8Array, wanted: number[]): boolean =>
  wanted.every((byte, n) => bytes[n] === byte);

export function withJpegDensity(jpeg: Uint8Array, dotsPerInch: number): Bytes {
  if (!startsWith(jpeg, start)) throw new Error("This file is not a JPEG picture.");
  const has = startsWith(jpeg.subarray(start.length), jfif);
  // Version 1.02, no thumbnail.
  const header = new Uint8Array([...start, ...jfif, 1, 2, 0, 0, 0, 0, 0, 0, 0]);
  const whole = has ? join(jpeg) : join(header, jpeg.subarray(start.length));
  const data = new DataView(whole.buffer);
  data.setUint8(unitsAt, dotsToTheInch);
  data.setUint16(unitsAt + 1, dotsPerInch);
  data.setUint16(unitsAt + 3, dotsPerInch);
  return whole;
}
