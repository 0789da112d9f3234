// Times, sizes and errors of the drawn frames: the table in the corner of the picture (key \). It
// is not announced to screen readers.
import { byId } from "../base/dom";
import { orNull } from "../base/storage";
import { errorMetric, errorWord } from "../base/error_text";
import {
  encodingLabel,
  errorLabel,
  FrameRate,
  methodText,
  networkMs,
  markText,
  paceText,
  scaleText,
  stepsText,
  workText,
  type LabelText,
} from "./frame_text";
import type { FrameState, DrawnFrame } from "@windsplat/client/parts";
import {
  frameHeaderBytes,
  type ChosenMessage,
  type FrameHeader,
  type StatsMessage,
} from "@windsplat/client";
import { formatBytes } from "../base/ticks";

const rateEveryMs = 1000;
const key = "windsplat.frame-times"; // in the browser's storage: "shown"

const ms = (value: number): string => (value < 10 ? value.toFixed(1) : value.toFixed(0));

const withDot = (word: string): string => (word === "" ? "" : ` · ${word}`);

function write(element: HTMLElement, { text, title }: LabelText, before = ""): void {
  element.textContent = text === "" ? "" : before + text;
  if (element.title !== title) element.title = title;
}

export class Hud {
  private readonly element = byId("hud", HTMLElement);
  private readonly button = byId("hud-button", HTMLButtonElement);
  private readonly rate = new FrameRate();
  private readonly markElement = byId("mark", HTMLElement);
  private readonly fps = byId("fps", HTMLElement);
  private readonly bytes = byId("hud-bytes", HTMLElement);
  private readonly headline = byId("hud-head", HTMLElement);
  private readonly drawingError = byId("hud-error", HTMLElement);
  private readonly errorWord = byId("hud-word", HTMLElement);
  private readonly encodingError = byId("hud-encoding", HTMLElement);
  private readonly times = byId("hud-times", HTMLElement);
  private readonly work = byId("hud-work", HTMLElement);
  private readonly pace = byId("hud-pace", HTMLElement);
  private readonly stepCounts = byId("hud-steps", HTMLElement);
  private lastT = -1;
  private network: number | null = null;
  private latency: number | null = null;
  private newest: { header: FrameHeader; limit: number | null } | null = null;

  constructor() {
    if (orNull(() => window.localStorage.getItem(key)) === "shown") this.toggle();
    errorMetric.watch(() => this.showErrors());
    window.setInterval(() => this.showRate(), rateEveryMs);
  }

  // Folded until the user asks for them: they cover the data. The browser remembers.
  toggle(): boolean {
    const shown = !this.element.classList.toggle("folded");
    this.button.setAttribute("aria-expanded", String(shown));
    orNull(() => window.localStorage.setItem(key, shown ? "shown" : "folded"));
    return shown;
  }

  // `scale` is the text from scaleText; it is shown unless the picture is final.
  mark(state: FrameState | "offline", scale: string): void {
    const text = markText(state, scale);
    if (this.markElement.textContent === text) return;
    this.markElement.textContent = text;
    this.markElement.classList.toggle("is-offline", state === "offline");
    this.markElement.classList.toggle("is-final", state === "final");
    this.markElement.classList.toggle("is-refining", state === "refining");
  }

  // Statistics of the current or last playback.
  steps(stats: StatsMessage): void {
    const { playFps } = stats;
    this.pace.textContent = playFps === null ? "" : paceText(playFps);
    this.stepCounts.textContent = stepsText(stats);
  }

  // fullWidth: width of the full-resolution picture in pixels.
  show(frame: DrawnFrame, chosen: ChosenMessage | null, fullWidth: number): void {
    const { header } = frame;
    this.rate.add(frame.drawnAt, header.payloadBytes + frameHeaderBytes);
    const network = networkMs(header, frame.arrivedAt, this.lastT);
    if (network !== null) {
      this.network = network;
      this.latency = frame.drawnAt - header.t;
    }
    this.lastT = header.t;
    const scale = scaleText(header.width, fullWidth);
    const quality = header.codec === "jpeg" ? ` ${header.quality}` : "";
    this.headline.textContent = [
      chosen === null ? header.method : methodText(chosen),
      `${header.width}×${header.height}${scale === "" ? "" : ` (${scale})`}`,
      `${header.codec}${quality} ${formatBytes(header.payloadBytes)}`,
      ...(header.cached ? ["cached"] : []),
    ].join(" · ");
    this.newest = { header, limit: chosen?.view.quality?.maxError ?? null };
    this.showErrors();
    const msOrDash = (value: number | null): string => (value === null ? "–" : ms(value));
    this.times.textContent =
      `queue ${ms(header.queueUs / 1e3)} · render ${ms(header.renderUs / 1e3)} · ` +
      `encode ${ms(header.encodeUs / 1e3)} · net ${msOrDash(this.network)} · ` +
      `decode ${ms(frame.decodeMs)} · latency ${msOrDash(this.latency)} ms`;
    this.work.textContent = chosen === null ? "" : workText(chosen);
    this.showRate();
  }

  private showErrors(): void {
    if (this.newest === null) return;
    const { header, limit } = this.newest;
    write(this.drawingError, errorLabel(header, limit, errorMetric.value));
    const known = header.errorMeasured || header.errorEstimated;
    this.errorWord.textContent = known ? withDot(errorWord(header.error)) : "";
    write(this.encodingError, encodingLabel(header, errorMetric.value), " · ");
  }

  private showRate(): void {
    const { fps, bytes } = this.rate.value(performance.now());
    this.fps.textContent = fps === 0 ? "– fps" : `${fps} fps`;
    this.bytes.textContent = fps === 0 ? "" : `${formatBytes(bytes)}/s`;
  }
}
