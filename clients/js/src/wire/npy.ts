// Arrays of values as the server sends them (NPY 1.0, little-endian float32, last index fastest):
// bytes -> numbers and shape.
import { notUnderstood } from "./requests";

const fixedBytes = 10; // magic number, version, length of the text that follows
const version1 = "\x93NUMPY\x01\x00";
const described = /'descr': '<f4', 'fortran_order': False, 'shape': \(([\d, ]*)\)/;

export interface Npy {
  values: Float32Array<ArrayBuffer>;
  shape: number[];
}

/** Throws an Error for anything else. */
export function npyOf(bytes: ArrayBuffer): Npy {
  const data = new DataView(bytes);
  const isNpy = bytes.byteLength >= fixedBytes && textOf(bytes, 0, 8) === version1;
  const start = isNpy ? fixedBytes + data.getUint16(8, true) : 0;
  const told = isNpy ? described.exec(textOf(bytes, fixedBytes, start)) : null;
  if (told === null) throw new Error(notUnderstood);
  const shape = (told[1]!.match(/\d+/g) ?? []).map(Number);
  const count = shape.reduce((product, length) => product * length, 1);
  if (bytes.byteLength !== start + 4 * count) throw new Error(notUnderstood);
  const values = new Float32Array(count);
  for (let n = 0; n < count; n++) values[n] = data.getFloat32(start + 4 * n, true);
  return { values, shape };
}

const textOf = (bytes: ArrayBuffer, from: number, to: number): string =>
  String.fromCharCode(...new Uint8Array(bytes.slice(from, to)));
