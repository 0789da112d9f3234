// What a frame is in the sequence of frames of a view. Pure.
import type { FrameHeader } from "../wire/protocol";

export type FrameState = "moving" | "refining" | "final";

// A non-final frame of a view that was already shown is "refining": the server improves it while
// the view rests.
export function frameState(header: FrameHeader, before: FrameHeader | null): FrameState {
  if (header.final) return "final";
  const again = before !== null && before.rev === header.rev && before.step === header.step;
  return again && !before.final ? "refining" : "moving";
}
