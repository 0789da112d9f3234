// Smoke test of the latency table: every event is matched with its picture and all rows are
// printed.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

test("the latency table matches every event with its picture", () => {
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
    "no event is lost",
  );
  for (const part of parts) {
    const means = [...part.matchAll(/^ {2}([a-z ]+?) +-?[\d.]+ +-?[\d.]+ +(-?[\d.]+)$/gm)];
    const of = Object.fromEntries(means.map(([, name, mean]) => [name, Number(mean)]));
    const { total, "panels and HUD": _, ...stages } = of;
    assert.equal(Object.keys(stages).length, 11);
    const sum = Object.values(stages).reduce((so, mean) => so + mean, 0);
    assert.ok(Math.abs(sum - total) < 0.1, `the stages sum to ${sum} ms instead of ${total} ms`);
    assert.ok(stages.render > 0 && stages.decode > 0 && stages["to the display"] > 0);
  }
});
