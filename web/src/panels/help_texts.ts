// What the server's schema of the view says about each key -> tooltips of the controls. Fetched
// when the panel is first built; until it is there, or if it never comes, a control has its label
// alone.

interface Schema {
  description?: string;
  properties?: Record<string, Schema>;
  items?: Schema | boolean;
}

const texts = new Map<string, string>();
let waiting: [HTMLElement, string][] = [];

// Pointers without the indices of arrays.
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
  } finally {
    const due = waiting;
    waiting = []; // without the texts too: each panel that is built waits for them anew
    if (texts.size > 0) for (const [element, pointer] of due) explain(element, pointer);
  }
}
