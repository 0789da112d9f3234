// Plot of error against time in the Quality panel: the server's forecast for the view's settings,
// the displayed frame, and the budget and error limit as handles. The forecast is requested while
// the plot is visible and the view is at rest.
import { failureText } from "../base/problem_text";
import type { Forecast, FrameHeader, View } from "@windsplat/client";
import { debounced, clamp } from "@windsplat/client/parts";
import { make, makeSvg, setAttributes, svgText, observeVisibility } from "../base/dom";
import { errorMetric, errorName, errorText, errorWord } from "../base/error_text";
import {
  axisOver,
  budgetAfter,
  limitAfter,
  logTicks,
  msText,
  positionOn,
  pointText,
  spotText,
  valueOn,
  type Axis,
} from "./forecast";
import { formatNumber } from "../base/ticks";

export interface ForecastHost {
  view(): View;
  playing(): boolean;
  frame(): FrameHeader | null; // the newest on the canvas
  load(view: View): Promise<Forecast>;
  budget(): number; // ms
  setBudget(ms: number): void;
  maxError(): number | null;
  setMaxError(error: number): void;
}

const restMs = 1000; // time without a change before the forecast is requested
// interval of repeated requests, as calibration continues while the view is at rest
const againMs = 5000;
const errorMin = 5e-6; // the least quality.maxError of the server
const [width, height, left, right, top, bottom] = [284, 184, 36, 10, 20, 30]; // drawing units
const [inner, tall] = [width - left - right, height - top - bottom];

interface Handle {
  element: SVGElement;
  name: string;
  across: boolean; // the handle moves along x
  set(place: number): void;
  step(way: 1 | -1, fine: boolean): void;
}

const keyEntries: [mark: SVGElement, text: string][] = [
  [makeSvg("circle", { r: 3.5, class: "plot-measured" }), "measured"],
  [makeSvg("circle", { r: 3.5, class: "plot-estimated" }), "estimated"],
  [makeSvg("circle", { r: 3.5, class: "plot-estimated chosen" }), "chosen while moving"],
  [makeSvg("path", { d: "M-7 0h14", class: "plot-line" }), "best at its time"],
  [makeSvg("path", { d: "M0-6l6 6-6 6-6-6z", class: "plot-now" }), "this frame"],
  [makeSvg("path", { d: "M0-6l6 6-6 6-6-6z", class: "plot-final" }), "final frame"],
  [makeSvg("path", { d: "M-5-6h10v5l-5 6-5-6z", class: "key-handle" }), "time allowed: drag"],
  [makeSvg("path", { d: "M5-5v10l-8-5z", class: "key-handle" }), "error allowed: drag"],
];

// What the marks of the plot mean.
function plotKey(): HTMLElement {
  const list = make("ul", "plot-key");
  list.setAttribute("aria-label", "Key of the plot");
  for (const [mark, text] of keyEntries) {
    const entry = make("li");
    const picture = makeSvg("svg", { viewBox: "-8 -8 16 16", "aria-hidden": "true" });
    picture.append(mark.cloneNode());
    entry.append(picture, text);
    list.append(entry);
  }
  return list;
}

export class ForecastPlot {
  readonly element = make("div", "histogram");
  private readonly svg = makeSvg("svg", { viewBox: `0 0 ${width} ${height}`, role: "group" });
  private readonly back = makeSvg("g", {});
  private readonly caption = make("p", "histogram-caption");
  private readonly budget = this.handle("moving budget (ms)", true, {
    set: (place) => this.host.setBudget(Math.round(valueOn(this.x, place)) || 1),
    step: (way, fine) => this.host.setBudget(budgetAfter(this.host.budget(), way, fine)),
  });
  private readonly limit = this.handle("max error", false, {
    set: (place) => this.setLimit(Number(valueOn(this.y, 1 - place).toPrecision(2))),
    step: (way, fine) => this.setLimit(limitAfter(this.host.maxError()!, way, fine)),
  });
  private data: Forecast | null = null;
  private final: FrameHeader | null = null;
  private asked = ""; // key of the last request
  private again = 0; // timer
  private seen = false;
  private held = false; // a handle is being dragged; the axes must not change
  private x: Axis = { low: 1, high: 1000 };
  private y: Axis = { low: 1e-4, high: 1 };
  private readonly loadSoon = debounced(() => void this.load(), restMs);

