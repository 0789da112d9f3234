// The opacity curve editor over a histogram: points to drag, add and remove, and the same as a
// table of numbers. During a drag at most one change per display frame is sent.
import type { Range } from "@windsplat/client";
import { checkLabel, make, makeSvg, numberBox, setAttributes } from "../base/dom";
import { neat, positionOf } from "../view/histogram";
import type { Curve } from "./media";
import {
  addPoint,
  curvePath,
  dragShareMax,
  extinctionAt,
  freePosition,
  movePoint,
  pointText,
  removePoint,
  roomyTop,
  shareOf,
  shownPoint,
  type Scale,
} from "./transfer";
import { formatNumber } from "../base/ticks";
import { clamp } from "@windsplat/client/parts";

export interface CurveSource {
  curve(): Curve; // never empty
  setCurve(curve: Curve): void;
}

const columns = ["value", "extinction"] as const;

export class TransferView {
  readonly line = makeSvg("path", { class: "transfer-line" });
  readonly points = make("div", "transfer-points");
  readonly scaleRow = make("div", "histogram-row");
  readonly table = make("details", "transfer-table");
  private readonly rows = make("tbody");
  private readonly log = make("input");
  private readonly top = numberBox();
  private readonly add = make("button", "", "Add a point");
  private scale: Scale = { top: 1, log: false };
  private ownTop = false; // entered by the user
  private held: number | null = null; // index of the dragged point
  private moving: Curve | null = null; // not sent yet
  private domain: Range = [0, 1];
  private added = [false, false]; // whether each of the last two presses added a point

  constructor(
    private readonly source: CurveSource,
    private readonly units: () => string,
    private readonly changed: () => void,
  ) {
    this.addScale();
    this.addTable();
    this.bind();
  }

  get dragging(): boolean {
    return this.held !== null;
  }

  // Draws the whole curve; `domain` holds the values at the two edges of the plot.
  draw(domain: Range): void {
    const curve = this.curve();
    this.domain = domain;
    if (!this.dragging && !this.ownTop) this.scale.top = roomyTop(curve, this.scale.top);
    if (document.activeElement !== this.top) this.top.value = formatNumber(this.scale.top);
    this.line.setAttribute("d", curvePath(curve, domain, this.scale));
    const { points, rows } = this;
    while (points.children.length > curve.length) points.lastElementChild!.remove();
    while (points.children.length < curve.length) points.append(this.point());
    if (rows.children.length !== curve.length) {
      rows.replaceChildren(...curve.map((_, n) => this.row(n)));
    }
    curve.forEach((point, n) => {
      const handle = points.children[n] as HTMLElement;
      const share = Math.min(shareOf(point[1], this.scale), 1);
      handle.style.left = `${100 * positionOf(point[0], domain)}%`;
      handle.style.top = `${100 * (1 - share)}%`;
      const text = pointText(point, this.units());
      setAttributes(handle, {
        "aria-label": `point ${n + 1}: ${text}`,
        "aria-valuemin": 0,
        "aria-valuenow": point[1],
        "aria-valuemax": Math.max(this.scale.top, point[1]),
        "aria-valuetext": text,
      });
      rows.children[n]!.querySelectorAll("input").forEach((input, column) => {
        if (document.activeElement !== input) input.value = this.shown(point, column);
      });
    });
    this.add.disabled = addPoint(curve, 0, 0) === null;
  }

  private shown(point: Curve[0], column: number): string {
    return String(shownPoint(point, this.domain)[column]);
  }

  private curve(): Curve {
    return this.moving ?? this.source.curve();
  }

  private set(curve: Curve): void {
    this.moving = null;
    this.source.setCurve(curve);
    this.changed();
  }

  private setSoon(curve: Curve): void {
    if (this.moving === null) window.requestAnimationFrame(() => this.flush());
    this.moving = curve;
    this.changed();
  }

  private flush(): void {
    if (this.moving !== null) this.set(this.moving);
  }

  private remove(index: number): void {
    this.set(removePoint(this.curve(), index));
    (this.points.children[Math.max(0, index - 1)] as HTMLElement).focus();
  }

  private point(): HTMLElement {
    const handle = make("button", "transfer-point");
    handle.setAttribute("role", "slider");
    handle.title = "Drag, or arrow keys (shift: finer); double click or Delete removes it";
    return handle;
  }

  private indexOf(target: EventTarget | null): number {
    return [...this.points.children].indexOf(target as Element);
  }

  // Value and extinction under the pointer, which may be above the plot.
  private under(event: PointerEvent): [number, number] {
    const box = this.points.getBoundingClientRect();
    const place = clamp((event.clientX - box.left) / box.width, 0, 1);
    const share = Math.min((box.bottom - event.clientY) / box.height, dragShareMax(this.scale));
    const [low, high] = this.domain;
    return [neat(low + place * (high - low), this.domain), extinctionAt(share, this.scale)];
  }

