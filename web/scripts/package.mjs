// clients/js/src -> clients/js/dist: modules, their types, and <windsplat-view> as one file; and
// the licence beside them, which npm takes from the folder of the package only.
// Usage: node scripts/package.mjs [--dist DIR] [--no-types]
import { execFileSync } from "node:child_process";
import { copyFile, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { installModules } from "./install.mjs";

const web = join(dirname(fileURLToPath(import.meta.url)), "..");
const client = join(web, "..", "clients", "js");
const [, , ...words] = process.argv;
const dist = words.includes("--dist")
  ? resolve(words[words.indexOf("--dist") + 1])
  : join(client, "dist");

const common = {
  absWorkingDir: client,
  bundle: true,
  format: "esm",
  target: ["es2022", "chrome105", "firefox104", "safari16.4"],
  logLevel: "warning",
};

// Declarations are found by Node's rules only if imports name whole files.
async function completeImports(folder) {
  for (const name of await readdir(folder, { recursive: true })) {
    if (!name.endsWith(".d.ts")) continue;
    const path = join(folder, name);
    const text = await readFile(path, "utf8");
    await writeFile(path, text.replace(/(from "|import\(")(\.[^"]*)"/g, '$1$2.js"'));
  }
}

installModules();
const { build } = await import("esbuild");
const { generateTypes } = await import("./types.mjs");
await rm(dist, { recursive: true, force: true });
await generateTypes();
await build({
  ...common,
  entryPoints: ["index", "parts", "element"].map((name) => `src/${name}.ts`),
  splitting: true,
  chunkNames: "chunks/[name]-[hash]",
  outdir: dist,
});
await build({
  ...common,
  entryPoints: ["src/element.ts"],
  minify: true,
  outfile: join(dist, "windsplat-view.min.js"),
});
if (!words.includes("--no-types")) {
  const compiler = join(web, "node_modules", "typescript", "bin", "tsc");
  const options = ["--noEmit", "false", "--declaration", "--emitDeclarationOnly"];
  const types = join(dist, "types");
  execFileSync(process.execPath, [compiler, "-p", client, ...options, "--outDir", types], {
    stdio: "inherit",
  });
  await completeImports(types);
}
if (dist === join(client, "dist")) {
  await copyFile(join(web, "..", "LICENSE"), join(client, "LICENSE"));
}
