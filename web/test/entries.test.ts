// Choosing members and other entries: requests of the page and its view, for answers of a simulated
// server.
import assert from "node:assert/strict";
import { test } from "node:test";
import { entryOf, openEntry, type EntryApi } from "../src/app/entries";
import { entryControls } from "../src/app/entry_picker";
import { ProblemError, type OpeningJob, type Dataset, type View } from "@windsplat/client";
import { hashOfView, viewOfHash } from "../src/view/link";
import { described, Page, problem } from "./page";

const members = (chosen: string): Dataset["choices"] => [
  { name: "number", length: 3, values: ["0", "1", "5"], chosen },
];
const gcm = described("gcm", { choices: members("0") });
const fifth = described("gcm,number=5", { choices: members("5") });
const storm = described("storm");

const running: OpeningJob = {
  ...{ id: "7", kind: "dataset", state: "running", progress: 0.5, etaMs: null },
  ...{ result: null, problem: null },
};
const done = (result: string): OpeningJob => ({ ...running, state: "done", result });

// Answers later requests of the newest page by their method and path. Returns them, with bodies.
function serve(answers: Record<string, unknown>, status = 200): string[] {
  const calls: string[] = [];
  const answer = (url: string, init?: RequestInit) => {
    const call = `${init?.method ?? "GET"} ${url.replace("http://host/", "")}`;
    calls.push(init?.body === undefined ? call : `${call} ${init.body as string}`);
    return Promise.resolve({
      ok: status < 400,
      status,
      json: () => Promise.resolve(answers[call]),
    });
  };
  Object.assign(globalThis, { fetch: answer });
  return calls;
}

const settled = () => new Promise((resolve) => setImmediate(resolve));

function opened(page: Page, dataset: Dataset): void {
  page.opened(dataset);
  page.draws();
}

const posting = 'POST v1/datasets {"from":"gcm","selection":{"number":"5"}}';
const fifthAnswers = {
  "POST v1/datasets": done("gcm,number=5"),
  "GET v1/datasets/gcm%2Cnumber%3D5": fifth,
};
const camera = { eye: [3, 0, 0] } as View["camera"];

test("an id names the entries of a listed dataset", () => {
  const listed = [{ id: "gcm" }, { id: "gcm,number=5" }, { id: "storm" }];
  const found = (id: string) => entryOf(id, listed);
  assert.deepEqual(found("gcm,number=5"), { from: "gcm", selection: { number: "5" } });
  assert.deepEqual(found("gcm,number=5,time=2001-01-01T00:00:00Z"), {
    from: "gcm",
    selection: { number: "5", time: "2001-01-01T00:00:00Z" },
  });
  for (const id of [
    "gcm",
    "gcm2number=5",
    "calm,number=5",
    "storm,",
    "storm,x",
    "storm,=3",
    "storm,x=",
  ]) {
    assert.equal(found(id), null, id);
  }
});

test("a control lists the entries of the description; of a long dimension others are typed", () => {
  const controls = entryControls([
    { name: "number", length: 2, values: ["0", "1"], chosen: "0" },
    { name: "time", length: 200, values: ["2001-01-01T06:00:00Z"], chosen: "x" },
    { name: "single", length: 1, values: ["0"], chosen: "0" },
  ]);
  const [number, time] = controls;
  assert.equal(controls.length, 2, "of a single entry there is no choice");
  assert.deepEqual(
    number!.listed.map(({ value }) => value),
    ["0", "1"],
  );
  assert.equal(number!.title, "number: one of 2 entries");
  assert.equal(number!.isWhole, true);
  assert.equal(time!.isWhole, false);
  assert.equal(time!.listed[0]!.text, "2001-01-01 06:00Z");
  assert.match(time!.title, /the first 1 are listed/);
});

