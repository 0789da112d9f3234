// The reference picture of the view: requested by the first press, rendered by a job of the server,
// shown while the key is held, discarded when the view changes. Pure except for its host.
import { failureText } from "../base/problem_text";
import { errorMetric, errorName, errorText } from "../base/error_text";
import type { View } from "@windsplat/client";

export interface Job {
  id: string;
  state: "queued" | "running" | "done" | "failed" | "cancelled";
  progress: number; // 0 to 1
  etaMs: number | null;
  result: { id: string; error: { value: number } } | null;
  problem: { detail: string } | null;
}

export interface ReferenceHost {
  view(): View; // with all defaults
  // Returns parsed answers of the server; a failure throws an Error with a message.
  request(method: "GET" | "POST" | "DELETE", path: string, body?: View): Promise<unknown>;
  sleep(ms: number): Promise<void>;
  load(path: string): Promise<void>; // resolves when the picture can be shown without delay
  show(on: boolean): void;
  // Text for the status region, and the progress outside of it; empty: nothing.
  report(text: string, progress: string): void;
}

const pollMs = 500;
const pixelsMax = 1e6; // each pixel takes about 50 microseconds

// The view at the size requested for the reference: its own size, up to `pixelsMax`. `quality` is
// omitted, as it affects only how frames are drawn, not their content.
export function referenceView(explicit: View): View {
  const { quality: _quality, ...view } = explicit;
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
  private asked: { view: string } | null = null; // the requested view; each request is a new object
  private ready: { name: string; error: number } | null = null;
  private held = false;
  private job: string | null = null; // the active job
  private last = Promise.resolve(); // the server renders one reference at a time for a page

  constructor(private readonly host: ReferenceHost) {
    errorMetric.watch(() => this.reportReady());
  }

  hold(): void {
    this.held = true;
    this.prepare();
    this.host.show(this.ready !== null);
  }

  release(): void {
    this.held = false;
    this.host.show(false);
  }

  // Requests the reference unless it is ready or in progress.
  prepare(): void {
    if (this.asked !== null) return;
    const view = referenceView(this.host.view());
    const asked = (this.asked = { view: JSON.stringify(view) });
    this.last = this.last.then(() => this.fetch(asked, view));
  }

  // Call when the view may have changed.
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
    this.host.report("", "");
  }

  // Cancels the active job.
  abandon(): void {
    if (this.job === null) return;
    // the job may have finished
    void this.host.request("DELETE", `v1/jobs/${this.job}`).catch(() => {});
    this.job = null;
  }

  private reportReady(): void {
    if (this.ready === null) return;
    const { name, error } = this.ready;
    const metric = errorMetric.value;
    const accuracy = `${errorName(metric)} ${errorText(error, metric)} true`;
    this.host.report(`${name} ready: hold r · ${accuracy}`, "");
  }

  private async fetch(asked: object, view: View): Promise<void> {
    const wanted = (): boolean => this.asked === asked;
    if (!wanted()) return;
    const name = `reference ${view.image?.width}×${view.image?.height}`;
    try {
      this.host.report(name, "");
      let job = (await this.host.request("POST", "v1/references", view)) as Job;
      this.job = job.id;
      while (wanted() && isOpen(job)) {
        this.host.report(name, progressText(job));
        await this.host.sleep(pollMs);
        if (wanted()) job = (await this.host.request("GET", `v1/jobs/${job.id}`)) as Job;
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
      this.reportReady();
      this.host.show(this.held);
    } catch (failure) {
      if (!wanted()) return;
      this.asked = null; // the next press tries again
      this.job = null;
      this.host.report(`${name}: ${failureText(failure)}`, "");
    }
  }
}
