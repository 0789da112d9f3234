// Every key binding of the page in one table: it binds them and the help lists them.

export interface Binding {
  keys: string[]; // KeyboardEvent.key, after "Mod+" or "Mod+Shift+" for ctrl or cmd
  shown: string;
  does: string;
  run(event: KeyboardEvent): void;
  ends?(): void; // once it is let go of; run() is then not repeated
}

const sliderKey = /^(Arrow|Home|End|Page|Delete|Backspace)/; // our own ones remove points, too
const listKey = /^[\p{L}\p{N} ]$|^(Arrow|Home|End|Page|Enter|Escape)/u; // its letters, too

// Elements that have a use of their own for keys.
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

// As the table has it.
function nameOf({ key, ctrlKey, metaKey, shiftKey }: KeyboardEvent): string {
  if (!ctrlKey && !metaKey) return key;
  return `Mod+${shiftKey ? "Shift+" : ""}${key.toLowerCase()}`;
}

const isMac = (): boolean => /Mac|iPhone|iPad/.test(navigator.platform);

// The label of a key with ctrl or cmd.
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
  // By the place of the key: with shift its letter is another.
  const end = (event: Event) => {
    if (event instanceof KeyboardEvent && event.code === held?.code) letGo();
  };
  const run = (event: Event) => {
    if (!(event instanceof KeyboardEvent) || event.altKey) return;
    // The focus may have fallen to the body, behind the dialog.
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
  // On its way down: the panel's controls let no key come up again.
  target.addEventListener("keydown", run, true);
  target.addEventListener("keyup", end, true);
  window.addEventListener("blur", letGo);
}