  private bind(): void {
    const { points } = this;
    points.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      this.flush();
      let index = this.indexOf(event.target);
      this.added = [this.added[1]!, index < 0];
      if (index < 0) {
        const added = addPoint(this.curve(), ...this.under(event));
        if (added === null) return;
        index = added.index;
        this.set(added.curve);
      }
      (points.children[index] as HTMLElement).focus();
      points.setPointerCapture(event.pointerId);
      this.held = index;
    });
    let from: [number, number] = [0, 0];
    points.addEventListener("pointerdown", ({ clientX, clientY }) => (from = [clientX, clientY]));
    points.addEventListener("pointermove", (event) => {
      if (this.held === null) return;
      // A click slightly off a point does not move it.
      if (from[0] >= 0 && Math.hypot(event.clientX - from[0], event.clientY - from[1]) < 3) return;
      from = [-1, -1];
      this.setSoon(movePoint(this.curve(), this.held, ...this.under(event)));
    });
    for (const end of ["pointerup", "pointercancel"] as const) {
      points.addEventListener(end, () => {
        this.held = null;
        this.flush();
        this.changed();
      });
    }
    // With pointer capture the container of the points is the event target. A point added by the
    // first click of a double click remains.
    points.addEventListener("dblclick", (event) => {
      if (this.added.includes(true)) return;
      const under = document.elementFromPoint(event.clientX, event.clientY);
      const index = this.indexOf(under);
      if (index >= 0) this.remove(index);
    });
    points.addEventListener("keydown", (event) => this.key(event));
  }

  private key(event: KeyboardEvent): void {
    const index = this.indexOf(event.target);
    const point = this.curve()[index];
    if (point === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    const fine = event.shiftKey ? 0.1 : 1;
    const along = (this.domain[1] - this.domain[0]) * 0.01 * fine;
    const [x, y] = {
      ArrowLeft: [-1, 0],
      ArrowRight: [1, 0],
      ArrowUp: [0, 1],
      ArrowDown: [0, -1],
    }[event.key] ?? [0, 0];
    const removes = event.key === "Delete" || event.key === "Backspace";
    if (!removes && x === 0 && y === 0) return;
    event.preventDefault();
    event.stopPropagation(); // otherwise the arrow keys would turn the volume
    if (removes) {
      this.remove(index);
      return;
    }
    const share = shareOf(point[1], this.scale) + 0.02 * fine * y!;
    const extinction = y === 0 ? point[1] : extinctionAt(share, this.scale);
    const value = x === 0 ? point[0] : neat(point[0] + along * x!, this.domain);
    this.setSoon(movePoint(this.curve(), index, value, extinction));
  }

  private addScale(): void {
    const { log, top } = this;
    const topLabel = make("label", "histogram-check", "top");
    topLabel.title =
      "Extinction at the upper edge of the plot; the longest edge of the box counts as 2";
    topLabel.append(top);
    this.scaleRow.append(checkLabel(log, "log opacity"), topLabel);
    log.addEventListener("change", () => {
      this.scale.log = log.checked;
      this.changed();
    });
    top.addEventListener("change", () => {
      this.ownTop = top.valueAsNumber > 0;
      if (this.ownTop) this.scale.top = Math.min(top.valueAsNumber, 1e30);
      this.changed();
    });
  }

  private addTable(): void {
    const table = make("table");
    const head = make("tr");
    head.append(...columns.map((name) => make("th", "", name)), make("td"));
    table.createTHead().append(head);
    table.append(this.rows);
    this.add.addEventListener("click", () => {
      const curve = this.curve();
      const added = addPoint(curve, ...freePosition(curve));
      if (added === null) return;
      this.set(added.curve);
      this.rows.children[added.index]!.querySelector("input")!.focus();
    });
    this.table.append(make("summary", "", "Points as numbers"), table, this.add);
  }

  private row(index: number): HTMLElement {
    const row = make("tr");
    columns.forEach((name, column) => {
      const input = numberBox();
      input.setAttribute("aria-label", `${name} of point ${index + 1}`);
      input.addEventListener("change", () => {
        const next = [...this.curve()[index]!] as [number, number];
        next[column] = input.valueAsNumber;
        this.set(movePoint(this.curve(), index, ...next));
        // a focused input is not overwritten
        input.value = this.shown(this.curve()[index]!, column);
      });
      const cell = make("td");
      cell.append(input);
      row.append(cell);
    });
    const remove = make("button", "", "×");
    remove.setAttribute("aria-label", `remove point ${index + 1}`);
    remove.addEventListener("click", () => {
      this.set(removePoint(this.curve(), index));
      const { children } = this.rows;
      children[Math.min(index, children.length - 1)]!.querySelector("button")!.focus();
    });
    const cell = make("td");
    cell.append(remove);
    row.append(cell);
    return row;
  }
}
