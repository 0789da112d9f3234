// The stream of a view with a simulated socket: what it sends, when frames count as shown, and what
// becomes of promises of final frames.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Client } from "../src/client/client";
import { ViewStream, type StreamEvents, type StreamOptions } from "../src/client/view_stream";
import type { Dataset, FrameHeader, View } from "../src/wire/protocol";
import { problemText, type ProblemError } from "../src/wire/requests";

type Sent = Record<string, unknown> & { type: string; rev: number };

class Socket {
  static last: Socket;
  binaryType = "";
  readyState = 1;
  bufferedAmount = 0;
  sent: Sent[] = [];
  closed = false;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;

  constructor(
    readonly url: string,
    readonly protocols: string[],
  ) {
    Socket.last = this;
  }

  send(text: string): void {
    this.sent.push(JSON.parse(text) as Sent);
  }

  close(): void {
    this.closed = true;
  }

  says(message: object): void {
    this.onmessage?.({ data: JSON.stringify(message) });
  }

  hello(...datasets: string[]): void {
    const listed = datasets.map((id) => ({ id }));
    const limits = { imagePixelsMax: 1e6 };
    this.says({ type: "hello", protocol: "windsplat.v1", datasets: listed, limits });
  }

  // A frame of an empty picture.
  frame(seq: number, rev: number, { final = true, step = 0 } = {}): void {
    const view = { dataset: "a", step };
    this.says({ type: "chosen", seq, view, work: {} });
    const header = new DataView(new ArrayBuffer(64));
    header.setUint32(0, 0x4c505357, true);
    header.setUint8(4, 1);
    header.setUint8(5, 1);
    header.setUint16(6, 64, true);
    header.setUint32(8, seq, true);
    header.setUint32(12, rev, true);
    header.setUint32(16, step, true);
    header.setUint32(20, final ? 1 : 0, true);
    header.setUint8(28, 1);
    header.setUint8(30, 1);
    this.onmessage?.({ data: header.buffer });
  }

  of(type: string): Sent[] {
    return this.sent.filter((message) => message.type === type);
  }

  get rev(): number {
    return this.of("patch").at(-1)!.rev;
  }
}

class Clock {
  timers = new Map<number, () => void>();
  private last = 0;
  readonly setTimeout = (run: () => void) => {
    this.timers.set(++this.last, run);
    return this.last;
  };
  readonly clearTimeout = (timer: number) => void this.timers.delete(timer);
  readonly random = () => 0.5;

  elapse(): void {
    for (const [timer, run] of [...this.timers]) {
      this.timers.delete(timer);
      run();
    }
  }
}

const dataset = { id: "a", fields: [], world: {}, axes: {}, steps: { count: 3 } };

function open(view: View, events: StreamEvents = {}, options: StreamOptions = {}) {
  const clock = new Clock();
  const stream = new ViewStream("http://host/base/", view, events, {
    webSocket: Socket,
    clock,
    fetch: () => Promise.reject(new Error("no server")),
    ...options,
  });
  return { stream, clock, socket: Socket.last };
}

const settled = () => new Promise((done) => setImmediate(done));

test("the view is sent before the dataset is opened, and frames are acknowledged", async () => {
  const opened: Dataset[] = [];
  const { stream, socket } = open({ dataset: "a" }, { opened: (one) => void opened.push(one) });
  assert.equal(socket.url, "ws://host/base/v1/stream");
  assert.equal(socket.sent.length, 0);
  socket.hello("b", "a");
  assert.deepEqual(
    socket.sent.map(({ type }) => type),
    ["patch", "open"],
  );
  assert.deepEqual(socket.sent[0]!.patch, { dataset: "a" });
  socket.says({ type: "opened", id: socket.sent[1]!.id, dataset });
  assert.equal(opened[0]?.id, "a");
  const final = stream.final();
  socket.frame(1, socket.rev, { final: false });
  socket.frame(2, socket.rev);
  assert.equal((await final).header.seq, 2);
  await settled();
  assert.deepEqual(
    socket.of("ack").map(({ seq }) => seq),
    [1, 2],
  );
});

test("a frame is acknowledged after the promise of its handler", async () => {
  let go = () => {};
  const waits = new Promise<void>((done) => (go = done));
  const { socket } = open({ dataset: "a" }, { frame: () => waits });
  socket.hello("a");
  socket.frame(1, socket.rev);
  await settled();
  assert.deepEqual(socket.of("ack"), []);
  go();
  await settled();
  assert.equal(socket.of("ack").length, 1);
});

