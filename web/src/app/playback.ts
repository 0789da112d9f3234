// Playback state and direction. The server keeps the time; the page sends `play` and `pause` and
// follows the frames that come.
import type { ClientMessage } from "../wire/protocol";
import type { Direction } from "./time_bar";

export interface PlaybackHost {
  send(message: ClientMessage): boolean; // whether it went out
  settings(): { steps: number; fps: number; loop: boolean; drop: boolean };
  seek(step: number): void;
  changed(): void; // it runs, or stands still, or runs another way
}

export class Playback {
  private way: Direction | 0 = 0;
  private resume: Direction | 0 = 0; // when the slider is let go
  private moved = false; // another step was shown since `play`

  constructor(private readonly host: PlaybackHost) {}

  get direction(): Direction | 0 {
    return this.way;
  }

  get running(): boolean {
    return this.way !== 0;
  }

  // Also while steps run: then it changes how, from the present step on.
  play(direction: Direction): void {
    const { steps, fps, loop, drop } = this.host.settings();
    const last = steps - 1;
    if (last < 1) return;
    const [from, to] = direction > 0 ? [0, last] : [last, 0];
    const sent = this.host.send({ type: "play", from, to, fps, loop, drop });
    this.way = sent ? direction : 0;
    this.moved = false;
    this.host.changed();
  }

  // Speed, loop or dropping changed.
  again(): void {
    if (this.way !== 0) this.play(this.way);
  }

  pause(): void {
    if (!this.running) return;
    this.halt();
    this.host.send({ type: "pause" });
    this.host.changed();
  }

  // The server stopped playback, or the connection is lost.
  halt(): void {
    this.way = 0;
    this.resume = 0;
  }

  // Time stands still under the slider and runs on when it is let go.
  scrub(step: number): void {
    const running = this.way;
    this.host.seek(step);
    if (running !== 0) this.resume = running;
  }

  scrubbed(): void {
    const direction = this.resume;
    this.resume = 0;
    if (direction !== 0) this.play(direction);
  }

  // A frame of this step is on the screen. Without loop the last one ends it; but one that was on
  // its way before `play` may show that step too.
  shown(step: number, before: number): void {
    if (!this.running) return;
    const { steps, loop } = this.host.settings();
    this.moved ||= step !== before;
    if (!loop && this.moved && step === (this.way > 0 ? steps - 1 : 0)) this.halt();
  }
}
