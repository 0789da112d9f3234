// The bar below the picture: time step, play, speed. It shows what it is told and says what the
// user wants; it holds no step of its own.
import type { Dataset } from "./protocol";
import { byId } from "./dom";

export interface TimeBarEvents {
  seek(step: number): void;
  play(): void;
  pause(): void;
  settings(): void; // loop or speed changed
}

export class TimeBar {
  private readonly element = byId("time", HTMLElement);
  private readonly slider = byId("time-slider", HTMLInputElement);
  private readonly playButton = byId("time-play", HTMLButtonElement);
  private readonly loopBox = byId("time-loop", HTMLInputElement);
  private readonly speed = byId("time-fps", HTMLSelectElement);
  private readonly label = byId("time-label", HTMLElement);
  private readonly stepText = byId("time-step", HTMLElement);
  private count = 0;
  private times: string[] = [];
  private step = 0;
  private running = false;

  constructor(private readonly events: TimeBarEvents) {
    this.slider.addEventListener("input", () => events.seek(Number(this.slider.value)));
    this.playButton.addEventListener("click", () => this.toggle());
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
  }

  get fps(): number {
    return Number(this.speed.value);
  }

  get loop(): boolean {
    return this.loopBox.checked;
  }

  get steps(): number {
    return this.count;
  }

  neighbour(by: number): number {
    if (this.count === 0) return 0;
    return (this.step + by + this.count) % this.count;
  }

  toggle(): void {
    if (this.count < 2) return;
    if (this.running) this.events.pause();
    else this.events.play();
  }

  setDataset(dataset: Dataset): void {
    this.count = dataset.steps.count;
    this.times = dataset.steps.times.map((time) => time.text);
    this.slider.max = String(Math.max(0, this.count - 1));
    this.element.classList.toggle("single", this.count < 2);
    this.element.inert = this.count < 2;
  }

  show(step: number, running: boolean): void {
    this.step = step;
    this.running = running;
    this.slider.value = String(step);
    const time = readableTime(this.times[step] ?? "");
    this.stepText.textContent = this.count < 2 ? "one step" : `step ${step} of ${this.count}`;
    this.label.textContent = time;
    this.slider.setAttribute(
      "aria-valuetext",
      `step ${step} of ${this.count}${time === "" ? "" : `, ${time}`}`,
    );
    this.playButton.classList.toggle("running", running);
    this.playButton.setAttribute("aria-label", running ? "Pause" : "Play");
  }
}

// 2001-01-01T03:00:00Z -> 2001-01-01 03:00Z; anything else as it stands.
export function readableTime(text: string): string {
  const parts = /^(\d{4,}-\d\d-\d\d)T(\d\d:\d\d)(?::00(?:\.0+)?)?(:\d\d)?(Z?)$/.exec(text);
  if (parts === null) return text;
  return `${parts[1]} ${parts[2]}${parts[3] ?? ""}${parts[4]}`;
}
