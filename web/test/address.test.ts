// The page's address: its updates by the view, links to views stored by the server, and the link
// that Share copies. Server and browser are simulated.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Address } from "../src/app/address";
import { hashOfView } from "../src/view/link";
import type { View } from "@windsplat/client";
import type { Status } from "../src/app/status";

class Visit {
  view: View = { image: { width: 8, height: 6 } };
  runs = false;
  begun: (View | null)[] = [];
  restored: View[] = [];
  alert = "";
  copied = "";
  answer: (response: Response) => void = () => {};
  readonly address: Address;
  private due: (() => void) | undefined;
  private follow = (): void => {};
  private readonly location: { hash: string; href: string };

  constructor(hash: string) {
    const location = {
      hash,
      get href() {
        return `http://host/a/${this.hash}`;
      },
    };
    this.location = location;
    const fetch = (_url: string, { signal }: RequestInit) =>
      new Promise<Response>((resolve, reject) => {
        this.answer = resolve;
        signal?.addEventListener("abort", () => reject(signal.reason as Error));
      });
    const window = {
      location,
      history: {
        replaceState: (_state: null, _title: string, next: string) => (location.hash = next),
      },
      addEventListener: (_type: string, run: () => void) => (this.follow = run),
      setTimeout: (run: () => void) => ((this.due = run), 1),
      clearTimeout: () => {},
    };
    const clipboard = { writeText: (text: string) => Promise.resolve(void (this.copied = text)) };
    Object.assign(globalThis, { window, fetch });
    Object.defineProperty(globalThis, "navigator", { value: { clipboard }, configurable: true });
    const status = {
      error: (_topic: string, text: string) => (this.alert = text),
      note: () => {},
    } as unknown as Status;
    const host = {
      document: () => this.view,
      busy: () => this.runs,
      restore: (view: View) => void this.restored.push(view),
    };
    this.address = new Address(host, status, "http://host/a/");
    this.address.first((view) => this.begun.push(view));
  }

  goTo(hash: string): void {
    this.location.hash = hash;
    this.follow();
  }

  // The address after the debounce interval with this view.
  rests(view: View): string {
    this.view = view;
    this.address.save();
    this.due?.();
    return this.location.hash;
  }
}

const short = "#!view=k7";
const settled = () => new Promise((resolve) => setImmediate(resolve));

test("a link to a stored view is kept until that view is loaded", async () => {
  const visit = new Visit(short);
  assert.equal(visit.rests({ image: { width: 9, height: 6 } }), short);
  visit.address.edited();
  assert.equal(visit.rests({}), short);
  assert.deepEqual(visit.begun, []);
  visit.answer(Response.json({ id: "k7", view: { dataset: "gcm", image: { width: 1 } } }));
  await settled();
  assert.deepEqual(visit.begun, [{ dataset: "gcm" }]);
  assert.equal(visit.rests({ dataset: "gcm" }), "#!{%22dataset%22:%22gcm%22}");
  assert.equal(visit.alert, "");
});

test("a stored view that fails to load keeps the link until an edit", async () => {
  for (const later of [false, true]) {
    const visit = new Visit(later ? "" : short);
    if (later) visit.goTo(short);
    visit.answer(Response.json({ title: "No", detail: "unknown view k7" }, { status: 404 }));
    await settled();
    assert.deepEqual(visit.begun, [null]);
    assert.match(visit.alert, /unknown view k7/);
    assert.equal(
      visit.rests({ dataset: "gcm", step: 0 }),
      short,
      "the page's own changes keep the link",
    );
    visit.address.edited();
    assert.equal(visit.rests({ step: 3 }), hashOfView({ step: 3 }));
  }
});

test("an unresponsive server is not waited for indefinitely", async (t) => {
  const late = new AbortController();
  const given: number[] = [];
  t.mock.method(AbortSignal, "timeout", (ms: number) => (given.push(ms), late.signal));
  const visit = new Visit(short);
  await settled();
  assert.deepEqual(visit.begun, []);
  late.abort();
  await settled();
  assert.ok(given[0]! > 1000 && given[0]! <= 15_000);
  assert.deepEqual(visit.begun, [null]);
  assert.match(visit.alert, /did not answer in time/);
  assert.equal(visit.rests({}), short);
});

test("navigation cancels the previous request", async () => {
  const visit = new Visit(short);
  visit.goTo(hashOfView({ step: 2 }));
  visit.answer(Response.json({ title: "No" }, { status: 404 }));
  await settled();
  assert.deepEqual([visit.begun, visit.restored], [[null], [{ step: 2 }]]);
  assert.equal(visit.alert, "");
  assert.equal(visit.rests({ step: 4 }), hashOfView({ step: 4 }));
});

test("share copies the current view during playback and pending updates", async () => {
  const visit = new Visit("");
  const before = visit.rests({ step: 1 });
  visit.runs = true;
  assert.equal(visit.rests({ step: 5 }), before);
  await visit.address.copy();
  assert.equal(visit.copied, `http://host/a/${hashOfView({ step: 5 })}`);
  visit.view = { step: 6, dataset: "x".repeat(3000), image: { width: 8, height: 6 } };
  const copying = visit.address.copy();
  visit.answer(Response.json({ id: "k9", view: {} }));
  await copying;
  assert.equal(visit.copied, "http://host/a/#!view=k9");
});
