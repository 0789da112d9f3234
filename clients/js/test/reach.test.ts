// What the client learns of a server that gives a page no answer: it is down, or refuses pages of
// this origin.
import assert from "node:assert/strict";
import { test, type TestContext } from "node:test";
import { Client, UnreachableError } from "../src/index";
import { isForeign, reachOf } from "../src/wire/reach";

const site = "https://site.example";
const server = "https://host.example/base/";
const livez = `${server}livez`;

// As in a page of this origin.
function inPage(t: TestContext, origin = site): void {
  Object.assign(globalThis, { origin });
  t.after(() => Reflect.deleteProperty(globalThis, "origin"));
}

const blocked = () => Promise.reject<Response>(new TypeError("Failed to fetch"));

// As a browser asks a server whose answers the page cannot read: only that to a no-cors request
// comes, without its contents. down: nor does that.
function stranger({ down = false } = {}) {
  const asked: string[] = [];
  const inits: RequestInit[] = [];
  const fetch = (url: string, init: RequestInit): Promise<Response> => {
    asked.push(url);
    inits.push(init);
    const opaque = !down && init.mode === "no-cors" && url === livez;
    return opaque ? Promise.resolve(Response.error()) : blocked();
  };
  return { asked, inits, fetch };
}

test("one whose answers the page cannot read is foreign, one that is down is silent", async (t) => {
  inPage(t);
  const there = stranger();
  assert.equal(await reachOf(there.fetch, server), "foreign");
  assert.deepEqual(there.asked, [`${server}v1/datasets`, livez]);
  assert.ok(there.inits[1]!.signal, "not without a limit of time");
  const away = stranger({ down: true });
  assert.equal(await reachOf(away.fetch, server), "silent");
  assert.deepEqual(away.asked, [`${server}v1/datasets`, livez]);
});

test("an answer that the page can read is not asked for again", async (t) => {
  inPage(t);
  for (const [status, reach] of [
    [200, "answers"],
    [401, "login"],
    [502, "silent"],
  ] as const) {
    const asked: string[] = [];
    const ask = (url: string) => {
      asked.push(url);
      return Promise.resolve(new Response(null, { status }));
    };
    assert.equal(await reachOf(ask, server), reach);
    assert.equal(asked.length, 1, reach);
  }
});

test("a server of the page's own origin is not foreign, nor any outside of a page", async (t) => {
  const { asked, fetch } = stranger();
  assert.equal(await isForeign(fetch, server), false);
  inPage(t, "https://host.example");
  assert.equal(await isForeign(fetch, server), false);
  assert.deepEqual(asked, [], "without a question");
  for (const other of ["http://host.example", "https://host.example:8443", site, "null"]) {
    inPage(t, other);
    assert.equal(await isForeign(fetch, server), true, other);
  }
});

test("the error of a server that refuses the page says so, with the origin to allow", async (t) => {
  inPage(t);
  const { asked, fetch } = stranger();
  const error = await new Client(server, { fetch }).datasets().catch((one: unknown) => one);
  assert.ok(error instanceof UnreachableError);
  assert.equal(error.foreign, true);
  const text =
    `${server} answers, but not for pages of ${site}: ` +
    "it does not allow them (--allow-origin), or a proxy answers in its place";
  assert.equal(error.message, text);
  assert.equal((error.cause as Error).message, "Failed to fetch");
  assert.deepEqual(asked, [`${server}v1/datasets`, livez]);
});

test("the error of a server that is down says that there is no answer", async (t) => {
  inPage(t);
  const { fetch } = stranger({ down: true });
  const error = await new Client(server, { fetch }).datasets().catch((one: unknown) => one);
  assert.ok(error instanceof UnreachableError);
  assert.equal(error.foreign, false);
  assert.equal(error.message, `no answer from ${server} (Failed to fetch)`);
  assert.equal(new UnreachableError(server, "reset").message, `no answer from ${server} (reset)`);
});

test("a request that its caller ended is no failure of the server", async (t) => {
  inPage(t);
  const { asked, fetch } = stranger();
  const ended = AbortSignal.abort();
  const client = new Client(server, { fetch });
  const error = await client.frame({}, { signal: ended }).catch((one: unknown) => one);
  assert.ok(!(error instanceof UnreachableError));
  assert.deepEqual(asked, [`${server}v1/frames`]);
});

// A socket whose handshake is refused.
class RefusedSocket {
  onclose: ((event: { code: number; reason: string }) => void) | null = null;

  constructor() {
    setImmediate(() => this.onclose?.({ code: 1006, reason: "" }));
  }

  close(): void {}
}

test("a stream learns whether the server refuses the page by one question", async (t) => {
  inPage(t);
  for (const down of [false, true]) {
    const { asked, fetch } = stranger({ down });
    const client = new Client(server, { fetch, webSocket: RefusedSocket });
    const reach = await new Promise((reached) => {
      const stream = client.stream(
        {},
        {
          reached: (one) => {
            stream.close();
            reached(one);
          },
        },
      );
    });
    assert.equal(reach, down ? "silent" : "foreign");
    assert.deepEqual(asked, [`${server}v1/datasets`, livez]);
  }
});
