// The camera of the view: the user's camera commands -> patches.
import { frameBox, scaledBox, withProjection, type Angles, type Box } from "./camera";
import type { Camera } from "./camera";
import type { Vec3 } from "../base/vec3";
import type { ViewModel } from "./view_model";
import type { Patch } from "./view_state";

// bounds of a grid that is mapped to a sphere
const globe: Box = { min: [-1, -1, -1], max: [1, 1, 1] };

const round = (v: number): number => Number(v.toFixed(6));
const roundAll = (v: Vec3): Vec3 => [round(v[0]), round(v[1]), round(v[2])];

// To the digits that are sent.
export const roundedCamera = (camera: Camera): Camera => ({
  ...camera,
  eye: roundAll(camera.eye),
  target: roundAll(camera.target),
  up: roundAll(camera.up),
  height: round(camera.height),
});

export interface CameraControlHost {
  change(patch: Patch): void;
  size(): [number, number]; // size of the picture in pixels
  ready(): boolean; // whether a patch would be sent without waiting for earlier ones
}

export class CameraControl {
  constructor(
    private readonly model: ViewModel,
    private readonly host: CameraControlHost,
  ) {}

  ready(): boolean {
    return this.host.ready();
  }

  camera(): Camera | null {
    return this.model.camera();
  }

  setCamera(camera: Camera): void {
    const { eye, target, up, height, projection } = roundedCamera(camera);
    const patch: Patch = { eye, target, up, height };
    // A stated eye is in perspective by default, also where the server chose otherwise.
    const stated = this.model.state.document.camera?.projection ?? "perspective";
    if (projection !== stated) patch.projection = projection;
    this.host.change({ camera: patch });
  }

  // Resets the camera; the server then frames the whole box, or faces the slice, for the present
  // picture size.
  reset(): void {
    this.host.change({ camera: { eye: null, target: null, up: null, height: null } });
  }

  // Views the whole volume from these angles, upright; null: there is no volume yet.
  viewFrom(angles: Angles): Camera | null {
    const camera = this.camera();
    if (camera === null) return null;
    const world = this.model.dataset().world as Box;
    const { mapping, scale } = this.model.view().geometry ?? {};
    const box = mapping === "sphere" ? globe : scaledBox(world, scale ?? [1, 1, 1]);
    const [width, height] = this.host.size();
    return frameBox(camera, box, angles, width / height);
  }

  toggleProjection(): void {
    const camera = this.camera();
    if (camera === null) return;
    const other = camera.projection === "perspective" ? "orthographic" : "perspective";
    this.setCamera(withProjection(camera, other));
  }
}
