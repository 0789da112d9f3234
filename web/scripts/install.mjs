// package-lock.json -> node_modules, only if they do not match. Requires only node itself.
// Usage: node install.mjs [FOLDER]       default: web
// If several builds start at once, one installs and the others wait for it.
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync, readFileSync, rmSync, statSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const web = join(dirname(fileURLToPath(import.meta.url)), "..");
const patienceMs = 5 * 60_000;

const textOf = (path) => {
  try {
    return readFileSync(path, "utf8");
  } catch {
    return null;
  }
};

const sleep = (ms) => Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, ms);

function withLock(path, run) {
  const until = Date.now() + patienceMs;
  for (;;) {
    try {
      mkdirSync(path);
      break;
    } catch (error) {
      if (error.code !== "EEXIST") throw error;
    }
    const made = statSync(path, { throwIfNoEntry: false })?.mtimeMs ?? Date.now();
    if (Date.now() - made > patienceMs) rmSync(path, { recursive: true, force: true });
    if (Date.now() > until) throw new Error(`waited too long for another build; remove ${path}`);
    sleep(200);
  }
  try {
    return run();
  } finally {
    rmSync(path, { recursive: true, force: true });
  }
}

export function installModules(folder = web) {
  const lock = join(folder, "package-lock.json");
  // A copy of the lock file from which the modules were installed.
  const installed = join(folder, "node_modules", ".installed-lock");
  const fits = () => textOf(installed) === textOf(lock);
  if (fits()) return;
  withLock(join(folder, ".install-lock"), () => {
    if (fits()) return;
    try {
      execFileSync("npm", ["ci", "--no-audit", "--no-fund", "--loglevel=error"], {
        cwd: folder,
        stdio: ["ignore", "pipe", "pipe"],
        encoding: "utf8",
      });
    } catch (error) {
      throw new Error(`npm ci failed in ${folder}:\n${error.stderr ?? error.message}`);
    }
    copyFileSync(lock, installed);
  });
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) installModules(process.argv[2]);
