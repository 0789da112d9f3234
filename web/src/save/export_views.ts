// Export: (explicit view, choices) -> views to render, their size and progress text.
// Pure.
import { orbit, type Camera } from "../view/camera";
import type { View } from "../wire/protocol";

const edgeMax = 8192; // pixels, the view's schema's
export const framesMax = 2000;

export interface ExportSize {
  width: number; // pixels
  height: number;
  scale: number; // pixels a CSS pixel, less than what was asked for where a limit is in the way
}

export function exportSize(
  cssWidth: number,
  cssHeight: number,
  wanted: number,
  pixelsMax: number, // the server's
): ExportSize {
  const [w, h] = [Math.max(1, cssWidth), Math.max(1, cssHeight)];
  const scale = Math.min(wanted, edgeMax / Math.max(w, h), Math.sqrt(pixelsMax / (w * h)));
  const pixels = (edge: number) => Math.max(1, Math.floor(edge * scale + 1e-6));
  return { width: pixels(w), height: pixels(h), scale };
}

// The view that a saved picture shows and contains: without `quality`, which is a preference of the
// viewer and would leave settings to the server.
export function pictureView(explicit: View, { width, height }: ExportSize): View {
  const { quality: _quality, ...view } = explicit;
  return { ...view, step: explicit.step ?? 0, image: { ...explicit.image, width, height } };
}

export type AnimationKind = "steps" | "turn" | "flow";

export interface Animation {
  over: AnimationKind;
  from: number; // steps
  to: number;
  every: number;
  frames: number; // of turn and flow
  fps: number;
}

export function frameCount({ over, from, to, every, frames }: Animation): number {
  return over === "steps" ? Math.floor(Math.abs(to - from) / every) + 1 : frames;
}

// Frame n of an animation of the view.
export function frameView(view: View, camera: Camera, animation: Animation, n: number): View {
  const { over, from, to, every, frames, fps } = animation;
  if (over === "steps") return { ...view, step: from + Math.sign(to - from) * every * n };
  if (over === "turn") {
    const { eye, target, up } = orbit(camera, (360 * n) / frames, 0);
    return { ...view, camera: { ...view.camera, eye, target, up } };
  }
  const motion = view.vector?.motion;
  const time = Number(((motion?.time ?? 0) + n / fps).toFixed(3)); // a step a second
  return { ...view, vector: { ...view.vector, motion: { ...motion, time } } };
}

export function progressText(done: number, count: number, elapsedMs: number): string {
  const left = Math.ceil((elapsedMs / 1000 / Math.max(1, done)) * (count - done));
  return `frame ${done} of ${count}${done > 0 ? `, ${left} s left` : ""}`;
}
