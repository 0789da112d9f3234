// Animates the camera to a preset, or sets it at once if reduced motion is preferred. Any other
// change of the camera stops the animation.
import { between, type Camera } from "../view/camera";
import { length, subtract } from "../base/vec3";
import type { MoveQueue } from "./input";

const turnMs = 250;
const near = 1e-5; // tolerance, because coordinates on the wire are rounded

export interface TurnHost {
  now(): number; // ms
  requestFrame(run: () => void): void;
  still(): boolean; // whether reduced motion is preferred
}

const isAt = (camera: Camera, place: Camera): boolean =>
  camera.projection === place.projection &&
  length(subtract(camera.eye, place.eye)) < near * (1 + length(place.eye)) &&
  length(subtract(camera.up, place.up)) < near;

// Ease in and out.
const eased = (t: number): number => t * t * (3 - 2 * t);

export class Turn {
  private turns = 0;

  constructor(
    private readonly moves: MoveQueue,
    private readonly host: TurnHost,
  ) {}

  to(camera: Camera | null): void {
    this.turns += 1;
    if (camera === null) return;
    if (this.host.still()) this.moves.push(() => camera);
    else this.begin(camera, this.turns);
  }

  private begin(to: Camera, turn: number): void {
    const start = this.host.now();
    let from: Camera | null = null;
    let last: Camera | null = null;
    let left = false; // whether something else moved the camera
    const step = () => {
      if (turn !== this.turns || left) return;
      const t = Math.min(1, (this.host.now() - start) / turnMs);
      this.moves.push((camera) => {
        left ||= turn !== this.turns || (last !== null && !isAt(camera, last));
        if (left) return camera;
        from ??= camera;
        last = t < 1 ? between(from, to, eased(t)) : to;
        return last;
      });
      if (t < 1) this.host.requestFrame(step);
    };
    step();
  }
}
