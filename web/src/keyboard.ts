// Every key binding of the page in one table: it binds them and the help lists them.

export interface Binding {
  keys: string[]; // KeyboardEvent.key
  shown: string;
  does: string;
  run(event: KeyboardEvent): void;
}

// Elements that have a use of their own for keys.
function takesKey(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest("dialog") !== null) return true;
  if (target.matches("textarea, select") || target.isContentEditable) return true;
  if (target instanceof HTMLInputElement) {
    if (target.type === "checkbox" || target.type === "color") return key === " ";
    return true;
  }
  return target.matches("button, a, summary") && (key === " " || key === "Enter");
}

export function bindKeys(bindings: Binding[], target: EventTarget): void {
  const table = new Map<string, Binding>();
  for (const binding of bindings) {
    for (const key of binding.keys) {
      if (table.has(key)) throw new Error(`key ${key} is bound twice`);
      table.set(key, binding);
    }
  }
  target.addEventListener("keydown", (event) => {
    if (!(event instanceof KeyboardEvent)) return;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (takesKey(event.target, event.key)) return;
    const binding = table.get(event.key);
    if (binding === undefined) return;
    event.preventDefault();
    binding.run(event);
  });
}
