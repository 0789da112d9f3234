// The bar below the picture: time step, playback in both directions, speed. It displays the state
// passed to it and reports the user's input; it stores no step itself.
import type { Dataset } from "@windsplat/client";
import { byId } from "../base/dom";
import { readableTime } from "@windsplat/client/parts";

export type Direction = 1 | -1; // forward, backward

export interface TimeBarEvents {
  seek(step: number): void;
  scrub(step: number): void; // the slider is being dragged
  scrubbed(): void; // the slider was released
  play(direction: Direction): void;
  pause(): void;
  settings(): void; // loop, speed or step dropping changed
}

export class TimeBar {
  private readonly element = byId("time", HTMLElement);
  private readonly slider = byId("time-slider", HTMLInputElement);
  private readonly buttons: [Direction, HTMLButtonElement, string][] = [
    [1, byId("time-play", HTMLButtonElement), "Play"],
    [-1, byId("time-reverse", HTMLButtonElement), "Play backward"],
  ];
  private readonly loopBox = byId("time-loop", HTMLInputElement);
  private readonly speed = byId("time-fps", HTMLSelectElement);
  private readonly keeping = byId("time-drop", HTMLSelectElement);
  private readonly label = byId("time-label", HTMLElement);
  private readonly stepText = byId("time-step", HTMLElement);
  private count = 0;
  private times: string[] = [];
  private step = 0;
  private running: Direction | 0 = 0;

  constructor(private readonly events: TimeBarEvents) {
    this.slider.addEventListener("input", () => events.scrub(Number(this.slider.value)));
    this.slider.addEventListener("change", () => events.scrubbed());
    for (const [direction, button] of this.buttons) {
      button.addEventListener("click", () => this.toggle(direction));
    }
    const moves: [string, () => number][] = [
      ["time-first", () => 0],
      ["time-previous", () => this.neighbour(-1)],
      ["time-next", () => this.neighbour(1)],
      ["time-last", () => this.count - 1],
    ];
    for (const [id, target] of moves) {
      byId(id, HTMLButtonElement).addEventListener("click", () => events.seek(target()));
    }
    this.loopBox.addEventListener("change", () => events.settings());
    this.speed.addEventListener("change", () => events.settings());
    this.keeping.addEventListener("change", () => events.settings());
  }

  get fps(): number {
    return Number(this.speed.value);
  }

  get loop(): boolean {
    return this.loopBox.checked;
  }

  // Whether late steps are dropped rather than shown late.
  get drop(): boolean {
    return this.keeping.value === "time";
  }

  get steps(): number {
    return this.count;
  }

  neighbour(by: number): number {
    if (this.count === 0) return 0;
    return (this.step + by + this.count) % this.count;
  }

  // Plays in this direction, or stops if it is already playing in it.
  toggle(direction: Direction = 1): void {
    if (this.count < 2) return;
    if (this.running === direction) this.events.pause();
    else this.events.play(direction);
  }

  setDataset(dataset: Dataset): void {
    this.count = dataset.steps.count;
    this.times = dataset.steps.times.map((time) => time.text);
    this.slider.max = String(Math.max(0, this.count - 1));
    this.element.classList.toggle("single", this.count < 2);
    this.element.inert = this.count < 2;
  }

  show(step: number, running: Direction | 0): void {
    this.step = step;
    this.running = running;
    this.slider.value = String(step);
    const time = readableTime(this.times[step] ?? "");
    this.stepText.textContent = this.count < 2 ? "one step" : `step ${step + 1} of ${this.count}`;
    this.label.textContent = time;
    this.slider.setAttribute(
      "aria-valuetext",
      `step ${step + 1} of ${this.count}${time === "" ? "" : `, ${time}`}`,
    );
    for (const [direction, button, name] of this.buttons) {
      button.classList.toggle("running", running === direction);
      button.setAttribute("aria-label", running === direction ? "Pause" : name);
    }
  }
}
