// The value under the cursor on the page: mouse position on the picture -> text beside the cursor,
// and a ring around the sample that it is read from. It is the sample that the picture shows there,
// which the server finds, or by choice the one in the probe's level. It can be switched on or off
// for the session; on touch screens a tap shows it and the next touch hides it.
import type { Api, Dataset, View } from "@windsplat/client";
import { make } from "../base/dom";
import { Hover } from "./hover";
import { featureLines, ringAt } from "../view/feature";
import { pixelAt } from "@windsplat/client/parts";
import { derivedIn, fieldsIn } from "../view/view_fields";
import { hoverLines } from "../view/sample_position";
import type { Found } from "./probe";
import { hoverOf, hoverOn } from "../view/hover_setting";

export interface HoverViewHost {
  api: Api;
  view(): View;
  dataset(): Dataset;
  playing(): boolean;
  find(at: [number, number]): Found | null;
}

const gap = 14; // pixels between the cursor and the text
const apart = 3; // CSS pixels between cursor positions of different values

// Where the value is sought: in a plane, or at a pixel of the picture.
type Target = Found | { pixel: [number, number] };

export class HoverView {
  private readonly hover: Hover<Target>;
  private dismissed = false; // the touch that goes on has hidden a value
  private marked: [number, number] | null = null; // the ring of the newest answer

  constructor(
    private readonly canvas: HTMLElement,
    private readonly element: HTMLElement,
    private readonly ring: SVGElement,
    private readonly host: HoverViewHost,
  ) {
    this.hover = new Hover<Target>({
      now: () => performance.now(),
      setTimeout: (run, ms) => window.setTimeout(run, ms),
      clearTimeout: (timer) => window.clearTimeout(timer),
      busy: () =>
        !hoverOn.value ||
        document.hidden ||
        host.playing() ||
        canvas.classList.contains("dragging"),
      find: (at) => this.find(at),
      request: (target, signal) => this.request(target, signal),
      show: (lines, at) => this.show(lines, at),
    });
    for (const type of ["pointermove", "pointerdown", "pointerup"] as const) {
      canvas.addEventListener(type, (event) => this.move(event));
    }
    canvas.addEventListener("pointerleave", ({ pointerType }) => {
      if (pointerType !== "touch") this.hover.leave(); // a lifted finger leaves, too
    });
    document.addEventListener("visibilitychange", () => this.hover.poke());
    for (const setting of [hoverOn, hoverOf]) setting.watch(() => this.hover.poke());
  }

  // Call when the view may have changed.
  refresh(): void {
    this.hover.poke();
  }

  // Shows the value at a place that was tapped, until the picture is touched again.
  tap(at: [number, number]): void {
    if (!this.dismissed) this.hover.move(at);
  }

  private move(event: PointerEvent): void {
    if (event.pointerType === "touch") {
      if (event.type !== "pointerdown") return;
      this.dismissed = !this.element.hidden;
      this.hover.leave();
      return;
    }
    const box = this.canvas.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width;
    this.hover.move([x, (event.clientY - box.top) / box.height]);
    if (event.buttons !== 0) this.hover.poke();
  }

  private find(at: [number, number]) {
    if (hoverOf.value === "feature") return this.pixel(at);
    const found = this.host.find(at);
    if (found === null) return null;
    const view = this.host.view();
    const { dataset, step = 0, geometry, difference } = view;
    const fields = fieldsIn(view);
    return {
      sample: found,
      key: JSON.stringify([dataset, step, found, fields, geometry?.heightField, difference]),
    };
  }

  // Positions that are a few pixels apart have the same target.
  private pixel(at: [number, number]) {
    const [x, y] = at;
    if (!(x >= 0 && y >= 0 && x < 1 && y < 1)) return null;
    const view = this.host.view();
    const box = [this.canvas.clientWidth, this.canvas.clientHeight];
    const near = at.map((place, n) => Math.round((place * box[n]!) / apart));
    return { sample: { pixel: pixelAt(view, at) }, key: JSON.stringify([view, near]) };
  }

  private async request(target: Target, signal: AbortSignal): Promise<string[]> {
    const { api } = this.host;
    const [dataset, view] = [this.host.dataset(), this.host.view()];
    this.marked = null;
    if ("pixel" in target) {
      const feature = await api.pick(view, target.pixel, signal);
      this.marked = feature === null ? null : ringAt(view, feature);
      return feature === null ? [] : featureLines(dataset, feature);
    }
    const { sample, axis } = target;
    const heights = view.geometry?.heightField ?? null;
    const { step = 0, difference } = view;
    const of = { step, difference, derived: derivedIn(dataset, view) };
    const probe = await api.probe(dataset.id, sample, heights, of, signal);
    return hoverLines(dataset, view, probe, axis);
  }

  private show(lines: string[], [x, y]: [number, number]): void {
    const { element } = this;
    element.hidden = lines.length === 0;
    this.ring.toggleAttribute("hidden", element.hidden || this.marked === null);
    if (element.hidden) return;
    if (this.marked !== null) {
      this.ring.style.left = `${(100 * this.marked[0]).toFixed(2)}%`;
      this.ring.style.top = `${(100 * this.marked[1]).toFixed(2)}%`;
    }
    element.replaceChildren(
      ...lines.map((line, n) => make("div", n > 0 ? "hover-place" : "", line)),
    );
    element.style.left = `${100 * x}%`;
    element.style.top = `${100 * y}%`;
    // Places the text on the side with more room.
    const aside = (at: number) => (at < 0.5 ? `${gap}px` : `calc(-100% - ${gap}px)`);
    element.style.transform = `translate(${aside(x)}, ${aside(y)})`;
  }
}