test("another member is shown with the same camera and settings, and undone", async () => {
  const page = new Page([gcm, storm]);
  opened(page, gcm);
  assert.deepEqual(page.entriesShown, ["number=0"]);
  page.app.change({ camera, step: 3 });
  page.draws();
  const calls = serve(fifthAnswers);
  page.app.chooseEntry("number", "5");
  assert.equal(page.app.explicitView().dataset, "gcm", "until the server has opened it");
  page.app.change({ background: "#000000" } as never);
  await settled();
  assert.deepEqual(calls, [posting, "GET v1/datasets/gcm%2Cnumber%3D5"]);
  const view = page.app.explicitView();
  assert.equal(view.dataset, "gcm,number=5");
  assert.deepEqual([view.camera, view.step], [camera, 3]);
  assert.equal((view as Record<string, unknown>).background, "#000000", "changed meanwhile");
  assert.equal(page.sent("open").at(-1)!.dataset, "gcm,number=5");
  opened(page, fifth);
  assert.deepEqual(page.entriesShown, ["number=5"]);
  assert.deepEqual(page.entries, ["The gcm", "The storm", "The gcm,number=5"]);
  page.app.undoControl.undo();
  await settled();
  assert.equal(page.app.explicitView().dataset, "gcm");
  opened(page, gcm);
  page.app.undoControl.redo();
  await settled();
  assert.equal(page.app.explicitView().dataset, "gcm,number=5", "it is opened again");
  assert.equal(calls.filter((call) => call === posting).length, 2);
});

test("a link to a member that the server does not list opens it", async () => {
  for (const again of [false, true]) {
    const page = new Page([gcm, storm]);
    opened(page, gcm);
    const calls = serve(fifthAnswers);
    if (again) {
      page.app.chooseEntry("number", "5");
      await settled();
      opened(page, fifth);
      page.app.change({ camera });
      page.draws();
      calls.length = 0;
      page.again(); // the server was restarted
    } else {
      page.app.openView({ dataset: "gcm,number=5", camera } as View);
    }
    await settled();
    // a lost connection asks first whether the server answers
    assert.equal(calls.filter((call) => !call.startsWith("HEAD "))[0], posting);
    assert.equal(page.sent("open").at(-1)!.dataset, "gcm,number=5");
    const patch = page.sent("patch").at(-1)!.patch as View;
    assert.deepEqual([patch.dataset, patch.camera], ["gcm,number=5", camera], `again ${again}`);
  }
});

test("the address keeps a link to a member while that is opened", async () => {
  const failed = { id: "7", state: "failed", result: null, problem: problem("it is damaged") };
  for (const answers of [fifthAnswers, { "POST v1/datasets": failed }]) {
    const page = new Page([gcm]);
    opened(page, gcm);
    const link = hashOfView({ dataset: "gcm,number=5" });
    const { location } = window;
    const due: (() => void)[] = [];
    const rest = () => due.splice(0).at(-1)?.();
    Object.assign(window, {
      setTimeout: (run: () => void) => due.push(run),
      history: {
        replaceState: (_state: null, _title: string, hash: string) => (location.hash = hash),
      },
    });
    serve(answers);
    location.hash = link; // the user goes there
    page.app.openView({ dataset: "gcm,number=5" });
    rest();
    assert.equal(location.hash, link, "until the server has opened it");
    await settled();
    rest();
    const shown = answers === fifthAnswers ? fifth.id : gcm.id;
    assert.equal(viewOfHash(location.hash)?.dataset, shown);
  }
});

test("steps that the other entry lacks are left", async () => {
  const page = new Page([gcm]);
  opened(page, gcm);
  page.app.change({ step: 4 });
  page.draws();
  serve({
    ...fifthAnswers,
    "GET v1/datasets/gcm%2Cnumber%3D5": described("gcm,number=5", { steps: 2 }),
  });
  page.app.chooseEntry("number", "5");
  await settled();
  assert.equal(page.app.explicitView().step, 1);
});

