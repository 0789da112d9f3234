// Descriptions of keys in the server's view schema -> tooltips of the controls. Fetched when the
// panel is first built; until then, or if the request fails, controls have only their labels.

import { learnKeys } from "../base/key_words";

interface Schema {
  description?: string;
  properties?: Record<string, Schema>;
  items?: Schema | boolean;
}

const texts = new Map<string, string>();
let waiting: [HTMLElement, string][] = [];

// Pointers omit array indices.
function collect(node: Schema, pointer: string): void {
  for (const [key, child] of Object.entries(node.properties ?? {})) {
    const at = `${pointer}/${key}`;
    texts.set(at, child.description ?? "");
    collect(child, at);
    if (typeof child.items === "object") collect(child.items, at);
  }
}

export function explain(element: HTMLElement, pointer: string): void {
  if (texts.size > 0) element.title = texts.get(pointer) ?? "";
  else waiting.push([element, pointer]);
}

export async function loadHelpTexts(baseUri: string): Promise<void> {
  if (texts.size > 0) return;
  try {
    const answer = await fetch(new URL("view.schema.json", baseUri));
    if (answer.ok) collect((await answer.json()) as Schema, "");
    learnKeys(texts.keys());
  } finally {
    const due = waiting;
    waiting = []; // cleared after a failure too: each new panel registers again
    if (texts.size > 0) for (const [element, pointer] of due) explain(element, pointer);
  }
}
