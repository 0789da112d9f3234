// Playback state and direction. The server advances the steps; the page sends `play` and `pause`
// and follows the steps of the arriving frames.
import type { ClientMessage } from "@windsplat/client";
import type { Direction } from "./time_bar";

export interface PlaybackHost {
  send(message: ClientMessage): boolean; // returns whether the message was sent
  settings(): { steps: number; fps: number; loop: boolean; drop: boolean };
  seek(step: number): void;
  changed(): void; // playback started, stopped or changed direction
}

export class Playback {
  private way: Direction | 0 = 0;
  private resume: Direction | 0 = 0; // direction to resume in when the slider is released
  private moved = false; // another step was shown since `play`

  constructor(private readonly host: PlaybackHost) {}

  get direction(): Direction | 0 {
    return this.way;
  }

  get running(): boolean {
    return this.way !== 0;
  }

  // May be called during playback: the settings then change, starting at the present step.
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

  // Restarts playback after a change of speed, loop or step dropping.
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

  // Playback pauses while the slider is dragged and resumes when it is released.
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

  // Called when a frame of this step is on the canvas. Without loop, playback ends at the last
  // step; a frame rendered before `play` may show that step too and does not count.
  shown(step: number, before: number): void {
    if (!this.running) return;
    const { steps, loop } = this.host.settings();
    this.moved ||= step !== before;
    if (!loop && this.moved && step === (this.way > 0 ? steps - 1 : 0)) this.halt();
  }
}
