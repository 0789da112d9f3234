// The bar of controls of <windsplat-view>: time steps, zoom, the whole picture.
import { readableTime } from "../base/time_text";
import type { Dataset } from "../wire/protocol";
import type { Inside } from "./template";

export interface ControlHost {
  seek(step: number): void;
  toggle(): void; // plays or pauses
  zoom(factor: number): void;
  reset(): void;
}

const zoomFactor = 1.25;

export class ControlBar {
  private times: string[] = [];

  constructor(
    private readonly inside: Inside,
    host: ControlHost,
  ) {
    const { play, slider, zoomIn, zoomOut, reset } = inside;
    slider.addEventListener("input", () => host.seek(Number(slider.value)));
    play.addEventListener("click", () => host.toggle());
    zoomIn.addEventListener("click", () => host.zoom(zoomFactor));
    zoomOut.addEventListener("click", () => host.zoom(1 / zoomFactor));
    reset.addEventListener("click", () => host.reset());
    this.showTimes(1);
  }

  describe({ steps }: Dataset): void {
    this.times = steps.times.map(({ text }) => readableTime(text));
    this.showTimes(steps.count);
    this.showStep(Number(this.inside.slider.value));
  }

  showStep(step: number): void {
    const { slider, time } = this.inside;
    const text = this.times[step] ?? `step ${step + 1}`;
    slider.value = String(step);
    slider.setAttribute("aria-valuetext", text);
    time.textContent = text;
  }

  showPlaying(on: boolean): void {
    const { play } = this.inside;
    play.textContent = on ? "❚❚" : "▶";
    play.title = on ? "Pause" : "Play";
    play.setAttribute("aria-label", play.title);
  }

  private showTimes(count: number): void {
    const { play, slider, time } = this.inside;
    slider.max = String(Math.max(0, count - 1));
    for (const one of [play, slider, time]) one.hidden = count < 2;
  }
}
