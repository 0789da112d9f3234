// Time and place at which the sun of a view stands.
import type { Dataset, View } from "../wire/protocol";

type SunAt = NonNullable<NonNullable<View["light"]>["sunAt"]>;

const noTime = "2024-03-20T12:00"; // an equinox at noon, for steps without dates

// "2024-06-21T12:00:30Z" -> "2024-06-21T12:00"; null: not a time in UTC.
export function minuteOf(text: string): string | null {
  const found = /^(\d{4}-\d{2}-\d{2}T\d{2}:\d{2})(:\d{2}(\.\d+)?)?Z$/.exec(text);
  return found?.[1] ?? null;
}

// The middle of an axis in degrees; 0 for other axes.
function middleOf({ axes }: Dataset, axis: "x" | "y", kind: "longitude" | "latitude"): number {
  const { kind: own, coordinates } = axes[axis];
  if (own !== kind || coordinates.length === 0) return 0;
  const middle = 0.5 * (Math.min(...coordinates) + Math.max(...coordinates));
  return Number(middle.toFixed(2));
}

// At the time of a step, in the middle of the data.
export function sunAtStep(dataset: Dataset, step: number): SunAt {
  const minute = minuteOf(dataset.steps.times[step]?.text ?? "") ?? noTime;
  return {
    utc: `${minute}Z`,
    longitude: middleOf(dataset, "x", "longitude"),
    latitude: middleOf(dataset, "y", "latitude"),
  };
}
