// The connection with a simulated socket and clock.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import {
  Connection,
  reconnectDelayMs,
  streamUrl,
  type CloseLike,
  type ConnectionState,
  type MessageLike,
  type SocketLike,
  logIn,
  reachOf,
  type AskServer,
  type Reach,
} from "@windsplat/client/parts";
import type { Frame, HelloMessage, ServerMessage } from "@windsplat/client";

class FakeSocket implements SocketLike {
  binaryType = "blob";
  readyState = 1;
  bufferedAmount = 0;
  sent: string[] = [];
  closed: { code?: number; reason?: string } | null = null;
  onmessage: ((event: MessageLike) => void) | null = null;
  onclose: ((event: CloseLike) => void) | null = null;

  constructor(
    readonly url: string,
    readonly protocol: string,
  ) {}

  send(text: string): void {
    this.sent.push(text);
  }

  close(code?: number, reason?: string): void {
    this.closed = { code, reason };
    this.readyState = 3;
  }

  receives(data: unknown): void {
    this.onmessage?.({ data });
  }

  dies(code = 1006, reason = ""): void {
    this.readyState = 3;
    this.onclose?.({ code, reason });
  }
}

class FakeClock {
  now = 0;
  chance = 0.5;
  private timers = new Map<number, { at: number; run: () => void }>();
  private next = 1;

  setTimeout(run: () => void, ms: number): number {
    this.timers.set(this.next, { at: this.now + ms, run });
    return this.next++;
  }

  clearTimeout(timer: number): void {
    this.timers.delete(timer);
  }

  random(): number {
    return this.chance;
  }

  get waiting(): number {
    return this.timers.size;
  }

  advance(ms: number): void {
    const until = this.now + ms;
    for (;;) {
      const due = [...this.timers]
        .filter(([, timer]) => timer.at <= until)
        .sort((a, b) => a[1].at - b[1].at)[0];
      if (due === undefined) break;
      this.timers.delete(due[0]);
      this.now = due[1].at;
      due[1].run();
    }
    this.now = until;
  }
}

interface Row {
  kind: string;
  document: { type?: string };
  hex: string;
}
const vectors = (name: string): Row[] =>
  JSON.parse(readFileSync(`../protocol/vectors/valid/${name}.json`, "utf8")) as Row[];
const hello = JSON.stringify(
  vectors("server_messages").find((row) => row.document.type === "hello")!.document,
);
const stats =
  '{"type": "stats", "frames": 1, "dropped": 0, "cancelled": 0, "bytes": 2, ' +
  '"playFps": null, "stepsDropped": 0, "stepsNotReady": 0}';

function frameBytes(payload = 3): ArrayBuffer {
  const header = Buffer.from(vectors("frame_headers")[0]!.hex.replaceAll(" ", ""), "hex");
  const bytes = new Uint8Array(64 + payload);
  bytes.set(header);
  new DataView(bytes.buffer).setUint32(52, payload, true);
  return bytes.buffer;
}

// reach: what the server says to another request.
function setUp(reach: () => Reach = () => "silent") {
  const clock = new FakeClock();
  const sockets: FakeSocket[] = [];
  const seen = {
    states: [] as ConnectionState[],
    hellos: [] as HelloMessage[],
    messages: [] as ServerMessage[],
    frames: [] as Frame[],
  };
  const connection = new Connection(
    "ws://x/v1/stream",
    (url, protocol) => {
      const socket = new FakeSocket(url, protocol);
      sockets.push(socket);
      return socket;
    },
    clock,
    {
      state: (state) => seen.states.push(state),
      hello: (message) => seen.hellos.push(message),
      message: (message) => seen.messages.push(message),
      frame: (frame) => seen.frames.push(frame),
    },
    () => Promise.resolve(reach()),
  );
  const last = () => sockets[sockets.length - 1]!;
  const state = () => seen.states[seen.states.length - 1]!;
  return { clock, sockets, seen, connection, last, state };
}

test("sends the subprotocol, is live after hello and delivers messages and frames", () => {
  const { connection, last, seen, state } = setUp();
  connection.start();
  assert.equal(last().protocol, "windsplat.v1");
  assert.equal(last().binaryType, "arraybuffer");
  assert.equal(connection.live, false);
  last().receives(hello);
  assert.equal(state().name, "live");
  assert.equal(seen.hellos.length, 1);
  last().receives(stats);
  last().receives(frameBytes());
  assert.equal(seen.messages[0]!.type, "stats");
  assert.equal(seen.frames[0]!.header.seq, 7);
  assert.equal(seen.frames[0]!.picture.byteLength, 3);
});

