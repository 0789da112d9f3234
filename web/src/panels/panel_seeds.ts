// Lines that follow the flow: through every sample, or through seeds, which fill the data evenly or
// are points, a line or a plane; and how far the lines go.
import type GUI from "lil-gui";
import type { Controller } from "lil-gui";
import { nameKey } from "../base/key_words";
import { axisNames, axisUnit } from "../view/sample_position";
import { extentOf } from "./panel_region";
import { keyAccess, type PanelKit } from "./panel_kit";
import { SeedPoints, type Place } from "./seed_points";
import type { Dataset, View } from "@windsplat/client";

type Seeds = NonNullable<NonNullable<NonNullable<View["vector"]>["trace"]>["seeds"]>;
export type SeedKind = "none" | "evenly" | "points" | "line" | "plane";
export type SeedReach = "data" | "length" | "duration";
type Ends = { from: Place; to: Place };

const pathStepsMax = 24; // of the view's schema

const seedsOf = (view: View): Seeds | null => view.vector?.trace?.seeds ?? null;

// What the seeds of a view are to the panel.
export function kindOf(view: View): SeedKind {
  const seeds = seedsOf(view);
  if (seeds === null) return "none";
  if ((seeds.line ?? null) !== null) return "line";
  if ((seeds.block ?? null) !== null) return "plane";
  return (seeds.points ?? []).length > 0 ? "points" : "evenly";
}

// What ends the lines of a view, besides the boundary.
export function reachOf(view: View): SeedReach {
  const { duration = null, length = null } = seedsOf(view) ?? {};
  if (duration !== null) return "duration";
  return length === null ? "data" : "length";
}

// The patch of a reach that is chosen anew. The lengths are of the order of the box; a duration is
// that of a way of half its diagonal at the greatest magnitude drawn, if that is known.
export function reachPatch(
  reach: SeedReach,
  dataset: Dataset,
  view: View,
): Record<string, unknown> {
  const { min, max } = dataset.world;
  const diagonal = Math.hypot(...max.map((most, n) => most - min[n]!));
  const half = Number((diagonal / 2).toPrecision(2));
  if (reach === "data") return { length: null, duration: null };
  if (reach === "length") return { length: half, duration: null };
  const top = view.vector?.magnitudeRange?.[1] ?? 0;
  return { length: null, duration: top > 0 ? Number((half / top).toPrecision(2)) : 1 };
}

// A place at a part of both horizontal axes, in the middle of the vertical one.
function placeAt(dataset: Dataset, part: number): Place {
  const along = (axis: "x" | "y" | "z", at: number): number => {
    const [low, high] = extentOf(dataset, axis);
    return Number((low + at * (high - low)).toPrecision(6));
  };
  return [along("x", part), along("y", part), along("z", 0.5)];
}

// The seeds of a kind that is chosen anew.
export function seedsFor(kind: SeedKind, dataset: Dataset): Record<string, unknown> | null {
  const ends = { from: placeAt(dataset, 0.1), to: placeAt(dataset, 0.9) };
  const none = { points: [], evenly: null, line: null, block: null };
  if (kind === "none") return null;
  if (kind === "points") return { ...none, points: [placeAt(dataset, 0.5)] };
  if (kind === "line") return { ...none, line: { ...ends, count: 20 } };
  if (kind === "plane") return { ...none, block: { ...ends, counts: [8, 8, 1] } };
  return { ...none, evenly: 100 };
}

// The key of the seeds that have ends.
const keyOf = (view: View): "line" | "block" => (kindOf(view) === "line" ? "line" : "block");
const endsOf = (view: View): Ends | null => (seedsOf(view)?.[keyOf(view)] ?? null) as Ends | null;

function addEnds(folder: GUI, kit: PanelKit): Controller[] {
  const dataset = kit.host.dataset();
  const boxes: Controller[] = [];
  for (const end of ["from", "to"] as const) {
    // Three boxes set one key, so its name is that of the end.
    for (const key of ["line", "block"]) nameKey(`/vector/trace/seeds/${key}/${end}`, end);
    axisNames.forEach((axis, n) => {
      const { coordinates, name, units } = dataset.axes[axis];
      if (coordinates.length < 2) return;
      const access = {
        pointer: `/vector/trace/seeds/line/${end}`,
        get: (view: View) => endsOf(view)?.[end][n],
        set: (value: number) => {
          const view = kit.host.view();
          const ends = endsOf(view);
          if (ends === null) return null;
          const place = ends[end].map((old, k) => (k === n ? value : old));
          return { vector: { trace: { seeds: { [keyOf(view)]: { [end]: place } } } } };
        },
      };
      const label = `${end} ${name || axis} ${axisUnit(units)}`.trim();
      boxes.push(kit.number(folder, label, access, { field: true }));
    });
  }
  return boxes;
}

const reaches = {
  "as far as they go": "data",
  "for a length": "length",
  "for a time": "duration",
} satisfies Record<string, SeedReach>;

