// Views that the user keeps in this browser under names: a list in its storage, newest first. What
// is found there may be anything, and is believed only as far as it looks right.
import type { View } from "../wire/protocol";
import { isView } from "../wire/view_shape";

export interface KeptView {
  id: string; // its own for good: other tabs of the page change the same list
  name: string;
  view: View;
  date: number; // ms since 1970
}

export const keptMax = 100;
export const nameMax = 80;
const viewCharactersMax = 20_000;

type Store = Pick<Storage, "getItem" | "setItem">;

function looksRight(entry: unknown): entry is KeptView {
  const { name, view, date } = (entry ?? {}) as Partial<KeptView>;
  const named = typeof name === "string" && name.length <= nameMax;
  return named && isView(view) && Number.isFinite(date);
}

// Entries of earlier releases have none: theirs is made of what they began with.
const withId = (entry: Omit<KeptView, "id">): KeptView => ({
  id: `${entry.date} ${entry.name}`,
  ...entry,
});

export class KeptViews {
  // The storage itself may be forbidden: it is asked for only when it is used.
  constructor(
    private readonly store: () => Store,
    private readonly key: string,
  ) {}

  list(): KeptView[] {
    try {
      const found: unknown = JSON.parse(this.store().getItem(this.key) ?? "[]");
      return Array.isArray(found) ? found.filter(looksRight).slice(0, keptMax).map(withId) : [];
    } catch {
      return [];
    }
  }

  // Fails, with words, where the browser keeps nothing.
  add(name: string, view: View, date: number): void {
    const list = this.list();
    if (list.length >= keptMax) throw new Error(`${keptMax} views are saved: delete one first.`);
    if (JSON.stringify(view).length > viewCharactersMax) throw new Error("This view is too long.");
    this.write([withId({ name: name.slice(0, nameMax), view, date }), ...list]);
  }

  // One that another tab has deleted stays so.
  rename(id: string, name: string): void {
    this.write(this.list().map((kept) => (kept.id === id ? { ...kept, name } : kept)));
  }

  remove(id: string): void {
    this.write(this.list().filter((kept) => kept.id !== id));
  }

  private write(list: KeptView[]): void {
    try {
      this.store().setItem(this.key, JSON.stringify(list));
    } catch {
      throw new Error("This browser allows this page no storage.");
    }
  }
}
