// src/ -> dist/: one script, one style sheet and the icon under names that carry their content's
// hash, and the index.html that names them; beside each of them NAME.gz, as it is sent.
// Usage: node scripts/build.mjs [--outdir DIR] [--quiet]
import { mkdir, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { createHash } from "node:crypto";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipAsync } from "@gfx/zopfli";
import { build } from "esbuild";
import { minify } from "terser";
import { leanScript, leanStyle } from "./lean_gui.mjs";
import { withMarkedPrivates } from "./private_names.mjs";
import { generateTypes } from "./types.mjs";

const web = join(dirname(fileURLToPath(import.meta.url)), "..");
const gzipBytesMax = 150_000;

function option(name, fallback) {
  const at = process.argv.indexOf(name);
  return at < 0 ? fallback : process.argv[at + 1];
}

const leanGui = {
  name: "lean-gui",
  setup(setup) {
    const lean = (filter, loader, make) =>
      setup.onLoad({ filter }, async ({ path }) => ({
        contents: make(await readFile(path, "utf8"), path),
        loader,
      }));
    lean(/lil-gui\.esm\.js$/, "js", leanScript);
    lean(/lil-gui\.css$/, "css", leanStyle);
  },
};

// The sources with private names marked, for the bundler to shorten.
const shortPrivates = {
  name: "short-privates",
  setup(setup) {
    let texts;
    setup.onLoad({ filter: /\/src\/[^/]+\.ts$/ }, ({ path }) => {
      texts ??= withMarkedPrivates(join(web, "src/main.ts"));
      return { contents: texts.get(path), loader: "js" };
    });
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
    mangleProps: /^[_$][a-z]/i, // the names marked so, and what lil-gui calls its own parts
    plugins: [leanGui, shortPrivates],
  });
  return Buffer.from(result.outputFiles[0].contents);
}

// The bundler's own minifier leaves some per cent that a second look finds. What that one would put
// in another's place, or turn round, only looks shorter: packed it is longer.
async function script(entry) {
  const bundled = (await bundle(entry)).toString();
  const { code } = await minify(bundled, {
    module: true,
    ecma: 2020,
    compress: {
      unsafe_arrows: true,
      passes: 2,
      inline: 1,
      reduce_funcs: false,
      lhs_constants: false,
    },
  });
  return Buffer.from(code);
}

// Gzip as small as it gets; the same bytes for the same content.
const pack = async (content) => Buffer.from(await gzipAsync(content, { numiterations: 60 }));

function hashed(stem, extension, content) {
  const hash = createHash("sha256").update(content).digest("hex").slice(0, 10);
  return `${stem}-${hash}.${extension}`;
}

async function main() {
  const outdir = resolve(option("--outdir", join(web, "dist")));
  await generateTypes();
  const program = await script("src/main.ts");
  const style = await bundle("src/bundle.css");
  const icon = await readFile(join(web, "src/icon.svg"));
  const names = {
    SCRIPT: hashed("app", "js", program),
    STYLE: hashed("app", "css", style),
    ICON: hashed("icon", "svg", icon),
  };
  const page = (await readFile(join(web, "index.html"), "utf8"))
    .replace(/%(SCRIPT|STYLE|ICON)%/g, (_, key) => names[key])
    .replace(/\s+/g, " "); // the page shows no run of spaces anywhere
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
    const packed = await pack(content);
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
