// Progress of loading, shown without covering the picture: a line at its lower edge, or in words
// where there is no picture yet. Short loads, as of every step of a playback, are not shown.
import type { ProgressMessage } from "../wire/protocol";
import type { Inside } from "./template";

const quietMs = 300;

export class Loading {
  private timer: number | null = null;
  private newest: ProgressMessage | null = null;

  constructor(
    private readonly inside: Pick<Inside, "loading">,
    private readonly sayFirst: (text: string) => boolean, // whether there is no picture yet
  ) {}

  /** A part was loaded: 0 to 1. */
  show(progress: ProgressMessage): void {
    if (!progress.phase.startsWith("loading")) return;
    this.newest = progress;
    if (!this.inside.loading.hidden) this.draw();
    else this.timer ??= window.setTimeout(() => this.draw(), quietMs);
  }

  /** A picture was shown, or there is no stream. */
  end(): void {
    if (this.timer !== null) window.clearTimeout(this.timer);
    this.timer = null;
    this.newest = null;
    this.inside.loading.hidden = true;
  }

  private draw(): void {
    const { newest } = this;
    this.timer = null;
    if (newest === null) return;
    const percent = Math.round(100 * newest.done);
    if (this.sayFirst(`${newest.phase} ${percent} %`)) return;
    const { loading } = this.inside;
    loading.hidden = false;
    loading.style.width = `${percent}%`;
    loading.setAttribute("aria-label", newest.phase);
    loading.setAttribute("aria-valuenow", String(percent));
  }
}
