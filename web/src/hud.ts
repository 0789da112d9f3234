// Times and sizes of the frames that are drawn: the table in the picture's corner (key \).
import type { ChosenMessage, FrameHeader } from "./protocol";
import type { DrawnFrame } from "./viewport";
import { byId } from "./dom";
import { formatBytes, formatNumber } from "./ticks";

const windowMs = 1000;

// Frames drawn in the last second.
export class FrameRate {
  private times: number[] = [];

  add(now: number): void {
    this.times.push(now);
  }

  value(now: number): number {
    this.times = this.times.filter((time) => now - time < windowMs);
    return this.times.length;
  }
}

// What the way took besides the server's own work, ms: from the patch's departure to the frame's
// arrival. Only the first frame that echoes a patch tells it; later ones waited for other reasons.
export function networkMs(header: FrameHeader, arrivedAt: number, lastT: number): number | null {
  if (header.t === lastT || header.t <= 0) return null;
  const serverMs = (header.queueUs + header.renderUs + header.encodeUs) / 1000;
  return Math.max(0, arrivedAt - header.t - serverMs);
}

const ms = (value: number): string => (value < 10 ? value.toFixed(1) : value.toFixed(0));

export class Hud {
  private readonly element = byId("hud", HTMLElement);
  private readonly rate = new FrameRate();
  private readonly markElement = byId("mark", HTMLElement);
  private readonly headline = byId("hud-head", HTMLElement);
  private readonly times = byId("hud-times", HTMLElement);
  private readonly work = byId("hud-work", HTMLElement);
  private lastT = -1;
  private network: number | null = null;

  constructor() {
    window.setInterval(() => this.showRate(), windowMs);
  }

  toggle(): boolean {
    this.element.classList.toggle("folded");
    return !this.element.classList.contains("folded");
  }

  // Whether the picture is the last word on what was asked for; else its level, 0 full size.
  mark(final: boolean, level: number): void {
    const text = final ? "final" : level === 0 ? "moving" : `moving 1/${2 ** level}`;
    if (this.markElement.textContent === text) return;
    this.markElement.textContent = text;
    this.markElement.classList.toggle("is-final", final);
  }

  show(frame: DrawnFrame, chosen: ChosenMessage | null): void {
    const { header } = frame;
    this.rate.add(performance.now());
    const network = networkMs(header, frame.arrivedAt, this.lastT);
    if (network !== null) this.network = network;
    this.lastT = header.t;
    const kind = header.errorMeasured ? "measured" : header.errorEstimated ? "estimated" : "";
    this.headline.textContent = [
      `${formatBytes(header.payloadBytes)} ${header.codec}`,
      chosen === null ? header.method : methodText(chosen),
      `${header.width}×${header.height}`,
      ...(header.cached ? ["cached"] : []),
      ...(kind === "" ? [] : [`error ${formatNumber(header.error, 2)} ${kind}`]),
    ].join(" · ");
    const net = this.network === null ? "–" : ms(this.network);
    this.times.textContent =
      `queue ${ms(header.queueUs / 1e3)} · render ${ms(header.renderUs / 1e3)} · ` +
      `encode ${ms(header.encodeUs / 1e3)} · net ${net} · decode ${ms(frame.decodeMs)} ms`;
    this.work.textContent = chosen === null ? "" : workLines(chosen.work).join("\n");
    this.showRate();
  }

  private showRate(): void {
    const rate = this.rate.value(performance.now());
    byId("fps", HTMLElement).textContent = rate === 0 ? "– fps" : `${rate} fps`;
  }
}

// The method, and what is particular to it.
export function methodText({ method, compositing, slabThickness }: ChosenMessage): string {
  const slabs = slabThickness === null ? "" : ` of ${formatNumber(slabThickness, 3)} cells`;
  return method === "reference" ? method : `${method}${slabs} ${compositing}`;
}

const many = (n: number): string => {
  if (n < 1000) return String(n);
  if (n < 1e6) return `${(n / 1e3).toFixed(1)} k`;
  return n < 1e9 ? `${(n / 1e6).toFixed(1)} M` : `${(n / 1e9).toFixed(1)} G`;
};

// What was drawn and what was left out, and what it cost.
export function workLines(work: ChosenMessage["work"]): [string, string, string] {
  const drawn = work.samples - work.culled - work.skippedBoth;
  return [
    `${many(drawn)} of ${many(work.samples)} samples · culled ${many(work.culled)}` +
      ` · occluded ${many(work.occluded)}`,
    `skipped ${many(work.skippedVector)} lines, ${many(work.skippedScalar)} splats,` +
      ` ${many(work.skippedBoth)} both`,
    `${many(work.pixelUpdates)} pixel updates · ${many(work.exponentials)} exponentials` +
      ` · ${work.variant}`,
  ];
}
