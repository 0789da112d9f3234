// Export: (explicit view, choices) -> views to render, their size and progress text. Pure.
import { orbit, type Camera, type View } from "@windsplat/client";

const edgeMax = 8192; // pixels, as in the schema of the view
export const framesMax = 2000;

const millimetresToTheInch = 25.4;

export type SizeUnit = "mm" | "px";

// Pixels per CSS pixel of a picture of this width.
export function scaleOf(width: number, unit: SizeUnit, dpi: number, cssWidth: number): number {
  const pixels = unit === "mm" ? Math.round((width * dpi) / millimetresToTheInch) : width;
  return pixels / Math.max(1, cssWidth);
}

export const millimetres = (pixels: number, dpi: number): number =>
  (millimetresToTheInch * pixels) / dpi;

export interface ExportSize {
  width: number; // pixels
  height: number;
  scale: number; // pixels per CSS pixel, reduced if a limit applies
}

export function exportSize(
  cssWidth: number,
  cssHeight: number,
  wanted: number,
  pixelsMax: number, // limit of the server
): ExportSize {
  const [w, h] = [Math.max(1, cssWidth), Math.max(1, cssHeight)];
  const scale = Math.min(wanted, edgeMax / Math.max(w, h), Math.sqrt(pixelsMax / (w * h)));
  const pixels = (edge: number) => Math.max(1, Math.floor(edge * scale + 1e-6));
  return { width: pixels(w), height: pixels(h), scale };
}

// The view that a saved picture shows and contains, without `quality`: that is a preference of the
// user, and would let the server choose settings.
export function pictureView(explicit: View, { width, height }: ExportSize): View {
  const { quality: _quality, ...view } = explicit;
  return { ...view, step: explicit.step ?? 0, image: { ...explicit.image, width, height } };
}

export type AnimationKind = "steps" | "turn" | "flow";

export interface Animation {
  over: AnimationKind;
  from: number; // first step
  to: number;
  every: number;
  frames: number; // number of frames, for turn and flow
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
  const time = Number(((motion?.time ?? 0) + n / fps).toFixed(3)); // one step per second
  return { ...view, vector: { ...view.vector, motion: { ...motion, time } } };
}

export function progressText(done: number, count: number, elapsedMs: number): string {
  const left = Math.ceil((elapsedMs / 1000 / Math.max(1, done)) * (count - done));
  return `frame ${done} of ${count}${done > 0 ? `, ${left} s left` : ""}`;
}
