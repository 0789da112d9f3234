// The camera as data attributes of the canvas, for tests and style sheets.
import { anglesOf, distanceOf, rollOf, type Camera } from "@windsplat/client";

export function markCamera({ dataset }: HTMLElement, camera: Camera): void {
  const { azimuth, elevation } = anglesOf(camera);
  dataset.azimuth = azimuth.toFixed(1);
  dataset.elevation = elevation.toFixed(1);
  dataset.distance = distanceOf(camera).toFixed(4);
  dataset.roll = rollOf(camera).toFixed(1);
}
