// The page's state while it waits, and the state it returns to.
import assert from "node:assert/strict";
import { test } from "node:test";
import { described, Page, problem } from "./page";

const a = described("a");
const b = described("b");

test("minor messages do not replace the reason of a lost connection", async () => {
  const page = new Page([a]);
  page.lose(1013);
  await new Promise((done) => setImmediate(done)); // let the colour map request fail
  assert.equal(
    page.element("status").textContent,
    "connection lost: the server has reached its session limit",
  );
  assert.match(page.element("offline-text").textContent, /session limit.*Retrying in \d+ s/);
  page.again();
  assert.notEqual(page.element("status").textContent.slice(0, 10), "connection");
  assert.equal(page.element("offline").hidden, true);
});

test("cancelling a dataset requests the previous view and ignores late answers", () => {
  const page = new Page([a, b]);
  page.opened(a);
  page.app.change({ vector: { opacity: 0.25 } });
  page.draws();
  page.choose("b");
  page.app.cancelLoading();
  const { patch } = page.sent("patch").at(-1)!;
  assert.deepEqual([patch.dataset, (patch.vector as { opacity: number }).opacity], ["a", 0.25]);
  page.receives({ type: "error", id: page.openId, problem: problem("too late") });
  page.opened(b);
  assert.deepEqual([page.alert, page.app.dataset().id], [null, "a"]);
});

test("cancelling a slow step returns to the rendered one", () => {
  const page = new Page([a]);
  page.opened(a);
  page.draws();
  page.app.seek(3);
  page.app.cancelLoading();
  assert.equal(page.app.view().step ?? 0, 0);
  assert.equal(page.sent("patch").at(-1)!.patch.step ?? 0, 0);
});

test("without a dataset, or when the first is cancelled, the cards are shown", () => {
  assert.equal(new Page([]).cardsShown, 1);
  const page = new Page([a]);
  assert.equal(page.cardsShown, 0);
  page.app.cancelLoading();
  assert.equal(page.cardsShown, 1);
  page.choose("a");
  page.opened(a);
  assert.equal(page.app.dataset().id, "a");
});
