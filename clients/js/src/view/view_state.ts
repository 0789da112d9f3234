// The page's view document: explicit keys only, no defaults. Changes are entered as merge patches,
// are pending until a frame or an error answers them, and are sent as (rev, patch).
import type { SurfaceView, View } from "../wire/protocol";
import { isObject } from "../base/values";

export type Patch = Record<string, unknown>;

// RFC 7396 with one exception of the protocol: null at /vector/field is a value ("no lines").
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

// Explicit values over defaults. Arrays are replaced as a whole.
export function withDefaults(defaults: unknown, explicit: unknown): unknown {
  if (explicit === undefined) return defaults;
  if (!isObject(explicit) || !isObject(defaults)) return explicit;
  const filled: Patch = { ...defaults };
  for (const [key, value] of Object.entries(explicit))
    filled[key] = withDefaults(defaults[key], value);
  return filled;
}

// The same for a view; its media are merged if field and position in the list agree.
export function completeView(defaults: View, explicit: View): View {
  const view = withDefaults(defaults, explicit) as View;
  if (explicit.surfaces && defaults.surfaces) {
    view.surfaces = completeSurfaces(defaults.surfaces, explicit.surfaces) as View["surfaces"];
  }
  if (!explicit.scalars || !defaults.scalars) return view;
  const scalars = explicit.scalars.map((medium, index) => {
    const known = defaults.scalars?.[index];
    return known?.field === medium.field ? (withDefaults(known, medium) as typeof medium) : medium;
  }) as View["scalars"];
  return { ...view, scalars };
}

const kindOf = ({ isovalue, slice, plane }: SurfaceView): boolean[] =>
  [isovalue, slice, plane].map((value) => (value ?? null) !== null);

// Of a surface only the colours have defaults that depend on the data: known ones are added if the
// surface at this position still shows the same fields.
function completeSurfaces(defaults: SurfaceView[], explicit: SurfaceView[]): SurfaceView[] {
  const shows = (s: SurfaceView) => JSON.stringify([s.field, s.color?.field ?? null, kindOf(s)]);
  return explicit.map((surface, index) => {
    const known = defaults[index];
    if (known === undefined || shows(known) !== shows(surface)) return surface;
    const own = Object.entries(surface.color ?? {}).filter(([, value]) => value !== null);
    return { ...surface, color: { ...known.color, ...Object.fromEntries(own) } };
  });
}

// The merge patch that turns `old`, or any part of it, into `next`: null for each key to remove,
// and every key of `next`, whether already present or not.
function replacement(old: Patch, next: Patch): Patch {
  const patch: Patch = {};
  for (const key of Object.keys(old)) if (!(key in next)) patch[key] = null;
  for (const [key, value] of Object.entries(next)) {
    const before = old[key];
    patch[key] = isObject(value) && isObject(before) ? replacement(before, value) : value;
  }
  return patch;
}

// The merge patch by which `next` departs from `base`: equal values are left out.
export function departure(base: unknown, next: unknown): Patch {
  const patch: Patch = {};
  const from = isObject(base) ? base : {};
  const to = isObject(next) ? next : {};
  for (const key of Object.keys(from)) if (!(key in to) && from[key] !== null) patch[key] = null;
  for (const [key, value] of Object.entries(to)) {
    const before = from[key];
    if (JSON.stringify(before) === JSON.stringify(value)) continue;
    const inside = isObject(value) && isObject(before) ? departure(before, value) : null;
    if (inside === null) patch[key] = value;
    else if (Object.keys(inside).length > 0) patch[key] = inside;
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
  private lastRev = 0; // never reused
  private confirmedRev = 0;

  // The newest view with its explicit keys. Callers must not modify it.
  get document(): View {
    return this.explicit;
  }

  // The newest view that a frame has answered.
  get settled(): View {
    return this.confirmed;
  }

  // The rev of the newest patch that has not been refused: frames with this rev show the requested
  // view.
  get rev(): number {
    return this.pending.at(-1)?.rev ?? this.confirmedRev;
  }

  change(patch: Patch): Outgoing {
    this.lastRev += 1;
    this.pending.push({ rev: this.lastRev, patch });
    // If answers are missing for a long time (hidden page, lost connection), the oldest patches
    // count as accepted.
    while (this.pending.length > pendingMax) this.settle(this.pending[0]!.rev);
    this.recompute();
    return { rev: this.lastRev, patch };
  }

  // Replaces the whole document. One merge patch suffices except for /vector/field, where null is a
  // value: a field that was set is removed by an earlier patch that removes the whole of `vector`.
  replace(next: View): Outgoing[] {
    const outgoing: Outgoing[] = [];
    const old = this.explicit;
    if (old.vector?.field !== undefined && next.vector?.field === undefined) {
      outgoing.push(this.change({ vector: null }));
    }
    outgoing.push(this.change(replacement(this.explicit as Patch, next as Patch)));
    return outgoing;
  }

  // A new session has no view on the server, so the whole view is sent as one patch.
  restate(): Outgoing {
    const whole = this.explicit;
    this.confirmed = {};
    this.pending = [];
    return this.change(whole as Patch);
  }

  // A frame of this rev arrived: all patches up to it are confirmed.
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

  // The server refused this patch; other patches remain valid. Returns whether the patch was
  // pending.
  refuse(rev: number): boolean {
    const kept = this.pending.filter((entry) => entry.rev !== rev);
    if (kept.length === this.pending.length) return false;
    this.pending = kept;
    this.recompute();
    return true;
  }

  // During playback the server advances the step; nothing is sent back.
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
