// What the client says to wrong arguments and of a server that is down.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Client, problemText, UnreachableError } from "../src/index";

const noRequest = () => Promise.reject(new Error("a request was sent"));
const server = new Client("http://host/", { fetch: noRequest });

test("a host with its port is an address; what is none is named", () => {
  assert.equal(new Client("127.0.0.1:18881").url, "http://127.0.0.1:18881/");
  assert.equal(new Client("localhost:8080/base").url, "http://localhost:8080/base/");
  assert.equal(new Client("[::1]:8080").url, "http://[::1]:8080/");
  for (const wrong of ["", "host", "/base", "ftp://host/"]) {
    assert.throws(() => new Client(wrong), new RegExp(`^TypeError: "${wrong}" is no http`), wrong);
  }
});

test("the error of a server without an answer names its address", async () => {
  const cause = Object.assign(new TypeError("fetch failed"), { cause: { code: "ECONNREFUSED" } });
  const down = new Client("127.0.0.1:18881", { fetch: () => Promise.reject(cause) });
  const asks = [() => down.datasets(), () => down.frame({}), () => down.describe("a")];
  for (const ask of asks as (() => Promise<unknown>)[]) {
    const error = await ask().catch((failure: unknown) => failure);
    assert.ok(error instanceof UnreachableError);
    assert.equal(error.message, "no answer from http://127.0.0.1:18881/ (ECONNREFUSED)");
    assert.equal(error.address, "http://127.0.0.1:18881/");
    assert.equal(error.cause, cause);
  }
});

test("wrong arguments are refused by name before anything is sent", async () => {
  const wrong = server as unknown as Record<string, (...words: unknown[]) => Promise<unknown>>;
  const says = (name: string, words: unknown[], text: RegExp) =>
    assert.rejects(async () => wrong[name]!(...words), { name: "TypeError", message: text });
  await says("series", ["a", "t", { x: 0 }], /^of must be the indices \[x, y, z\].*not {"x":0}/);
  await says("series", ["a", "t", [1, 2]], /^of must be the indices/);
  await says("series", ["a", undefined, [1, 2, 3]], /^field must be a name, not undefined/);
  await says("probe", ["a", [1, 2, 0.5], null, { step: 0 }], /^of must be/);
  await says("probe", ["a", [1, 2, 3], null], /^the last argument must be such as { step: 0 }/);
  await says("probe", ["a", [1, 2, 3], null, { step: -1 }], /^step must be a whole number/);
  await says("probeAt", ["a"], /must be a place such as { x: 0, y: 0, z: 0 }, not undefined/);
  await says("histogram", ["a", "t", "last", 8], /^step must be a whole number from 0, not "last"/);
  await says("range", ["a", "t"], /^step must be/);
  await says("describe", [], /^id must be a name/);
  const noView = /^view must be an object such as { dataset: "a" }, not "hurricane"/;
  for (const name of ["frame", "saveView", "forecast", "picture", "stream"]) {
    await says(name, ["hurricane"], noView);
  }
  await says("pick", ["hurricane", [1, 2]], noView);
  await says("rangeIn", ["hurricane", "a", "t"], noView);
  await says("replaceView", ["k7", "hurricane"], noView);
  const promised = wrong.frame!("hurricane");
  await assert.rejects(promised, TypeError, "as a promise");
});

test("a problem of a whole document has a place, too", () => {
  const problem = { type: "/problems/invalid-value", title: "No", status: 422, detail: "d" };
  const errors = [{ pointer: "", detail: "must be an object" }] as const;
  assert.equal(problemText({ ...problem, errors: [...errors] }), "the document: must be an object");
});

test("the error of a program without a WebSocket says where to pass one", (t) => {
  const own = Object.getOwnPropertyDescriptor(globalThis, "WebSocket");
  Reflect.deleteProperty(globalThis, "WebSocket");
  t.after(() => own && Object.defineProperty(globalThis, "WebSocket", own));
  assert.throws(() => server.stream({}), /the package ws, in new Client\(url, { webSocket }\)$/);
});
