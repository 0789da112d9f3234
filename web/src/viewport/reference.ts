// The truth of the view that is shown: asked for by the first hold, drawn by a job of the server,
// looked at while it is held, dropped as soon as the view is another. Pure but for its host.
import { failureText } from "../wire/api";
import { errorMetric, errorName, errorText } from "../base/error_text";
import type { View } from "../wire/protocol";

export interface Job {
  id: string;
  state: "queued" | "running" | "done" | "failed" | "cancelled";
  progress: number; // 0 to 1
  etaMs: number | null;
  result: { id: string; error: { value: number } } | null;
  problem: { detail: string } | null;
}

export interface ReferenceHost {
  view(): View; // with every default
  // Answers of the server, parsed; a failure is thrown in words.
  ask(method: "GET" | "POST" | "DELETE", path: string, body?: View): Promise<unknown>;
  sleep(ms: number): Promise<void>;
  load(path: string): Promise<void>; // until the picture can be shown at once
  show(on: boolean): void;
  // What is said once, and what is only written beside it; empty: nothing.
  tell(words: string, progress: string): void;
}

const pollMs = 500;
const pixelsMax = 1e6; // each takes some 50 microseconds

// The view at the size that is asked for: its own, as long as that is not too much. Without
// `quality`, which says how frames are drawn, not what they show.
export function referenceView(said: View): View {
  const { quality: _quality, ...view } = said;
  const { width = 0, height = 0 } = view.image ?? {};
  const scale = Math.min(1, Math.sqrt(pixelsMax / (width * height)));
  const image = {
    ...view.image,
    width: Math.floor(width * scale),
    height: Math.floor(height * scale),
  };
  return { ...view, image };
}

export function progressText({ state, progress, etaMs }: Job): string {
  if (state === "queued") return ": waiting";
  const left = etaMs === null ? "" : `, ${Math.ceil(etaMs / 1000)} s left`;
  return `: ${Math.floor(100 * progress)} %${left}`;
}

const isOpen = ({ state }: Job): boolean => state === "queued" || state === "running";

export class Reference {
  private asked: { view: string } | null = null; // what it is of; each asking is another
  private ready: { name: string; error: number } | null = null;
  private held = false;
  private job: string | null = null; // that is under way
  private last = Promise.resolve(); // a server draws one at a time for a page

  constructor(private readonly host: ReferenceHost) {
    errorMetric.watch(() => this.tellReady());
  }

  hold(): void {
    this.held = true;
    this.ask();
    this.host.show(this.ready !== null);
  }

  release(): void {
    this.held = false;
    this.host.show(false);
  }

  // Unless it is there or on its way.
  ask(): void {
    if (this.asked !== null) return;
    const view = referenceView(this.host.view());
    const asked = (this.asked = { view: JSON.stringify(view) });
    this.last = this.last.then(() => this.fetch(asked, view));
  }

  // The view may be another now.
  follow(): void {
    if (this.asked === null) return;
    if (JSON.stringify(referenceView(this.host.view())) !== this.asked.view) this.drop();
  }

  drop(): void {
    const wasAsked = this.asked !== null;
    this.asked = null;
    this.ready = null;
    this.abandon();
    if (!wasAsked) return;
    this.host.show(false);
    this.host.tell("", "");
  }

  // Nobody waits for it any more.
  abandon(): void {
    if (this.job === null) return;
    void this.host.ask("DELETE", `v1/jobs/${this.job}`).catch(() => {}); // gone by itself
    this.job = null;
  }

  private tellReady(): void {
    if (this.ready === null) return;
    const { name, error } = this.ready;
    const metric = errorMetric.value;
    const words = `${errorName(metric)} ${errorText(error, metric)} true`;
    this.host.tell(`${name} ready: hold r · ${words}`, "");
  }

  private async fetch(asked: object, view: View): Promise<void> {
    const wanted = (): boolean => this.asked === asked;
    if (!wanted()) return;
    const name = `reference ${view.image?.width}×${view.image?.height}`;
    try {
      this.host.tell(name, "");
      let job = (await this.host.ask("POST", "v1/references", view)) as Job;
      this.job = job.id;
      while (wanted() && isOpen(job)) {
        this.host.tell(name, progressText(job));
        await this.host.sleep(pollMs);
        if (wanted()) job = (await this.host.ask("GET", `v1/jobs/${job.id}`)) as Job;
      }
      if (!wanted()) return this.abandon();
      this.job = null;
      const { result } = job;
      if (result === null) {
        throw new Error(job.problem?.detail ?? job.state);
      }
      await this.host.load(`v1/references/${result.id}.png`);
      if (!wanted()) return;
      this.ready = { name, error: result.error.value };
      this.tellReady();
      this.host.show(this.held);
    } catch (failure) {
      if (!wanted()) return;
      this.asked = null; // another hold tries again
      this.job = null;
      this.host.tell(`${name}: ${failureText(failure)}`, "");
    }
  }
}
