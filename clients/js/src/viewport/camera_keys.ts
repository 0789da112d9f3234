// Keys that move the camera.
import { drag, pan, roll, zoom } from "../view/camera";
import type { Move } from "./input";

export interface CameraKey {
  keys: string[]; // as KeyboardEvent.key names them
  shown: string;
  does: string;
  move(shift: boolean): Move;
}

const arrowDegrees = 5;
const arrowShift = 0.05; // of the picture's height
const keyZoom = 1.15;

// right, down: 1, 0 or -1.
const arrow = (
  key: string,
  shown: string,
  does: string,
  right: number,
  down: number,
): CameraKey => ({
  keys: [key],
  shown,
  does,
  move: (shift) => (camera) =>
    shift
      ? pan(camera, arrowShift * right, arrowShift * down)
      : drag(camera, arrowDegrees * right, arrowDegrees * down),
});

const simple = (keys: string[], shown: string, does: string, move: Move): CameraKey => ({
  keys,
  shown,
  does,
  move: () => move,
});

export const cameraKeys: readonly CameraKey[] = [
  arrow("ArrowLeft", "←", "rotate (shift: pan) left", -1, 0),
  arrow("ArrowRight", "→", "rotate (shift: pan) right", 1, 0),
  arrow("ArrowUp", "↑", "tilt (shift: pan) up", 0, -1),
  arrow("ArrowDown", "↓", "tilt (shift: pan) down", 0, 1),
  simple(["+", "="], "+", "zoom in", (camera) => zoom(camera, keyZoom)),
  simple(["-", "_"], "−", "zoom out", (camera) => zoom(camera, 1 / keyZoom)),
  simple([","], ",", "roll left", (camera) => roll(camera, -5)),
  simple(["."], ".", "roll right", (camera) => roll(camera, 5)),
];

// The move of a key; null: it moves nothing.
export function moveOfKey({ key, shiftKey }: Pick<KeyboardEvent, "key" | "shiftKey">): Move | null {
  return cameraKeys.find(({ keys }) => keys.includes(key))?.move(shiftKey) ?? null;
}
