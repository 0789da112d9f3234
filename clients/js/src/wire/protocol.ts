// The wire format: bytes of a binary message -> frame header and picture; text -> typed server
// message. All functions are pure; malformed input throws a WireError.
import type { ClientMessage, Dataset, ServerMessage } from "../generated/messages";
import { isObject } from "../base/values";

export type {
  ChosenMessage,
  ClientMessage,
  Dataset,
  DatasetSummary,
  ErrorMessage,
  Field,
  HelloMessage,
  OpenedMessage,
  Problem,
  ProgressMessage,
  ServerMessage,
  StatsMessage,
  UnchangedMessage,
} from "../generated/messages";
export type { RegionView, ScalarView, SurfaceView, View } from "../generated/view";

export const subprotocol = "windsplat.v1";
export const frameHeaderBytes = 64;

export interface FrameHeader {
  seq: number;
  rev: number; // rev of the view drawn
  step: number;
  final: boolean;
  errorMeasured: boolean;
  errorEstimated: boolean;
  cached: boolean;
  key: boolean; // of H.264: refers to no other frame
  flags: number;
  width: number; // pixels, as rendered
  height: number;
  codec: "jpeg" | "png" | "h264";
  quality: number;
  method: "kernel" | "slab" | "reference";
  level: number; // 0 full resolution, n = 1/2^n
  error: number; // linear RMSE, NaN unknown
  jpegError: number;
  queueUs: number;
  renderUs: number;
  encodeUs: number;
  payloadBytes: number;
  t: number; // t of the newest patch, in ms of this page's clock
}

export interface Frame {
  header: FrameHeader;
  picture: Uint8Array<ArrayBuffer>;
}

export class WireError extends Error {
  override name = "WireError";
}

const magic = 0x4c505357; // "WSPL" read little-endian
const codecs = { 1: "jpeg", 2: "png", 3: "h264" } as const;
const methods = { 1: "kernel", 2: "slab", 3: "reference" } as const;

function named<T>(names: Record<number, T>, code: number, what: string): T {
  const name = names[code];
  if (name === undefined) throw new WireError(`unknown ${what} ${code}`);
  return name;
}

export function parseFrameHeader(bytes: Uint8Array): FrameHeader {
  if (bytes.byteLength < frameHeaderBytes) {
    throw new WireError(`a frame of ${bytes.byteLength} bytes has no whole header`);
  }
  const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (data.getUint32(0, true) !== magic) throw new WireError("no WSPL at a frame's start");
  const version = data.getUint8(4);
  if (version !== 1) throw new WireError(`unknown frame version ${version}`);
  const kind = data.getUint8(5);
  if (kind !== 1) throw new WireError(`unknown frame kind ${kind}`);
  const headerLength = data.getUint16(6, true);
  if (headerLength !== frameHeaderBytes) {
    throw new WireError(`a frame header of ${headerLength} bytes`);
  }
  const flags = data.getUint32(20, true);
  return {
    seq: data.getUint32(8, true),
    rev: data.getUint32(12, true),
    step: data.getUint32(16, true),
    flags,
    final: (flags & 1) !== 0,
    errorMeasured: (flags & 2) !== 0,
    errorEstimated: (flags & 4) !== 0,
    cached: (flags & 8) !== 0,
    key: (flags & 16) !== 0,
    width: data.getUint16(24, true),
    height: data.getUint16(26, true),
    codec: named(codecs, data.getUint8(28), "codec"),
    quality: data.getUint8(29),
    method: named(methods, data.getUint8(30), "method"),
    level: data.getUint8(31),
    error: data.getFloat32(32, true),
    jpegError: data.getFloat32(36, true),
    queueUs: data.getUint32(40, true),
    renderUs: data.getUint32(44, true),
    encodeUs: data.getUint32(48, true),
    payloadBytes: data.getUint32(52, true),
    t: data.getFloat64(56, true),
  };
}

export function parseFrame(message: ArrayBuffer): Frame {
  const header = parseFrameHeader(new Uint8Array(message));
  const picture = new Uint8Array(message, frameHeaderBytes);
  if (picture.byteLength !== header.payloadBytes) {
    throw new WireError(
      `a frame of ${picture.byteLength} picture bytes whose header says ${header.payloadBytes}`,
    );
  }
  return { header, picture };
}

type Json = Record<string, unknown>;

const isDataset = (value: unknown): value is Dataset =>
  isObject(value) &&
  typeof value.id === "string" &&
  Array.isArray(value.fields) &&
  isObject(value.world) &&
  isObject(value.axes) &&
  isObject(value.steps);

const isProblem = (value: unknown): boolean =>
  isObject(value) && typeof value.detail === "string" && typeof value.title === "string";

// Checks of the keys that the page reads from each message; other keys are ignored.
const looksRight: Record<ServerMessage["type"], (message: Json) => boolean> = {
  hello: (m) => m.protocol === subprotocol && Array.isArray(m.datasets) && isObject(m.limits),
  opened: (m) => Number.isInteger(m.id) && isDataset(m.dataset),
  progress: (m) => typeof m.phase === "string" && typeof m.done === "number",
  chosen: (m) => Number.isInteger(m.seq) && isObject(m.view) && isObject(m.work),
  unchanged: (m) => Number.isInteger(m.rev) && Number.isInteger(m.seq),
  stats: (m) =>
    typeof m.stepsDropped === "number" &&
    typeof m.stepsNotReady === "number" &&
    (m.playFps === null || typeof m.playFps === "number"),
  error: (m) => isProblem(m.problem),
};

export function parseServerMessage(text: string): ServerMessage {
  let message: unknown;
  try {
    message = JSON.parse(text);
  } catch {
    throw new WireError("a message that is not JSON");
  }
  if (!isObject(message) || typeof message.type !== "string") {
    throw new WireError("a message without a type");
  }
  if (!Object.hasOwn(looksRight, message.type)) {
    throw new WireError(`a message of unknown type "${message.type.slice(0, 40)}"`);
  }
  const type = message.type as ServerMessage["type"];
  if (!looksRight[type](message)) throw new WireError(`a malformed "${type}" message`);
  return message as unknown as ServerMessage;
}

export const encodeClientMessage = (message: ClientMessage): string => JSON.stringify(message);