test("a first view that is refused leaves its dataset, of which the default is shown", () => {
  const told: string[] = [];
  const { stream, socket } = open(
    { dataset: "a", vector: { stride: -1 }, image: { width: 64, height: 48, background: "#000" } },
    {
      refused: (error) => void told.push(error.message),
      opened: ({ id }) => void told.push(`opened ${id}`),
    },
  );
  socket.hello("b", "a");
  const errors = [{ pointer: "/vector/stride", detail: "must be at least 1" }];
  const refuse = () =>
    socket.says({
      type: "error",
      rev: socket.rev,
      problem: { status: 422, title: "t", detail: "invalid", errors },
    });
  refuse();
  assert.deepEqual(socket.of("patch").at(-1)!.patch, {
    dataset: "a",
    image: { width: 64, height: 48 },
  });
  socket.says({ type: "opened", id: socket.of("open").at(-1)!.id, dataset });
  assert.deepEqual(told, ["/vector/stride: must be at least 1", "opened a"]);
  assert.equal(stream.dataset?.id, "a");
  refuse();
  assert.equal(socket.of("patch").length, 2, "not again and again");
});

test("without a dataset the first one of the server is shown", () => {
  const { socket } = open({ step: 1 });
  socket.hello("b", "a");
  assert.deepEqual(socket.sent[0]!.patch, { step: 1, dataset: "b" });
});

test("a change is answered by the frame shown before if it changes nothing visible", async () => {
  const { stream, socket } = open({ dataset: "a" });
  socket.hello("a");
  socket.frame(1, socket.rev);
  await stream.final();
  stream.change({ depthCue: { strength: 0 } });
  let done = false;
  const final = stream.final().then(({ header }) => {
    done = true;
    return header.seq;
  });
  await settled();
  assert.equal(done, false, "an older frame is none of the new view");
  socket.says({ type: "unchanged", rev: socket.rev, seq: 1 });
  assert.equal(await final, 1);
});

test("refused changes are reported and reverted; unknown datasets are reported once", async () => {
  const errors: ProblemError[] = [];
  const { stream, socket } = open({ dataset: "a" }, { refused: (error) => errors.push(error) });
  socket.hello("a");
  socket.frame(1, socket.rev);
  await stream.final();
  stream.change({ step: 99 });
  const final = stream.final();
  const problem = { type: "about:blank", title: "No", status: 422, detail: "too large" };
  socket.says({ type: "error", rev: socket.rev, problem });
  await assert.rejects(final, /too large/);
  assert.deepEqual([errors.length, errors[0]!.status, stream.explicit.step], [1, 422, undefined]);
  stream.replace({ dataset: "gone" });
  const missing = { ...problem, status: 404, detail: "no dataset gone" };
  socket.says({ type: "error", rev: socket.rev, problem: missing });
  socket.says({ type: "error", id: socket.of("open").at(-1)!.id, problem: missing });
  assert.equal(errors.length, 2);
});

test("an answer to an earlier request does not fail the present view", async () => {
  const { stream, socket } = open({ dataset: "gone" });
  socket.hello("a");
  stream.replace({ dataset: "a" });
  const final = stream.final();
  const problem = { type: "about:blank", title: "No", status: 404, detail: "no dataset gone" };
  socket.says({ type: "error", id: socket.of("open")[0]!.id, problem });
  socket.frame(1, socket.rev);
  assert.equal((await final).header.seq, 1);
});

test("after an outage the whole view is sent again, with a rev of its own", async () => {
  const reached: string[] = [];
  const { stream, socket, clock } = open(
    { dataset: "a" },
    { reached: (reach) => reached.push(reach) },
  );
  socket.hello("a");
  stream.change({ scalars: [] });
  const final = stream.final();
  socket.onclose?.({ code: 1006, reason: "" });
  await assert.rejects(final, /no answer from the server/);
  await settled();
  assert.deepEqual(reached, ["silent"]);
  stream.change({ step: 2 });
  clock.elapse();
  const again = Socket.last;
  assert.notEqual(again, socket);
  again.hello("a");
  assert.deepEqual(again.sent[0]!.patch, { dataset: "a", scalars: [], step: 2 });
  assert.ok(again.rev > socket.rev);
});

test("playback moves the step of the view, without an answer to the server", async () => {
  const steps: (number | undefined)[] = [];
  const { stream, socket } = open(
    { dataset: "a" },
    { changed: (view) => void steps.push(view.step) },
  );
  socket.hello("a");
  assert.ok(stream.play(0, 2, { fps: 5 }));
  const before = socket.of("patch").length;
  socket.frame(1, socket.rev, { final: false, step: 1 });
  await settled();
  assert.deepEqual([stream.explicit.step, steps], [1, [1]]);
  assert.equal(socket.of("patch").length, before);
});

test("a closed stream releases its socket and fails what waits", async () => {
  const { stream, socket, clock } = open({ dataset: "a" });
  socket.hello("a");
  const final = stream.final();
  stream.close();
  await assert.rejects(final, /closed/);
  assert.equal(socket.closed, true);
  assert.equal(clock.timers.size, 0);
});

