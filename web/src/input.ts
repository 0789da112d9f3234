// Mouse, wheel and touch on the picture -> camera moves, at most one a display frame.
import { orbit, pan, zoom, type Camera } from "./camera";

export interface CameraHost {
  camera(): Camera | null; // null: nothing to move yet
  setCamera(camera: Camera): void;
}

type Move = (camera: Camera) => Camera;

const orbitDegrees = 240; // for a drag as long as the picture is high
const wheelLineFactor = 1.0015; // zoom a wheel unit (pixel)

// Gathers moves and applies them together before the next display frame: however fast the device
// reports, one patch a frame goes out.
export class MoveQueue {
  private moves: Move[] = [];

  constructor(
    private readonly host: CameraHost,
    private readonly requestFrame: (run: () => void) => void,
  ) {}

  push(move: Move): void {
    this.moves.push(move);
    if (this.moves.length === 1) this.requestFrame(() => this.flush());
  }

  private flush(): void {
    const moves = this.moves;
    this.moves = [];
    const camera = this.host.camera();
    if (camera !== null) this.host.setCamera(moves.reduce((moved, move) => move(moved), camera));
  }
}

interface Finger {
  x: number;
  y: number;
}

// Centre and spread (mean distance from the centre) of all fingers, pixels.
export function gesture(fingers: Finger[]): { x: number; y: number; spread: number } {
  const x = fingers.reduce((sum, f) => sum + f.x, 0) / fingers.length;
  const y = fingers.reduce((sum, f) => sum + f.y, 0) / fingers.length;
  const spread = fingers.reduce((sum, f) => sum + Math.hypot(f.x - x, f.y - y), 0) / fingers.length;
  return { x, y, spread };
}

// One finger (or the left button) orbits; two fingers, another button or shift pan, two also zoom.
export class PointerInput {
  private readonly fingers = new Map<number, Finger>();
  private panning = false;

  constructor(
    private readonly element: HTMLElement,
    private readonly moves: MoveQueue,
  ) {
    element.addEventListener("pointerdown", (event) => this.down(event));
    element.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      element.addEventListener(end, (event) => this.up(event));
    }
    element.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    element.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  private down(event: PointerEvent): void {
    if (this.fingers.size === 0) this.panning = event.button !== 0 || event.shiftKey;
    this.element.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    this.element.classList.add("dragging");
  }

  private up(event: PointerEvent): void {
    this.fingers.delete(event.pointerId);
    if (this.fingers.size === 0) this.element.classList.remove("dragging");
  }

  private move(event: PointerEvent): void {
    const finger = this.fingers.get(event.pointerId);
    if (finger === undefined) return;
    const before = gesture([...this.fingers.values()]);
    finger.x = event.clientX;
    finger.y = event.clientY;
    const after = gesture([...this.fingers.values()]);
    const height = this.element.clientHeight;
    const dx = (after.x - before.x) / height;
    const dy = (after.y - before.y) / height;
    if (this.fingers.size === 1 && !this.panning) {
      // The volume follows the hand: to the right means that the eye goes west.
      this.moves.push((camera) => orbit(camera, -dx * orbitDegrees, dy * orbitDegrees));
      return;
    }
    this.moves.push((camera) => pan(camera, dx, dy));
    if (before.spread > 1 && after.spread > 1) {
      const factor = after.spread / before.spread;
      this.moves.push((camera) => zoom(camera, factor));
    }
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const unit = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? 1 : 30;
    // One notch is about 100 pixels; a torn-off trackpad swipe must not jump.
    const pixels = Math.min(Math.max(event.deltaY * unit, -400), 400);
    this.moves.push((camera) => zoom(camera, wheelLineFactor ** -pixels));
  }
}
