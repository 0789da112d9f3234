// src/ -> dist/: one script, one style sheet and the icon with content hashes in their names, the
// index.html that refers to them, and a gzipped NAME.gz of each file.
// Usage: node scripts/build.mjs [--outdir DIR] [--quiet]
import { mkdir, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { createHash } from "node:crypto";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";
import { generateTypes } from "./types.mjs";

const web = join(dirname(fileURLToPath(import.meta.url)), "..");
const gzipBytesMax = 150_000;

function option(name, fallback) {
  const at = process.argv.indexOf(name);
  return at < 0 ? fallback : process.argv[at + 1];
}

// lil-gui's icon font is a data: URL, which the content security policy forbids; browsers check
// that URL even if no text uses the font. src/styles/panel.css draws the icons with the page's
// fonts.
const withoutIconFont = {
  name: "without-icon-font",
  setup(setup) {
    setup.onResolve({ filter: /^data:application\/font-woff2/ }, () => ({
      path: "icon-font",
      namespace: "empty",
    }));
    setup.onLoad({ filter: /^icon-font$/, namespace: "empty" }, () => ({
      contents: "",
      loader: "empty",
    }));
  },
};

async function bundle(entry) {
  const result = await build({
    entryPoints: [join(web, entry)],
    bundle: true,
    minify: true,
    write: false,
    format: "esm",
    target: ["es2022", "chrome105", "firefox104", "safari16"],
    legalComments: "none",
    logLevel: "warning",
    outdir: "out",
    plugins: [withoutIconFont],
  });
  return Buffer.from(result.outputFiles[0].contents);
}

function hashed(stem, extension, content) {
  const hash = createHash("sha256").update(content).digest("hex").slice(0, 10);
  return `${stem}-${hash}.${extension}`;
}

async function main() {
  const outdir = resolve(option("--outdir", join(web, "dist")));
  await generateTypes();
  const program = await bundle("src/app/main.ts");
  const style = await bundle("src/styles/bundle.css");
  const icon = await readFile(join(web, "src/styles/icon.svg"));
  const names = {
    SCRIPT: hashed("app", "js", program),
    STYLE: hashed("app", "css", style),
    ICON: hashed("icon", "svg", icon),
  };
  const page = (await readFile(join(web, "index.html"), "utf8"))
    .replace(/%(SCRIPT|STYLE|ICON)%/g, (_, key) => names[key])
    .replace(/\s+/g, " "); // no text of the page needs consecutive spaces
  const files = [
    ["index.html", Buffer.from(page)],
    [names.SCRIPT, program],
    [names.STYLE, style],
    [names.ICON, icon],
  ];
  await mkdir(outdir, { recursive: true });
  for (const old of await readdir(outdir)) await rm(join(outdir, old));
  let total = 0;
  for (const [name, content] of files) {
    await writeFile(join(outdir, name), content);
    const packed = gzipSync(content, { level: 9 });
    await writeFile(join(outdir, `${name}.gz`), packed);
    total += packed.length;
    if (!process.argv.includes("--quiet")) {
      console.log(`${String(packed.length).padStart(7)}  ${name}`);
    }
  }
  if (!process.argv.includes("--quiet")) console.log(`${String(total).padStart(7)}  gzipped bytes`);
  if (total > gzipBytesMax) {
    console.error(`the page is ${total} B gzipped, over ${gzipBytesMax}`);
    process.exitCode = 1;
  }
}

await main();
