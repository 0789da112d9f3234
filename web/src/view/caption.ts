// The caption of a picture that leaves the page: dataset, step and time.
import { readableTime } from "@windsplat/client/parts";
import type { Dataset } from "@windsplat/client";

export function pictureCaption({ title, steps }: Dataset, step: number): string {
  const time = readableTime(steps.times[step]?.text ?? "");
  const counted = steps.count > 1 ? ` · step ${step + 1} of ${steps.count}` : "";
  return `${title}${counted}${time === "" ? "" : ` · ${time}`}`;
}
