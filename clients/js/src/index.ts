// REST, the stream, views and cameras of a windsplat server, in browsers and in Node.
export { viewRanges } from "./generated/view_ranges";
export * from "./wire/protocol";
export * from "./wire/api";
export type { ConnectionState } from "./wire/connection";
export type { Reach } from "./wire/reach";
export type { SocketClass } from "./wire/browser_link";
export { ProblemError, problemText, UnreachableError } from "./wire/requests";
export * from "./view/camera";
export * from "./client/client";
export type { Upload, UploadOptions, Values, ValuesAxis, ValuesBox } from "./client/data_api";
export type { Opener, OpenerHost } from "./client/opener";
export { ViewStream, type StreamEvents, type StreamOptions } from "./client/view_stream";
export { mergePatch, mergeView, type Patch } from "./view/view_state";
