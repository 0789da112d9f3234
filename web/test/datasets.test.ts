// Unreadable datasets, dataset lists, and files that change while displayed: the page's messages
// and state for simulated server messages.
import assert from "node:assert/strict";
import { test } from "node:test";
import { bestDataset, pickerEntries, withState } from "../src/app/dataset_list";
import { hashOfView } from "../src/view/link";
import type { View } from "@windsplat/client";
import { mergeView } from "@windsplat/client/parts";
import { described, Page, problem, summaryOf } from "./page";

const tooBig =
  "the field needs 27.5 MiB; the memory limit is 20.0 MiB, of which 0.4 MiB are in use";

test("repeated titles show ids, and failures are marked", () => {
  const titled = (id: string, title: string, more = {}) =>
    summaryOf(described(id, { title, ...more }));
  const notes = ["levels were turned", "'b.nc' is damaged"];
  const list = [
    titled("a", "My storm"),
    titled("b", "My storm", { state: "failed", notes }),
    titled("c", ""),
    titled("d", "Calm"),
    titled("e", "Gone", { state: "failed" }),
  ];
  const entries = pickerEntries(list);
  assert.deepEqual(
    entries.map(({ text }) => text),
    ["My storm (a)", "My storm (b) — failed", "c", "Calm", "Gone — failed"],
  );
  assert.deepEqual(entries.map(({ hint }) => hint).slice(0, 3), ["", "'b.nc' is damaged", ""]);
  assert.match(entries[4]!.hint, /cannot be read/);
});

test("the initial dataset is one that can be read", () => {
  const list = ["b", "climate", "c"].map((id) => summaryOf(described(id)));
  assert.equal(bestDataset(list), "climate");
  const without = withState(list, { id: "climate", state: "failed", notes: ["gone"] });
  assert.equal(bestDataset(without), "b");
  assert.equal(withState(without, { id: "climate", state: "failed", notes: ["gone"] }), without);
  assert.equal(
    bestDataset(without.map((one) => ({ ...one, state: "failed" as const }))),
    undefined,
  );
});

test("the reason why a dataset cannot be shown remains visible", () => {
  const storm = described("storm");
  // The server refuses the request and the patch in either order; meanwhile the page restores the
  // previous view.
  for (const patchFirst of [false, true]) {
    const page = new Page([storm, described("big")]);
    page.opened(storm);
    page.draws();
    page.choose("big");
    const [id, rev] = [page.openId, page.rev];
    const refuseId = () => page.receives({ type: "error", id, problem: problem(tooBig, 507) });
    const refuseRev = () => page.receives({ type: "error", rev, problem: problem(tooBig, 507) });
    if (patchFirst) refuseRev();
    refuseId();
    if (!patchFirst) refuseRev();
    page.receives({ type: "unchanged", rev: page.rev, seq: 1 });
    assert.equal(page.alert, tooBig);
    assert.equal(page.element("dataset").value, "storm");
    assert.deepEqual(page.entries, ["The storm", "The big — failed"]);
    page.app.change({ step: 1 });
    page.draws();
    assert.equal(page.alert, tooBig, "the error remains until the next choice");
    page.choose("big");
    assert.equal(page.alert, null, "a new request clears the error");
    page.opened(described("big"));
    page.draws();
    assert.equal(page.alert, null);
    assert.deepEqual(page.entries, ["The storm", "The big"]);
  }
});

test("when no dataset can be read each is tried once and the last error remains", () => {
  const page = new Page([described("a"), described("b")]);
  page.receives({ type: "error", id: page.openId, problem: problem("a is damaged") });
  assert.equal(page.sent("open").at(-1)!.dataset, "b");
  page.receives({ type: "error", id: page.openId, problem: problem("b is damaged") });
  assert.equal(page.sent("open").length, 2);
  assert.equal(page.alert, "b is damaged");
});

const camera = { eye: [1, 2, 3], target: [0, 0, 0], up: [0, 0, 1], fovY: 20, height: 1 };

// The view on the server, computed from all patches sent.
const explicitView = (page: Page): View =>
  page.sent("patch").reduce<View>((view, { patch }) => mergeView(view, patch), {});

