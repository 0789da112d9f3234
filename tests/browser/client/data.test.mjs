// Uploads and arrays of values, by a page of another origin: what it may send, and which headers of
// answers it may read.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { sharedSite } from "./site.mjs";

const folder = mkdtempSync(join(tmpdir(), "windsplat-data-"));
after(() => rmSync(folder, { recursive: true }));
const state = join(folder, "state");
mkdirSync(state);
const file = join(folder, "x.nc");
execFileSync(process.env.WINDSPLAT_PROGRAM, ["synth", "tornado", "--dims", "8x8x8", "-o", file]);

const shared = sharedSite({ args: ["--upload-limit", "64M", "--state-dir", state, "tornado"] });

// Runs a function in a page with a client of the daemon in its window.
async function inPage(t, run, given) {
  const page = await shared.pageWith(t, "");
  await page.evaluate(async (url) => {
    const { Client } = await import("/client/index.js");
    window.server = new Client(url);
    window.bytes = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  }, shared.daemon.url);
  return page.evaluate(run, given);
}

test("a file is sent, opened, read and removed", async (t) => {
  const found = await inPage(
    t,
    async (base64) => {
      const { server } = window;
      const bytes = window.bytes(base64);
      const failed = (asked) => asked.then(String, (error) => [error.name, error.status]);
      const first = await server.upload("page-7f3a.nc", new Blob([bytes]), { keep: 60 });
      const twice = await failed(server.upload("page-7f3a.nc", bytes));
      const asked = await server.uploaded("page-7f3a.nc");
      const id = await server.finished(await server.openUpload("page-7f3a.nc"));
      const { shape } = await server.values(id, "wind", {});
      await server.removeUpload("page-7f3a.nc");
      const gone = await failed(server.uploaded("page-7f3a.nc"));
      const closed = await failed(server.describe(id));
      const digest = first.digest.replace(/:.{4}/, ":AAAA");
      const others = await failed(server.upload("other.nc", bytes.buffer, { digest }));
      const { digest: same } = await server.upload("other.nc", bytes, { digest: first.digest });
      await server.removeUpload("other.nc");
      return [first, asked, twice, shape, gone, closed, others, same];
    },
    readFileSync(file).toString("base64"),
  );
  const [first, asked, twice, shape, gone, closed, others, same] = found;
  assert.equal(first.bytes, readFileSync(file).length);
  assert.ok(Date.parse(first.expires) < Date.now() + 120_000, "keep");
  assert.deepEqual(asked, first);
  assert.deepEqual(shape, [3, 8, 8, 8]);
  assert.equal(same, first.digest);
  const refused = (status) => ["ProblemError", status];
  assert.deepEqual(
    [twice, gone, closed, others],
    [refused(409), refused(404), refused(404), refused(422)],
  );
});

test("the bytes of a text are its UTF-8", async (t) => {
  const bytes = await inPage(t, async () => {
    const { bytes: length } = await window.server.upload("text-9c1e.json", '{"title": "Böe"}');
    await window.server.removeUpload("text-9c1e.json");
    return length;
  });
  assert.equal(bytes, 17);
});

test("values are those of the probe at the same samples, with their axes", async (t) => {
  const { strided, level, probed, refused } = await inPage(t, async () => {
    const { server } = window;
    const box = { bbox: [100, 200, 700, 900], stride: [4, 3, 5] };
    const { values, ...strided } = await server.values("tornado", "wind", box);
    const { x, y, z } = strided.axes;
    const last = [x, y, z].map(({ index, stride, count }) => index + stride * (count - 1));
    const probe = await server.probe("tornado", last, null, { step: 0 });
    const size = strided.shape.reduce((a, b) => a * b);
    const probed = {
      ...{ length: values.length, size, is: values instanceof Float32Array },
      got: [1, 2, 3].map((n) => values[(size / 3) * n - 1]),
      wanted: probe.values.wind.value,
      at: [probe.position.x, probe.position.y, probe.position.z],
    };
    const { dims, shape } = await server.values("tornado", "wind", { level: z.first });
    const refused = await server.values("tornado", "wind", { box: 1 }).catch((error) => error);
    return { strided, level: { dims, shape }, probed, refused: [refused.name, refused.message] };
  });
  assert.deepEqual(strided.dims, ["component", "z", "y", "x"]);
  assert.deepEqual([strided.field, strided.units, strided.step], ["wind", "m s-1", 0]);
  const { x, y, z } = strided.axes;
  assert.deepEqual(strided.shape, [3, z.count, y.count, x.count]);
  assert.deepEqual([x.stride, y.stride, z.stride], [4, 3, 5]);
  assert.ok(x.first >= 100 && x.last <= 700 && y.first >= 200 && y.last <= 900);
  assert.ok(probed.is);
  assert.equal(probed.length, probed.size);
  assert.deepEqual(probed.at, [x.last, y.last, z.last]);
  for (const n of [0, 1, 2]) assert.ok(Math.abs(probed.got[n] - probed.wanted[n]) < 1e-4, `${n}`);
  assert.deepEqual(level.dims, ["component", "y", "x"]);
  assert.equal(level.shape.length, 3);
  assert.equal(refused[0], "ProblemError");
  assert.match(refused[1], /box/);
});
