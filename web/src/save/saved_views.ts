// Named views saved in this browser's storage: a list, newest first. Stored content is untrusted
// and checked.
import { besideOf, type Beside } from "../view/beside";
import type { View } from "@windsplat/client";
import { isView } from "@windsplat/client/parts";

export interface SavedView {
  id: string; // permanent, because other tabs change the same list
  name: string;
  view: View;
  date: number; // ms since 1970
  beside?: Beside; // the second picture
}

export const savedViewsMax = 100;
export const nameMax = 80;
const viewCharactersMax = 20_000;

type Store = Pick<Storage, "getItem" | "setItem">;

function looksRight(entry: unknown): entry is SavedView {
  const { name, view, date } = (entry ?? {}) as Partial<SavedView>;
  const named = typeof name === "string" && name.length <= nameMax;
  return named && isView(view) && Number.isFinite(date);
}

function checkedBeside({ beside, ...saved }: SavedView): SavedView {
  const checked = besideOf(beside);
  return checked === null ? saved : { ...saved, beside: checked };
}

// Entries of earlier releases have no id; it is derived from their original date and name.
const withId = (entry: Omit<SavedView, "id">): SavedView => ({
  id: `${entry.date} ${entry.name}`,
  ...entry,
});

export class SavedViews {
  // Access to the storage may be forbidden, so it is requested only when needed.
  constructor(
    private readonly store: () => Store,
    private readonly key: string,
  ) {}

  list(): SavedView[] {
    try {
      const found: unknown = JSON.parse(this.store().getItem(this.key) ?? "[]");
      return Array.isArray(found)
        ? found.filter(looksRight).slice(0, savedViewsMax).map(checkedBeside).map(withId)
        : [];
    } catch {
      return [];
    }
  }

  // Throws an Error with a message if the browser refuses storage.
  add(name: string, view: View, date: number, beside: Beside | null = null): void {
    const list = this.list();
    if (list.length >= savedViewsMax)
      throw new Error(`${savedViewsMax} views are saved: delete one first.`);
    const both = beside === null ? { view } : { view, beside };
    if (JSON.stringify(both).length > viewCharactersMax) throw new Error("This view is too long.");
    this.write([withId({ name: name.slice(0, nameMax), date, ...both }), ...list]);
  }

  // An entry that another tab has deleted is not restored.
  rename(id: string, name: string): void {
    this.write(this.list().map((saved) => (saved.id === id ? { ...saved, name } : saved)));
  }

  remove(id: string): void {
    this.write(this.list().filter((saved) => saved.id !== id));
  }

  private write(list: SavedView[]): void {
    try {
      this.store().setItem(this.key, JSON.stringify(list));
    } catch {
      throw new Error("This browser allows this page no storage.");
    }
  }
}
