// Legend entries -> elements over the picture. Rebuilt only when what it says has changed.
import { make, makeSvg } from "./dom";
import type { LegendEntry } from "./legend_entries";
import type { ColorMaps } from "./color_maps";

const stripHeight = 10; // of the curve's own coordinates

export class Legend {
  private shown = "";

  constructor(
    private readonly element: HTMLElement,
    private readonly maps: ColorMaps,
  ) {}

  show(entries: LegendEntry[]): void {
    const key = JSON.stringify(entries) + this.maps.names().join();
    if (key === this.shown) return;
    this.shown = key;
    this.element.replaceChildren(...entries.map((entry) => this.entry(entry)));
    this.element.hidden = entries.length === 0;
  }

  private entry(entry: LegendEntry): HTMLElement {
    const box = make("div", `legend-entry legend-${entry.kind}`);
    const title = make("div", "legend-title");
    title.append(make("span", "legend-name", entry.title));
    if (entry.units !== "") title.append(make("span", "legend-units", entry.units));
    const strip = make("div", "legend-strip");
    strip.style.background =
      entry.map === null ? (entry.color ?? "") : this.maps.gradient(entry.map);
    if (entry.extinction.length > 0) strip.append(extinctionCurve(entry.extinction));
    box.append(title, strip);
    if (entry.range !== null) {
      const ticks = make("div", "legend-ticks");
      for (const tick of entry.ticks) {
        const mark = make("span", "legend-tick", tick.text);
        mark.style.left = `${(100 * tick.at).toFixed(2)}%`;
        ticks.append(mark);
      }
      box.append(ticks);
    }
    if (entry.note !== "") box.append(make("div", "legend-note", entry.note));
    const said = entry.ticks.map((tick) => tick.text).join(", ");
    box.setAttribute("role", "img");
    box.setAttribute("aria-label", `Legend: ${entry.title} ${entry.units}; ticks ${said}`);
    return box;
  }
}

// How opaque the medium is along its strip: the colours show below the curve, what is above it is
// covered.
function extinctionCurve(points: [number, number][]): SVGElement {
  const inside = points.map(([at, share]) => [100 * Math.min(Math.max(at, -1), 2), share] as const);
  const first = inside[0]!;
  const last = inside[inside.length - 1]!;
  const left = Math.min(0, first[0]);
  const right = Math.max(100, last[0]);
  const path = [[left, first[1]] as const, ...inside, [right, last[1]] as const]
    .map(([x, share]) => `${x.toFixed(2)},${(stripHeight * (0.94 - 0.88 * share)).toFixed(2)}`)
    .join(" ");
  const svg = makeSvg("svg", {
    viewBox: `0 0 100 ${stripHeight}`,
    preserveAspectRatio: "none",
    "aria-hidden": "true",
  });
  svg.append(makeSvg("polygon", { points: `${left},0 ${path} ${right},0`, class: "above" }));
  svg.append(makeSvg("polyline", { points: path, class: "curve" }));
  return svg;
}