test("a token goes into a subprotocol and a header, never into an address", async () => {
  const asked: [string, RequestInit][] = [];
  const token = "ab+/c~d==";
  const server = new Client("https://host/base?x=1#y", {
    token,
    webSocket: Socket,
    fetch: (url, init) => {
      asked.push([url, init]);
      return Promise.resolve(new Response('{"datasets": []}'));
    },
  });
  assert.deepEqual(await server.datasets(), []);
  assert.equal(asked[0]![0], "https://host/base/v1/datasets");
  assert.deepEqual(asked[0]![1].headers, { Authorization: `Bearer ${token}` });
  server.stream({ dataset: "a" }, {}, { clock: new Clock() });
  assert.equal(Socket.last.url, "wss://host/base/v1/stream");
  // RFC 4648, section 5: "-" and "_" in place of "+" and "/".
  const [protocol, bearer] = Socket.last.protocols;
  assert.equal(protocol, "windsplat.v1");
  assert.equal(Buffer.from(bearer!.replace("bearer.", ""), "base64url").toString(), token);
  assert.match(bearer!, /^bearer\.[\w-]+$/);
  assert.throws(() => new Client("file:///etc/passwd"), /no http/);
});

test("refusals of saved views and probes are typed problems; parameters are encoded", async () => {
  const asked: string[] = [];
  const problem = { type: "about:blank", title: "Not Found", status: 404, detail: "no such view" };
  const server = new Client("http://host/", {
    fetch: (url, { method = "GET", headers } = {}) => {
      asked.push(`${method} ${url} ${(headers as Record<string, string>)?.["Content-Type"] ?? ""}`);
      return Promise.resolve(new Response(JSON.stringify(problem), { status: 404 }));
    },
  });
  await assert.rejects(server.savedView("a/b"), { status: 404, problem, message: "no such view" });
  await assert.rejects(server.changeView("x", { step: 1 }), { status: 404 });
  await assert.rejects(server.probeAt("a b", { x: -1.5, y: 2, z: 0, fields: ["u v", "w"] }), {
    status: 404,
  });
  assert.deepEqual(asked, [
    "GET http://host/v1/views/a%2Fb ",
    "PATCH http://host/v1/views/x application/merge-patch+json",
    "GET http://host/v1/datasets/a%20b/probe?x=-1.5&y=2&z=0&fields=u+v%2Cw ",
  ]);
});

test("the text of a problem has all of its entries, else its detail or title", () => {
  const problem = { type: "about:blank", title: "Unprocessable", status: 422, detail: "/a: wrong" };
  const errors = [
    { pointer: "/a", detail: "wrong" },
    { pointer: "/b/0", detail: "too large" },
  ] as [{ pointer: string; detail: string }, ...{ pointer: string; detail: string }[]];
  assert.equal(problemText({ ...problem, errors }), "/a: wrong; /b/0: too large");
  assert.equal(problemText(problem), "/a: wrong");
  assert.equal(problemText({ ...problem, detail: "" }), "Unprocessable");
});

test("an opener of the caller's own decides on datasets, views and refusals", () => {
  const told: string[] = [];
  open({ dataset: "a" });
  const before = Socket.last;
  const { stream, socket } = open(
    {},
    {},
    {
      opener: {
        begin: ({ datasets }) => {
          const dataset = datasets.at(-1)!.id;
          stream.transmit([stream.model.state.change({ dataset })]);
        },
        replace: ({ dataset }) => void told.push(`replace ${dataset}`),
        opened: ({ id }) => void told.push(`opened ${id}`),
        refused: ({ rev }) => stream.withdraw(rev!),
      },
    },
  );
  assert.equal(socket, before, "nothing is connected before start()");
  stream.setHidden(true);
  stream.connection.start();
  const own = Socket.last;
  own.hello("a", "b");
  assert.deepEqual(
    own.sent.map(({ type }) => type),
    ["visibility", "patch"],
    "a hidden session draws nothing",
  );
  assert.deepEqual(own.sent[1]!.patch, { dataset: "b" });
  own.says({ type: "opened", id: 7, dataset });
  stream.replace({ dataset: "a" });
  stream.change({ step: 2 });
  const problem = { type: "about:blank", title: "no", status: 400, detail: "no", errors: [] };
  own.says({ type: "error", rev: own.rev, problem });
  assert.deepEqual(stream.explicit, { dataset: "b" });
  assert.equal(stream.isAfterRefusal(own.rev), false);
  assert.deepEqual(told, ["opened 7", "replace a"]);
});

test("during playback the step of an older view is followed if the caller says so", () => {
  const { stream, socket } = open({ dataset: "a" }, {}, { acknowledge: "manual" });
  socket.hello("a");
  const { rev } = socket;
  stream.change({ scalars: [] });
  const header = { seq: 1, rev, step: 2, final: false } as FrameHeader;
  stream.show(header);
  assert.equal(stream.explicit.step, undefined);
  stream.show({ ...header, seq: 2 }, true);
  assert.equal(stream.explicit.step, 2);
});
