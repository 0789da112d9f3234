// One WebSocket to /v1/stream, reopened whenever it is lost. Received bytes -> typed messages and
// frames passed to `events`; outgoing messages -> text. Sockets, timers and random numbers are
// injected, so that tests can simulate the network.
import {
  encodeClientMessage,
  parseFrame,
  parseServerMessage,
  subprotocol,
  WireError,
  type ClientMessage,
  type Frame,
  type HelloMessage,
  type ServerMessage,
} from "./protocol";
import type { Reach } from "./reach";

export interface MessageLike {
  data: unknown;
}

export interface CloseLike {
  code: number;
  reason: string;
}

export interface SocketLike {
  binaryType: string;
  readyState: number;
  bufferedAmount: number; // bytes not sent yet
  send(text: string): void;
  close(code?: number, reason?: string): void;
  onmessage: ((event: MessageLike) => void) | null;
  onclose: ((event: CloseLike) => void) | null;
}

export interface Clock {
  setTimeout(run: () => void, ms: number): number;
  clearTimeout(timer: number): void;
  random(): number; // 0..1
}

export type ConnectionState =
  | { name: "connecting"; attempt: number }
  | { name: "live" }
  | { name: "waiting"; attempt: number; delayMs: number; reason: string }
  | { name: "asleep"; reason: string } // closed as idle; input or showing the page reconnects
  | { name: "locked" } // the server asks for a token; a login reconnects
  | { name: "stopped" };

export interface ConnectionEvents {
  state(state: ConnectionState): void;
  // After a connection was lost for this reason: what the server answers otherwise.
  reached?(reach: Reach, reason: string): void;
  hello(hello: HelloMessage): void;
  message(message: ServerMessage): void;
  frame(frame: Frame): void;
}

const helloDeadlineMs = 10_000;
const delayFirstMs = 625;
const delayLastMs = 12_500;
const silentDelayLastMs = 1_600;
const socketOpen = 1;
const waitingBytesMax = 2048; // a few patches
const idleCode = 4410;

// Milliseconds before attempt n (from 0): doubling each time, randomized by 20 % so that the
// clients of a restarted server do not all reconnect at once. A server that answers but refuses is
// tried less and less often, within 500..15000; one that is silent, which costs it nothing, within
// 500..2000, so that the page is back soon after it.
export function reconnectDelayMs(attempt: number, random: number, silent = false): number {
  const last = silent ? silentDelayLastMs : delayLastMs;
  const base = Math.min(last, delayFirstMs * 2 ** Math.min(attempt, 30));
  return Math.round(base * (0.8 + 0.4 * random));
}

const closeReasons: Record<number, string> = {
  1001: "the server is shutting down",
  1006: "no answer from the server",
  1008: "the server refused this page (origin or token)",
  1009: "a message was too large for the server",
  1013: "the server has reached its session limit",
  4400: "the server rejected a malformed message",
  4408: "the server sent no hello message",
  4410: "closed by the server after a long time without input",
};

export function closeReason(code: number, reason: string): string {
  const known = closeReasons[code];
  if (known !== undefined) return known;
  return reason === "" ? `the connection was closed (${code})` : reason;
}

export class Connection {
  private socket: SocketLike | null = null;
  private greeted = false;
  private attempt = 0;
  private refusals = 0; // attempts since the last frame at which the server was there
  private retryTimer: number | null = null;
  private helloTimer: number | null = null;
  private stopped = true;
  private asleep = false;
  private locked = false;
  private fault: string | null = null;

  constructor(
    private readonly url: string,
    private readonly openSocket: (url: string, protocol: string) => SocketLike,
    private readonly clock: Clock,
    private readonly events: ConnectionEvents,
    private readonly reach: () => Promise<Reach>,
  ) {}

  get live(): boolean {
    return this.greeted;
  }

  // Whether a message would be sent at once. Also true without a connection, when nothing is
  // queued.
  get ready(): boolean {
    return !this.greeted || (this.socket?.bufferedAmount ?? 0) <= waitingBytesMax;
  }

  start(): void {
    this.stopped = false;
    this.connect();
  }

  stop(): void {
    this.stopped = true;
    this.asleep = false;
    this.locked = false;
    this.clearTimers();
    this.drop(1000, "");
    this.events.state({ name: "stopped" });
  }

  // Returns whether the message was sent. While the connection is lost nothing is queued, because
  // the whole view is sent after the next hello.
  send(message: ClientMessage): boolean {
    if (!this.greeted || this.socket?.readyState !== socketOpen) return false;
    this.socket.send(encodeClientMessage(message));
    return true;
  }

