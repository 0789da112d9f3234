// The page's view document: explicit keys only, no defaults.
// Changes go in as merge patches, stay pending until a frame or an error settles them, and
// come out as (rev, patch) to send.
import type { View } from "../wire/protocol";
import { isObject } from "../base/values";

export type Patch = Record<string, unknown>;

// RFC 7396, with the wire's exception: null at /vector/field is a value ("no lines").
export function mergePatch(target: unknown, patch: unknown, pointer = ""): unknown {
  if (!isObject(patch)) return patch;
  const merged: Patch = isObject(target) ? { ...target } : {};
  for (const [key, value] of Object.entries(patch)) {
    if (key === "__proto__") continue; // would set the prototype instead of a key
    const at = `${pointer}/${key}`;
    if (value === null && at !== "/vector/field") {
      delete merged[key];
    } else {
      merged[key] = mergePatch(merged[key], value, at);
    }
  }
  return merged;
}

export const mergeView = (view: View, patch: unknown): View => mergePatch(view, patch) as View;

// Explicit values over defaults. Arrays are taken whole.
export function withDefaults(defaults: unknown, explicit: unknown): unknown {
  if (explicit === undefined) return defaults;
  if (!isObject(explicit) || !isObject(defaults)) return explicit;
  const filled: Patch = { ...defaults };
  for (const [key, value] of Object.entries(explicit))
    filled[key] = withDefaults(defaults[key], value);
  return filled;
}

// The same for a view, and for its media too: one that is of the same field in the same place.
export function completeView(defaults: View, explicit: View): View {
  const view = withDefaults(defaults, explicit) as View;
  if (!explicit.scalars || !defaults.scalars) return view;
  const scalars = explicit.scalars.map((medium, index) => {
    const known = defaults.scalars?.[index];
    return known?.field === medium.field ? (withDefaults(known, medium) as typeof medium) : medium;
  }) as View["scalars"];
  return { ...view, scalars };
}

// The merge patch that turns `old`, or any part of it, into `next`: nulls for what must go, and all
// that shall be there, whether it is there already or not.
function replacement(old: Patch, next: Patch): Patch {
  const patch: Patch = {};
  for (const key of Object.keys(old)) if (!(key in next)) patch[key] = null;
  for (const [key, value] of Object.entries(next)) {
    const before = old[key];
    patch[key] = isObject(value) && isObject(before) ? replacement(before, value) : value;
  }
  return patch;
}

interface Pending {
  rev: number;
  patch: Patch;
}

export interface Outgoing {
  rev: number;
  patch: Patch;
}

const pendingMax = 64;

export class ViewState {
  private confirmed: View = {};
  private pending: Pending[] = [];
  private explicit: View = {};
  private lastRev = 0; // never used twice
  private confirmedRev = 0;

  // The newest view with its explicit keys. Not to be changed in place.
  get document(): View {
    return this.explicit;
  }

  // The newest view that has been answered by a picture.
  get settled(): View {
    return this.confirmed;
  }

  // Of the newest patch that stands: frames of this rev show what is wanted.
  get rev(): number {
    return this.pending.at(-1)?.rev ?? this.confirmedRev;
  }

  change(patch: Patch): Outgoing {
    this.lastRev += 1;
    this.pending.push({ rev: this.lastRev, patch });
    // Without an answer for long (a hidden page, a lost connection) the oldest count as accepted.
    while (this.pending.length > pendingMax) this.settle(this.pending[0]!.rev);
    this.recompute();
    return { rev: this.lastRev, patch };
  }

  // Replaces the whole document. A merge patch can do it all but one thing: null at /vector/field
  // is a value, so a field that was set goes only with the whole of `vector`, by a patch before.
  replace(next: View): Outgoing[] {
    const outgoing: Outgoing[] = [];
    const old = this.explicit;
    if (old.vector?.field !== undefined && next.vector?.field === undefined) {
      outgoing.push(this.change({ vector: null }));
    }
    outgoing.push(this.change(replacement(this.explicit as Patch, next as Patch)));
    return outgoing;
  }

  // After a new session was opened the server knows nothing: the whole view is one patch.
  restate(): Outgoing {
    const whole = this.explicit;
    this.confirmed = {};
    this.pending = [];
    return this.change(whole as Patch);
  }

  // A frame of this rev arrived: the patches up to it are confirmed.
  settle(rev: number): void {
    const done = this.pending.filter((entry) => entry.rev <= rev);
    if (done.length === 0) return;
    this.confirmed = done.reduce<View>(
      (view, entry) => mergeView(view, entry.patch),
      this.confirmed,
    );
    this.confirmedRev = done.at(-1)!.rev;
    this.pending = this.pending.filter((entry) => entry.rev > rev);
  }

  // The server refused this patch; the others stand. True if there was such a patch.
  refuse(rev: number): boolean {
    const kept = this.pending.filter((entry) => entry.rev !== rev);
    if (kept.length === this.pending.length) return false;
    this.pending = kept;
    this.recompute();
    return true;
  }

  // While time runs by itself the server moves the step; nothing is sent back.
  follow(step: number): void {
    this.confirmed = { ...this.confirmed, step };
    this.recompute();
  }

  private recompute(): void {
    this.explicit = this.pending.reduce<View>(
      (view, entry) => mergeView(view, entry.patch),
      this.confirmed,
    );
  }
}
