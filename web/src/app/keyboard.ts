// All key bindings of the page in one table, which also supplies the help text.

export interface Binding {
  keys: string[]; // KeyboardEvent.key, prefixed by "Mod+" or "Mod+Shift+" for ctrl or cmd
  shown: string;
  does: string;
  run(event: KeyboardEvent): void;
  ends?(): void; // called when the key is released; run() is then not repeated
}

const sliderKey = /^(Arrow|Home|End|Page|Delete|Backspace)/; // Delete and Backspace remove points
// letters and digits select entries
const listKey = /^[\p{L}\p{N} ]$|^(Arrow|Home|End|Page|Enter|Escape)/u;

// Elements that handle some keys themselves.
function takesKey(target: EventTarget | null, key: string): boolean {
  if (target instanceof Element && target.matches('[role="slider"]')) return sliderKey.test(key);
  if (!(target instanceof HTMLElement)) return false;
  if (target.matches("textarea") || target.isContentEditable) return true;
  if (target.matches("select")) return listKey.test(key);
  if (target instanceof HTMLInputElement) {
    if (target.type === "checkbox" || target.type === "color") return key === " ";
    return target.type === "range" ? sliderKey.test(key) : true;
  }
  return target.matches("button, a, summary") && (key === " " || key === "Enter");
}

// The key's name as written in the table.
function nameOf({ key, ctrlKey, metaKey, shiftKey }: KeyboardEvent): string {
  if (!ctrlKey && !metaKey) return key;
  return `Mod+${shiftKey ? "Shift+" : ""}${key.toLowerCase()}`;
}

const isMac = (): boolean => /Mac|iPhone|iPad/.test(navigator.platform);

// The label of a key combined with ctrl or cmd.
export const modText = (key: string): string => (isMac() ? `⌘ ${key}` : `ctrl ${key}`);

export function bindKeys(bindings: Binding[], target: EventTarget): void {
  const table = new Map<string, Binding>();
  for (const binding of bindings) {
    for (const key of binding.keys) {
      if (table.has(key)) throw new Error(`key ${key} is bound twice`);
      table.set(key, binding);
    }
  }
  let held: { code: string; binding: Binding } | null = null;
  const letGo = (): void => {
    held?.binding.ends?.();
    held = null;
  };
  // Compares the physical key: with shift, the reported letter differs.
  const end = (event: Event) => {
    if (event instanceof KeyboardEvent && event.code === held?.code) letGo();
  };
  const run = (event: Event) => {
    if (!(event instanceof KeyboardEvent) || event.altKey) return;
    // The focus may be on the body, behind the dialog.
    if (document.querySelector("dialog[open]") !== null) return;
    const name = nameOf(event);
    if (takesKey(event.target, name)) return;
    const binding = table.get(name);
    if (binding === undefined) return;
    event.preventDefault();
    if (binding.ends !== undefined) {
      if (event.repeat) return;
      letGo();
      held = { code: event.code, binding };
    }
    binding.run(event);
  };
  // Uses the capture phase, because the panel's controls stop the propagation of key events.
  target.addEventListener("keydown", run, true);
  target.addEventListener("keyup", end, true);
  window.addEventListener("blur", letGo);
}
