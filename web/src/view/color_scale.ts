// The ends of the colours of lines as the legend shows them: coordinates of the vertical axis in
// place of world heights, and units. Pure.
import { axisNames } from "./sample_position";
import { sampleHeights } from "./legend_entries";
import { unitText } from "./unit_text";
import type { Dataset, View } from "@windsplat/client";

// Linear between the samples and beyond the outermost two; both lists have the same length, and
// `from` is strictly monotonic.
function interpolated(from: number[], to: number[], value: number): number {
  const ascends = from[0]! < from.at(-1)!;
  let n = 1;
  while (n < from.length - 1 && (ascends ? from[n]! < value : from[n]! > value)) n++;
  const share = (value - from[n - 1]!) / (from[n]! - from[n - 1]!);
  return to[n - 1]! + share * (to[n]! - to[n - 1]!);
}

export interface ColorScale {
  units: string;
  shown(value: number): number; // of the view -> as shown
  stored(value: number): number; // as shown -> of the view
}

export function colorScale(dataset: Dataset, view: View): ColorScale {
  const same = (value: number) => value;
  const plain = (units: string): ColorScale => ({ units, shown: same, stored: same });
  const { by, field } = view.vector?.color ?? {};
  const unitsOf = (name: string | null | undefined) =>
    unitText(dataset.fields.find((one) => one.name === name)?.units);
  if (by === "magnitude") return plain(unitsOf(view.vector?.field));
  if (by === "scalar") return plain(unitsOf(field));
  if (by === "direction") return plain("°");
  const axis = dataset.axes[axisNames[2]];
  const heights = by === "worldZ" ? sampleHeights(dataset, view) : null;
  if (heights === null || heights.length < 2) return plain("");
  return {
    units: unitText(axis.units),
    shown: (value) => interpolated(heights, axis.coordinates, value),
    stored: (value) => interpolated(axis.coordinates, heights, value),
  };
}
