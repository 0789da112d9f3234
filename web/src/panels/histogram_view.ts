// A histogram in the panel: fetched while it is visible and playback is paused. Dragging over it,
// or over the colours below it, chooses a range; a medium's opacity curve is edited on top of it.
import { failureText } from "../base/problem_text";
import type { Histogram, Range } from "@windsplat/client";
import { checkLabel, make, makeSvg, setAttributes, observeVisibility } from "../base/dom";
import { debounced, clamp } from "@windsplat/client/parts";
import { barPath, clipRange, countedText, positionOf, RangeDrag, valueAt } from "../view/histogram";
import { oriented, RangeChoice, type RangeSource } from "./range_choice";
import { TransferView, type CurveSource } from "./transfer_view";

export const histogramBins = 128;
const restMs = 250; // time without a change before it is fetched again
const clipTail = 0.01;
const holdPixels = 9;

export interface HistogramSource extends RangeSource {
  title(): string; // the quantity counted
  units(): string;
  dataKey(): string | null; // key of the data to show; null: none at present
  load(): Promise<Histogram>;
  curve?: CurveSource; // media only
  // of the map, with its ends at these positions in per cent
  gradient?(from: number, to: number): string;
}

export class HistogramView {
  readonly element = make("div", "histogram");
  private readonly svg = makeSvg("svg", { preserveAspectRatio: "none", role: "img" });
  private readonly bars = makeSvg("path", { class: "histogram-bars" });
  private readonly shades = [0, 1].map(() => makeSvg("rect", { class: "histogram-out", y: 0 }));
  private readonly ends = [0, 1].map(() => makeSvg("line", { class: "histogram-end", y1: 0 }));
  private readonly caption = make("p", "histogram-caption");
  private readonly strip = make("div", "histogram-strip");
  private readonly log = make("input");
  private readonly clip = make("button", "", "1–99 %");
  private readonly choice: RangeChoice;
  private readonly transfer: TransferView | null = null;
  private data: Histogram | null = null;
  private wanted: string | null = null; // key of the last request
  private seen = false;
  private drag: RangeDrag | null = null;
  private domain: Range = [0, 1]; // values at the left and right edge
  private chosen: Range | null = null; // range of the current drag, not sent yet
  private readonly loadSoon = debounced(() => void this.load(), restMs);

  constructor(private readonly source: HistogramSource) {
    this.svg.append(this.bars, ...this.shades, ...this.ends);
    const logLabel = checkLabel(this.log, "log counts", "Logarithmic bar heights");
    this.log.checked = source.curve !== undefined; // most media are empty almost everywhere
    this.clip.title = "From the 1st to the 99th percentile";
    this.choice = new RangeChoice(source, (text) => this.fail(text));
    const plot = make("div", "histogram-plot");
    plot.append(this.svg);
    const row = make("div", "histogram-row");
    row.append(this.choice.element, this.clip);
    this.element.append(plot, this.strip, this.caption, row, logLabel);
    if (source.curve !== undefined) {
      this.transfer = new TransferView(source.curve, source.units, () => this.draw());
      this.svg.append(this.transfer.line);
      plot.append(this.transfer.points);
      this.transfer.scaleRow.prepend(logLabel);
      this.element.append(this.transfer.scaleRow, this.transfer.table);
    }
    this.strip.hidden = source.gradient === undefined;
    this.strip.title = "Drag: the colours' range";
    this.log.addEventListener("change", () => this.draw());
    this.clip.addEventListener("click", () => {
      const range = this.data === null ? null : clipRange(this.data, clipTail);
      if (range !== null) this.source.choose(oriented(range, source.range()));
    });
    this.bindDrag(this.strip);
    if (this.transfer === null) this.bindDrag(this.svg);
    observeVisibility(this.element, (seen) => {
      this.seen = seen;
      this.refresh();
    });
    this.draw();
  }

  refresh(): void {
    this.choice.refresh();
    if (!this.seen) return;
    this.draw();
    const key = this.source.dataKey();
    if (key !== null && key !== this.wanted) this.loadSoon();
  }

  private async load(): Promise<void> {
    const key = this.source.dataKey();
    if (key === null || key === this.wanted || !this.element.isConnected) return;
    this.wanted = key;
    try {
      const data = await this.source.load();
      if (this.wanted !== key) return;
      this.data = data;
      this.caption.classList.remove("failed");
    } catch (failure) {
      if (this.wanted !== key) return;
      this.data = null;
      this.fail(failureText(failure));
    }
    if (this.element.isConnected) this.draw(); // otherwise its medium is gone
  }

