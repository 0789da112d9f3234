// The probe on the picture: clicks -> probe position, probe position -> a mark. The probe is on
// while its folder in the panel is open. A click moves it to the sample that the picture shows
// there, or by choice to the one in the slice or in its own level.
import {
  cameraFrame,
  degree,
  pointInPlane,
  project,
  type Camera,
  type Api,
  type Dataset,
  type View,
} from "@windsplat/client";
import { axisNames, sampleAt, worldOf, type Sample } from "../view/sample_position";
import { sampleOf } from "../view/feature";
import { pixelAt } from "@windsplat/client/parts";
import { hoverOf } from "../view/hover_setting";

// below this angle positions in a horizontal plane are too inaccurate
const edgewiseMax = Math.sin(8 * degree);

export interface Found {
  sample: Sample;
  axis: 0 | 1 | 2; // the position lies in the plane perpendicular to this axis
}

// The probe's controls, which store its position.
export interface ProbeControls {
  readonly on: boolean;
  readonly place: Sample;
  open(): void;
  close(): void;
  moveTo(sample: Sample): void;
}

export interface ProbeHost {
  api: Pick<Api, "pick">;
  controls(): ProbeControls | null; // null: no dataset is open
  camera(): Camera | null;
  view(): View;
  dataset(): Dataset;
  aspect(): number; // width / height of the picture
}

export class Probe {
  private clicks = 0; // so that an earlier answer does not follow a later one

  constructor(
    private readonly host: ProbeHost,
    private readonly mark: SVGElement,
    private readonly button: HTMLButtonElement,
  ) {
    button.addEventListener("click", () => this.toggle());
  }

  toggle(): void {
    const controls = this.host.controls();
    if (controls === null) return;
    if (controls.on) {
      controls.close();
      return;
    }
    document.documentElement.classList.remove("no-panel");
    controls.open();
  }

  // A position on the picture has no depth, so the sample is sought in the slice, or without a
  // slice in the probe's level. If that plane is seen edge-on, the vertical section through the
  // probe that faces the eye is used.
  find(at: [number, number]): Found | null {
    const controls = this.host.controls();
    const camera = this.host.camera();
    if (controls === null || camera === null) return null;
    const [view, dataset] = [this.host.view(), this.host.dataset()];
    const slice = view.geometry?.slice;
    const sample: Sample = [...controls.place];
    let axis: 0 | 1 | 2 = 2;
    if (slice) {
      axis = axisNames.indexOf(slice.axis) as typeof axis;
      sample[axis] = Math.round(slice.index);
    } else {
      const { forward } = cameraFrame(camera);
      const edgewise = Math.abs(forward[2]) < edgewiseMax;
      if (edgewise) axis = Math.abs(forward[0]) > Math.abs(forward[1]) ? 0 : 1;
    }
    const world = worldOf(dataset, view, sample);
    if (world === null) return null;
    const point = pointInPlane(camera, at, this.host.aspect(), axis, world[axis]);
    const found = point === null ? null : sampleAt(dataset, view, point);
    if (found === null) return null;
    found[axis] = sample[axis];
    return { sample: found, axis };
  }

  pick(at: [number, number], deliberate: boolean): void {
    const controls = this.host.controls();
    if (controls === null || !(controls.on || deliberate)) return;
    const click = ++this.clicks;
    void this.sampleAt(at).then((sample) => {
      if (sample === null || click !== this.clicks || controls !== this.host.controls()) return;
      controls.moveTo(sample);
      if (!controls.on) this.toggle();
    });
  }

  // In the probe's level also where the picture is empty.
  async sampleAt(at: [number, number]): Promise<Sample | null> {
    const view = this.host.view();
    const seen =
      hoverOf.value === "level"
        ? null
        : await this.host.api.pick(view, pixelAt(view, at)).catch(() => null);
    const sample = seen === null ? null : sampleOf(seen.position);
    return sample ?? this.find(at)?.sample ?? null;
  }

  show(): void {
    const controls = this.host.controls();
    const on = controls?.on ?? false;
    this.button.setAttribute("aria-pressed", String(on));
    const camera = on ? this.host.camera() : null;
    const point =
      camera === null ? null : worldOf(this.host.dataset(), this.host.view(), controls!.place);
    const at = point === null ? null : project(camera!, point, this.host.aspect());
    this.mark.toggleAttribute("hidden", at === null);
    if (at === null) return;
    this.mark.style.left = `${(100 * at[0]).toFixed(2)}%`;
    this.mark.style.top = `${(100 * at[1]).toFixed(2)}%`;
  }
}
