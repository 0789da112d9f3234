// protocol/*.schema.json -> clients/js/src/generated/*.ts and web/generated/study.ts, so that the
// schemas define the types of the client and of the report. The files are not committed; every
// build and test generates them.
import { mkdir, readFile, rename, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { compile } from "json-schema-to-typescript";

const web = join(dirname(fileURLToPath(import.meta.url)), "..");
const protocol = join(web, "..", "protocol");
const client = join(web, "..", "clients", "js", "src", "generated");
const schemas = { view: client, messages: client, study: join(web, "generated") };

// json-schema-to-typescript reads drafts before 2020-12, which define tuples by `items` and not by
// `prefixItems`.
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

// The limits of numeric keys: pointer without array indices -> least and greatest value.
function collectRanges(node, pointer, ranges) {
  for (const [key, child] of Object.entries(node.properties ?? {})) {
    const at = `${pointer}/${key}`;
    const { minimum, maximum } = child;
    if (minimum !== undefined && maximum !== undefined) ranges[at] = [minimum, maximum];
    collectRanges(child, at, ranges);
    if (child.items && !Array.isArray(child.items)) collectRanges(child.items, at, ranges);
  }
  return ranges;
}

async function generateRanges() {
  const schema = JSON.parse(await readFile(join(protocol, "view.schema.json"), "utf8"));
  const ranges = JSON.stringify(collectRanges(schema, "", {}), null, 1);
  const text = `// Made from protocol/view.schema.json by web/scripts/types.mjs.
export const viewRanges: Readonly<Record<string, readonly [number, number]>> = ${ranges};
`;
  await writeIfChanged(join(client, "view_ranges.ts"), text);
}

// A sample value of the schema's shape: objects with their required keys, lists of variable length
// with one element.
function sampleOf(schema) {
  const type = [schema.type ?? "string"].flat()[0]; // enumerations are of strings
  if (type === "object") {
    const needed = schema.required ?? [];
    return Object.fromEntries(needed.map((key) => [key, sampleOf(schema.properties[key])]));
  }
  if (type === "array") {
    const { minItems, maxItems } = schema;
    return Array(minItems === maxItems ? minItems : 1).fill(sampleOf(schema.items));
  }
  return { string: "", boolean: false, number: 0, integer: 0 }[type];
}

// Key -> sample, for keys without a numeric range except booleans; a key means the same wherever it
// occurs in a view.
function collectKeys(schema, keys) {
  for (const [key, child] of Object.entries(schema.properties ?? {})) {
    const sample = sampleOf(child);
    if (key in keys && JSON.stringify(keys[key]) !== JSON.stringify(sample)) {
      throw new Error(`the view's schema has two kinds of "${key}"`);
    }
    keys[key] = sample;
    collectKeys(child, keys);
    if (child.items) collectKeys(child.items, keys);
  }
  return keys;
}

async function generateKeys() {
  const schema = JSON.parse(await readFile(join(protocol, "view.schema.json"), "utf8"));
  const entries = Object.entries(collectKeys(schema, {}))
    .filter(([, sample]) => !["0", "{}", "false"].includes(JSON.stringify(sample)))
    .map(([key, sample]) => [JSON.stringify(sample), key]);
  entries.sort(); // sorted, so that the file compresses better
  const lines = entries.map(([sample, key]) => `  ${key}: ${sample},\n`).join("");
  const text = `// Made from protocol/view.schema.json by web/scripts/types.mjs.
export const viewKeys: Readonly<Record<string, unknown>> = {\n${lines}};
`;
  await writeIfChanged(join(client, "view_keys.ts"), text);
}

// Answers of REST that no message of the stream contains.
const answers = ["animation", "animationRequest", "colorMaps", "fieldRange", "folder", "forecast"];
answers.push("frameInfo", "histogram");
answers.push("job", "jobs", "pick", "presets", "probe", "savedView", "series", "service");
answers.push("upload", "values");

async function generateAnswers() {
  const schema = JSON.parse(await readFile(join(protocol, "messages.schema.json"), "utf8"));
  const properties = Object.fromEntries(answers.map((name) => [name, { $ref: `#/$defs/${name}` }]));
  const { $id, $defs } = schema;
  await writeTypes(client, "answers", "messages", {
    ...{ $id, $defs, title: "Answers", type: "object", additionalProperties: false, properties },
  });
}

async function writeTypes(folder, name, from, schema) {
  const text = await compile(toOlderDraft(schema), schema.title, {
    cwd: protocol,
    bannerComment: `// Made from protocol/${from}.schema.json by web/scripts/types.mjs.`,
    unreachableDefinitions: name === from,
    format: false,
    maxItems: 3,
  });
  await writeIfChanged(join(folder, `${name}.ts`), text);
}

export async function generateTypes() {
  for (const folder of Object.values(schemas)) await mkdir(folder, { recursive: true });
  await generateRanges();
  await generateKeys();
  await generateAnswers();
  for (const [name, folder] of Object.entries(schemas)) {
    const path = join(protocol, `${name}.schema.json`);
    await writeTypes(folder, name, name, JSON.parse(await readFile(path, "utf8")));
  }
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) await generateTypes();
