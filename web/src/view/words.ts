// What scientists call the parts of a dataset: its vectors and its volumes.
import type { Dataset, Field } from "@windsplat/client";
import { isSpeed } from "./legend_entries";

const wordsOf = ({ name, standardName, longName }: Field): string =>
  [name, standardName, longName].join(" ").toLowerCase();

// Vectors that the file has, without those that are derived from them.
const storedVectors = ({ fields }: Dataset): Field[] =>
  fields.filter(({ kind, dtype }) => kind === "vector" && dtype !== "derived");

// "Winds", "Currents", "Flow" or "Vectors".
export function vectorsTitle(dataset: Dataset): string {
  const vectors = storedVectors(dataset);
  if (vectors.some((field) => /(\b|_)winds?(\b|_)/.test(wordsOf(field)))) return "Winds";
  if (vectors.some((field) => /sea_water|\bcurrents?\b/.test(wordsOf(field)))) return "Currents";
  return vectors.some(({ units }) => isSpeed(units)) ? "Flow" : "Vectors";
}

// Whether a field shows clouds, fog, smoke or precipitation, through which light is scattered.
export const isCloud = (field: Field): boolean =>
  /cloud|condens|\bfog|smoke|aerosol|\brain|\bsnow|graupel|hydrometeor|_ice_in_air/.test(
    wordsOf(field),
  );

export const volumesTitle = ({ fields }: Dataset): string =>
  fields.some((field) => field.kind === "scalar" && isCloud(field))
    ? "Clouds and volumes"
    : "Volumes";