test("a server that does not allow it disables the choice with its reason", async () => {
  const page = new Page([gcm]);
  opened(page, gcm);
  const why = "choosing other entries is disabled: the server runs with --fixed-entries";
  serve({ "POST v1/datasets": problem(why, 403) }, 403);
  page.app.chooseEntry("number", "5");
  await settled();
  assert.equal(page.alert, why);
  assert.equal(page.entriesRefused, why);
  assert.deepEqual(page.entriesShown, ["number=0"]);
  assert.equal(page.app.explicitView().dataset, "gcm");
  assert.equal(page.element("loading").hidden, true);
  page.app.change({ step: 2 });
  assert.equal(page.rev, page.sent("patch").at(-1)!.rev);
});

test("a member that cannot be opened leaves the present one and the choice", async () => {
  const page = new Page([gcm]);
  opened(page, gcm);
  const failed = { id: "7", state: "failed", result: null, problem: problem("it is damaged") };
  serve({ "POST v1/datasets": failed });
  page.app.chooseEntry("number", "5");
  await settled();
  assert.equal(page.alert, "it is damaged");
  assert.equal(page.entriesRefused, "");
  assert.equal(page.app.explicitView().dataset, "gcm");
  assert.equal(page.sent("open").length, 1);
});

test("the newest choice wins, and a cancelled one has no effect", async () => {
  const page = new Page([gcm]);
  opened(page, gcm);
  serve(fifthAnswers);
  page.app.chooseEntry("number", "1");
  page.app.chooseEntry("number", "5");
  await settled();
  assert.deepEqual(
    page.sent("open").map(({ dataset }) => dataset),
    ["gcm", "gcm,number=5"],
  );
  opened(page, fifth);
  page.app.chooseEntry("number", "1");
  page.app.cancelLoading();
  await settled();
  assert.equal(page.sent("open").length, 2);
  assert.equal(page.app.explicitView().dataset, "gcm,number=5");
  assert.deepEqual(page.entriesShown, ["number=5"]);
});

test("a running job is asked again, and cancelled once it is not wanted", async () => {
  const slept: number[] = [];
  const cancelled: string[] = [];
  let polls = 0;
  const api: EntryApi = {
    openEntry: () => Promise.resolve(running),
    job: () => Promise.resolve(++polls < 8 ? running : done("gcm,number=5")),
    cancelJob: (id) => Promise.resolve(void cancelled.push(id)),
    describe: (id) => Promise.resolve(described(id)),
  };
  const sleep = (ms: number) => Promise.resolve(void slept.push(ms));
  const entry = { from: "gcm", selection: { number: "5" } };
  assert.equal((await openEntry(api, entry, () => true, sleep))!.id, "gcm,number=5");
  assert.deepEqual(slept, [40, 80, 160, 320, 640, 1000, 1000, 1000]);
  polls = 0;
  assert.equal(await openEntry(api, entry, () => polls < 2, sleep), null);
  assert.deepEqual(cancelled, ["7"]);
  const failing = {
    ...api,
    openEntry: () => Promise.resolve({ ...running, state: "failed" as const }),
  };
  await assert.rejects(
    openEntry(failing, entry, () => true, sleep),
    ProblemError,
  );
});

test("undo and redo lead through members, and the list names the last one only", async () => {
  const first = described("gcm,number=1", { choices: members("1") });
  const page = new Page([gcm, storm]);
  opened(page, gcm);
  serve({
    "POST v1/datasets": done("gcm,number=1"),
    "GET v1/datasets/gcm%2Cnumber%3D1": first,
  });
  page.app.chooseEntry("number", "1");
  await settled();
  opened(page, first);
  page.choose("storm");
  opened(page, storm);
  page.app.undoControl.undo();
  await settled();
  opened(page, first);
  assert.equal(page.app.explicitView().dataset, "gcm,number=1");
  page.app.undoControl.redo();
  assert.equal(page.app.explicitView().dataset, "storm", "the way back remains");
  opened(page, storm);
  page.app.undoControl.undo();
  await settled();
  opened(page, first);
  serve(fifthAnswers);
  page.app.chooseEntry("number", "5");
  await settled();
  opened(page, fifth);
  assert.deepEqual(page.entries, ["The gcm", "The storm", "The gcm,number=5"]);
});
