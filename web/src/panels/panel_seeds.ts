// Lines through seeds: how many of them fill the data, or a line or plane of them by numbers.
import type GUI from "lil-gui";
import type { Controller } from "lil-gui";
import { nameKey } from "../base/key_words";
import { axisNames, axisUnit } from "../view/sample_position";
import { extentOf } from "./panel_region";
import { keyAccess, type PanelKit } from "./panel_kit";
import type { Dataset, View } from "../wire/protocol";

type Seeds = NonNullable<NonNullable<NonNullable<View["vector"]>["trace"]>["seeds"]>;
type Place = [number, number, number];
export type SeedKind = "none" | "evenly" | "line" | "plane";
type Ends = { from: Place; to: Place };

const seedsOf = (view: View): Seeds | null => view.vector?.trace?.seeds ?? null;

// What the seeds of a view are to the panel; points are those of other programs.
export function kindOf(view: View): SeedKind {
  const seeds = seedsOf(view);
  if (seeds === null) return "none";
  if ((seeds.line ?? null) !== null) return "line";
  return (seeds.block ?? null) !== null ? "plane" : "evenly";
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

export function addSeeds(folder: GUI, kit: PanelKit): void {
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
    { "every sample": "none", "even seeds": "evenly", "a line": "line", "a plane": "plane" },
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
}
