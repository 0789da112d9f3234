// What `npm pack` makes: its list of files, its types, its use in Node and in a page, and the
// examples of docs/user/javascript.md, which are run as they are written.
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { Daemon, freePort, launch, openPage, shot } from "../support.mjs";

const root = fileURLToPath(new URL("../../..", import.meta.url));
const example = "http://127.0.0.1:8080/";
const guide = readFileSync(join(root, "docs/user/javascript.md"), "utf8");
const blocks = (kind) => [...guide.matchAll(/```(\w+)\n(.*?)```/gs)].filter(([, k]) => k === kind);
let folder, packed, daemon, browser;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "windsplat-package-"));
  const options = { cwd: join(root, "clients/js"), encoding: "utf8" };
  const pack = ["pack", "--json", "--loglevel=error", "--pack-destination", folder];
  const told = execFileSync("npm", pack, { ...options, stdio: ["ignore", "pipe", "inherit"] });
  [packed] = JSON.parse(told.slice(told.indexOf("[")));
  const modules = join(folder, "node_modules/@windsplat");
  mkdirSync(modules, { recursive: true });
  execFileSync("tar", ["-xzf", join(folder, packed.filename), "-C", modules]);
  execFileSync("mv", [join(modules, "package"), join(modules, "client")]);
  browser = await launch();
  daemon = new Daemon(await freePort());
});

after(async () => {
  await browser?.close();
  await daemon?.kill();
  rmSync(folder, { recursive: true, force: true });
});

const inPackage = (name) => join(folder, "node_modules/@windsplat/client", name);

// Starts the daemon for pages of this origin.
async function serve(origin) {
  await daemon.kill();
  await daemon.start("tornado", ...(origin === undefined ? [] : ["--allow-origin", origin]));
}

// Runs a module in the folder of the package's user; returns what it prints.
function run(code, ...options) {
  const path = join(folder, "example.mjs");
  writeFileSync(path, code.replaceAll(example, daemon.url));
  const { status, stdout, stderr } = spawnSync(process.execPath, [...options, path], {
    cwd: folder,
    encoding: "utf8",
    timeout: 60_000,
  });
  assert.equal(status, 0, stderr);
  return stdout;
}

