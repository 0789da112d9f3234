// Keys of the view in the words of the page: the pointers of the server's messages -> the labels of
// the controls. Panels tell the labels as they are built; other keys get their own names as words.

const labels = new Map<string, string>(); // pointer without array indices -> label

const titles = new Map<string, string>(); // of folders that are named for the data

const parts: Readonly<Record<string, string>> = {
  dataset: "Dataset",
  step: "Time step",
  camera: "Camera",
  image: "Picture",
  geometry: "Place",
  ground: "Ground",
  vector: "Lines",
  scalars: "Volumes",
  depthCue: "Depth cue",
  difference: "Difference",
  method: "Method",
  quality: "Quality",
  annotations: "Axes and labels",
  region: "Region",
  light: "Light",
  surfaces: "Surfaces",
};

// Names that tell too little as words.
const names: Readonly<Record<string, string>> = {
  r1: "radius at the tail",
  r2: "radius at the head",
  fovY: "angle of view",
  stepTime: "time",
  minMagnitude: "smallest magnitude",
  minOpticalDepth: "smallest optical depth",
  up: "direction upward",
};

// "magnitudeRange" -> "magnitude range"
const wordsOf = (key: string): string =>
  names[key] ?? key.replace(/[A-Z]/g, (letter) => ` ${letter.toLowerCase()}`);

const isIndex = (key: string): boolean => /^\d+$/.test(key);

// The name of a control for a range ends with the end that it sets and a unit.
const ownLabel = (label: string): string =>
  label.replace(/ \([^()]*\)$/, "").replace(/ (from|to)$/, "");

// The first control of a key names it.
export function nameKey(pointer: string, label: string): void {
  if (!labels.has(pointer)) labels.set(pointer, ownLabel(label));
}

const ordinals = ["first", "second", "third", "fourth"];

// "5th", "21st"; of the counted place from 1.
function ordinal(place: number): string {
  const word = ordinals[place - 1];
  if (word !== undefined) return word;
  const teen = Math.floor(place / 10) % 10 === 1;
  return `${place}${(teen ? undefined : ["th", "st", "nd", "rd"][place % 10]) ?? "th"}`;
}

// The panel's folders of vectors and volumes are titled for the data.
export function namePart(key: "vector" | "scalars", title: string): void {
  titles.set(key, title);
}

// "/vector/stride" -> "Lines, sampling stride"; "/scalars/1/stride" -> "Volumes (second), sampling
// stride". null: not a key of the view.
export function keyName(pointer: string): string | null {
  const keys = pointer.split("/").slice(1);
  const part = titles.get(keys[0] ?? "") ?? parts[keys[0] ?? ""];
  if (part === undefined) return null;
  const at = Number(keys[1]);
  const which = keys[1] !== undefined && isIndex(keys[1]) ? ordinal(at + 1) : "";
  const place = which === "" ? part : `${part} (${which})`;
  const inner = keys.slice(1).filter((key) => !isIndex(key));
  if (inner.length === 0) return place;
  for (let n = inner.length; n > 0; n--) {
    const label = labels.get(`/${[keys[0], ...inner.slice(0, n)].join("/")}`);
    if (label !== undefined) return [place, label, ...inner.slice(n).map(wordsOf)].join(", ");
  }
  return [place, ...inner.map(wordsOf)].join(", ");
}

const named = (pointer: string, asWritten: string): string => {
  const name = keyName(pointer);
  return name === null ? asWritten : `“${name}”`;
};

// Whether a dotted word is a key, not a file such as surfaces.nc: a control sets it, or the schema
// of the view describes it.
const schemaKeys = new Set<string>(); // pointers without array indices
const isKey = (pointer: string): boolean => labels.has(pointer) || schemaKeys.has(pointer);

export function learnKeys(pointers: Iterable<string>): void {
  for (const pointer of pointers) schemaKeys.add(pointer);
}

// Names in quotes are those of fields and files.
const quoted = /("[^"]*"|“[^”]*”|'[^']*'(?!\w))/;

// A text of the server with the keys in it by their names: "/geometry/slice" and "geometry.slice".
const withNames = (text: string): string =>
  text
    .split(quoted)
    .map((piece, n) => (n % 2 === 1 ? piece : withNamesUnquoted(piece)))
    .join("");

const withNamesUnquoted = (text: string): string =>
  text
    .replace(/(?<![\w/.])(?:\/[A-Za-z0-9]+)+/g, (pointer) => named(pointer, pointer))
    .replace(/(?<![\w/.])[a-z][A-Za-z]*(?:\.[a-z][A-Za-z0-9]*)+(?![\w/])/g, (dotted) => {
      const pointer = `/${dotted.replaceAll(".", "/")}`;
      return isKey(pointer) ? named(pointer, dotted) : dotted;
    });

// What the server's texts say about JSON, as people say it.
const plain: readonly [RegExp, string][] = [
  [/\bmust ascend by at least\b/g, "the second value must exceed the first by at least"],
  [/, not an? (?:object|array|string)\b.*$/, ""],
  [/(\bunknown key; did you mean '[^']*'\?) Known keys: .*$/, "$1"],
  [/\bunknown key(; known keys: .*)?/, "is not known to this server"],
  [/\bset one to null\b/g, "switch one off"],
  [/\bthe mapping flat\b/g, "the shape “flat”"],
  [/\bheightField\b/g, "a height field"],
];

// One entry of a problem's `errors`.
export function entryText(pointer: string, detail: string): string {
  const text = plain.reduce((out, [what, by]) => out.replace(what, by), withNames(detail));
  if (pointer === "") return text;
  const name = keyName(pointer);
  const last = pointer.split("/").at(-1) ?? "";
  const subject = name ?? wordsOf(isIndex(last) ? (pointer.split("/").at(-2) ?? "") : last);
  return `${subject}: ${text}`;
}
