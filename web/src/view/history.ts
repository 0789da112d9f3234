// Bounded undo and redo of the view document. Pure: documents, times and gestures in, documents
// out. The picture size, played steps and flowing lines are not part of the history. Each entry
// restores only what the user's change affected, so undoing a camera change does not affect the
// current step.
import type { View } from "@windsplat/client";
import { isObject, withoutSize } from "@windsplat/client/parts";

type Node = Record<string, unknown>;

interface Difference {
  path: string[];
  before: unknown; // undefined: was not set
  after: unknown;
}

interface Entry {
  before: View;
  after: View;
}

export interface Undone {
  view: View;
  what: string; // the change as text: "camera", "lines and media"
}

const entriesMax = 200;
const restMs = 600; // changes of the same keys within this time form one entry

const same = (a: unknown, b: unknown): boolean => JSON.stringify(a) === JSON.stringify(b);

// Compares all leaves; an array counts as one leaf.
export function differences(before: unknown, after: unknown, path: string[] = []): Difference[] {
  if (!isObject(before) || !isObject(after)) {
    return same(before, after) ? [] : [{ path, before, after }];
  }
  const keys = new Set([...Object.keys(before), ...Object.keys(after)]);
  return [...keys].flatMap((key) => differences(before[key], after[key], [...path, key]));
}

function withValue(node: unknown, [key, ...rest]: string[], value: unknown): unknown {
  if (key === undefined) return value;
  const copy: Node = isObject(node) ? { ...node } : {};
  const inner = withValue(copy[key], rest, value);
  if (inner === undefined) delete copy[key];
  else copy[key] = inner;
  return copy;
}

const apply = (view: View, changes: Difference[], side: "before" | "after"): View =>
  changes.reduce<unknown>((next, one) => withValue(next, one.path, one[side]), view) as View;

// Paths of all changed leaves, including those of added and removed objects.
function leavesOf({ path, before, after }: Difference): string[] {
  const part = isObject(after) ? after : before;
  if (!isObject(part) || Object.keys(part).length === 0) return [path.join("/")];
  return Object.keys(part).flatMap((key) =>
    leavesOf({ path: [...path, key], before: undefined, after: part[key] }),
  );
}

const changesOf = (entry: Entry): Difference[] => differences(entry.before, entry.after);

const partNames: Record<string, string> = {
  vector: "lines",
  scalars: "volumes",
  depthCue: "depth cue",
  step: "time step",
  geometry: "place",
  annotations: "axes and labels",
  image: "background",
};

function whatOf(changes: Difference[]): string {
  const keys = [...new Set(changes.map(({ path }) => path[0] ?? ""))];
  if (keys.includes("dataset")) return "dataset";
  return keys.length > 3 ? "view" : keys.map((key) => partNames[key] ?? key).join(" and ");
}

export class ViewHistory {
  private readonly past: Entry[] = [];
  private future: Entry[] = [];
  // leaves of the newest entry while changes may still be merged into it
  private open = new Set<string>();
  private held = false; // a pointer is down: all its changes form one entry
  private lastAt = 0;

  get canUndo(): boolean {
    return this.past.length > 0;
  }

  get canRedo(): boolean {
    return this.future.length > 0;
  }

  // A pointer or another key was pressed: following changes form a new entry.
  begin(held: boolean): void {
    this.open.clear();
    this.held = held;
  }

  // The pointer was released; its last change may not have arrived yet.
  end(): void {
    this.held = false;
  }

  // Records a possible change by the user; returns whether the view changed. now: ms.
  note(before: View, after: View, now: number): boolean {
    const changes = differences(withoutSize(before), withoutSize(after));
    if (changes.length === 0) return false;
    const leaves = changes.flatMap(leavesOf);
    const again = now - this.lastAt < restMs && leaves.every((leaf) => this.open.has(leaf));
    const joins = this.held ? this.open.size > 0 : again;
    const entry = this.past.at(-1);
    this.open = new Set(joins ? [...this.open, ...leaves] : leaves);
    this.lastAt = now;
    this.future = [];
    if (joins && entry !== undefined) {
      entry.after = apply(entry.after, changes, "after");
      if (changesOf(entry).length === 0) this.past.pop(); // the change was reversed
      return true;
    }
    this.past.push({ before: withoutSize(before), after: withoutSize(after) });
    if (this.past.length > entriesMax) this.past.shift();
    return true;
  }

  // The document that replaces `view`; null: there is nothing to undo. Entries without an effect,
  // such as changes refused by the server, are skipped.
  undo(view: View): Undone | null {
    return this.turn(view, this.past, this.future, "before");
  }

  redo(view: View): Undone | null {
    return this.turn(view, this.future, this.past, "after");
  }

  private turn(view: View, from: Entry[], to: Entry[], side: "before" | "after"): Undone | null {
    this.open.clear();
    for (let entry = from.pop(); entry !== undefined; entry = from.pop()) {
      const changes = changesOf(entry);
      const next = apply(view, changes, side);
      if (same(next, view)) continue;
      to.push(entry);
      return { view: next, what: whatOf(changes) };
    }
    return null;
  }
}
