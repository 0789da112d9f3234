// What a pixel of the picture shows, as the server answers a pick: position and text. Pure.
import type { Feature, Position, Dataset, View } from "@windsplat/client";
import { formatNumber } from "../base/ticks";
import { sizeOf } from "@windsplat/client/parts";
import { unitText } from "./unit_text";
import { coordinateText, axisNames, type Sample } from "./sample_position";

// Below this share of a pixel's opacity the text tells the share.
const wholeShare = 0.5;

// Where a feature is, in fractions of the picture; null outside of it.
export function ringAt(view: View, { at }: Feature): [number, number] | null {
  const [width, height] = sizeOf(view);
  const [x, y] = [at[0] / width, at[1] / height];
  return x >= 0 && y >= 0 && x <= 1 && y <= 1 ? [x, y] : null;
}

export const sampleOf = ({ index }: Position): Sample | null =>
  index === undefined ? null : [index.x, index.y, index.z];

// Lines beside the cursor: the value and where it is.
export function featureLines(dataset: Dataset, feature: Feature): string[] {
  const { field, value, units, position, share } = feature;
  const told = value === null ? "masked" : `${formatNumber(value)} ${unitText(units)}`;
  const text = `${field} ${told}`.trim();
  const part = share < wholeShare ? ` · ${formatNumber(100 * share, 2)} % of this point` : "";
  const places = axisNames.map((name, n) => {
    const called = name === "z" ? "level" : undefined;
    return coordinateText(dataset, n, position[name], called, position.units[name]);
  });
  return [`${text}${part}`, places.join(", ")];
}