  constructor(private readonly host: ForecastHost) {
    this.svg.setAttribute("class", "forecast");
    this.svg.append(this.back, this.limit.element, this.budget.element);
    this.element.append(this.svg, plotKey(), this.caption);
    observeVisibility(this.element, (seen) => {
      this.seen = seen;
      this.refresh();
    });
  }

  refresh(): void {
    const frame = this.host.frame();
    if (frame?.final) this.final = frame;
    if (!this.seen) return;
    this.draw();
    if (this.key() !== this.asked) this.loadSoon();
  }

  private key(): string {
    return JSON.stringify([this.host.view(), this.host.budget()]);
  }

  private async load(): Promise<void> {
    const { host } = this;
    window.clearTimeout(this.again);
    const rests = this.seen && !this.held && !document.hidden && !host.playing();
    if (!rests || !this.element.isConnected || !host.frame()?.final) return;
    const key = this.key();
    const first = key !== this.asked;
    this.asked = key;
    try {
      const view = host.view();
      const quality = { ...view.quality, budgetMs: host.budget() };
      const data = await host.load({ ...view, quality });
      if (key !== this.asked) return;
      this.data = data;
      this.caption.classList.remove("failed");
    } catch (failure) {
      if (key !== this.asked) return;
      this.data = null;
      this.caption.classList.add("failed");
      this.caption.textContent = failureText(failure);
    }
    if (first) this.again = window.setTimeout(() => void this.load(), againMs);
    this.draw();
  }

  private setLimit(error: number): void {
    this.host.setMaxError(clamp(error, errorMin, 1));
  }

  private fit(): void {
    if (this.held) return;
    const points = this.data?.points ?? [];
    const frames = this.frames();
    const times = frames.map(({ renderUs }) => renderUs / 1000);
    this.x = axisOver([...points.map(({ ms }) => ms), ...times, this.host.budget()], 30);
    const errors = frames.map(({ error }) => error);
    this.y = axisOver(
      [...points.map(({ error }) => error), ...errors, this.host.maxError() ?? 0],
      30,
    );
  }

  // The last final frame of the view, and the newest frame.
  private frames(): FrameHeader[] {
    const now = this.host.frame();
    const { final } = this;
    const known = [final?.rev === now?.rev ? final : null, now].filter((one) => one !== null);
    return known.filter((one, n) => known.indexOf(one) === n && Number.isFinite(one.error));
  }

  private at(ms: number, error: number): [number, number] {
    return [left + inner * positionOn(this.x, ms), top + tall * (1 - positionOn(this.y, error))];
  }

  private draw(): void {
    this.fit();
    const metric = errorMetric.value;
    const points = this.data?.points ?? [];
    const parts: SVGElement[] = [];
    for (const tick of logTicks(this.x, 7)) {
      const [x] = this.at(tick, 1);
      parts.push(makeSvg("path", { d: `M${x} ${top}v${tall}`, class: "plot-grid" }));
      parts.push(svgText(x, height - 18, formatNumber(tick), "middle"));
    }
    for (const tick of logTicks(this.y, 7)) {
      const [, y] = this.at(1, tick);
      parts.push(makeSvg("path", { d: `M${left} ${y}h${inner}`, class: "plot-grid" }));
      const text = metric === "rmse" ? formatNumber(tick, 3) : errorText(tick, metric).slice(0, -3);
      parts.push(svgText(left - 4, y + 3, text, "end"));
    }
    parts.push(svgText(left + inner, height - 5, "time of a frame, ms", "end"));
    const unit = metric === "rmse" ? "error, linear RMSE" : "PSNR, dB";
    parts.push(svgText(2, height - 5, `↑ ${unit}`, "start"));
    const line = points.filter(({ pareto }) => pareto).map(({ ms, error }) => this.at(ms, error));
    parts.push(makeSvg("polyline", { points: line.join(" "), class: "plot-line" }));
    points.forEach((point, n) => {
      const [cx, cy] = this.at(point.ms, point.error);
      const chosen = n === this.data!.chosen ? " chosen" : "";
      const circle = makeSvg("circle", { cx, cy, r: 3.5, class: `plot-${point.kind}${chosen}` });
      parts.push(this.titled(circle, pointText(point, metric)));
    });
    const captions = this.frames().map((frame) => {
      const [x, y] = this.at(frame.renderUs / 1000, frame.error);
      const what = frame.final ? "final" : "now";
      const mark = makeSvg("path", { d: `M${x} ${y - 6}l6 6-6 6-6-6z`, class: `plot-${what}` });
      const spot = spotText(frame.renderUs / 1000, frame.error, metric);
      const text = `${what} ${spot}, ${errorWord(frame.error)}`;
      parts.push(this.titled(mark, text));
      return text;
    });
    this.back.replaceChildren(...parts);
    this.placeHandles();
    const measured = points.filter(({ kind }) => kind === "measured").length;
    const counts = `${points.length} settings, ${measured} measured`;
    this.svg.setAttribute("aria-label", `${errorName(metric)} against time: ${counts}`);
    if (!this.caption.classList.contains("failed")) {
      this.caption.textContent = [this.data === null ? "estimating…" : counts, ...captions].join(
        " · ",
      );
    }
  }

