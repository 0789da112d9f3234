// Saved views, short links, and the check of views from links, files and storage.
import assert from "node:assert/strict";
import { test } from "node:test";
import { parseView } from "../src/save/saved_picture";
import { SavedViews, savedViewsMax } from "../src/save/saved_views";
import { hashOfView, viewOfHash } from "../src/view/link";
import type { View } from "@windsplat/client";
import { linkMax, shortLinkHash, shortLinkId } from "../src/view/short_link";
import { loadView, storeView } from "@windsplat/client/parts";
import { problem, server } from "./server";

class Store {
  text: string | null = null;
  full = false;

  getItem(): string | null {
    return this.text;
  }

  setItem(_key: string, text: string): void {
    if (this.full) throw new Error("QuotaExceededError");
    this.text = text;
  }
}

test("views are saved, renamed and deleted, the newest first", () => {
  const store = new Store();
  const saved = new SavedViews(() => store, "key");
  saved.add("one", { step: 1 }, 10);
  saved.add("two", { step: 2 }, 20);
  saved.rename(saved.list()[1]!.id, "eins");
  assert.deepEqual(
    saved.list().map(({ id: _id, ...rest }) => rest),
    [
      { name: "two", view: { step: 2 }, date: 20 },
      { name: "eins", view: { step: 1 }, date: 10 },
    ],
  );
  saved.remove(saved.list()[0]!.id);
  assert.deepEqual(namesOf(saved), ["eins"]);
});

test("a view is saved with the picture beside it, which is checked when it is read", () => {
  const store = new Store();
  const saved = new SavedViews(() => store, "key");
  const beside = { step: 2, camera: { eye: [1, 2, 3] as [number, number, number] } };
  saved.add("two", { step: 1 }, 10, beside);
  saved.add("one", { step: 1 }, 20);
  saved.rename(saved.list()[1]!.id, "both");
  assert.deepEqual(
    saved.list().map(({ name, beside: kept }) => [name, kept]),
    [
      ["one", undefined],
      ["both", beside],
    ],
  );
  store.text = JSON.stringify([
    { name: "a", view: {}, date: 1, beside: { step: "x", camera: { eye: 3 } } },
    { name: "b", view: {}, date: 1, beside: 7 },
  ]);
  assert.deepEqual(
    saved.list().map(({ beside: kept }) => kept),
    [{}, undefined],
  );
});

const namesOf = (saved: SavedViews): string[] => saved.list().map(({ name }) => name);

test("changes by other tabs are applied, including entries of earlier releases", () => {
  const store = new Store();
  store.text = JSON.stringify([
    { name: "b", view: {}, date: 2 },
    { name: "a", view: {}, date: 1 },
  ]);
  const [here, there] = [new SavedViews(() => store, "key"), new SavedViews(() => store, "key")];
  const [b, a] = here.list();
  there.add("c", {}, 3);
  there.rename(a!.id, "A");
  here.remove(b!.id);
  assert.deepEqual(namesOf(there), ["c", "A"]);
  there.remove(b!.id);
  here.rename(b!.id, "B");
  here.rename(a!.id, "AA");
  assert.deepEqual(namesOf(there), ["c", "AA"]);
});

test("any stored content is read as a list of views", () => {
  const store = new Store();
  const saved = new SavedViews(() => store, "key");
  const good = { name: "a", view: {}, date: 1 };
  for (const [text, count] of [
    ["", 0],
    ["{", 0],
    ["null", 0],
    ["{}", 0],
    ['"x"', 0],
    [JSON.stringify([null, 3, "x", [], {}, good, { ...good, view: [] }, { ...good, name: 3 }]), 1],
    [JSON.stringify([{ ...good, date: "now" }, { ...good, name: "n".repeat(999) }, good]), 1],
    [JSON.stringify(Array.from({ length: 999 }, () => good)), savedViewsMax],
  ] as const) {
    store.text = text;
    assert.equal(saved.list().length, count, text.slice(0, 40));
  }
  assert.throws(() => saved.add("b", {}, 2), /100 views/);
  store.text = null;
  assert.throws(() => saved.add("long", { dataset: "x".repeat(1e6) }, 2), /too long/);
  store.full = true;
  assert.throws(() => saved.add("b", {}, 2), /allows this page no storage/);
  const forbidden = new SavedViews(() => {
    throw new Error("SecurityError");
  }, "key");
  assert.deepEqual(forbidden.list(), []);
  assert.throws(() => forbidden.add("b", {}, 2), /allows this page no storage/);
});

