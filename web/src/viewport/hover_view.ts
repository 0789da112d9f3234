// The value under the cursor on the page: mouse position on the picture -> text beside the cursor.
// It can be switched on or off for the session; on touch screens a tap probes instead.
import type { Api } from "../wire/api";
import { make } from "../base/dom";
import { Hover } from "./hover";
import { hoverLines } from "../view/sample_position";
import type { Found } from "./probe";
import type { Dataset, View } from "../wire/protocol";
import { hoverOn } from "../view/hover_setting";

export interface HoverViewHost {
  api: Api;
  view(): View;
  dataset(): Dataset;
  playing(): boolean;
  find(at: [number, number]): Found | null;
}

const gap = 14; // pixels between the cursor and the text

export class HoverView {
  private readonly hover: Hover<Found>;

  constructor(
    private readonly canvas: HTMLElement,
    private readonly element: HTMLElement,
    private readonly host: HoverViewHost,
  ) {
    this.hover = new Hover<Found>({
      now: () => performance.now(),
      setTimeout: (run, ms) => window.setTimeout(run, ms),
      clearTimeout: (timer) => window.clearTimeout(timer),
      busy: () =>
        !hoverOn.value ||
        document.hidden ||
        host.playing() ||
        canvas.classList.contains("dragging"),
      find: (at) => this.find(at),
      request: (found, signal) => this.request(found, signal),
      show: (lines, at) => this.show(lines, at),
    });
    for (const type of ["pointermove", "pointerdown", "pointerup"] as const) {
      canvas.addEventListener(type, (event) => this.move(event));
    }
    canvas.addEventListener("pointerleave", () => this.hover.leave());
    document.addEventListener("visibilitychange", () => this.hover.poke());
    hoverOn.watch(() => this.hover.poke());
  }

  // Call when the view may have changed.
  refresh(): void {
    this.hover.poke();
  }

  private move(event: PointerEvent): void {
    if (event.pointerType === "touch") return;
    const box = this.canvas.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width;
    this.hover.move([x, (event.clientY - box.top) / box.height]);
    if (event.buttons !== 0) this.hover.poke();
  }

  private find(at: [number, number]) {
    const found = this.host.find(at);
    if (found === null) return null;
    const { dataset, step = 0, vector, scalars, geometry } = this.host.view();
    const fields = [vector?.field, scalars?.map(({ field }) => field)];
    return {
      sample: found,
      key: JSON.stringify([dataset, step, found, fields, geometry?.heightField]),
    };
  }

  private async request({ sample, axis }: Found, signal: AbortSignal): Promise<string[]> {
    const { api } = this.host;
    const [dataset, view] = [this.host.dataset(), this.host.view()];
    const heights = view.geometry?.heightField ?? null;
    const probe = await api.probe(dataset.id, sample, heights, view.step ?? 0, signal);
    return hoverLines(dataset, view, probe, axis);
  }

  private show(lines: string[], [x, y]: [number, number]): void {
    const { element } = this;
    element.hidden = lines.length === 0;
    if (element.hidden) return;
    element.replaceChildren(
      ...lines.map((line, n) => make("div", n > 0 ? "hover-place" : "", line)),
    );
    element.style.left = `${100 * x}%`;
    element.style.top = `${100 * y}%`;
    // Places the text on the side with more room.
    const aside = (at: number) => (at < 0.6 ? `${gap}px` : `calc(-100% - ${gap}px)`);
    element.style.transform = `translate(${aside(x)}, ${aside(y)})`;
  }
}