test("a dataset that cannot be opened keeps the shown one", () => {
  const storm = described("storm");
  for (const twice of [false, true]) {
    const page = new Page([storm, described("big"), described("other")]);
    page.opened(storm);
    page.draws();
    page.app.change({ camera, scalars: [{ field: "temperature", opacity: 0.3 }] });
    page.draws();
    const before = page.app.explicitView();
    if (twice) page.choose("other");
    page.choose("big");
    const rev = page.rev;
    page.receives({ type: "error", id: page.openId, problem: problem(tooBig, 507) });
    page.receives({ type: "error", rev, problem: problem(tooBig, 507) });
    assert.deepEqual(page.app.explicitView(), before);
    assert.deepEqual(explicitView(page), before);
    assert.equal(page.alert, tooBig);
  }
});

test("choosing the shown dataset while another opens keeps it", () => {
  const [storm, big] = [described("storm"), described("big")];
  for (const back of ["picker", "link"]) {
    const page = new Page([storm, big]);
    page.opened(storm);
    page.draws();
    page.app.change({ camera });
    page.draws();
    const before = page.app.explicitView();
    page.choose("big");
    if (back === "picker") page.choose("storm");
    else page.app.restore({ dataset: "storm", step: 2, camera } as View);
    const wanted = back === "picker" ? before : { ...before, step: 2 };
    assert.deepEqual(page.app.explicitView(), wanted);
    page.opened(big); // arrives too late
    assert.deepEqual(page.app.explicitView(), wanted);
    assert.equal(page.app.dataset().id, "storm");
    assert.equal(page.element("dataset").value, "storm");
    assert.equal(page.element("loading").hidden, true);
  }
});

test("a picture that shows nothing of the data says why, until one shows some", () => {
  const page = new Page([described("a")]);
  page.opened(page.datasets[0]!);
  page.draws({ empty: "the camera does not show the data" });
  assert.equal(page.emptyText, "Nothing is shown: the camera does not show the data.");
  page.draws();
  assert.equal(page.emptyText, null);
});

test("a link to a dataset that is not there says so, and shows no other one", () => {
  const page = new Page([described("climate"), described("storm")], {
    hash: hashOfView({ dataset: "gone", step: 2 } as View),
  });
  assert.equal(page.sent("open").at(-1)!.dataset, "gone");
  page.receives({ type: "error", id: page.openId, problem: problem("no dataset 'gone'", 404) });
  assert.equal(page.sent("open").length, 1, "no other dataset is asked for");
  assert.equal(page.alert, "There is no dataset “gone” on this server.");
  assert.deepEqual(page.cardsSaid, ["there is no dataset “gone” on this server"]);
  assert.equal(page.element("loading").hidden, true);
  page.choose("storm");
  page.opened(page.datasets[1]!);
  page.draws();
  assert.equal(page.alert, null);
  assert.equal(page.app.dataset().id, "storm");
});

test("a link to a dataset that cannot be read shows the reason and no other one", () => {
  const hash = hashOfView({ dataset: "big" } as View);
  const page = new Page([described("climate"), described("big")], { hash });
  page.receives({ type: "error", id: page.openId, problem: problem(tooBig, 507) });
  assert.equal(page.sent("open").length, 1);
  assert.match(page.alert!, /needs 27.5 MiB/);
});

test("a step that is not there is counted from 1, as on the page", () => {
  const page = new Page([described("a")]);
  page.opened(page.datasets[0]!);
  page.draws();
  const told = (detail: string): string | null => {
    page.app.change({ step: 40 });
    page.receives({ type: "error", rev: page.rev, problem: problem(detail, 422, "/step") });
    return page.alert;
  };
  assert.equal(told("dataset 'a' has steps 0 to 11"), "Time step: dataset 'a' has steps 1 to 12");
  assert.match(
    told("dataset 'b' has no step 9 to subtract: name one of 0 to 3")!,
    /no step 10 to subtract: name one of 1 to 4$/,
  );
  assert.match(
    told("the times of steps 2 and 3 differ by 5 steps")!,
    /steps 3 and 4 differ by 5 st/,
  );
  page.draws({ empty: "every sample of cloud is masked at step 0" });
  assert.equal(page.emptyText, "Nothing is shown: every sample of cloud is masked at step 1.");
});

test("a picture that is dark because it is night says so", () => {
  const page = new Page([described("a")]);
  page.opened(page.datasets[0]!);
  const sunAt = { utc: "2024-06-20T00:00Z", longitude: 0, latitude: 50 };
  page.draws({ view: { light: { sunAt } } as unknown as View });
  assert.match(page.emptyText!, /^The sun is \d+° below the horizon here at this time\.$/);
  page.draws({ view: { light: { sunAt: { ...sunAt, longitude: 180 } } } as unknown as View });
  assert.equal(page.emptyText, null);
});
