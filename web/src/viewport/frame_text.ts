// A frame's header as text for the HUD: state, size relative to the full picture, error, and frame
// rate. Pure.
import type { FrameState } from "@windsplat/client/parts";
import { errorName, errorText, type ErrorMetric } from "../base/error_text";
import type { ChosenMessage, FrameHeader, StatsMessage } from "@windsplat/client";
import { formatBytes, formatNumber } from "../base/ticks";

export interface LabelText {
  text: string;
  title: string; // explanation
}

const meaning =
  "Deviation of this picture from the exact one of this view: the root mean square of the " +
  "difference over all pixels and colours, in linear light, where 1 is full brightness; " +
  "or the corresponding PSNR, -20 log10 of that (key e switches).";
const measured = `${meaning} Measured against a picture drawn with finer settings.`;
const estimated =
  `${meaning} Estimated from measured pictures of this dataset with similar settings, ` +
  "or of other data while there are none.";
const unknown = `${meaning} Unknown for this frame.`;

// The rendering error, with the view's error limit if it exceeds that limit. The encoding error is
// separate, in encodingLabel.
export function errorLabel(
  header: FrameHeader,
  limit: number | null = null,
  metric: ErrorMetric = "rmse",
): LabelText {
  const known = header.errorMeasured || header.errorEstimated;
  if (!Number.isFinite(header.error) || !known) return { text: "error unknown", title: unknown };
  // Tolerance: the header stores the error in single precision.
  const above = limit !== null && header.error > limit * (1 + 1e-6);
  const kind = header.errorMeasured ? "measured" : "est.";
  // A greater error means a lower PSNR.
  const beyond = metric === "rmse" ? "above" : "below";
  const allowed = above ? `, ${beyond} ${errorText(limit, metric)}` : "";
  return {
    text: `${errorName(metric)} ${errorText(header.error, metric)} ${kind}${allowed}`,
    title:
      (header.errorMeasured ? measured : estimated) +
      (above ? " It exceeds the limit of the view: no available setting meets it." : ""),
  };
}

// An empty text: not known.
export function encodingLabel(
  { codec, jpegError }: FrameHeader,
  metric: ErrorMetric = "rmse",
): LabelText {
  if (codec === "h264") {
    return { text: "", title: "A picture of a video stream, because the link is slow." };
  }
  if (codec === "png") {
    return { text: "PNG lossless", title: "The picture was encoded without loss." };
  }
  const title =
    "Error that the JPEG encoding adds, in the same measure; " +
    "measured for a final frame, otherwise estimated.";
  if (!Number.isFinite(jpegError)) return { text: "", title };
  return { text: `JPEG ${errorText(jpegError, metric)}`, title };
}

// Width of a frame relative to the whole picture: "" for full, else 1/2, 1/4 ... or a percentage.
export function scaleText(width: number, full: number): string {
  if (width >= full) return "";
  for (let n = 2; n <= 32; n *= 2) if (Math.abs(width * n - full) < n) return `1/${n}`;
  return `${Math.max(1, Math.round((100 * width) / full))} %`;
}

// `scale` is that of scaleText: a size, which alone would be read as progress.
export function markText(state: FrameState | "offline", scale: string): string {
  if (scale === "" || state === "final" || state === "offline") return state;
  return `${state === "moving" ? "preview" : state}, ${scale} size`;
}

// Latency beyond the server's own work, in ms, from sending the patch to receiving the frame. Only
// the first frame that echoes a patch measures it; later frames waited longer.
export function networkMs(header: FrameHeader, arrivedAt: number, lastT: number): number | null {
  if (header.t === lastT || header.t <= 0) return null;
  const serverMs = (header.queueUs + header.renderUs + header.encodeUs) / 1000;
  return Math.max(0, arrivedAt - header.t - serverMs);
}

const windowMs = 1000;

// Frames and bytes of the last second.
export class FrameRate {
  private frames: { at: number; bytes: number }[] = [];

  add(now: number, bytes: number): void {
    this.frames.push({ at: now, bytes });
  }

  value(now: number): { fps: number; bytes: number } {
    this.frames = this.frames.filter(({ at }) => now - at < windowMs);
    const bytes = this.frames.reduce((sum, frame) => sum + frame.bytes, 0);
    return { fps: this.frames.length, bytes };
  }
}

