// Common parts of the figures: logarithmic axes, legends, and the figure element with its caption.
import {
  dot,
  link,
  text,
  type Markish,
  type PlotOptions,
  type SymbolType,
} from "@observablehq/plot";
import { element } from "./dom";

export type Domain = [low: number, high: number];

export const drawable = (value: number | null): value is number => value !== null && value > 0;

// A domain with a margin around the values, at least half a decade wide.
export function logDomain(values: (number | null)[]): Domain {
  const known = values.filter(drawable);
  const low = known.length > 0 ? Math.min(...known) : 1;
  const high = known.length > 0 ? Math.max(...known) : 1;
  const decades = Math.log10(high / low);
  const spread = Math.max(decades, 0.5);
  const margin = 10 ** (0.06 * spread + 0.5 * (spread - decades));
  return [low / margin, high * margin];
}

// Powers of ten within the domain; multiples of them too if there are few, and fewer if there are
// many.
export function logTicks([low, high]: Domain): number[] {
  const decades = Math.log10(high / low);
  const factors = decades > 2.5 ? [1] : decades > 1 ? [1, 2, 5] : [1, 2, 3, 5, 7];
  const every = Math.ceil(decades / 10);
  const ticks: number[] = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); ++power) {
    if (power % every !== 0) continue;
    for (const factor of factors) {
      const tick = Number(`${factor}e${power}`);
      if (tick >= low && tick <= high) ticks.push(tick);
    }
  }
  return ticks;
}

export interface LegendRow {
  text: string;
  color?: string; // without: the row is a note
  symbol?: SymbolType;
  hollow?: boolean;
  dash?: string; // dash pattern of a line through the symbol
  bold?: boolean;
}

const rowHeight = 18;

// The legend to the right of the frame; lengths in pixels.
export function legend(rows: LegendRow[], left: number, top: number): Markish[] {
  const at = (value: number) => ({ value: [value], scale: null });
  return rows.flatMap((row, n) => {
    const y = at(top + n * rowHeight);
    const marks: Markish[] = [];
    if (row.color !== undefined && row.dash !== undefined) {
      const ends = { x1: at(left), x2: at(left + 40), y1: y, y2: y };
      const stroke = { stroke: row.color, strokeWidth: 1.8, strokeDasharray: row.dash };
      marks.push(link([0], { ...ends, ...stroke }));
    }
    if (row.color !== undefined && row.symbol !== undefined) {
      const paint = row.hollow ? { stroke: row.color, strokeWidth: 1.4 } : { fill: row.color };
      marks.push(dot([0], { x: at(left + 20), y, r: 3.6, symbol: row.symbol, ...paint }));
    }
    marks.push(
      text([row.text], {
        x: at(row.color === undefined ? left : left + 48),
        y,
        text: [row.text],
        textAnchor: "start",
        fill: row.color === undefined && !row.bold ? "#555" : "#1b1d22",
        fontWeight: row.bold ? "bold" : "normal",
      }),
    );
    return marks;
  });
}

export const title = (words: string, left: number): Markish =>
  text([words], {
    x: { value: [left], scale: null },
    y: { value: [22], scale: null },
    text: [words],
    textAnchor: "start",
    fontSize: 16,
    fontWeight: "bold",
  });

export const plotStyle: PlotOptions["style"] = {
  fontFamily: "sans-serif",
  fontSize: "12px",
  background: "white",
};

export const axisStyle = { tickSize: 0, tickPadding: 7 } as const;
export const gridStyle = { stroke: "#e4e4e8", strokeOpacity: 1 } as const;

function save(svg: Element, name: string): void {
  const blob = new Blob([new XMLSerializer().serializeToString(svg)], { type: "image/svg+xml" });
  const address = URL.createObjectURL(blob);
  element("a", { href: address, download: name }).click();
  URL.revokeObjectURL(address);
}

export function figure(svg: Element, caption: string, fileName: string): HTMLElement {
  // The figure is a single image to assistive technology, which finds the numbers in the tables, so
  // the labels of its marks are hidden.
  svg.setAttribute("role", "img");
  for (const mark of svg.querySelectorAll("[aria-label]")) {
    mark.setAttribute("data-label", mark.getAttribute("aria-label")!);
    mark.removeAttribute("aria-label");
  }
  const button = element("button", { type: "button" }, "Save as SVG");
  button.addEventListener("click", () => save(svg, fileName));
  const words = element("figcaption", {}, element("span", {}, caption), button);
  return element("figure", { class: "plot" }, svg, words);
}