  // Reconnects without the remaining delay, as the network is available again, the page is shown or
  // the user has logged in.
  retryNow(): void {
    if (this.retryTimer !== null || this.asleep || this.locked) this.connect();
  }

  // Reconnects an idle connection on input or when the page becomes visible.
  wake(): void {
    if (this.asleep) this.connect();
  }

  private connect(): void {
    this.clearTimers();
    this.asleep = false;
    this.locked = false;
    this.events.state({ name: "connecting", attempt: this.attempt });
    const socket = this.openSocket(this.url, subprotocol);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    this.helloTimer = this.clock.setTimeout(() => {
      if (this.socket === socket) this.fail(4408, "the server sent no hello message");
    }, helloDeadlineMs);
    socket.onmessage = (event) => {
      if (this.socket === socket) this.receive(event.data);
    };
    socket.onclose = (event) => {
      if (this.socket === socket) this.lost(event.code, event.reason);
    };
  }

  private receive(data: unknown): void {
    try {
      if (typeof data === "string") {
        this.receiveText(data);
      } else if (data instanceof ArrayBuffer) {
        if (!this.greeted) throw new WireError("a frame before hello");
        this.events.frame(parseFrame(data));
        this.attempt = 0;
        this.refusals = 0;
      } else {
        throw new WireError("a message of an unknown kind");
      }
    } catch (error) {
      if (!(error instanceof WireError)) throw error;
      this.fail(4400, `the server sent ${error.message}`);
    }
  }

  private receiveText(text: string): void {
    const message = parseServerMessage(text);
    if (message.type === "hello") {
      if (this.greeted) throw new WireError("hello twice");
      this.greeted = true;
      this.clearTimers();
      this.events.state({ name: "live" });
      this.events.hello(message);
      return;
    }
    if (!this.greeted) throw new WireError(`"${message.type}" before hello`);
    this.events.message(message);
  }

  // Closes on a protocol error at once; later messages are ignored.
  private fail(code: number, reason: string): void {
    this.fault = reason;
    // A close reason is limited to 123 bytes.
    this.drop(code, reason.replace(/[^ -~]/g, "?").slice(0, 100));
    this.lost(code, reason);
  }

  private drop(code: number, reason: string): void {
    const socket = this.socket;
    this.socket = null;
    this.greeted = false;
    if (socket === null) return;
    socket.onmessage = null;
    socket.onclose = null;
    socket.close(code, reason);
  }

  private lost(code: number, reason: string): void {
    this.clearTimers();
    const answered = this.greeted || (code !== 1001 && code !== 1006);
    this.socket = null;
    this.greeted = false;
    if (this.stopped) return;
    if (code === idleCode) {
      this.asleep = true;
      this.events.state({ name: "asleep", reason: closeReason(code, reason) });
      return;
    }
    // policy violation: an early retry is unlikely to succeed
    if (code === 1008) this.refusals = Math.max(this.refusals, 5);
    else if (answered && this.attempt > 0) this.refusals += 1;
    this.attempt += 1;
    const why = this.fault ?? closeReason(code, reason);
    this.fault = null;
    const timer = this.retry(why);
    void this.reach().then((reach) => {
      if (!this.stopped && !this.greeted) this.events.reached?.(reach, why);
      if (this.retryTimer === timer) this.reached(reach, answered, why);
    });
  }

  // Waits for the next attempt. Returns its timer.
  private retry(reason: string): number {
    const chance = this.clock.random();
    const delayMs =
      this.refusals > 0
        ? reconnectDelayMs(this.refusals, chance)
        : reconnectDelayMs(this.attempt - 1, chance, true);
    this.retryTimer = this.clock.setTimeout(() => this.connect(), delayMs);
    this.events.state({ name: "waiting", attempt: this.attempt, delayMs, reason });
    return this.retryTimer;
  }

  // A browser does not say why a stream could not be opened; the server's answer to another request
  // shows whether it asks for a token, or refuses streams for another reason.
  private reached(reach: Reach, counted: boolean, reason: string): void {
    if (reach === "silent" || reach === "foreign" || (reach === "answers" && counted)) return;
    this.clearTimers();
    if (reach === "login") {
      this.locked = true;
      this.events.state({ name: "locked" });
      return;
    }
    this.refusals += 1;
    this.retry(reason);
  }

  private clearTimers(): void {
    if (this.retryTimer !== null) this.clock.clearTimeout(this.retryTimer);
    if (this.helloTimer !== null) this.clock.clearTimeout(this.helloTimer);
    this.retryTimer = null;
    this.helloTimer = null;
  }
}

// URL ws(s)://... of the stream, relative to the page's base URL.
export function streamUrl(baseUri: string): string {
  const url = new URL("v1/stream", baseUri);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  url.hash = "";
  url.search = "";
  return url.href;
}
