// One value over the time steps: numbers -> an SVG with gaps at missing values.
import type { SeriesTime } from "@windsplat/client";
import { makeSvg, svgText } from "../base/dom";
import { formatNumber } from "../base/ticks";
import { readableTime } from "@windsplat/client/parts";

export interface SeriesCurve {
  path: string; // x in steps, y 0 (greatest) to 1 (least)
  low: number;
  high: number;
}

// null: no value at any step. A value between gaps is drawn as a dash a quarter of a step long.
export function seriesCurve(values: (number | null)[]): SeriesCurve | null {
  const known = values.filter((value) => value !== null);
  if (known.length === 0) return null;
  const low = known.reduce((a, b) => Math.min(a, b));
  const high = known.reduce((a, b) => Math.max(a, b));
  const height = (value: number): string =>
    (high === low ? 0.5 : (high - value) / (high - low)).toFixed(4);
  const parts: string[] = [];
  values.forEach((value, step) => {
    if (value === null) return;
    const joined = step > 0 && values[step - 1] !== null;
    const alone = !joined && (values[step + 1] ?? null) === null;
    parts.push(`${joined ? "L" : "M"}${step} ${height(value)}${alone ? "h0.25" : ""}`);
  });
  return { path: parts.join(""), low, high };
}

// The first and the last time as text.
export function timeEnds(times: SeriesTime[]): [string, string] {
  return [readableTime(times[0]?.text ?? ""), readableTime(times.at(-1)?.text ?? "")];
}

// Draws the curve, its least and greatest value, the first and last time, and the present step.
export function drawSeries(
  svg: SVGElement,
  values: (number | null)[],
  units: string,
  ends: [string, string],
  step: number,
): void {
  const [width, height, top, bottom] = [280, 96, 14, 14]; // drawing units
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const course = seriesCurve(values);
  const unit = units === "" ? "" : ` ${units}`;
  if (course === null) {
    svg.setAttribute("aria-label", "No value at any step");
    svg.replaceChildren(svgText(width / 2, height / 2, "masked at every step", "middle"));
    return;
  }
  const inner = height - top - bottom - 4;
  const last = Math.max(1, values.length - 1);
  const line = makeSvg("path", {
    class: "course-line",
    d: course.path,
    transform: `translate(2 ${top + 2}) scale(${(width - 4) / last} ${inner})`,
  });
  const x = 2 + ((width - 4) * step) / last;
  const now = makeSvg("line", { class: "course-now", x1: x, x2: x, y1: top, y2: height - bottom });
  const [low, high] = [course.low, course.high].map((value) => formatNumber(value) + unit);
  svg.setAttribute("aria-label", `From ${low} to ${high} between ${ends[0]} and ${ends[1]}`);
  svg.replaceChildren(
    now,
    line,
    svgText(2, top - 4, `${high}`, "start"),
    svgText(width - 2, top - 4, `min ${low}`, "end"),
    svgText(2, height - 3, ends[0], "start"),
    svgText(width - 2, height - 3, ends[1], "end"),
  );
}
