// Status text: connection, loading with a progress bar, and errors. An error is shown until it is
// dismissed or the failed operation succeeds; less important messages never overwrite it.
import type { ConnectionState, DrawnFrame } from "@windsplat/client/parts";
import { countedFromOne } from "../base/step_text";
import { byId } from "../base/dom";

const noteMs = 4000;
const barDelayMs = 200; // faster loads show no bar

export class Status {
  private readonly line = byId("status", HTMLElement);
  private readonly light = byId("light", HTMLElement);
  private readonly latency = byId("latency", HTMLElement);
  private readonly alert = byId("alert", HTMLElement);
  private readonly alertText = byId("alert-text", HTMLElement);
  private readonly loading = byId("loading", HTMLElement);
  private readonly bar = byId("loading-bar", HTMLProgressElement);
  private readonly loadingText = byId("loading-text", HTMLElement);
  private alertTopic = "";
  private answeredT = 0; // t of the newest patch answered by a frame
  private barTimer: number | undefined;
  private noteTimer: number | undefined;
  private noted: string | null = null; // the text that a note has temporarily replaced
  private countdown: number | undefined;
  private readonly emptyText = byId("empty", HTMLElement);
  private readonly offline = byId("offline", HTMLElement);
  private readonly retryButton = byId("retry-button", HTMLButtonElement);
  private readonly loginButton = byId("login-button", HTMLButtonElement);
  private readonly offlineText = byId("offline-text", HTMLElement);
  private lost = false; // the line reports the lost connection and must not be overwritten

  constructor() {
    byId("alert-close", HTMLButtonElement).addEventListener("click", () => this.clearError());
  }

  // Text for screen readers and the status line.
  announce(text: string): void {
    window.clearTimeout(this.noteTimer);
    this.noted = null;
    if (!this.lost) this.setLine(text);
  }

  // Shows the text for a few seconds, then restores the previous text.
  note(text: string): void {
    const before = this.noted ?? this.line.textContent ?? "";
    this.announce(text);
    this.noted = before;
    this.noteTimer = window.setTimeout(() => this.announce(before), noteMs);
  }

  private setLine(text: string): void {
    if (this.line.textContent !== text) this.line.textContent = text;
  }

  connection(state: ConnectionState): void {
    window.clearInterval(this.countdown);
    document.documentElement.dataset.connection = state.name;
    this.light.title = state.name;
    const locked = state.name === "locked";
    this.lost = state.name === "waiting" || state.name === "asleep" || locked;
    this.offline.hidden = !this.lost;
    this.retryButton.hidden = locked;
    this.loginButton.hidden = !locked;
    if (state.name !== "live") this.latency.textContent = "";
    if (state.name === "live") {
      this.setLine("live");
    } else if (state.name === "connecting") {
      this.setLine(
        state.attempt === 0 ? "connecting…" : `reconnecting (attempt ${state.attempt})…`,
      );
    } else if (state.name === "asleep") {
      this.loaded();
      this.setLine("idle; move the volume to reconnect");
      this.offlineText.textContent = `Idle: ${state.reason}.`;
    } else if (state.name === "locked") {
      this.loaded();
      this.setLine("the server asks for its token");
      this.offlineText.textContent = "The server asks for its token.";
    } else if (state.name === "waiting") {
      this.loaded();
      const until = performance.now() + state.delayMs;
      const showCountdown = () => {
        const left = Math.max(0, Math.ceil((until - performance.now()) / 1000));
        this.offlineText.textContent = `Offline: ${state.reason}. Retrying in ${left} s.`;
      };
      this.setLine(`connection lost: ${state.reason}`);
      showCountdown();
      this.countdown = window.setInterval(showCountdown, 1000);
    }
  }

  // Only the first frame that answers a patch measures the latency.
  responded({ header: { t }, drawnAt }: Pick<DrawnFrame, "header" | "drawnAt">): void {
    if (t > 0 && t !== this.answeredT) this.latency.textContent = `${(drawnAt - t).toFixed(0)} ms`;
    this.answeredT = t;
  }

  // `topic` names the operation whose success clears the error.
  error(topic: string, text: string): void {
    this.alertTopic = topic;
    this.alertText.textContent = text;
    this.alert.hidden = false;
  }

  clearError(topic?: string): void {
    if (topic !== undefined && topic !== this.alertTopic) return;
    this.alert.hidden = true;
    this.alertText.textContent = "";
  }

  // Why the picture shows nothing of the data; undefined: it shows some. note: what else to know.
  empty(reason: string | undefined, note = ""): void {
    const text = reason === undefined ? note : `Nothing is shown: ${countedFromOne(reason)}.`;
    if (this.emptyText.textContent !== text) this.emptyText.textContent = text;
    this.emptyText.hidden = text === "";
    this.emptyText.classList.toggle("is-note", reason === undefined);
  }

  // Keeps the error even if its operation succeeds, because another view replaced the failed one.
  holdError(): void {
    this.alertTopic = "";
  }

  startLoading(text: string): void {
    window.clearTimeout(this.barTimer);
    this.loadingText.textContent = text;
    this.bar.removeAttribute("value"); // indeterminate progress
    this.barTimer = window.setTimeout(() => (this.loading.hidden = false), barDelayMs);
    this.announce(text);
  }

  progress(phase: string, done: number, etaMs: number | null): void {
    // the server reports only slow loads
    if (phase.startsWith("loading ")) this.loading.hidden = false;
    this.bar.value = done;
    const left = etaMs === null ? "" : `, ${Math.ceil(etaMs / 1000)} s left`;
    this.loadingText.textContent = `${phase}: ${Math.round(100 * done)} %${left}`;
  }

  loaded(): void {
    window.clearTimeout(this.barTimer);
    this.loading.hidden = true;
  }
}
