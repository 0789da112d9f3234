// The sequence of a reference: requests and reported text for simulated answers.
import assert from "node:assert/strict";
import { test } from "node:test";
import { errorMetric } from "../src/base/error_text";
import type { View } from "@windsplat/client";
import { progressText, Reference, referenceView, type Job } from "../src/viewport/reference";

const job = (change: Partial<Job>): Job => ({
  id: "7",
  state: "running",
  progress: 0,
  etaMs: null,
  result: null,
  problem: null,
  ...change,
});
const done = job({ state: "done", progress: 1, result: { id: "ab", error: { value: 2.64e-4 } } });

const settled = () => new Promise((resolve) => setImmediate(resolve));

function page(answers: unknown[]) {
  const calls: string[] = [];
  const said: string[] = [];
  const wakes: (() => void)[] = [];
  const state = { view: { step: 0, image: { width: 640, height: 480 } } as View, shown: false };
  const reference = new Reference({
    view: () => state.view,
    request: async (method, path, body) => {
      calls.push(`${method} ${path}`);
      assert.equal(body?.quality, undefined, "a reference request omits `quality`");
      if (method === "DELETE") return null;
      const answer = answers.shift();
      if (answer instanceof Error) throw answer;
      return answer;
    },
    sleep: () => new Promise((resolve) => wakes.push(resolve)),
    load: async (path) => void calls.push(`load ${path}`),
    show: (on) => (state.shown = on),
    report: (text, progress) => said.push(text + progress),
  });
  const wake = async () => {
    wakes.splice(0).forEach((run) => run());
    await settled();
  };
  return { reference, calls, said, state, wake };
}

test("a reference is as large as the picture, up to a million pixels", () => {
  const image = (width: number, height: number) =>
    referenceView({ step: 3, image: { width, height, background: "#102030" } } as View);
  assert.deepEqual(image(640, 480), {
    step: 3,
    image: { width: 640, height: 480, background: "#102030" },
  });
  const { width, height } = image(2560, 1440).image!;
  assert.ok(width! * height! <= 1e6 && width! * height! > 0.99e6);
  assert.ok(Math.abs(width! / height! - 16 / 9) < 0.005);
});

test("progress is formatted as text", () => {
  assert.equal(progressText(job({ state: "queued" })), ": waiting");
  assert.equal(progressText(job({ progress: 0.004 })), ": 0 %");
  assert.equal(progressText(job({ progress: 0.346, etaMs: 7100 })), ": 34 %, 8 s left");
});

test("the first hold requests the reference, a later or continued hold shows it", async () => {
  for (const keeps of [false, true]) {
    const { reference, calls, said, state, wake } = page([
      job({ state: "queued" }),
      job({ progress: 0.5, etaMs: 4000 }),
      done,
    ]);
    reference.hold();
    if (!keeps) reference.release();
    await settled();
    await wake();
    reference.prepare(); // the request is already in progress
    assert.equal(state.shown, false);
    await wake();
    assert.deepEqual(calls, [
      "POST v1/references",
      "GET v1/jobs/7",
      "GET v1/jobs/7",
      "load v1/references/ab.png",
    ]);
    assert.deepEqual(said, [
      "reference 640×480",
      "reference 640×480: waiting",
      "reference 640×480: 50 %, 4 s left",
      "reference 640×480 ready: hold r · error 2.6e-4 true",
    ]);
    assert.equal(state.shown, keeps);
    errorMetric.set("psnr");
    assert.equal(said.at(-1), "reference 640×480 ready: hold r · PSNR 71.6 dB true");
    errorMetric.set("rmse");
    reference.hold();
    assert.equal(state.shown, true);
    reference.release();
    assert.equal(state.shown, false);
    assert.equal(calls.length, 4, "the reference is rendered once");
  }
});

test("a different view discards the reference, an equivalent one does not", async () => {
  const { reference, calls, said, state, wake } = page([job({}), job({ id: "8" }), done, done]);
  reference.hold();
  await settled();
  state.view = { ...state.view, quality: { budgetMs: 40 } } as View;
  reference.follow();
  assert.equal(calls.length, 1);
  state.view = { ...state.view, step: 1 };
  reference.follow();
  assert.deepEqual(calls.slice(1), ["DELETE v1/jobs/7"]);
  assert.equal(said.at(-1), "");
  reference.hold(); // the previous request has not been cancelled yet
  await settled();
  assert.equal(calls.length, 2);
  await wake();
  assert.equal(calls[2], "POST v1/references", "the old job is not polled");
  await wake();
  assert.equal(calls[3], "GET v1/jobs/8");
  assert.equal(state.shown, true);
  reference.drop();
  assert.equal(state.shown, false);
  assert.equal(calls.at(-1), "load v1/references/ab.png", "no request remains to be cancelled");
});

test("a view that changes before the job id is known cancels the job", async () => {
  let answer: (job: Job) => void = () => {};
  const posted = new Promise((resolve: (job: Job) => void) => (answer = resolve));
  const { reference, calls } = page([posted]);
  reference.prepare();
  reference.drop();
  await settled();
  assert.deepEqual(calls, [], "no request yet");
  reference.prepare();
  await settled();
  reference.drop();
  assert.deepEqual(calls, ["POST v1/references"], "the job id is not known yet");
  answer(job({}));
  await settled();
  assert.deepEqual(calls.slice(1), ["DELETE v1/jobs/7"]);
});

test("after a discard the same view is requested again", async () => {
  const { reference, calls, said, wake } = page([job({}), done]);
  reference.prepare();
  await settled();
  reference.drop();
  reference.prepare();
  await wake();
  assert.deepEqual(calls.slice(1, 3), ["DELETE v1/jobs/7", "POST v1/references"]);
  assert.match(said.at(-1)!, /ready/);
});

test("a failure is reported, and the next hold requests again", async () => {
  const busy = new Error("4 references wait");
  const failed = job({ state: "failed", problem: { detail: "no room" } });
  const { reference, calls, said } = page([busy, failed, done]);
  for (const words of ["4 references wait", "no room"]) {
    reference.hold();
    reference.release();
    await settled();
    assert.equal(said.at(-1), `reference 640×480: ${words}`);
  }
  reference.hold();
  await settled();
  assert.equal(calls.at(-1), "load v1/references/ab.png");
});
