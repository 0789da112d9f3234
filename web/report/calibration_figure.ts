// A calibration -> its figure of reported against true errors, both logarithmic.
import * as Plot from "@observablehq/plot";
import type { StudyCalibration } from "../generated/study";
import {
  axisStyle,
  figure,
  gridStyle,
  legend,
  logDomain,
  logTicks,
  plotStyle,
  title,
  type LegendRow,
} from "./figure";
import { fixed, percent, powerOfTen, scientific, type Known } from "./text";

const width = 980;
const height = 560;
const margins = { marginTop: 40, marginRight: 450, marginBottom: 60, marginLeft: 74 };
const errorLeast = 1e-5; // the least error that server/quality distinguishes
const measuredColor = "#111";

// Colours by setting class.
const colors: Record<string, string> = {
  kernel: "#d1421f",
  "kernel, fewer pixels": "#e39a1d",
  "kernel, coarser data": "#b0478f",
  slab: "#1f5fbf",
  "slab, fewer pixels": "#17a2b8",
  "slab, coarser data": "#6f5bd0",
};

function legendRows(calibration: StudyCalibration): LegendRow[] {
  const rowsOf = (name: string, row: Omit<LegendRow, "text">): LegendRow[] =>
    calibration.agreement
      .filter(({ of }) => of === name)
      .map(({ count, withinTwo, median }) => {
        const label = name === "measured" ? "measured by a finer rendering" : name;
        const words = `${label}: ${percent(withinTwo)} of ${count}`;
        return { ...row, text: row.color ? `${words}, median ${fixed(median, 2)}` : words };
      });
  return [
    { text: "Within a factor of 2 of the true error (the band)", bold: true },
    ...Object.entries(colors).flatMap(([name, color]) => rowsOf(name, { color, symbol: "circle" })),
    ...rowsOf("measured", { color: measuredColor, symbol: "circle", hollow: true }),
    { text: "median: of reported over true error" },
    { text: "" },
    { text: "The same by variant of the scene", bold: true },
    ...calibration.looks.flatMap((name) => rowsOf(name, {})),
  ];
}

interface Comparison {
  x: number; // true error
  y: number; // reported error
  color: string;
  title: string;
}

function comparison(name: string, error: Known, reported: Known, color: string): Comparison {
  const title = `${name}\nreported ${scientific(reported)}, true ${scientific(error)}`;
  const counted = (value: Known) => Math.max(value ?? 0, errorLeast);
  return { x: counted(error), y: counted(reported), color, title };
}

export function calibrationFigure(scene: string, calibration: StudyCalibration): HTMLElement {
  const estimated = calibration.points.map(({ settingClass, look, error, estimate }) =>
    comparison(`${settingClass}; ${look}`, error, estimate, colors[settingClass] ?? "#000"),
  );
  const measured = calibration.measured.map((frame) =>
    comparison(
      `${frame.method}, measured; ${frame.look}`,
      frame.error,
      frame.measured,
      measuredColor,
    ),
  );
  const all = [...estimated, ...measured];
  const domain = logDomain(all.flatMap(({ x, y }) => [x, y]));
  const ticks = logTicks(domain);
  const axis = { type: "log", domain, clamp: true, label: null } as const;
  const labels = {
    ...axisStyle,
    text: powerOfTen,
    labelAnchor: "center",
    labelArrow: "none",
  } as const;
  const marks = { x: "x", y: "y", ariaLabel: "title", className: "point" } as const;
  const svg = Plot.plot({
    ...margins,
    width,
    height,
    style: plotStyle,
    ariaLabel: `${scene}: reported against true errors`,
    x: axis,
    y: axis,
    marks: [
      Plot.areaY(band(domain), { x: "x", y1: "low", y2: "high", fill: "#eef3e6" }),
      Plot.gridX(ticks, gridStyle),
      Plot.gridY(ticks, gridStyle),
      Plot.line([domain[0], domain[1]], { x: Plot.identity, y: Plot.identity, stroke: "#9aa88a" }),
      Plot.frame({ stroke: "#777" }),
      Plot.axisX(ticks, { ...labels, label: "True error, RMS of linear RGBA", labelOffset: 46 }),
      Plot.axisY(ticks, {
        ...labels,
        label: "Reported error, RMS of linear RGBA",
        labelOffset: 64,
      }),
      Plot.dot(estimated, { ...marks, r: 2.4, fill: "color", fillOpacity: 0.6 }),
      Plot.dot(measured, { ...marks, r: 4, stroke: "color", strokeWidth: 1 }),
      title(`${scene}: reported against true error`, margins.marginLeft),
      ...legend(legendRows(calibration), width - margins.marginRight + 24, margins.marginTop + 6),
      Plot.tip(all, Plot.pointer({ x: "x", y: "y", title: "title" })),
    ],
  });
  const caption =
    "Reported against true errors of views that were not calibrated; the tables below list shares.";
  return figure(svg, caption, `calibration-${scene}.svg`);
}

// Within a factor of 2 of the diagonal; the scale clamps it to the frame.
function band([low, high]: [number, number]): { x: number; low: number; high: number }[] {
  return [low, 2 * low, high / 2, high].map((x) => ({
    x,
    low: Math.max(low, x / 2),
    high: Math.min(high, 2 * x),
  }));
}
