// Arguments of the client's methods, checked before anything is sent: a TypeError names the
// argument and what it should have been.

import { isObject } from "../base/values";
import type { View } from "./protocol";

const shown = (value: unknown): string => JSON.stringify(value) ?? String(value);

function refuse(name: string, wanted: string, value: unknown): never {
  throw new TypeError(`${name} must be ${wanted}, not ${shown(value)}`);
}

const isIndex = (value: unknown): boolean => Number.isInteger(value) && (value as number) >= 0;

/** A name, such as the id of a dataset or a field. */
export function nameOf(name: string, value: unknown): string {
  return typeof value === "string" && value !== "" ? value : refuse(name, "a name", value);
}

/** A time step, counted from 0. */
export function stepOf(value: unknown): number {
  return isIndex(value) ? (value as number) : refuse("step", "a whole number from 0", value);
}

/** Indices of a sample. */
export function indicesOf(value: unknown): number[] {
  if (Array.isArray(value) && value.length === 3 && value.every(isIndex)) return value as number[];
  return refuse("of", "the indices [x, y, z] of a sample, whole numbers from 0", value);
}

/** The settings of a method. */
export function settingsOf<T extends object>(wanted: string, value: T): T {
  return isObject(value) ? value : refuse("the last argument", wanted, value);
}

/** A view. What it says is checked by the server. */
export function viewOf(value: View): View {
  return isObject(value) ? value : refuse("view", 'an object such as { dataset: "a" }', value);
}

/** Settings as parameters of a query; lists are joined by commas. */
export const queryOf = (settings: object): URLSearchParams =>
  new URLSearchParams(
    Object.entries(settings)
      .filter(([, value]) => value !== undefined)
      .map(([key, value]) => [key, String(value)]),
  );

export type Bytes = Blob | ArrayBuffer | Uint8Array | string;

/** A body whose length is known before it is sent; a stream has none. */
export function bytesOf(name: string, value: Bytes): BodyInit {
  const is = value instanceof Blob || value instanceof ArrayBuffer || ArrayBuffer.isView(value);
  if (is || typeof value === "string") return value as BodyInit;
  return refuse(name, "a Blob, an ArrayBuffer, a Uint8Array or a text", value);
}

/** The address of a server; a host with its port counts as http://. */
export function addressOf(url: string | URL): URL {
  const text = String(url).trim();
  const bare = /^([\w.-]+|\[[\da-f:.]+\]):\d+(\/|$)/i.test(text);
  try {
    const address = new URL(bare ? `http://${text}` : text);
    if (/^https?:$/.test(address.protocol)) return address;
  } catch {
    // refused below
  }
  throw new TypeError(`"${text}" is no http(s) address, such as http://127.0.0.1:8080/`);
}
