// Legend entries -> elements over the picture. They are rebuilt only when their content has
// changed.
import { make, makeSvg } from "../base/dom";
import { curvePoints, type LegendEntry } from "../view/legend_entries";
import type { ColorMaps } from "@windsplat/client/parts";

const stripHeight = 10; // height in the coordinates of the curve

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
    const row = make("div", "legend-row");
    row.append(strip, ...this.arrows(entry));
    box.append(title, row);
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
    if (entry.leftOut !== "") {
      box.append(make("div", "legend-note legend-left-out", entry.leftOut));
    }
    const tickTexts = entry.ticks.map((tick) => tick.text).join(", ");
    const ends = ["smaller", "greater"].filter((_, n) => entry.beyond[n]);
    const more =
      ends.length === 0 ? "" : `; ${ends.join(" and ")} values have the colour of the end`;
    const leftOut = `${more}${entry.leftOut === "" ? "" : `; ${entry.leftOut}`}`;
    box.setAttribute("role", "img");
    box.setAttribute(
      "aria-label",
      `Legend: ${entry.title} ${entry.units}; ticks ${tickTexts}${leftOut}`,
    );
    return box;
  }

  // Triangles in the colours of the ends beyond which values lie.
  private arrows({ beyond, map }: LegendEntry): HTMLElement[] {
    if (map === null) return [];
    return (["low", "high"] as const)
      .filter((_, n) => beyond[n])
      .map((end) => {
        const arrow = make("span", `legend-arrow legend-arrow-${end}`);
        // one colour: the rest of the gradient lies beside the arrow
        arrow.style.background =
          end === "low" ? this.maps.gradient(map, 100, 200) : this.maps.gradient(map, -100, 0);
        return arrow;
      });
  }
}

// Opacity of the medium along its strip: the colours are visible below the curve and covered above
// it.
function extinctionCurve(points: [number, number][]): SVGElement {
  const at = curvePoints(points);
  const path = at
    .map(([x, y]) => `${(100 * x).toFixed(2)},${(stripHeight * y).toFixed(2)}`)
    .join(" ");
  const left = 100 * at[0]![0];
  const right = 100 * at.at(-1)![0];
  const svg = makeSvg("svg", {
    viewBox: `0 0 100 ${stripHeight}`,
    preserveAspectRatio: "none",
    "aria-hidden": "true",
  });
  svg.append(makeSvg("polygon", { points: `${left},0 ${path} ${right},0`, class: "above" }));
  svg.append(makeSvg("polyline", { points: path, class: "curve" }));
  return svg;
}
