// report/ -> the page of a study report as one file: style sheet, script and the licences of the
// bundled modules; the program replaces %STUDY% with the JSON of a study.
// Usage: node scripts/report.mjs FILE
import { readdirSync, readFileSync } from "node:fs";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { generateTypes } from "./types.mjs";

const web = join(dirname(fileURLToPath(import.meta.url)), "..");
const bytesMax = 500_000;

async function bundle(entry) {
  const { outputFiles, metafile } = await build({
    absWorkingDir: web,
    entryPoints: [entry],
    bundle: true,
    minify: true,
    write: false,
    metafile: true,
    format: "iife",
    charset: "utf8",
    target: ["es2022", "chrome105", "firefox104", "safari16"],
    legalComments: "none",
    logLevel: "warning",
    outdir: "out",
  });
  const used = Object.values(metafile.outputs).flatMap(({ inputs }) =>
    Object.entries(inputs).filter(([, { bytesInOutput }]) => bytesInOutput > 0),
  );
  const modules = used.map(([path]) => /^node_modules\/(?:@[^/]+\/)?[^/]+/.exec(path)?.[0]);
  return { code: outputFiles[0].text.trim(), modules: modules.filter(Boolean) };
}

// Modules with the same licence text are listed together.
function licences(modules) {
  const namesByText = new Map();
  for (const module of [...new Set(modules)].sort()) {
    const folder = join(web, module);
    const { name, version } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
    const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
    if (file === undefined) throw new Error(`${name} has no licence file`);
    const text = readFileSync(join(folder, file), "utf8").trim();
    namesByText.set(text, [...(namesByText.get(text) ?? []), `${name} ${version}`]);
  }
  return [...namesByText].map(([text, names]) => `${names.join(", ")}:\n${text}`).join("\n\n");
}

async function main(file) {
  await generateTypes();
  const script = await bundle("report/main.ts");
  const style = await bundle("report/report.css");
  const parts = {
    STYLE: style.code,
    SCRIPT: `/* This report contains:\n\n${licences(script.modules)}\n*/\n${script.code}`,
  };
  for (const [name, text] of Object.entries(parts)) {
    if (/<\/(script|style)|<!--/i.test(text)) throw new Error(`${name} would end its element`);
  }
  const page = (await readFile(join(web, "report/report.html"), "utf8")).replace(
    /\s*%(STYLE|SCRIPT|STUDY)%\s*/g,
    (_, name) => parts[name] ?? `%${name}%`,
  );
  const bytes = Buffer.byteLength(page);
  if (bytes > bytesMax) throw new Error(`the report is ${bytes} B without data, over ${bytesMax}`);
  await mkdir(dirname(file), { recursive: true });
  await writeFile(file, page);
}

await main(resolve(process.argv[2]));
