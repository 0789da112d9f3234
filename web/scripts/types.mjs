// protocol/*.schema.json -> web/generated/*.ts: the page's types are the wire's, never written
// twice. The files are not committed; every build and test makes them anew.
import { mkdir, readFile, rename, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { compile } from "json-schema-to-typescript";

const web = join(dirname(fileURLToPath(import.meta.url)), "..");
const protocol = join(web, "..", "protocol");
const schemas = ["view", "messages"];

// json-schema-to-typescript reads drafts before 2020-12: tuples by `items`, no `prefixItems`.
function toOlderDraft(node) {
  if (Array.isArray(node)) return node.map(toOlderDraft);
  if (node === null || typeof node !== "object") return node;
  const copy = Object.fromEntries(
    Object.entries(node).map(([key, value]) => [key, toOlderDraft(value)]),
  );
  if (copy.prefixItems) {
    copy.items = copy.prefixItems;
    delete copy.prefixItems;
  }
  delete copy.$schema;
  return copy;
}

async function writeIfChanged(path, text) {
  const old = await readFile(path, "utf8").catch(() => "");
  if (old === text) return;
  const temporary = `${path}.${process.pid}`;
  await writeFile(temporary, text);
  await rename(temporary, path);
}

// What the panels say about a key: pointer without array indices -> description and range.
function collectHelp(node, pointer, help) {
  for (const [key, child] of Object.entries(node.properties ?? {})) {
    const at = `${pointer}/${key}`;
    if (child.type !== "object") {
      help[at] = { text: child.description, min: child.minimum, max: child.maximum };
    }
    collectHelp(child, at, help);
    if (child.items && !Array.isArray(child.items)) collectHelp(child.items, at, help);
  }
  return help;
}

async function generateHelp(outDir) {
  const schema = JSON.parse(await readFile(join(protocol, "view.schema.json"), "utf8"));
  const help = collectHelp(schema, "", {});
  const text = `// Made from protocol/view.schema.json by web/scripts/types.mjs.
export interface KeyHelp { text: string; min?: number; max?: number }
export const viewHelp: Readonly<Record<string, KeyHelp>> = ${JSON.stringify(help, null, 1)};
`;
  await writeIfChanged(join(outDir, "view_help.ts"), text);
}

export async function generateTypes(outDir = join(web, "generated")) {
  await mkdir(outDir, { recursive: true });
  await generateHelp(outDir);
  for (const name of schemas) {
    const path = join(protocol, `${name}.schema.json`);
    const schema = toOlderDraft(JSON.parse(await readFile(path, "utf8")));
    const text = await compile(schema, schema.title, {
      cwd: protocol,
      bannerComment: `// Made from protocol/${name}.schema.json by web/scripts/types.mjs.`,
      unreachableDefinitions: true,
      format: false,
      maxItems: 3,
    });
    await writeIfChanged(join(outDir, `${name}.ts`), text);
  }
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) await generateTypes();