test("the package holds modules, types, a README and the licence, and nothing else", () => {
  const names = packed.files.map(({ path }) => path);
  const needed = ["index.js", "parts.js", "element.js", "windsplat-view.min.js"];
  for (const name of ["README.md", "LICENSE", "package.json", ...needed.map((n) => `dist/${n}`)]) {
    assert.ok(names.includes(name), name);
  }
  for (const name of ["index", "parts", "element"]) {
    assert.ok(names.includes(`dist/types/${name}.d.ts`), name);
  }
  const parts = [
    "(\\w+|windsplat-view\\.min)\\.js",
    "chunks/[\\w-]+\\.js",
    "types/[\\w/]+\\.d\\.ts",
  ];
  const known = new RegExp(`^(README.md|LICENSE|package.json|dist/(${parts.join("|")}))$`);
  assert.deepEqual(
    names.filter((name) => !known.test(name)),
    [],
  );
  const told = JSON.parse(readFileSync(inPackage("package.json"), "utf8"));
  assert.equal(told.dependencies, undefined);
  const cmake = readFileSync(join(root, "CMakeLists.txt"), "utf8");
  assert.equal(told.version, /project\(windsplat VERSION ([\d.]+)/.exec(cmake)[1]);
});

const typed = `import { Client, type View, ProblemError } from "@windsplat/client";
import type { WindsplatProperties, WindsplatView } from "@windsplat/client/element";
import "@windsplat/client/windsplat-view.min.js";
import { Viewport } from "@windsplat/client/parts";
import data from "@windsplat/client/package.json" with { type: "json" };
const view: View = { dataset: "a", vector: { stride: 2 } };
// @ts-expect-error a stride is a number
const wrong: View = { vector: { stride: "2" } };
const server = new Client("http://a/", { token: "t" });
export const status = (e: unknown): number => (e instanceof ProblemError ? e.status : 0);
export const times = async (): Promise<string[]> =>
  (await server.describe("a")).steps.times.map(({ text }) => text);
export const picked = (element: WindsplatView): void =>
  element.addEventListener("windsplat-pick", ({ detail }) => detail.feature?.position.x.toFixed());
document.addEventListener("windsplat-error", ({ detail }) => detail.message.trim());
document.createElement("windsplat-view").view = view;
export const jsx: WindsplatProperties = {
  view,
  pick: true,
  "onwindsplat-frame": ({ detail }) => void detail.header.seq,
};
// @ts-expect-error a step is a number
jsx.step = "1";
server.stream(view, { frame: ({ header }) => void header.final });
export { data, wrong, Viewport };
`;

for (const rules of [
  "--module nodenext",
  "--module node18",
  "--module esnext --moduleResolution bundler",
]) {
  test(`its types are those of the schemas, with ${rules}`, () => {
    writeFileSync(join(folder, "user.mts"), typed);
    const compiler = join(root, "web/node_modules/typescript/bin/tsc");
    const strict = "--noEmit --strict --exactOptionalPropertyTypes --resolveJsonModule";
    const lib = "--target es2022 --lib es2023,dom,dom.iterable";
    const { status, stdout } = spawnSync(
      process.execPath,
      [compiler, ...`${strict} ${lib} ${rules}`.split(" "), "user.mts"],
      { cwd: folder, encoding: "utf8" },
    );
    assert.equal(status, 0, stdout);
  });
}

test("servers that render pages may import all of it", async () => {
  const told = run(`for (const part of ["", "/parts", "/element", "/windsplat-view.min.js"]) {
  const names = Object.keys(await import("@windsplat/client" + part));
  console.log(names.includes(part.includes("e") ? "WindsplatView" : part ? "Viewport" : "Client"));
}
console.log(globalThis.customElements, globalThis.window);
`);
  assert.equal(told, "true\ntrue\ntrue\ntrue\nundefined undefined\n");
});

test("the examples for programs run in Node as they are written", async () => {
  await serve();
  symlinkSync(
    createRequire(import.meta.url).resolve("playwright-core/lib/utilsBundle"),
    join(folder, "ws.cjs"),
  );
  const [program, passed] = blocks("js").map(([, , code]) => code);
  const socket = `import bundle from "./ws.cjs";\nconst WebSocket = bundle.ws;\n`;
  const [major] = process.versions.node.split(".").map(Number);
  // Node before 22 has no WebSocket of its own, or behind an option.
  const own = process.allowedNodeEnvironmentFlags.has("--experimental-websocket");
  const flags = major < 22 && own ? ["--experimental-websocket"] : [];
  const code =
    major >= 22 || own ? program : `${socket}globalThis.WebSocket = WebSocket;\n${program}`;
  const told = run(code, ...flags);
  assert.match(told, /^tornado /m);
  assert.match(told, /^422 \/vector\/stride$/m);
  assert.ok((told.match(/final: true/g) ?? []).length >= 2, told);
  assert.deepEqual([...readFileSync(join(folder, "tornado.jpg")).subarray(0, 2)], [0xff, 0xd8]);
  assert.equal(run(passed.replace('import WebSocket from "ws";\n', socket)).trim(), "160 100");
});

test("a program learns that there is no WebSocket, no server, and no such dataset", async () => {
  await serve();
  const told = run(`import { Client } from "@windsplat/client";
import bundle from "./ws.cjs";
const server = new Client("${example}");
delete globalThis.WebSocket;
try { server.stream({}); } catch (error) { console.log(error.message); }
const options = { webSocket: bundle.ws };
const nobody = new Client("http://127.0.0.1:9/", options).stream({});
console.log((await nobody.final().catch((error) => error)).message);
nobody.close();
const stream = new Client("${example}", options).stream({ dataset: "gone" });
console.log((await stream.final().catch((error) => error)).problem.status);
stream.replace({ dataset: "tornado", image: { width: 64, height: 48 } });
console.log((await stream.final()).header.width);
stream.close();
`);
  const lines = told.trim().split("\n");
  assert.match(lines[0], /^no WebSocket here.*new Client\(url, { webSocket }\)$/);
  assert.deepEqual(lines.slice(1), ["no answer from the server", "404", "64"]);
});

test("the example for pages works with the one-file element by a script tag", async (t) => {
  const [[, , page]] = blocks("html");
  const site = createServer((request, response) => {
    const script = request.url.endsWith(".js");
    response.setHeader("Content-Type", script ? "text/javascript" : "text/html");
    response.end(
      script
        ? readFileSync(inPackage("dist/windsplat-view.min.js"))
        : page.replaceAll(example, daemon.url),
    );
  });
  await new Promise((listens) => site.listen(0, "127.0.0.1", listens));
  t.after(() => {
    site.close();
    site.closeAllConnections();
  });
  const origin = `http://127.0.0.1:${site.address().port}`;
  await serve(origin);
  const opened = await openPage(browser, `${origin}/page.html`, {
    viewport: { width: 640, height: 480 },
  });
  t.after(() => opened.context().close());
  const header = await opened.evaluate(() => document.querySelector("#storm").final());
  assert.ok(header.final);
  const { x, y } = await opened.locator("#storm").boundingBox();
  await opened.mouse.move(x + 200, y + 150);
  await opened.mouse.down();
  await opened.mouse.move(x + 260, y + 150, { steps: 4 });
  await opened.mouse.up();
  await opened.waitForFunction(() => /^eye at -?\d/.test(document.querySelector("#where").value));
  await shot(opened, "javascript-example");
});
