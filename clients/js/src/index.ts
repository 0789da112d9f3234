// REST, the stream, views and cameras of a windsplat server, in browsers and in Node.
export { viewRanges } from "./generated/view_ranges";
export * from "./wire/protocol";
export * from "./wire/api";
export type { Folder, FolderEntry } from "./wire/folder";
export { ProblemError, problemText } from "./wire/requests";
export * from "./view/camera";
export { mergePatch, mergeView, type Patch } from "./view/view_state";
