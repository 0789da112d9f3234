// The extreme cases of a study: where each method may be trusted, errors over parameters, cases.
import * as Plot from "@observablehq/plot";
import type { StudyExtreme, StudyExtremes, StudyTrust } from "../generated/study";
import { details, element, table } from "./dom";
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
} from "./figure";
import { fixed, powerOfTen, scientific, short, yesNo } from "./text";

const width = 980;
const height = 340;
const margins = { marginTop: 40, marginRight: 210, marginBottom: 60, marginLeft: 84 };
const errorLeast = 1e-9; // smaller errors are drawn here
const colors = { kernel: "#d55e00", slab: "#0072b2", reference: "#555" } as const;
const symbols = { kernel: "circle", slab: "square", reference: "triangle" } as const;
const methods = ["kernel", "slab", "reference"] as const;

const failColor = "#b00020";

function describe(one: StudyExtreme): string {
  return [
    `${one.group} ${one.label}: ${one.method}, ${one.projection}`,
    `true error ${scientific(one.rmse ?? null)}`,
    `measured ${scientific(one.measured ?? null)}, estimated ${scientific(one.estimate ?? null)}`,
    `truth: ${one.truth}`,
  ].join("\n");
}

function errorsFigure(trust: StudyTrust, cases: StudyExtreme[]): HTMLElement | undefined {
  const points = cases.filter(
    ({ outcome, value, rmse }) =>
      outcome !== "refused" && drawable(value) && rmse !== undefined && rmse !== null,
  );
  if (new Set(points.map(({ value }) => value)).size < 3) return undefined;
  const x = (one: StudyExtreme) => one.value;
  const y = (one: StudyExtreme) => Math.max(one.rmse ?? errorLeast, errorLeast);
  const xDomain = logDomain(points.map(x));
  const yDomain = logDomain([errorLeast, ...points.map(y)]);
  const limits = trust.within.map(({ limit }) => limit);
  const axis = { ...axisStyle, labelAnchor: "center", labelArrow: "none" } as const;
  const of = (method: string, projection: string) =>
    points.filter((one) => one.method === method && one.projection === projection);
  const marks: Plot.Markish[] = methods.flatMap((method) => [
    Plot.line(of(method, "perspective"), { x, y, stroke: colors[method] }),
    Plot.line(of(method, "orthographic"), { x, y, stroke: colors[method], strokeDasharray: "3,3" }),
    Plot.dot(
      points.filter((one) => one.method === method),
      {
        x,
        y,
        r: 3.4,
        symbol: symbols[method],
        fill: colors[method],
        ariaLabel: describe,
        className: "point",
      },
    ),
  ]);
  const failed = points.filter(({ outcome }) => outcome === "failed");
  const rows = [
    ...methods
      .filter((method) => points.some((one) => one.method === method))
      .map((method) => ({ text: method, color: colors[method], symbol: symbols[method] })),
    { text: "perspective", color: "#888", dash: "none" },
    { text: "orthographic", color: "#888", dash: "3,3" },
    ...(failed.length > 0
      ? [{ text: "fails", color: failColor, symbol: "times" as const, hollow: true }]
      : []),
  ];
  const svg = Plot.plot({
    ...margins,
    width,
    height,
    style: plotStyle,
    ariaLabel: `${trust.group}: error over the ${trust.parameter}`,
    x: { type: "log", domain: xDomain, label: null },
    y: { type: "log", domain: yDomain, clamp: true, label: null },
    marks: [
      Plot.gridX(logTicks(xDomain), gridStyle),
      Plot.gridY(logTicks(yDomain), gridStyle),
      Plot.frame({ stroke: "#777" }),
      Plot.ruleY(limits, { stroke: "#888", strokeDasharray: "6,3" }),
      Plot.axisX(logTicks(xDomain), {
        ...axis,
        text: (value: number) => short(value),
        label: trust.parameter,
        labelOffset: 46,
      }),
      Plot.axisY(logTicks(yDomain), {
        ...axis,
        text: powerOfTen,
        label: "Error, RMS of linear RGBA",
        labelOffset: 64,
      }),
      ...marks,
      Plot.dot(failed, { x, y, r: 7, symbol: "times", stroke: failColor, strokeWidth: 2 }),
      title(`${trust.group}: error against the truth`, margins.marginLeft),
      ...legend(rows, width - margins.marginRight + 24, margins.marginTop + 6),
      Plot.tip(points, Plot.pointer({ x, y, title: describe })),
    ],
  });
  const caption = [
    `Error over the ${trust.parameter}. Errors below ${powerOfTen(errorLeast)} are drawn there;`,
    "dashed lines are the limits of the table.",
  ].join(" ");
  return figure(svg, caption, `extremes-${trust.group}.svg`);
}

