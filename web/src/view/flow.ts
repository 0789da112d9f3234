// Animates the lines: advances /vector/motion/time while the motion is on, at most `flowFps` times
// a second and never before the frame of the last patch has arrived. Time, timers and the page's
// state are injected.
import { clamp } from "@windsplat/client/parts";

export const flowFps = 15;
const intervalMs = 1000 / flowFps;
const gapMsMax = 250; // limit, so that the lines do not jump after a stall
const timeMax = 1e6; // limit of the protocol, in steps

export interface FlowHost {
  now(): number; // ms
  setTimeout(run: () => void, ms: number): number;
  clearTimeout(timer: number): void;
  hidden(): boolean; // the page is hidden
  wanted(): boolean; // whether the view has lines with motion
  time(): number; // motion time of the view, in steps
  send(time: number): number; // returns the rev of the patch
  ended(): void; // the motion ended by itself, not by stop()
}

// The view's time `ms` later: one step per second, so that `rate` is in cycles per second.
export function laterTime(time: number, ms: number): number {
  const next = time + clamp(ms, 0, gapMsMax) / 1000;
  return next > timeMax ? 0 : Number(next.toFixed(3));
}

export class Flow {
  private on = false;
  private timer: number | null = null;
  private movedAt: number | null = null; // null: restarts at the next frame
  private sentRev = 0;
  private answeredRev = 0;

  constructor(private readonly host: FlowHost) {}

  get running(): boolean {
    return this.on;
  }

  start(): void {
    if (this.on) return;
    this.on = true;
    this.movedAt = null;
    this.sentRev = this.answeredRev; // earlier patches are not waited for
    this.plan();
  }

  stop(): void {
    this.on = false;
    if (this.timer !== null) this.host.clearTimeout(this.timer);
    this.timer = null;
  }

  // Call when a frame of this rev has been drawn.
  answered(rev: number): void {
    this.answeredRev = Math.max(this.answeredRev, rev);
    this.plan();
  }

  // Call when the page is visible again.
  seen(): void {
    this.plan();
  }

  // The server refused the patch with this rev. If the motion sent it, the motion ends.
  refused(rev: number): void {
    if (this.on && rev === this.sentRev) this.end();
  }

  private end(): void {
    this.stop();
    this.host.ended();
  }

  private plan(): void {
    if (!this.on || this.timer !== null || this.answeredRev < this.sentRev) return;
    const waited = this.movedAt === null ? 0 : this.host.now() - this.movedAt;
    this.timer = this.host.setTimeout(
      () => {
        this.timer = null;
        this.move();
      },
      Math.max(0, intervalMs - waited),
    );
  }

  private move(): void {
    if (!this.on || this.host.hidden()) return; // seen() resumes
    if (!this.host.wanted()) {
      this.end();
      return;
    }
    const now = this.host.now();
    const ms = this.movedAt === null ? intervalMs : now - this.movedAt;
    this.movedAt = now;
    this.sentRev = this.host.send(laterTime(this.host.time(), ms));
  }
}
