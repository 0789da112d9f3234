// Which annotations the drawn picture has and how large their texts are, for the style sheet
// (annotations.css), which keeps the page's own overlays out of their way.
import type { View } from "@windsplat/client";

type Annotations = NonNullable<View["annotations"]>;

// Names of the annotations that are on, in the order of the schema.
export const shownAnnotations = (annotations: Annotations | undefined): string[] =>
  Object.entries(annotations ?? {})
    .filter(([, on]) => on === true)
    .map(([name]) => name);

// The largest of those that the page's overlays lie beside, as a factor; the server draws at most
// four times the usual size.
export function annotationSize(annotations: Annotations | undefined): number {
  const { size = 1, titleStyle, stepTimeStyle, northStyle, scaleBarStyle } = annotations ?? {};
  const beside = [titleStyle, stepTimeStyle, northStyle, scaleBarStyle];
  return Math.min(4, size * Math.max(...beside.map((style) => style?.size ?? 1)));
}

export function leaveRoom(root: HTMLElement, { annotations }: View): void {
  const shown = shownAnnotations(annotations).join(" ");
  if (root.dataset.annotations !== shown) root.dataset.annotations = shown;
  root.style.setProperty("--annotation-size", String(annotationSize(annotations)));
}
