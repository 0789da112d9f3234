// Mouse, wheel and touch input on the picture -> camera moves, at most one patch per display frame.
import { drag, pan, roll, zoom, type Camera } from "../view/camera";
import { clamp } from "../base/values";

export interface CameraHost {
  camera(): Camera | null; // null: no camera yet
  setCamera(camera: Camera): void;
  ready(): boolean; // earlier patches have left the send buffer
}

export type Move = (camera: Camera) => Camera;

const orbitDegrees = 240; // rotation for a drag over the height of the picture
const clickPixels = 5; // a shorter movement is a click
const twistDegrees = 5; // a smaller rotation of the fingers does not roll the camera
const wheelFactor = 1.0015; // zoom per wheel pixel; one notch is about 100 pixels
const wheelPixelsMax = 400; // limit per event, so that a fast swipe does not jump
// zoom per pixel for a trackpad pinch, reported as a wheel event with ctrl
const pinchFactor = 1.01;
const pinchPixelsMax = 25;
const linePixels = 30; // pixels per line of a wheel that reports lines

// Sends the first move at once and combines later ones until the next display frame, so that at
// most one patch per frame is sent whatever the device's event rate. While earlier patches are
// still in the send buffer, moves are accumulated.
export class MoveQueue {
  private moves: Move[] = [];
  private waits = false; // a display frame callback is pending

  constructor(
    private readonly host: CameraHost,
    private readonly requestFrame: (run: () => void) => void,
  ) {}

  push(move: Move): void {
    this.moves.push(move);
    if (!this.waits) this.flush();
  }

  private flush(): void {
    this.waits = this.moves.length > 0;
    if (!this.waits) return;
    this.requestFrame(() => this.flush());
    if (!this.host.ready()) return;
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

// Degrees by which the fingers have turned about their centre, clockwise.
export function twist(before: Finger[], after: Finger[]): number {
  const [a, b] = [gesture(before), gesture(after)];
  let along = 0;
  let across = 0;
  before.forEach((finger, n) => {
    const [x0, y0] = [finger.x - a.x, finger.y - a.y];
    const [x1, y1] = [after[n]!.x - b.x, after[n]!.y - b.y];
    along += x0 * x1 + y0 * y1;
    across += x0 * y1 - y0 * x1;
  });
  return (Math.atan2(across, along) * 180) / Math.PI;
}

export interface PointerHost {
  // A click or tap that moved nothing; positions are fractions of the element's size.
  clicked(x: number, y: number, event: PointerEvent): void;
  takesWheel(event: WheelEvent): boolean; // false: it scrolls what is around the element
  active?(): boolean; // false: pointers are left alone
  fingerScrolls?: boolean; // one finger may scroll the page instead (CSS touch-action)
}

// One finger or the left button orbits; two fingers, another button or shift pan; two fingers also
// zoom and roll.
export class PointerInput {
  private readonly fingers = new Map<number, Finger>();
  private panning = false;
  private travelled = 0; // greatest distance in pixels from the first contact
  private twisted = 0; // degrees not applied yet
  private holds = false; // the first move of a finger may turn out to scroll the page
  private twisting = false; // rolling has begun since a finger was added or lifted

  constructor(
    private readonly element: HTMLElement,
    private readonly moves: MoveQueue,
    private readonly host: PointerHost,
  ) {
    element.addEventListener("pointerdown", (event) => this.down(event));
    element.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      element.addEventListener(end, (event) => this.up(event));
    }
    element.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    element.addEventListener("contextmenu", (event) => {
      if (this.active()) event.preventDefault();
    });
  }

  private active(): boolean {
    return this.host.active?.() ?? true;
  }

  private down(event: PointerEvent): void {
    if (!this.active()) return;
    if (this.fingers.size === 0) {
      this.panning = event.button !== 0 || event.shiftKey;
      this.travelled = 0;
      this.holds = event.pointerType === "touch" && this.host.fingerScrolls === true;
    } else {
      this.travelled = Infinity;
      this.holds = false;
    }
    this.element.setPointerCapture(event.pointerId);
    this.holdRoll();
    this.fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    this.element.classList.add("dragging");
  }

  private up(event: PointerEvent): void {
    const known = this.fingers.delete(event.pointerId);
    this.holdRoll();
    if (this.fingers.size === 0) this.element.classList.remove("dragging");
    if (known && event.type === "pointerup" && !this.panning && this.travelled < clickPixels) {
      const box = this.element.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width;
      this.host.clicked(x, (event.clientY - box.top) / box.height, event);
    }
  }

  private holdRoll(): void {
    this.twisted = 0;
    this.twisting = false;
  }

  private turn(degrees: number): void {
    this.twisted += degrees;
    this.twisting ||= Math.abs(this.twisted) >= twistDegrees;
    if (!this.twisting) return;
    const due = this.twisted;
    this.twisted = 0;
    this.moves.push((camera) => roll(camera, due));
  }

  private move(event: PointerEvent): void {
    const finger = this.fingers.get(event.pointerId);
    if (finger === undefined) return;
    if (this.holds) {
      // A browser that scrolls cancels the pointer before the next move, which counts from here.
      this.travelled = Math.hypot(event.clientX - finger.x, event.clientY - finger.y);
      this.holds = this.travelled < clickPixels;
      return;
    }
    const old = [...this.fingers.values()].map((one) => ({ ...one }));
    const before = gesture(old);
    this.travelled += Math.hypot(event.clientX - finger.x, event.clientY - finger.y);
    finger.x = event.clientX;
    finger.y = event.clientY;
    const now = [...this.fingers.values()];
    const after = gesture(now);
    const height = this.element.clientHeight;
    const dx = (after.x - before.x) / height;
    const dy = (after.y - before.y) / height;
    if (this.fingers.size === 1 && !this.panning) {
      this.moves.push((camera) => drag(camera, dx * orbitDegrees, dy * orbitDegrees));
      return;
    }
    this.moves.push((camera) => pan(camera, dx, dy));
    if (before.spread > 1 && after.spread > 1) {
      const factor = after.spread / before.spread;
      this.moves.push((camera) => zoom(camera, factor));
      this.turn(twist(old, now));
    }
  }

  private wheel(event: WheelEvent): void {
    if (!this.host.takesWheel(event)) return;
    event.preventDefault();
    this.moves.push((camera) => zoom(camera, wheelZoom(event)));
  }
}

// Zoom factor of a wheel event; the target does not move.
export function wheelZoom({ deltaY, deltaMode, ctrlKey }: WheelEvent): number {
  const [factor, most] = ctrlKey ? [pinchFactor, pinchPixelsMax] : [wheelFactor, wheelPixelsMax];
  const pixels = deltaY * (deltaMode === 0 ? 1 : linePixels);
  return factor ** -clamp(pixels, -most, most);
}
