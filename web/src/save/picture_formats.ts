// Formats of saved pictures: what the server is asked for, and what a file holds. Pure.
import type { View } from "@windsplat/client";

export type PictureFormat = "png" | "jpeg" | "svg" | "pdf";

export const mediaTypes: Readonly<Record<PictureFormat, string>> = {
  png: "image/png",
  jpeg: "image/jpeg",
  svg: "image/svg+xml",
  pdf: "application/pdf",
};

export const aboutFormat: Readonly<Record<PictureFormat, string>> = {
  png: "Lossless. The file contains the view: drop it on the page to restore it.",
  jpeg: "Smaller, but not lossless. The file does not contain the view.",
  svg: "Texts and lines stay sharp at any size. The file does not contain the view.",
  pdf: "Texts and lines stay sharp at any size. The file does not contain the view.",
};

// The server draws the legend of documents, as texts and lines.
export const isDocument = (format: PictureFormat): boolean => format === "svg" || format === "pdf";

// With a legend, and the title and time that a picture's caption tells, unless the view leaves
// these out.
export const withServerLegend = (view: View): View => ({
  ...view,
  annotations: { title: true, stepTime: true, ...view.annotations, legend: true },
});
