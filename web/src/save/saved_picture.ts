// Saved pictures: view -> the server's picture with the legend drawn in, its size in print and, in
// a lossless one, the view; and a picture that is dropped on the page or chosen -> its view.
import { type ColorMaps, isView, completeView } from "@windsplat/client/parts";
import type { ExportSize } from "./export_views";
import { legendEntries } from "../view/legend_entries";
import { pictureCaption } from "../view/caption";
import { drawLegend } from "./legend_picture";
import { withJpegDensity } from "./jpeg_density";
import { textOf, withDensity, withTexts, type Bytes } from "./png_text";
import type { Dataset, View } from "@windsplat/client";

const keyword = "windsplat-view";
const jpegQuality = 0.92; // of the browser's encoder
const fileBytesMax = 400e6;
const cardWidthMin = 228; // CSS pixels; on a phone the legend is narrower than its text

const bytesOf = async (blob: Blob): Promise<Bytes> => new Uint8Array(await blob.arrayBuffer());

export interface Shown {
  dataset: Dataset;
  view: View; // with all defaults, for the legend
  maps: ColorMaps;
}

// `drawn` is the server's picture of `view`; dotsPerInch: its size in print.
export async function finishPicture(
  drawn: Blob,
  view: View,
  size: ExportSize,
  legend: Shown | null,
  dotsPerInch: number,
): Promise<Bytes> {
  const picture = hasOwnLegend(view, legend) ? await withLegend(drawn, view, size, legend) : drawn;
  return withTexts(withDensity(await bytesOf(picture), dotsPerInch), {
    Software: "windsplat",
    [keyword]: JSON.stringify(view),
  });
}

// As JPEG: `drawn` is the server's JPEG, or with a legend its lossless picture.
export async function finishJpeg(
  drawn: Blob,
  view: View,
  size: ExportSize,
  legend: Shown | null,
  dotsPerInch: number,
): Promise<Bytes> {
  const picture = hasOwnLegend(view, legend)
    ? await withLegend(drawn, view, size, legend, "image/jpeg")
    : drawn;
  return withJpegDensity(await bytesOf(picture), dotsPerInch);
}

// Whether the page draws the legend: not if the server has done so.
export const hasOwnLegend = (view: View, legend: Shown | null): legend is Shown =>
  legend !== null && view.annotations?.legend !== true;

async function withLegend(
  drawn: Blob,
  view: View,
  { scale }: ExportSize,
  shown: Shown,
  type = "image/png",
): Promise<Blob> {
  const bitmap = await createImageBitmap(drawn, { colorSpaceConversion: "none" });
  const canvas = document.createElement("canvas");
  canvas.width = bitmap.width;
  canvas.height = bitmap.height;
  const context = canvas.getContext("2d", { alpha: false })!;
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  const { dataset, maps } = shown;
  drawLegend(
    context,
    {
      caption: pictureCaption(dataset, view.step ?? 0),
      entries: legendEntries(dataset, completeView(shown.view, view)),
      stops: (map) => maps.stops(map),
      font: getComputedStyle(document.body).fontFamily,
      cardWidth: Math.max(cardWidthMin, document.querySelector(".legend-entry")?.clientWidth ?? 0),
    },
    scale,
  );
  const blob = await new Promise<Blob | null>((done) => canvas.toBlob(done, type, jpegQuality));
  if (blob === null) throw new Error("The picture is too large for this browser.");
  return blob;
}

// The view of a saved picture; throws an Error with a message.
export async function viewOfFile(file: Blob): Promise<View> {
  if (file.size > fileBytesMax) throw new Error("This file is too large for a saved picture.");
  const text = textOf(await bytesOf(file), keyword);
  if (text === null)
    throw new Error("This picture contains no view: it was not saved by this page.");
  return parseView(text);
}

export function parseView(text: string): View {
  try {
    const view: unknown = JSON.parse(text);
    if (isView(view)) return view;
  } catch {
    // reported below
  }
  throw new Error("This picture contains an invalid view.");
}

export interface FileTarget {
  open(view: View): void;
  refuse(text: string): void;
}

export async function openFile(file: Blob | undefined, target: FileTarget): Promise<void> {
  if (file === undefined) return;
  await viewOfFile(file).then(
    (view) => target.open(view),
    (failure: Error) => target.refuse(failure.message),
  );
}

// Accepts files dropped anywhere on the page; `hint` is shown while a file is dragged over it.
export function takeDrops(hint: HTMLElement, target: FileTarget): void {
  const handle = (type: "dragover" | "dragleave" | "drop", run: (event: DragEvent) => void) =>
    window.addEventListener(type, (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      // Ignored while a dialog is open.
      if (document.querySelector("dialog[open]") === null) run(event);
      else event.dataTransfer.dropEffect = "none";
    });
  handle("dragover", () => (hint.hidden = false));
  handle("dragleave", (event) => (hint.hidden = event.relatedTarget === null));
  handle("drop", (event) => {
    hint.hidden = true;
    void openFile(event.dataTransfer?.files[0], target);
  });
}
