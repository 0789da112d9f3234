// The value under the cursor: mouse position on the picture -> the sample there -> a request to the
// server -> text beside the cursor. At most one request is active, requests are `everyMs` apart,
// and only the newest position is requested. Nothing is requested while the view moves; failures
// are not shown. Timers and the server are injected.

export interface HoverTarget<S> {
  sample: S;
  key: string; // targets with the same key have the same value
}

export interface HoverHost<S> {
  now(): number; // ms
  setTimeout(run: () => void, ms: number): number;
  clearTimeout(timer: number): void;
  busy(): boolean; // the view moves or the page is hidden; call poke() when this may have changed
  find(at: [number, number]): HoverTarget<S> | null; // null: no sample at this position
  request(sample: S, signal: AbortSignal): Promise<string[]>; // lines to show
  show(lines: string[], at: [number, number]): void; // no lines: hide the text
}

export const everyMs = 125;
const restMs = 150; // the view is at rest if unchanged for this long

export class Hover<S> {
  private at: [number, number] | null = null; // cursor position as fractions of the picture
  private asking: AbortController | null = null;
  private askedAt = -Infinity;
  private changedAt = -Infinity; // time of the last change of the view
  private timer: number | null = null;
  private shown = ""; // key of the displayed target; empty: none

  constructor(private readonly host: HoverHost<S>) {}

  move(at: [number, number]): void {
    this.at = at;
    this.plan();
  }

  // The cursor has left the picture: cancels the request and hides the text.
  leave(): void {
    this.at = null;
    this.asking?.abort();
    this.asking = null;
    this.hide();
    if (this.timer !== null) this.host.clearTimeout(this.timer);
    this.timer = null;
  }

  // The view, its step or its dataset may have changed under the cursor.
  poke(): void {
    if (this.at === null) return;
    const key = this.host.busy() ? "" : (this.host.find(this.at)?.key ?? "");
    if (key === this.shown && key !== "") return;
    this.changedAt = this.host.now();
    this.hide();
    this.plan();
  }

  private hide(): void {
    if (this.shown === "") return;
    this.shown = "";
    this.host.show([], [0, 0]);
  }

  private plan(): void {
    if (this.timer !== null || this.asking !== null) return;
    const due = Math.max(this.askedAt + everyMs, this.changedAt + restMs) - this.host.now();
    if (due <= 0) {
      this.request();
      return;
    }
    this.timer = this.host.setTimeout(() => {
      this.timer = null;
      this.plan();
    }, due);
  }

  private request(): void {
    const { at } = this;
    if (at === null) return;
    const target = this.host.busy() ? null : this.host.find(at);
    if (target === null) {
      this.hide();
      return;
    }
    if (target.key === this.shown) return;
    this.askedAt = this.host.now();
    const asking = new AbortController();
    this.asking = asking;
    void this.host
      .request(target.sample, asking.signal)
      .catch(() => [])
      .then((lines) => {
        if (this.asking !== asking) return; // the cursor has left the picture
        this.asking = null;
        this.showAnswer(target, lines, at);
      });
  }

  private showAnswer(target: HoverTarget<S>, lines: string[], at: [number, number]): void {
    const here = this.at === null || this.host.busy() ? null : this.host.find(this.at);
    if (here?.key === target.key) {
      // A failed request counts as answered and is not repeated.
      this.shown = target.key;
      this.host.show(lines, at);
    } else if (here !== null) {
      this.plan();
    } else {
      this.hide();
    }
  }
}
