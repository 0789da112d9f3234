// Jobs of the Save dialog: work -> progress bar, result text, and a file to download.
import { failureText } from "../base/problem_text";
import { byId, make, whenClosed } from "../base/dom";
import { formatBytes } from "../base/ticks";

export type ReportProgress = (text: string, done?: number) => void; // done: 0 to 1, if known

// Creates the file with this name.
export interface Job {
  name: string;
  work(signal: AbortSignal, report: ReportProgress): Promise<Blob>;
}

export const button = (id: string) => byId(id, HTMLButtonElement);
export const part = (id: string) => byId(`save-${id}`, HTMLElement);

function download(file: Blob, name: string): void {
  const link = make("a");
  link.href = URL.createObjectURL(file);
  link.download = name;
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

// Runs one job at a time and shows its progress bar and result text.
export class Jobs {
  private job: AbortController | null = null;

  constructor(
    private readonly dialog: HTMLDialogElement,
    private readonly changed: () => void,
  ) {
    const stop = () => this.job?.abort();
    button("save-cancel").addEventListener("click", stop);
    whenClosed(dialog, stop);
    dialog.addEventListener("cancel", (event) => {
      if (this.running) event.preventDefault(); // Escape cancels the job first
      stop();
    });
  }

  get running(): boolean {
    return this.job !== null;
  }

  clear(): void {
    part("error").hidden = true;
    part("said").textContent = "";
  }

  fail(failure: unknown): void {
    part("error").textContent = failureText(failure);
    part("error").hidden = false;
  }

  async run({ name, work }: Job): Promise<void> {
    const job = new AbortController();
    const bar = byId("save-bar", HTMLProgressElement);
    this.show(job);
    this.clear();
    button("save-cancel").focus();
    try {
      const file = await work(job.signal, (text, done) => {
        part("progress").textContent = text;
        if (done === undefined) bar.removeAttribute("value");
        else bar.value = done;
      });
      job.signal.throwIfAborted();
      download(file, name);
      part("said").textContent = `Saved ${name}, ${formatBytes(file.size)}.`;
    } catch (failure) {
      if (job.signal.aborted) part("said").textContent = "Cancelled.";
      else this.fail(failure);
      job.abort(); // cancels the requests still active
    }
    this.show(null);
    if (this.dialog.open) button("save-close").focus();
  }

  private show(job: AbortController | null): void {
    this.job = job;
    part("job").hidden = job === null;
    this.changed();
  }
}