export const paceText = (fps: number): string => `${fps.toFixed(fps < 10 ? 1 : 0)} steps/s`;

// Steps that were dropped or not ready in time; empty: none.
export function stepsText({ stepsDropped, stepsNotReady }: StatsMessage): string {
  const dropped = stepsDropped === 0 ? [] : [`${many(stepsDropped)} dropped`];
  const late = stepsNotReady === 0 ? [] : [`${many(stepsNotReady)} loaded late`];
  const parts = [...dropped, ...late];
  return parts.length === 0 ? "" : `steps: ${parts.join(" · ")}`;
}

// The method and its parameters.
export function methodText({ method, compositing, slabThickness }: ChosenMessage): string {
  const slabs = slabThickness === null ? "" : ` of ${formatNumber(slabThickness, 3)} cells`;
  return method === "reference" ? method : `${method}${slabs} ${compositing}`;
}

const many = (n: number): string => {
  if (n < 1000) return String(n);
  if (n < 1e6) return `${(n / 1e3).toFixed(1)} k`;
  return n < 1e9 ? `${(n / 1e6).toFixed(1)} M` : `${(n / 1e9).toFixed(1)} G`;
};

// Mean change of the picture by what was skipped: measured, estimated, or its upper bound.
function changeText(change: ChosenMessage["skippedChange"], bound: number | null): string {
  if (change.value !== null) {
    const kind = change.kind === "estimated" ? " est." : "";
    return ` · change ${formatNumber(change.value, 2)}${kind}`;
  }
  return bound === null ? "" : ` · change ≤ ${formatNumber(bound, 2)}`;
}

const countedIn = {
  ground: "pixels",
  surfaces: "triangles",
  streamlets: "pieces",
  seeds: "pieces",
  light: "samples",
  region: "samples outside",
  difference: "values",
  annotations: "items",
};

// What was computed and is held for the parts that the view adds to lines and clouds. Empty: the
// picture has none of them.
export function partsLine({ parts }: Pick<ChosenMessage["work"], "parts">): string {
  return parts
    .filter(({ shown }) => shown)
    .map(({ part, count, bytes }) => {
      const held = bytes > 0 ? ` ${formatNumber(bytes / 1e6, 2)} MB` : "";
      return `${part} ${many(count)} ${countedIn[part]}${held}`;
    })
    .join(" · ");
}

// What of a dataset with stored levels is drawn, and what would suffice. Empty: it has none, or
// every sample is drawn.
export function detailLine({ detail }: Pick<ChosenMessage, "detail">): string {
  if (detail === undefined) return "";
  const { wanted, drawn } = detail;
  if (drawn.count === undefined && drawn.halvings.every((n) => n === 0)) return "";
  const { count, boxes } = drawn;
  const held = boxes === undefined ? "" : `${boxes.count} boxes within `;
  const part = count === undefined ? "" : ` · part of ${held}${count.join(" x ")} samples`;
  const finer =
    wanted.halvings.join() === drawn.halvings.join() ? "" : ` · wanted ${levelText(wanted)}`;
  const missing =
    detail.missingBytes === undefined
      ? ""
      : ` · finer detail is being loaded (${formatBytes(detail.missingBytes)})`;
  return `${levelText(drawn)}${part}${finer}${missing}`;
}

const levelText = ({ halvings }: { halvings: number[] }): string =>
  halvings.every((n) => n === 0) ? "full detail" : `level ${halvings.join(",")}`;

// The work drawn, the work left out, and the cost.
export function workLines({
  work,
  skippedChange,
}: Pick<ChosenMessage, "work" | "skippedChange">): [string, string, string] {
  const drawn = work.samples - work.culled - work.skippedBoth;
  return [
    `${many(drawn)} of ${many(work.samples)} samples · culled ${many(work.culled)}` +
      ` · occluded ${many(work.occluded)}`,
    `skipped ${many(work.skippedVector)} lines, ${many(work.skippedScalar)} splats,` +
      ` ${many(work.skippedBoth)} both${changeText(skippedChange, work.skippedBound)}`,
    `${many(work.pixelUpdates)} pixel updates · ${many(work.exponentials)} exponentials` +
      ` · ${work.variant}`,
  ];
}

export function workText(chosen: ChosenMessage): string {
  return [...workLines(chosen), detailLine(chosen), partsLine(chosen.work)]
    .filter((line) => line !== "")
    .join("\n");
}
