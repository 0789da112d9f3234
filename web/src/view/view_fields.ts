// Which fields a view draws or colours by.
import type { Dataset, View } from "@windsplat/client";

const named = (names: (string | null | undefined)[]): string[] =>
  names.filter((name): name is string => typeof name === "string");

export function fieldsIn({ vector, scalars, surfaces }: View): string[] {
  const names = named([
    vector?.field,
    ...(vector?.field && vector.color?.by === "scalar" ? [vector.color.field] : []),
    ...(scalars ?? []).map(({ field }) => field),
    ...(surfaces ?? []).flatMap(({ field, color }) => [field, color?.field]),
  ]);
  return [...new Set(names)];
}

// The derived ones among them, which the server computes only if asked to.
export function derivedIn(dataset: Dataset, view: View): string[] {
  const derived = dataset.fields.filter(({ dtype }) => dtype === "derived");
  return fieldsIn(view).filter((name) => derived.some((field) => field.name === name));
}