  private fail(text: string): void {
    this.caption.textContent = text;
    this.caption.classList.add("failed");
  }

  private bindDrag(surface: Element): void {
    const on = (type: string, run: (event: PointerEvent) => void) =>
      surface.addEventListener(type, run as EventListener);
    const place = (event: PointerEvent): number => {
      const box = surface.getBoundingClientRect();
      return clamp((event.clientX - box.left) / box.width, 0, 1);
    };
    const choose = (range: Range | null) => {
      if (range === null) return;
      const [from, to] = range.map((at) => valueAt(at, this.domain)) as Range;
      if (from === to) return;
      if (this.chosen === null) window.requestAnimationFrame(() => this.flush());
      this.chosen = [from, to];
    };
    on("pointerdown", (event) => {
      if (this.data === null || event.button !== 0) return;
      const near = holdPixels / surface.getBoundingClientRect().width;
      const ends = (this.source.range() ?? this.data.range ?? this.domain).map((end) =>
        this.positionIn(end),
      );
      surface.setPointerCapture(event.pointerId);
      this.drag = new RangeDrag(place(event), ends as Range, near);
    });
    on("pointermove", (event) => {
      if (this.drag !== null) choose(this.drag.to(place(event)));
    });
    on("pointerup", () => {
      if (this.drag !== null) choose(this.drag.end());
      this.drag = null;
      this.flush();
      this.draw();
    });
    on("pointercancel", () => (this.drag = null));
  }

  private flush(): void {
    if (this.chosen !== null) this.source.choose(this.chosen);
    this.chosen = null;
  }

  private positionIn(value: number): number {
    return clamp(positionOf(value, this.domain), 0, 1);
  }

  // The domain contains all counted values, the colour range and the points of the curve. It is
  // constant during a drag.
  private fitDomain(): void {
    const { data, source } = this;
    if (this.drag !== null || this.transfer?.dragging) return;
    const curve = source.curve?.curve() ?? [];
    const values = [data?.range ?? [], curve.map(([value]) => value)].flat();
    if (source.curve !== undefined || values.length === 0) values.push(...(source.range() ?? []));
    const [low, high] = [Math.min(...values), Math.max(...values)];
    if (low < high) this.domain = [low, high];
    else if (values.length > 0) this.domain = [low - 0.5, low + 0.5];
  }

  private draw(): void {
    const { data, source } = this;
    this.fitDomain();
    const chosen = source.range();
    this.clip.disabled = (data?.range ?? null) === null;
    const unit = source.units() === "" ? "" : ` ${source.units()}`;
    this.bars.setAttribute("d", data === null ? "" : barPath(data.counts, this.log.checked));
    const label = `Histogram of ${source.title()}`;
    if (data === null) {
      this.svg.setAttribute("aria-label", `${label}: none yet`);
      if (!this.caption.classList.contains("failed")) this.caption.textContent = "computing…";
    } else {
      const text = countedText(data, unit);
      if (!this.caption.classList.contains("failed")) this.caption.textContent = text;
      this.svg.setAttribute("aria-label", `${label}, ${text}`);
    }
    const range = data?.range ?? this.domain;
    const bins = data?.counts.length ?? 1;
    const [left, right] = this.domain.map((end) => bins * positionOf(end, range)) as Range;
    const width = right - left;
    this.svg.setAttribute("viewBox", `${left} 0 ${width} 1`);
    const ends = chosen ?? this.domain;
    const places = [Math.min(...ends), Math.max(...ends)].map(
      (end) => left + width * this.positionIn(end),
    );
    this.ends.forEach((end, n) => {
      setAttributes(end, { x1: places[n]!, x2: places[n]!, y2: 1 });
    });
    this.shades.forEach((shade, n) => {
      const size = n === 0 ? places[0]! - left : right - places[1]!;
      setAttributes(shade, { x: n === 0 ? left : places[1]!, width: Math.max(0, size), height: 1 });
    });
    const [from, to] = ends.map((end) => 100 * positionOf(end, this.domain)) as Range;
    this.strip.style.backgroundImage = source.gradient?.(from, to) ?? "";
    this.transfer?.line.setAttribute("transform", `translate(${left} 0) scale(${width} 1)`);
    this.transfer?.draw(this.domain);
  }
}
