// A smoke run of the table of latencies: it follows events to their pictures and prints its rows.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

test("the table of latencies follows every event to its picture", () => {
  const script = join(dirname(fileURLToPath(import.meta.url)), "latency.mjs");
  const { status, stdout, stderr } = spawnSync(process.execPath, [script, "--quick"], {
    encoding: "utf8",
  });
  assert.equal(status, 0, stderr);
  assert.doesNotMatch(stdout, /NaN|undefined|Infinity/);
  const [loaded, first, final] = ["page loaded", "first picture", "final picture"].map((name) =>
    Number(stdout.match(new RegExp(`^  ${name} +([\\d.]+)`, "m"))?.[1]),
  );
  assert.ok(loaded > 0 && first > 0 && final >= first, `${loaded}, ${first}, ${final} ms`);
  const parts = stdout.split("\n\n").slice(1);
  assert.deepEqual(
    parts.map((part) => part.match(/: (\d+) events/)?.[1]),
    ["5", "30"],
    "none is lost",
  );
  for (const part of parts) {
    const means = [...part.matchAll(/^ {2}([a-z ]+?) +-?[\d.]+ +-?[\d.]+ +(-?[\d.]+)$/gm)];
    const of = Object.fromEntries(means.map(([, name, mean]) => [name, Number(mean)]));
    const { total, "panels and figures": _, ...stages } = of;
    assert.equal(Object.keys(stages).length, 11);
    const sum = Object.values(stages).reduce((so, mean) => so + mean, 0);
    assert.ok(Math.abs(sum - total) < 0.1, `the stages sum up to ${sum} ms of ${total}`);
    assert.ok(stages.render > 0 && stages.decode > 0 && stages["to the display"] > 0);
  }
});
