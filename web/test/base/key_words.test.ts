// The server's messages in the words of the page.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";
import { entryText, keyName, learnKeys, nameKey, namePart } from "../../src/base/key_words";
import { problemText } from "../../src/base/problem_text";

interface Schema {
  properties?: Record<string, Schema>;
  items?: Schema | boolean;
}

function pointersOf(node: Schema, at: string, found: string[] = []): string[] {
  for (const [key, child] of Object.entries(node.properties ?? {})) {
    found.push(`${at}/${key}`);
    pointersOf(child, `${at}/${key}`, found);
    if (typeof child.items === "object") pointersOf(child.items, `${at}/${key}/0`, found);
  }
  return found;
}

test("every key of the view has a name in plain words", () => {
  const schema = JSON.parse(readFileSync("../protocol/view.schema.json", "utf8")) as Schema;
  const pointers = pointersOf(schema, "");
  assert.ok(pointers.length > 100);
  learnKeys(pointers);
  for (const pointer of pointers) {
    const name = keyName(pointer);
    assert.ok(name !== null, `${pointer} has a name`);
    assert.doesNotMatch(name, /\/|[a-z][A-Z]|\br\d|\d/, pointer);
  }
});

test("a message names the control by its label", () => {
  nameKey("/vector/stride", "sampling stride");
  nameKey("/region/x", "longitude from (°E)");
  nameKey("/region/x", "longitude to (°E)");
  const limit = "must be a whole number from 1 to 64, not 100";
  assert.equal(entryText("/vector/stride", limit), `Lines, sampling stride: ${limit}`);
  assert.equal(keyName("/region/x/0"), "Region, longitude");
  const problem = { errors: [{ pointer: "/region/x", detail: "both ends are equal" }] };
  assert.equal(
    problemText({ title: "", detail: "", status: 422, ...problem } as never),
    "Region, longitude: both ends are equal",
  );
});

test("keys within a text are named too, other words with dots and slashes stay", () => {
  assert.equal(
    entryText("/geometry/plane", "is not available with heightField: use geometry.slice"),
    "Place, plane: is not available with a height field: use “Place, slice”",
  );
  assert.equal(
    entryText("/geometry", "a view has a slice or a plane, not both: set one to null"),
    "Place: a view has a slice or a plane, not both: switch one off",
  );
  assert.equal(entryText("", "see /vector/r1"), "see “Lines, radius at the tail”");
  for (const text of [
    "/data/winds.nc is no file",
    "winds.nc has 12.5 MB",
    "surfaces.nc is empty",
    "https://a.example/x",
    '"geometry.slice" is no field',
  ]) {
    assert.equal(entryText("", text), text);
  }
});

test("keys that are none of the view are shown by their last word", () => {
  assert.equal(entryText("/jobName", "is unknown"), "job name: is unknown");
});

test("the type that JSON expects is left out where no control can send it", () => {
  assert.equal(
    entryText("/annotations/title", "must be true or false, not an object"),
    "Axes and labels, title: must be true or false",
  );
});

test("what the server says of its documents is said as people say it", () => {
  const range = entryText("/vector/magnitudeRange", "must ascend by at least 1e-6");
  assert.match(range, /: the second value must exceed the first by at least 1e-6$/);
  const slice = entryText("/geometry/slice", "requires the mapping flat: use geometry.slice");
  assert.match(slice, /requires the shape “flat”: use “Place, /);
  const unknown = entryText("/vector/glow", "unknown key; known keys: color, field, length");
  assert.match(unknown, /: is not known to this server$/);
  const misspelt = entryText(
    "/vector/colour",
    "unknown key; did you mean 'color'? Known keys: color, field, length",
  );
  assert.match(misspelt, /: is not known to this server; did you mean 'color'\?$/);
});

test("repeated parts have ordinals: words up to the fourth, then numbers", () => {
  const names = [0, 3, 4, 10, 20, 21, 22, 110].map((at) => keyName(`/surfaces/${at}`));
  const counted = ["first", "fourth", "5th", "11th", "21st", "22nd", "23rd", "111th"];
  assert.deepEqual(
    names,
    counted.map((word) => `Surfaces (${word})`),
  );
});

test("parts that are named for the data have the title of their folder", () => {
  namePart("vector", "Winds");
  assert.equal(keyName("/vector/opacity"), "Winds, opacity");
  namePart("vector", "Lines");
});
