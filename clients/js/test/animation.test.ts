// Movies with a simulated server: how a job is followed, ended and reported.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Client, type AnimationRequest } from "../src/client/client";
import { ProblemError } from "../src/wire/requests";

const request: AnimationRequest = { view: { dataset: "a" }, format: "zip", turn: 360 };
const result = { id: "f", movie: "/base/v1/animations/f.zip" };
const problem = { type: "/problems/too-large", title: "T", status: 413, detail: "256 MiB" };
const jobOf = (state: string, more = {}) => ({
  ...{ id: "7", kind: "animation", state, progress: 0.5, etaMs: null },
  ...{ result: null, problem: null, ...more },
});

// Answers in order; an object is JSON, a text the bytes of a file.
function serverOf(answers: (object | string)[]) {
  const asked: string[] = [];
  const fetch = (url: string, init: RequestInit) => {
    asked.push(`${init.method ?? "GET"} ${url}`);
    if (init.method === "DELETE") return Promise.resolve(new Response(null, { status: 204 }));
    const answer = answers.shift()!;
    const body = typeof answer === "string" ? answer : JSON.stringify(answer);
    return Promise.resolve(new Response(body));
  };
  return { asked, client: new Client("http://a.example/base/", { fetch }) };
}

const soon = () => Promise.resolve();

test("a movie is the file of the job's result", async () => {
  const { asked, client } = serverOf([
    jobOf("queued"),
    jobOf("running"),
    jobOf("done", { result }),
    "PK",
  ]);
  const states: string[] = [];
  const progress = ({ state }: { state: string }) => states.push(state);
  const movie = await client.animate(request, { progress, wait: soon });
  assert.equal(await movie.text(), "PK");
  assert.deepEqual(states, ["queued", "running", "done"]);
  assert.deepEqual(asked, [
    "POST http://a.example/base/v1/animations",
    "GET http://a.example/base/v1/jobs/7",
    "GET http://a.example/base/v1/jobs/7",
    "GET http://a.example/base/v1/animations/f.zip",
  ]);
});

test("the result of opening a dataset is its id", async () => {
  const opening = { kind: "dataset" };
  const answers = [jobOf("queued", opening), jobOf("done", { ...opening, result: "winds" })];
  for (const open of ["openPath", "openUpload"] as const) {
    const { client } = serverOf([...answers]);
    const id: string | null = await client.finished(await client[open]("a.nc"), { wait: soon });
    assert.equal(id, "winds");
  }
});

test("a job that failed is its problem", async () => {
  const { client } = serverOf([jobOf("failed", { problem })]);
  const job = await client.createAnimation(request);
  const failure = await client.finished(job).catch((error: unknown) => error);
  assert.ok(failure instanceof ProblemError);
  assert.deepEqual([failure.message, failure.status], ["256 MiB", 413]);
});

test("a job that another client ended is told as such", async () => {
  const { client } = serverOf([jobOf("cancelled")]);
  const job = await client.createAnimation(request);
  await assert.rejects(client.finished(job), /cancelled/);
});

test("aborting ends the job of the server", async () => {
  const { asked, client } = serverOf([jobOf("running")]);
  const ended = new AbortController();
  const job = await client.createAnimation(request);
  const following = client.finished(job, { signal: ended.signal });
  ended.abort(new Error("not wanted"));
  await assert.rejects(following, /not wanted/);
  assert.deepEqual(asked.slice(1), ["DELETE http://a.example/base/v1/jobs/7"]);
});