  private titled(element: SVGElement, text: string): SVGElement {
    const title = makeSvg("title", {});
    title.textContent = text;
    element.append(title);
    return element;
  }

  private placeHandles(): void {
    const { host } = this;
    const budget = host.budget();
    const error = host.maxError();
    const [x] = this.at(budget, 1);
    this.budget.element.setAttribute("transform", `translate(${x} 0)`);
    this.updateAria(this.budget, 1, budget, 10_000, msText(budget));
    this.limit.element.toggleAttribute("hidden", error === null);
    if (error === null) return;
    const [, y] = this.at(1, error);
    this.limit.element.setAttribute("transform", `translate(0 ${y})`);
    this.updateAria(this.limit, errorMin, error, 1, errorText(error, errorMetric.value));
  }

  // A slider role requires a value, so the role is set with the first value.
  private updateAria(handle: Handle, min: number, now: number, max: number, text: string): void {
    const { element, name } = handle;
    setAttributes(element, {
      role: "slider",
      tabindex: 0,
      "aria-label": name,
      "aria-valuemin": min,
      "aria-valuenow": now,
      "aria-valuemax": max,
      "aria-valuetext": text,
    });
  }

  private handle(name: string, across: boolean, acts: Pick<Handle, "set" | "step">): Handle {
    const element = makeSvg("g", {
      class: "plot-handle",
      "aria-orientation": across ? "horizontal" : "vertical",
    });
    // The grab area is wide; only the line is visible.
    const hold = across
      ? { x: -12, y: 0, width: 24, height: height - bottom }
      : { x: left, y: -12, width: inner, height: 24 };
    const d = across ? `M0 ${top}v${tall}M-6 3h12v8l-6 6-6-6z` : `M${left} 0h${inner}m0-5v10l-8-5z`;
    element.append(makeSvg("rect", hold), makeSvg("path", { d }));
    const handle = { element, name, across, ...acts };
    this.bind(handle);
    return handle;
  }

  private bind({ element, across, set, step }: Handle): void {
    let place: number | null = null; // not sent yet
    const flush = () => {
      if (place !== null) set(place);
      place = null;
    };
    const on = (type: string, run: (event: PointerEvent & KeyboardEvent) => void) =>
      element.addEventListener(type, run as unknown as EventListener);
    on("pointerdown", (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      element.focus();
      element.setPointerCapture(event.pointerId);
      this.held = true;
    });
    on("pointermove", (event) => {
      if (!this.held) return;
      const box = this.svg.getBoundingClientRect();
      const x = (((event.clientX - box.left) / box.width) * width - left) / inner;
      const y = (((event.clientY - box.top) / box.height) * height - top) / tall;
      if (place === null) window.requestAnimationFrame(flush);
      place = across ? x : y;
    });
    for (const end of ["pointerup", "pointercancel"]) {
      on(end, () => {
        flush();
        this.held = false;
        this.refresh();
      });
    }
    on("keydown", (event) => {
      const up = event.key === "ArrowRight" || event.key === "ArrowUp";
      if (!up && event.key !== "ArrowLeft" && event.key !== "ArrowDown") return;
      event.preventDefault();
      event.stopPropagation(); // otherwise the arrow keys would turn the volume
      step(up ? 1 : -1, event.shiftKey);
    });
  }
}
