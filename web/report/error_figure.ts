// A scene's points and curves -> its figure of error against run time, both logarithmic.
import * as Plot from "@observablehq/plot";
import type { StudyCurve, StudyPoint, StudyScene } from "../generated/study";
import {
  axisStyle,
  drawable,
  figure,
  gridStyle,
  legend,
  logDomain,
  logTicks,
  plotStyle,
  title,
  type LegendRow,
} from "./figure";
import { fixed, powerOfTen, scientific, short } from "./text";

const width = 980;
const height = 520;
const margins = { marginTop: 40, marginRight: 360, marginBottom: 60, marginLeft: 74 };

const colors: Record<StudyPoint["method"], Record<StudyPoint["compositing"], string>> = {
  kernel: {
    analytic: "#d1421f",
    cd: "#e39a1d",
    "cd-naive": "#b0478f",
    simple: "#8a6b3a",
    "cd-euler": "#6b6b6b",
  },
  slab: {
    analytic: "#1f5fbf",
    cd: "#17a2b8",
    "cd-naive": "#6f5bd0",
    simple: "#3f8f4f",
    "cd-euler": "#5a7f99",
  },
};

const dashes: Record<StudyCurve["knob"], string> = {
  stride: "7,4",
  span: "2,3",
  slabThickness: "none",
  stopTransmittance: "9,3,2,3",
  width: "4,4",
};

const symbols: Record<StudyPoint["method"], Plot.SymbolType> = { kernel: "circle", slab: "square" };

const colorOf = (of: { method: StudyPoint["method"]; compositing: StudyPoint["compositing"] }) =>
  colors[of.method][of.compositing];

function describe(point: StudyPoint): string {
  const { method, compositing, rmse, ms, msMin, msMax } = point;
  const knobs = Object.entries(point.knobs).map(([name, value]) => `${name} ${short(value)}`);
  return [
    `${method} ${compositing}${point.stable ? "" : " (unstable)"}`,
    knobs.join(", "),
    `error ${scientific(rmse)}, ${short(ms, 3)} ms (${short(msMin, 3)} to ${short(msMax, 3)})`,
  ].join("\n");
}

const isDrawn = (point: StudyPoint) => point.stable && point.rmse !== null && drawable(point.ms);

function legendRows(scene: StudyScene): LegendRow[] {
  const rows = scene.curves.map((curve): LegendRow => {
    const row = { color: colorOf(curve), symbol: symbols[curve.method] };
    const name = `${curve.method} ${curve.compositing}`;
    if (curve.points.length < 2) return { ...row, text: name };
    const slope = curve.order === null ? "" : `: slope ${fixed(curve.order, 2)}`;
    return { ...row, text: `${name}, ${curve.knob}${slope}`, dash: dashes[curve.knob] };
  });
  return [
    { text: "Method, compositing and varied setting", bold: true },
    ...rows.filter((row) => row.dash !== undefined),
    ...rows.filter((row) => row.dash === undefined),
    { text: "bar: minimum to maximum run time" },
    { text: "ring and thin steps: Pareto front" },
    { text: "cross: unstable, that is outside [0, 1]" },
    { text: "symbol on the upper edge: larger error" },
    { text: "slope: of log error over log setting" },
  ];
}

export function errorFigure(scene: StudyScene): HTMLElement {
  const stable = scene.points.filter(isDrawn);
  const times = scene.points.flatMap((point) => [point.msMin, point.ms]);
  const xDomain = logDomain(times);
  const yDomain = logDomain([...stable.map((point) => point.rmse), scene.reconstructionRipple]);
  // Points beyond the axis are drawn on its edge.
  const x = (point: StudyPoint) => point.ms ?? xDomain[1];
  const y = (point: StudyPoint) =>
    point.rmse === null ? yDomain[1] : Math.max(point.rmse, yDomain[0]);
  const front = scene.points
    .filter((point) => point.pareto && isDrawn(point))
    .sort((a, b) => x(a) - x(b));
  const ripple = [scene.reconstructionRipple].filter(drawable);
  const marks: Plot.Markish[] = [
    Plot.gridX(logTicks(xDomain), gridStyle),
    Plot.gridY(logTicks(yDomain), gridStyle),
    Plot.frame({ stroke: "#777" }),
    Plot.ruleY(ripple, { stroke: "#888", strokeDasharray: "3,3" }),
    Plot.text(ripple, {
      x: xDomain[0],
      y: (value: number) => value,
      text: () => "reconstruction ripple (not part of these errors)",
      textAnchor: "start",
      dx: 8,
      dy: -9,
      fontSize: 11,
      fill: "#666",
      stroke: "white",
      strokeWidth: 4,
    }),
    ...scene.curves
      .filter((curve) => curve.points.length > 1)
      .map((curve) =>
        Plot.line(
          curve.points.map((n) => scene.points[n]),
          {
            x,
            // NaN leaves a gap at a point without an error.
            y: (point: StudyPoint) => (isDrawn(point) && drawable(point.rmse) ? point.rmse : NaN),
            stroke: colorOf(curve),
            strokeWidth: 1.6,
            strokeDasharray: dashes[curve.knob],
          },
        ),
      ),
    Plot.line(front, {
      x,
      y,
      curve: "step-after",
      stroke: "#111",
      strokeOpacity: 0.55,
      strokeWidth: 0.8,
    }),
    Plot.dot(front, { x, y, r: 7, stroke: "#111", strokeWidth: 1.3, className: "pareto" }),
    Plot.ruleY(scene.points, {
      x1: (point: StudyPoint) => point.msMin,
      x2: (point: StudyPoint) => point.msMax,
      y,
      stroke: colorOf,
      strokeOpacity: 0.35,
      strokeWidth: 3,
      className: "spread",
    }),
    ...(["kernel", "slab"] as const).map((method) =>
      Plot.dot(
        stable.filter((point) => point.method === method),
        {
          x,
          y,
          r: 3.4,
          symbol: symbols[method],
          fill: colorOf,
          ariaLabel: describe,
          className: "point",
        },
      ),
    ),
    Plot.dot(
      scene.points.filter((point) => !isDrawn(point)),
      {
        x,
        y,
        r: 4.5,
        symbol: "times",
        stroke: colorOf,
        strokeWidth: 2.2,
        ariaLabel: describe,
        className: "point",
      },
    ),
    title(scene.name, margins.marginLeft),
    ...legend(legendRows(scene), width - margins.marginRight + 24, margins.marginTop + 6),
    Plot.tip(scene.points, Plot.pointer({ x, y, title: describe, lineWidth: 40 })),
  ];
  const svg = Plot.plot({
    ...margins,
    width,
    height,
    style: plotStyle,
    ariaLabel: `${scene.name}: error against run time of every method`,
    x: { type: "log", domain: xDomain, clamp: true, label: null },
    y: { type: "log", domain: yDomain, clamp: true, label: null },
    marks: [
      Plot.axisX(logTicks(xDomain), {
        ...axisStyle,
        text: (value: number) => short(value),
        label: "Run time, median (ms)",
        labelAnchor: "center",
        labelArrow: "none",
        labelOffset: 46,
      }),
      Plot.axisY(logTicks(yDomain), {
        ...axisStyle,
        text: powerOfTen,
        label: "Error, RMS of linear RGBA",
        labelAnchor: "center",
        labelArrow: "none",
        labelOffset: 64,
      }),
      ...marks,
    ],
  });
  const caption = "Error against run time. The table “All points” lists the numbers.";
  return figure(svg, caption, `plot-${scene.name}.svg`);
}
