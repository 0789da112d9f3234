// The box of the region over the picture, with a handle on each face that can be moved. A drag
// moves the face along its axis from sample to sample; arrow keys do the same. Shown while the
// folder Region of the panel is open.
import { makeSvg, setAttributes } from "../base/dom";
import { clamp, type Vec3, type Patch } from "@windsplat/client/parts";
import { project, type Camera, type Dataset, type View } from "@windsplat/client";
import {
  alongAxis,
  cropBox,
  faceCentre,
  faces,
  hasHandle,
  limitsOf,
  rangeWith,
  sampleOfFace,
  towardViewer,
  type CropBox,
  type Face,
} from "../view/crop_box";
import { axisNames, coordinateText } from "../view/sample_position";

export interface RegionBoxHost {
  on(): boolean; // a dataset is open, and so is the folder of its region
  camera(): Camera | null;
  view(): View;
  explicitView(): View;
  dataset(): Dataset;
  change(patch: Patch): void;
  ready(): boolean; // earlier patches have left the send buffer
}

// A face that is dragged: everything as it was when the handle was taken.
interface Drag {
  face: Face;
  box: CropBox;
  camera: Camera;
  start: number; // world position of the face
  offset: [number, number]; // of the pointer from the face, pixels
  pointer: number;
  sample: number; // sent last; -1: none
  at: [number, number] | null; // newest position that has not been used, pixels
}

const radius = 8; // of handles, pixels
const touchRadius = 16; // takes the pointer
const pageShare = 0.1; // of the samples, by page up and down

// A line with a dark rim, which keeps it in sight over any picture: two paths of the same course.
type Outline = [line: SVGElement, rim: SVGElement];

function outline(kind: string): Outline {
  const path = (name: string): SVGElement =>
    makeSvg("path", { class: `${name} ${kind}`.trim(), "aria-hidden": "true" });
  return [path("region-line"), path("region-rim")];
}

const pathPoint = (point: [number, number]): string => point.map((at) => at.toFixed(1)).join(" ");

export class RegionBox {
  private readonly edges: [near: Outline, far: Outline];
  private readonly handles: SVGElement[];
  private drag: Drag | null = null;
  private drawn = ""; // what the lines and handles show

  constructor(
    private readonly svg: SVGSVGElement,
    private readonly host: RegionBoxHost,
  ) {
    this.edges = [outline(""), outline("is-far")];
    this.handles = faces.map((face) => this.makeHandle(face));
    svg.append(...this.edges.flat().reverse(), ...this.handles);
    new ResizeObserver(() => this.show()).observe(svg);
  }

  // Call when the view, the camera or the folder may have changed, as with every picture. What is
  // shown already is left alone: a change of it paints the whole picture of the page again.
  show(): void {
    const camera = this.host.on() ? this.host.camera() : null;
    const box = camera === null ? null : cropBox(this.host.dataset(), this.host.view());
    const hidden = box === null;
    if (this.svg.hasAttribute("hidden") !== hidden) this.svg.toggleAttribute("hidden", hidden);
    if (camera === null || box === null) return;
    const slice = this.host.view().geometry?.slice?.axis;
    const { clientWidth, clientHeight } = this.svg;
    const { id } = this.host.dataset();
    const held = this.drag?.face ?? null;
    const wanted = JSON.stringify([id, clientWidth, clientHeight, camera, box, slice, held]);
    if (wanted === this.drawn) return;
    this.drawn = wanted;
    this.showEdges(camera, box);
    this.handles.forEach((handle, n) => {
      const face = faces[n]!;
      const held = this.drag?.face === face;
      const offered = slice !== axisNames[face.axis] && hasHandle(camera, box, face);
      const at = offered || held ? this.place(camera, faceCentre(box, face)) : null;
      handle.toggleAttribute("hidden", at === null);
      if (at !== null) this.showHandle(handle, box, face, at);
    });
  }

  // Position in the picture, pixels.
  private place(camera: Camera, point: Vec3): [number, number] | null {
    const { clientWidth, clientHeight } = this.svg;
    const at = project(camera, point, clientWidth / clientHeight);
    return at === null ? null : [at[0] * clientWidth, at[1] * clientHeight];
  }

  // Edges whose two faces are turned away are dashed.
  private showEdges(camera: Camera, box: CropBox): void {
    const away = faces.map((face) => towardViewer(camera, box, face) < 0);
    const lines = ["", ""]; // near, far
    for (const n of [0, 1, 2] as const) {
      const [b, c] = [(n + 1) % 3, (n + 2) % 3] as [0 | 1 | 2, 0 | 1 | 2];
      for (const corner of [0, 1, 2, 3]) {
        const [endB, endC] = [corner & 1, corner >> 1];
        const from: Vec3 = [...box.min];
        if (endB === 1) from[b] = box.max[b];
        if (endC === 1) from[c] = box.max[c];
        const to: Vec3 = [...from];
        to[n] = box.max[n];
        const [p, q] = [this.place(camera, from), this.place(camera, to)];
        if (p === null || q === null) continue;
        const far = away[2 * b + endB]! && away[2 * c + endC]!;
        lines[Number(far)] += `M${pathPoint(p)}L${pathPoint(q)}`;
      }
    }
    this.edges.forEach((paths, far) => {
      for (const path of paths) path.setAttribute("d", lines[far]!);
    });
  }

