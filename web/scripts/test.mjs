// Generates the types, type-checks the page, the client package and their tests, bundles the tests
// (for node versions that cannot run TypeScript) and runs them.
// Usage: node scripts/test.mjs [node --test options]
import { spawnSync } from "node:child_process";
import { mkdirSync, readdirSync, rmSync } from "node:fs";
import { dirname, join, relative } from "node:path";
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
const folders = [join(web, "test"), join(web, "..", "clients", "js", "test")];
const tests = folders.flatMap((folder) =>
  readdirSync(folder, { recursive: true })
    .filter((name) => name.endsWith(".test.ts"))
    .map((name) => join(folder, name)),
);
await build({
  entryPoints: tests,
  bundle: true,
  platform: "node",
  target: "node18",
  format: "esm",
  packages: "external",
  sourcemap: "inline",
  outdir: out,
  outbase: join(web, ".."),
  outExtension: { ".js": ".mjs" },
  logLevel: "warning",
});
run([
  "--enable-source-maps",
  "--test",
  ...process.argv.slice(2),
  ...tests.map((path) => join(out, relative(join(web, ".."), path).replace(/\.ts$/, ".mjs"))),
]);