test("a short link names a view that the server stores", async () => {
  assert.equal(shortLinkId(shortLinkHash("aZ09_-")), "aZ09_-");
  for (const hash of ["", "#!{}", "#!view=", "#!view=a/b", `#!view=${"x".repeat(200)}`]) {
    assert.equal(shortLinkId(hash), null);
  }
  const stored = { id: "k7", view: { dataset: "gcm", step: 3 } };
  const { asked, fetch } = server(() => new Response(JSON.stringify(stored), { status: 201 }));
  assert.deepEqual(await storeView(fetch, "http://host/a/", stored.view), stored);
  assert.equal(asked[0]!.url, "http://host/a/v1/views");
  assert.equal(asked[0]!.options.method, "POST");
  assert.deepEqual(JSON.parse(asked[0]!.options.body as string), stored.view);
  assert.deepEqual(await loadView(fetch, "http://host/a/", "k7"), stored);
  assert.equal(asked[1]!.url, "http://host/a/v1/views/k7");
  assert.equal(asked[1]!.options.method ?? "GET", "GET");
  const refused = server(() => problem(404, "unknown view id: k8"));
  await assert.rejects(loadView(refused.fetch, "http://host/", "k8"), /unknown view id: k8/);
  const odd = server(() => new Response("[]"));
  await assert.rejects(loadView(odd.fetch, "http://host/", "k8"), /understood/);
  const none = server(() => Response.json({ id: "k8", view: null }));
  await assert.rejects(loadView(none.fetch, "http://host/", "k8"), /understood/);
  assert.ok(shortLinkHash("k7").length < linkMax);
});

test("invalid views are refused from any source", async () => {
  const whole = {
    ...{ dataset: "gcm", step: 3, image: { background: "#000000" }, later: [null, { x: 1 }] },
    camera: { projection: "perspective", eye: [0, -3, 1], target: null, fovY: 35 },
    geometry: { scale: [1, 1, 2], slice: { axis: "z", index: 3 } },
    vector: { field: null, magnitudeRange: [0, 9], motion: { mode: "phase", time: 0.5 } },
    scalars: [
      {
        field: "cloud",
        color: { range: [0, 1] },
        extinction: [
          [0, 0],
          [1, 2],
          [3, 4],
        ],
      },
    ],
  };
  assert.deepEqual(parseView(JSON.stringify(whole)), whole);
  assert.deepEqual(viewOfHash(hashOfView(whole as unknown as View)), whole);
  for (const text of [
    '{"scalars":5}',
    '{"scalars":{}}',
    '{"scalars":[null]}',
    '{"scalars":[{}]}',
    '{"scalars":[{"field":null}]}',
    '{"scalars":[{"field":"a","color":3}]}',
    '{"scalars":[{"field":"a","extinction":[3]}]}',
    '{"scalars":[{"field":"a","extinction":[[0,1],[2]]}]}',
    '{"vector":[]}',
    '{"vector":{"magnitudeRange":3}}',
    '{"vector":{"magnitudeRange":[0,null]}}',
    '{"vector":{"length":"0.2"}}',
    '{"vector":{"field":5}}',
    '{"camera":{"eye":5}}',
    '{"camera":{"eye":[0,1]}}',
    '{"camera":{"eye":[0,1,1e999]}}',
    '{"geometry":{"slice":"z"}}',
    '{"dataset":5}',
    '{"step":"3"}',
  ]) {
    assert.throws(() => parseView(text), /invalid view/, text);
    assert.equal(viewOfHash(`#!${encodeURIComponent(text)}`), null, text);
    const view: unknown = JSON.parse(text);
    const stored = server(() => new Response(JSON.stringify({ id: "k", view })));
    await assert.rejects(loadView(stored.fetch, "http://host/", "k"), /understood/, text);
    const store = new Store();
    store.text = JSON.stringify([{ name: "a", view, date: 1 }]);
    assert.deepEqual(new SavedViews(() => store, "key").list(), [], text);
  }
});