function trustTable({ trust }: StudyExtremes): HTMLElement {
  const limits = trust[0]?.within.map(({ limit }) => `RMSE at most ${short(limit)}`) ?? [];
  return table(
    "Values at which each method may be trusted",
    [
      "parameter",
      "method",
      "cases",
      "refused",
      "failed",
      ...limits,
      "largest RMSE",
      "at the value",
      "with a measured error",
      "least measured over true error",
      "within the bound of the estimate",
    ],
    trust.map((one) => ({
      className: one.failed > 0 ? "unstable" : "",
      cells: [
        element("span", { title: one.parameter }, one.group),
        one.method,
        String(one.cases),
        String(one.refused),
        String(one.failed),
        ...one.within.map(({ values }) => element("span", { class: "values" }, values)),
        scientific(one.worst, 1),
        one.worstAt,
        one.estimated > 0 ? `${one.measured} of ${one.estimated}` : "",
        fixed(one.leastReported, 2),
        one.estimated > 0 ? `${one.withinBound} of ${one.estimated}` : "",
      ],
    })),
  );
}

function casesTable(group: string, cases: StudyExtreme[]): HTMLElement {
  const flag = (value: boolean | null | undefined) => (value == null ? "" : yesNo(value));
  const number = (value: number | null | undefined) => (value == null ? "" : scientific(value, 1));
  return table(
    `${group}: every case`,
    [
      "value",
      "method",
      "projection",
      "mapping",
      "samples",
      "pixels",
      "outcome",
      "truth",
      "finite",
      "within [0, 1]",
      "monotone",
      "honest",
      "RMSE",
      "largest",
      "measured",
      "estimated",
      "message",
    ],
    cases.map((one) => ({
      className: one.outcome === "failed" ? "unstable" : "",
      cells: [
        one.label,
        one.method,
        one.projection,
        one.mapping,
        one.samples.join(" × "),
        `${one.width} × ${one.height}`,
        one.outcome,
        one.truth ?? "",
        flag(one.finite),
        flag(one.bounded),
        flag(one.monotone),
        flag(one.honest),
        number(one.rmse),
        number(one.max),
        number(one.measured),
        number(one.estimate),
        one.message ?? "",
      ],
    })),
  );
}

export function extremesSection(extremes: StudyExtremes): HTMLElement {
  const { cases, trust } = extremes;
  const failed = cases.filter(({ outcome }) => outcome === "failed").length;
  const refused = cases.filter(({ outcome }) => outcome === "refused").length;
  const words = [
    `${cases.length} cases, of which ${refused} beyond a limit were refused as expected and`,
    `${failed} failed. A case fails if a pixel is not finite or leaves [0, 1], if opacity`,
    "decreases along a sweep in which it must not, if the measured error of a frame (if none was",
    "measured, the bound of its estimate) is below a quarter of a true error above 1e-4, if it",
    "cannot be drawn, or if it is drawn although it lies beyond a limit. The column “truth” of the",
    "tables of cases states what a picture is compared with: the rendering integral by brute force",
    "(integrator), which shares no code with the engine; the reference of the engine, where the",
    "integrator does not apply; or a closed form. RMSE is that of linear premultiplied RGBA.",
    "Estimates are those without calibration.",
  ];
  const section = element("section", {}, element("p", {}, words.join(" ")), trustTable(extremes));
  for (const group of new Set(trust.map((one) => one.group))) {
    const own = cases.filter((one) => one.group === group);
    const plot = errorsFigure(
      trust.find((one) => one.group === group)!,
      own,
    );
    if (plot) section.append(plot);
    section.append(details(`${group}: every case`, casesTable(group, own)));
  }
  return section;
}