test("nothing is sent before hello or after the end", () => {
  const { connection, last } = setUp();
  assert.equal(connection.send({ type: "pause" }), false);
  connection.start();
  assert.equal(connection.send({ type: "pause" }), false);
  last().receives(hello);
  assert.equal(connection.send({ type: "ack", seq: 1, decodeMs: 2 }), true);
  assert.deepEqual(JSON.parse(last().sent[0]!), { type: "ack", seq: 1, decodeMs: 2 });
  last().dies();
  assert.equal(connection.send({ type: "pause" }), false);
});

test("reconnection delays double from 0.5 s to 15 s with jitter", () => {
  for (const chance of [0, 0.5, 1]) {
    const delays = Array.from({ length: 12 }, (_, n) => reconnectDelayMs(n, chance));
    delays.forEach((delay, n) => {
      assert.ok(delay >= 500 && delay <= 15_000, `${delay} at ${n}`);
      if (n > 0) assert.ok(delay >= delays[n - 1]!);
    });
  }
  assert.equal(reconnectDelayMs(0, 0), 500);
  assert.equal(reconnectDelayMs(1, 0), 1000);
  assert.equal(reconnectDelayMs(1e9, 1), 15_000);
  assert.ok(reconnectDelayMs(3, 1) - reconnectDelayMs(3, 0) > 0.3 * reconnectDelayMs(3, 0.5));
});

test("reconnects later after each failure, up to 2 s, and at once after a frame", () => {
  const { clock, connection, last, sockets, state } = setUp();
  connection.start();
  for (const delay of [625, 1250, 1600, 1600]) {
    last().dies();
    const waiting = state();
    assert.equal(waiting.name, "waiting");
    assert.equal(waiting.name === "waiting" && waiting.delayMs, delay);
    const before = sockets.length;
    clock.advance(delay - 1);
    assert.equal(sockets.length, before, "no early attempt");
    clock.advance(1);
    assert.equal(sockets.length, before + 1);
  }
  last().receives(hello);
  last().receives(frameBytes());
  last().dies();
  const waiting = state();
  assert.equal(waiting.name === "waiting" && waiting.delayMs, 625);
});

test("after an outage of any length the next attempt is at most 2 s away", () => {
  for (const chance of [0, 0.5, 1]) {
    const { clock, connection, last, sockets } = setUp();
    clock.chance = chance;
    connection.start();
    for (let seconds = 0; seconds < 3600; seconds += 2) {
      const before = sockets.length;
      last().dies();
      clock.advance(2000);
      assert.equal(sockets.length, before + 1, `after ${seconds} s`);
    }
  }
});

const settled = () => new Promise((done) => setImmediate(done));

test("a server that refuses streams but answers is tried less and less often", async () => {
  const { clock, connection, last, sockets, state } = setUp(() => "answers");
  connection.start();
  const delays: number[] = [];
  for (let n = 0; n < 6; n++) {
    const before = sockets.length;
    last().dies();
    await settled();
    const waiting = state();
    delays.push(waiting.name === "waiting" ? waiting.delayMs : 0);
    clock.advance(delays.at(-1)!);
    assert.equal(sockets.length, before + 1, "one attempt");
  }
  assert.deepEqual(delays, [1250, 2500, 5000, 10_000, 12_500, 12_500]);
});

test("one that refuses the page, as a proxy without its server may, is tried on", async () => {
  const { clock, connection, last, sockets } = setUp(() => "foreign");
  connection.start();
  for (let n = 0; n < 6; n++) {
    last().dies();
    await settled();
    clock.advance(2000);
    assert.equal(sockets.length, n + 2);
  }
});

test("a server that asks for a token is not tried until the user has logged in", async () => {
  for (const code of [1006, 1008]) {
    const { clock, connection, last, sockets, state } = setUp(() => "login");
    connection.start();
    last().receives(hello);
    last().receives(frameBytes());
    last().dies(code);
    await settled();
    assert.equal(state().name, "locked");
    clock.advance(3_600_000);
    assert.equal(sockets.length, 1);
    connection.retryNow();
    assert.equal(sockets.length, 2);
    last().receives(hello);
    assert.equal(state().name, "live");
  }
});

test("an answer that comes after the next attempt changes nothing", async () => {
  const { clock, connection, last, state } = setUp(() => "login");
  connection.start();
  last().dies();
  clock.advance(2000);
  last().receives(hello);
  await settled();
  assert.equal(state().name, "live");
});

const answering =
  (status: number, type: ResponseType = "basic"): AskServer =>
  () =>
    Promise.resolve({
      ok: status === 200,
      status,
      type,
      json: () => Promise.resolve({ type: "about:blank", title: "", status, detail: "too many" }),
    });
const offline: AskServer = () => Promise.reject(new TypeError("offline"));

test("401 asks for a login; a server that is away or behind a proxy is silent", async () => {
  const of = (ask: AskServer) => reachOf(ask, "http://h/a/");
  assert.equal(await of(answering(200)), "answers");
  assert.equal(await of(answering(429)), "answers");
  assert.equal(await of(answering(401)), "login");
  assert.equal(await of(answering(502)), "silent");
  assert.equal(await of(offline), "silent");
});