  private showHandle(handle: SVGElement, box: CropBox, face: Face, [x, y]: [number, number]): void {
    const dataset = this.host.dataset();
    const { ends } = box.axes[face.axis];
    const [low, high] = limitsOf(box, face);
    const now = sampleOfFace(box, face, box[face.end === 0 ? "min" : "max"][face.axis]);
    const name = dataset.axes[axisNames[face.axis]].name || axisNames[face.axis];
    setAttributes(handle, {
      transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})`,
      "aria-label": `Region: ${face.end === 0 ? "first" : "last"} ${name}`,
      "aria-valuemin": low,
      "aria-valuemax": high,
      "aria-valuenow": now,
      "aria-valuetext": coordinateText(dataset, face.axis, ends[face.end]),
    });
    handle.querySelector("title")!.textContent = handle.getAttribute("aria-valuetext");
  }

  private makeHandle(face: Face): SVGElement {
    const handle = makeSvg("g", { role: "slider", tabindex: 0, class: "region-handle" });
    handle.append(
      makeSvg("title", {}),
      makeSvg("circle", { r: touchRadius, class: "region-touch" }),
      makeSvg("circle", { r: radius, class: "region-knob" }),
    );
    handle.addEventListener("pointerdown", (event) => this.take(handle, face, event));
    handle.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      handle.addEventListener(end, (event) => this.release(event));
    }
    handle.addEventListener("keydown", (event) => this.key(face, event));
    return handle;
  }

  private pointerAt(event: PointerEvent): [number, number] {
    const { left, top } = this.svg.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  private take(handle: SVGElement, face: Face, event: PointerEvent): void {
    if (event.button !== 0 || this.drag !== null) return;
    const camera = this.host.camera();
    const box = cropBox(this.host.dataset(), this.host.view());
    const at = camera && box && this.place(camera, faceCentre(box, face));
    if (camera === null || box === null || at === null) return;
    event.preventDefault(); // selects no text
    handle.focus();
    handle.setPointerCapture(event.pointerId);
    const [x, y] = this.pointerAt(event);
    this.drag = {
      face,
      box,
      camera,
      start: faceCentre(box, face)[face.axis],
      offset: [x - at[0], y - at[1]],
      pointer: event.pointerId,
      sample: -1,
      at: null,
    };
  }

  // At most one patch for each picture of the display.
  private move(event: PointerEvent): void {
    const { drag } = this;
    if (drag === null || event.pointerId !== drag.pointer) return;
    const waits = drag.at !== null;
    drag.at = this.pointerAt(event);
    if (!waits) window.requestAnimationFrame(() => this.follow(drag));
  }

  private follow(drag: Drag): void {
    if (drag.at === null || this.drag !== drag) return;
    if (this.host.ready()) this.apply(drag);
    else window.requestAnimationFrame(() => this.follow(drag));
  }

  private apply(drag: Drag): void {
    const { face, box, camera, at, offset } = drag;
    drag.at = null;
    if (at === null) return;
    const { clientWidth, clientHeight } = this.svg;
    const wanted: [number, number] = [
      (at[0] - offset[0]) / clientWidth,
      (at[1] - offset[1]) / clientHeight,
    ];
    const centre = faceCentre(box, face);
    const moved = alongAxis(camera, clientWidth / clientHeight, centre, face.axis, wanted);
    if (moved === null) return;
    const sample = sampleOfFace(box, face, drag.start + moved);
    if (sample === drag.sample) return;
    drag.sample = sample;
    this.crop(box, face, sample, camera);
  }

  private release(event: PointerEvent): void {
    const { drag } = this;
    if (drag === null || event.pointerId !== drag.pointer) return;
    if (event.type === "pointerup") this.apply(drag);
    this.drag = null;
    this.show();
  }

  // The default camera follows the region, so that the picture would move under the pointer: the
  // present one is kept.
  private crop(box: CropBox, face: Face, sample: number, camera: Camera): void {
    const patch: Patch = { region: { [axisNames[face.axis]]: rangeWith(box, face, sample) } };
    const { eye, target, up, height } = camera;
    const own = this.host.explicitView().camera;
    if (!own?.eye || !own.target) patch.camera = { eye, target, up, height };
    this.host.change(patch);
  }

  // Right and up: onward along the axis of the world, as east, north and up.
  private key(face: Face, event: KeyboardEvent): void {
    const camera = this.host.camera();
    const box = cropBox(this.host.dataset(), this.host.view());
    if (camera === null || box === null || event.altKey || event.ctrlKey || event.metaKey) return;
    const [low, high] = limitsOf(box, face);
    const now = sampleOfFace(box, face, faceCentre(box, face)[face.axis]);
    const page = Math.max(1, Math.round(pageShare * box.axes[face.axis].size));
    const targets: Record<string, number> = {
      ArrowRight: now + 1,
      ArrowUp: now + 1,
      ArrowLeft: now - 1,
      ArrowDown: now - 1,
      PageUp: now + page,
      PageDown: now - page,
      Home: low,
      End: high,
    };
    const target = targets[event.key];
    if (target === undefined) return;
    event.preventDefault();
    const sample = clamp(target, low, high);
    if (sample !== now) this.crop(box, face, sample, camera);
  }
}