// How far lines go, and paths through time.
function addReach(folder: GUI, kit: PanelKit, seeded: () => boolean): void {
  const { host } = kit;
  const dataset = host.dataset();
  const set = (seeds: Record<string, unknown>) => ({ vector: { trace: { seeds } } });
  const at = "/vector/trace/seeds";
  const goes = kit.choice(
    folder,
    "followed",
    {
      pointer: at,
      get: reachOf,
      set: (reach) => set(reachPatch(reach as SeedReach, dataset, host.view())),
    },
    reaches,
  );
  const length = kit.number(folder, "length to each side", keyAccess(`${at}/length`), {
    min: 0.01,
    max: 10,
    step: 0.01,
  });
  const duration = kit.number(folder, "time to each side", keyAccess(`${at}/duration`), {
    field: true,
  });
  const is = (reach: SeedReach): boolean => seeded() && reachOf(host.view()) === reach;
  const isWorld = (): boolean => host.view().vector?.space === "world";
  kit.note(folder, () => {
    if (!is("duration")) return "";
    return isWorld()
      ? "Seconds of the flow, back and ahead."
      : "Units of the box over the unit of the field; seconds if direction is in world space.";
  });
  kit.showWhen((states) => states.traced && seeded(), goes);
  kit.showWhen((states) => states.traced && is("length"), length);
  kit.showWhen((states) => states.traced && is("duration"), duration);
  const { count } = dataset.steps;
  if (count < 2) return;
  const steps = kit.number(
    folder,
    "paths over steps",
    {
      pointer: `${at}/pathSteps`,
      get: (view) => seedsOf(view)?.pathSteps ?? 0,
      // Paths follow the flow in the world.
      set: (pathSteps) => ({
        vector: { ...(pathSteps > 0 ? { space: "world" } : {}), trace: { seeds: { pathSteps } } },
      }),
    },
    { min: 0, max: Math.min(pathStepsMax, count - 1), step: 1 },
  );
  kit.note(folder, () => {
    const over = seeded() ? (seedsOf(host.view())?.pathSteps ?? 0) : 0;
    if (over === 0) return "";
    const text = over === 1 ? "one step" : `${over} steps`;
    return `Paths of particles that are at the seeds now, ${text} back and ahead.`;
  });
  kit.showWhen((states) => states.traced && seeded(), steps);
}

// Returns the points, which clicks on the picture add to.
function addSeeds(folder: GUI, kit: PanelKit): SeedPoints {
  const kind = kit.choice(
    folder,
    "lines through",
    {
      pointer: "/vector/trace/seeds",
      get: kindOf,
      set: (chosen) => ({
        vector: { trace: { seeds: seedsFor(chosen as SeedKind, kit.host.dataset()) } },
      }),
    },
    {
      "every sample": "none",
      "even seeds": "evenly",
      points: "points",
      "a line": "line",
      "a plane": "plane",
    },
  );
  const isOf = (...kinds: SeedKind[]): boolean => kinds.includes(kindOf(kit.host.view()));
  const even = kit.number(
    folder,
    "number of seeds",
    {
      pointer: "/vector/trace/seeds/evenly",
      get: (view) => seedsOf(view)?.evenly ?? 100,
      set: (evenly) => ({ vector: { trace: { seeds: { evenly } } } }),
    },
    { min: 1, max: 1000, step: 1 },
  );
  const line = kit.number(
    folder,
    "seeds on the line",
    keyAccess("/vector/trace/seeds/line/count"),
    { min: 1, max: 200, step: 1 },
  );
  const ends = addEnds(folder, kit);
  const traced = (): boolean => (kit.host.view().vector?.trace ?? null) !== null;
  const points = new SeedPoints(folder, kit, () => traced() && isOf("points"));
  addReach(folder, kit, () => !isOf("none"));
  const dash = kit.number(folder, "dash", keyAccess("/vector/trace/seeds/dash"), {
    min: 0.01,
    max: 1,
  });
  const moves = (): boolean => kit.host.view().vector?.motion?.mode === "phase";
  kit.showWhen((states) => states.traced, kind);
  kit.showWhen((states) => states.traced && isOf("evenly"), even);
  kit.showWhen((states) => states.traced && isOf("line"), line);
  kit.showWhen((states) => states.traced && isOf("line", "plane"), ...ends);
  kit.showWhen((states) => states.traced && !isOf("none") && moves(), dash);
  return points;
}

// Streamlets and streamlines: lines that follow the flow.
export function addTrace(folder: GUI, kit: PanelKit): SeedPoints {
  const follows = kit.toggle(folder, "follow the flow", {
    pointer: "/vector/trace",
    get: (view) => (view.vector?.trace ?? null) !== null,
    set: (on) => ({ vector: { trace: on ? {} : null } }),
  });
  const segments = kit.number(folder, "pieces of a line", keyAccess("/vector/trace/segments"), {
    min: 1,
    max: 64,
    step: 1,
  });
  kit.showWhen((states) => states.traceable || states.traced, follows);
  const eachSample = (): boolean => kindOf(kit.host.view()) === "none";
  kit.showWhen((states) => states.traced && eachSample(), segments);
  return addSeeds(folder, kit);
}