test("a login tells why it failed, and sends the token in the body only", async () => {
  let sent: [string, RequestInit] = ["", {}];
  const accepted: AskServer = (url, init) => {
    sent = [url, init];
    return answering(0, "opaqueredirect")(url, init);
  };
  assert.equal(await logIn(accepted, "http://h/a/", "a+b&c"), null);
  assert.equal(sent[0], "http://h/a/login");
  assert.equal(sent[1].body, "token=a%2Bb%26c");
  assert.equal(await logIn(answering(401), "http://h/", "x"), "Invalid token.");
  assert.equal(await logIn(answering(429), "http://h/", "x"), "too many");
  assert.match((await logIn(offline, "http://h/", "x"))!, /did not answer/);
});

test("a server that fails after hello is not contacted more often", () => {
  const { clock, connection, last, state } = setUp();
  connection.start();
  let before = 0;
  for (let n = 0; n < 4; n++) {
    last().receives(hello);
    last().dies();
    const waiting = state();
    assert.ok(waiting.name === "waiting" && waiting.delayMs > before);
    before = waiting.name === "waiting" ? waiting.delayMs : 0;
    clock.advance(before);
  }
});

test("malformed data close the connection and are reported", () => {
  const garbage: unknown[] = [
    "",
    "{",
    "null",
    '{"type": "hello"}',
    '{"type": "launch"}',
    new ArrayBuffer(0),
    new ArrayBuffer(64),
    frameBytes().slice(0, 66),
    { not: "a message" },
    hello,
  ];
  for (const bad of garbage) {
    const { clock, connection, last, seen, sockets, state } = setUp();
    connection.start();
    const first = last();
    first.receives(hello);
    first.receives(bad);
    assert.equal(first.closed?.code, 4400, String(bad));
    assert.equal(connection.live, false);
    const waiting = state();
    assert.equal(waiting.name, "waiting");
    assert.match(waiting.name === "waiting" ? waiting.reason : "", /server sent/);
    const counts = [seen.messages.length, seen.frames.length];
    first.receives(stats);
    first.receives(frameBytes());
    assert.deepEqual([seen.messages.length, seen.frames.length], counts, "later data are ignored");
    first.dies(1000);
    clock.advance(1_000);
    assert.equal(sockets.length, 2, "one new connection, not two");
    last().receives(hello);
    assert.equal(connection.live, true);
  }
});

test("messages and frames before hello are protocol errors", () => {
  for (const early of [stats, frameBytes()]) {
    const { connection, last } = setUp();
    connection.start();
    last().receives(early);
    assert.equal(last().closed?.code, 4400);
  }
});

test("a server that never sends hello is disconnected", () => {
  const { clock, connection, last, sockets, state } = setUp();
  connection.start();
  clock.advance(9_999);
  assert.equal(last().closed, null);
  clock.advance(1);
  assert.equal(last().closed?.code, 4408);
  assert.equal(state().name, "waiting");
  clock.advance(20_000);
  assert.ok(sockets.length >= 2);
});

test("after a refused origin or token, attempts to reconnect are rare", () => {
  const { connection, last, state } = setUp();
  connection.start();
  last().dies(1008);
  const waiting = state();
  assert.ok(waiting.name === "waiting" && waiting.delayMs >= 10_000);
  assert.match(waiting.name === "waiting" ? waiting.reason : "", /origin or token/);
});

test("after long inactivity reconnection waits for the user", () => {
  const { clock, connection, last, sockets, state } = setUp();
  connection.start();
  last().receives(hello);
  last().dies(4410);
  assert.equal(state().name, "asleep");
  clock.advance(3_600_000);
  assert.equal(sockets.length, 1);
  connection.wake();
  assert.equal(sockets.length, 2);
  connection.wake();
  assert.equal(sockets.length, 2, "once");
});

test("reconnects at once when the network returns", () => {
  const { connection, last, sockets, clock } = setUp();
  connection.start();
  last().dies();
  connection.retryNow();
  assert.equal(sockets.length, 2);
  clock.advance(600_000);
  assert.ok(sockets.slice(1).filter((socket) => socket.closed === null).length <= 1);
  connection.stop();
  connection.retryNow();
  assert.equal(clock.waiting, 0, "a stopped connection has no timers");
});

test("the stream's address follows the page's base path and scheme", () => {
  assert.equal(streamUrl("http://h:8080/"), "ws://h:8080/v1/stream");
  assert.equal(streamUrl("https://h/a/b/"), "wss://h/a/b/v1/stream");
  assert.equal(streamUrl("http://h/a/b/?x=1#!%7B%7D"), "ws://h/a/b/v1/stream");
  assert.equal(streamUrl("http://h/a/index.html"), "ws://h/a/v1/stream");
});
