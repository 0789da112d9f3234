// What the page says in words: connection, loading with a bar, and errors. An error stays until it
// is dismissed or what caused it has succeeded; lesser news never overwrites it.
import type { ConnectionState } from "../wire/connection";
import { byId } from "../base/dom";

const noteMs = 4000;
const barDelayMs = 200; // what is faster than this needs no bar

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
  private barTimer: number | undefined;
  private noteTimer: number | undefined;
  private noted: string | null = null; // what a note stands in front of
  private countdown: number | undefined;
  private readonly offline = byId("offline", HTMLElement);
  private readonly offlineText = byId("offline-text", HTMLElement);
  private lost = false; // the line tells of the connection, and nothing less may take its place

  constructor() {
    byId("alert-close", HTMLButtonElement).addEventListener("click", () => this.clearError());
  }

  // A word for screen readers and the status line.
  say(text: string): void {
    window.clearTimeout(this.noteTimer);
    this.noted = null;
    if (!this.lost) this.tell(text);
  }

  // The same for a while, of what was done; then what was said before it.
  note(text: string): void {
    const before = this.noted ?? this.line.textContent ?? "";
    this.say(text);
    this.noted = before;
    this.noteTimer = window.setTimeout(() => this.say(before), noteMs);
  }

  private tell(text: string): void {
    if (this.line.textContent !== text) this.line.textContent = text;
  }

  connection(state: ConnectionState): void {
    window.clearInterval(this.countdown);
    document.documentElement.dataset.connection = state.name;
    this.light.title = state.name;
    this.lost = state.name === "waiting" || state.name === "asleep";
    this.offline.hidden = !this.lost;
    if (state.name !== "live") this.latency.textContent = "";
    if (state.name === "live") {
      this.tell("live");
    } else if (state.name === "connecting") {
      this.tell(state.attempt === 0 ? "connecting…" : `reconnecting (attempt ${state.attempt})…`);
    } else if (state.name === "asleep") {
      this.loaded();
      this.tell("idle; move the volume to reconnect");
      this.offlineText.textContent = `Idle: ${state.reason}.`;
    } else if (state.name === "waiting") {
      this.loaded();
      const until = performance.now() + state.delayMs;
      const tell = () => {
        const left = Math.max(0, Math.ceil((until - performance.now()) / 1000));
        this.offlineText.textContent = `Offline: ${state.reason}. Retrying in ${left} s.`;
      };
      this.tell(`connection lost: ${state.reason}`);
      tell();
      this.countdown = window.setInterval(tell, 1000);
    }
  }

  responded(ms: number): void {
    this.latency.textContent = `${ms.toFixed(0)} ms`;
  }

  // `topic` names what would have to succeed for the error to be over.
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

  // The error outlives the success of what it was about (something else took its place).
  holdError(): void {
    this.alertTopic = "";
  }

  startLoading(text: string): void {
    window.clearTimeout(this.barTimer);
    this.loadingText.textContent = text;
    this.bar.removeAttribute("value"); // unknown how far
    this.barTimer = window.setTimeout(() => (this.loading.hidden = false), barDelayMs);
    this.say(text);
  }

  progress(phase: string, done: number, etaMs: number | null): void {
    if (phase.startsWith("loading ")) this.loading.hidden = false; // told of what is slow only
    this.bar.value = done;
    const left = etaMs === null ? "" : `, ${Math.ceil(etaMs / 1000)} s left`;
    this.loadingText.textContent = `${phase}: ${Math.round(100 * done)} %${left}`;
  }

  loaded(): void {
    window.clearTimeout(this.barTimer);
    this.loading.hidden = true;
  }
}
