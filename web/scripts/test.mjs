// Generates the types, type-checks the page and its tests, bundles the tests (for node versions
// that cannot run TypeScript) and runs them. Usage: node scripts/test.mjs [node --test options]
import { spawnSync } from "node:child_process";
import { mkdirSync, readdirSync, rmSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { generateTypes } from "./types.mjs";

const web = join(dirname(fileURLToPath(import.meta.url)), "..");
const out = join(web, ".test-build");

function run(args) {
  const { status } = spawnSync(process.execPath, args, { cwd: web, stdio: "inherit" });
  if (status !== 0) process.exit(status ?? 1);
}

await generateTypes();
run([join(web, "node_modules/typescript/bin/tsc"), "--noEmit"]);
rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
const tests = readdirSync(join(web, "test"), { recursive: true }).filter((name) =>
  name.endsWith(".test.ts"),
);
await build({
  entryPoints: tests.map((name) => join(web, "test", name)),
  bundle: true,
  platform: "node",
  target: "node18",
  format: "esm",
  packages: "external",
  sourcemap: "inline",
  outdir: out,
  outbase: join(web, "test"),
  outExtension: { ".js": ".mjs" },
  logLevel: "warning",
});
run([
  "--enable-source-maps",
  "--test",
  ...process.argv.slice(2),
  ...tests.map((name) => join(out, name.replace(/\.ts$/, ".mjs"))),
]);
