// Which annotations the drawn picture has and how large their texts are, for the style sheet
// (annotations.css), which keeps the page's own overlays out of their way.
import type { View } from "../wire/protocol";

type Annotations = NonNullable<View["annotations"]>;

// Names of the annotations that are on, in the order of the schema.
export const shownAnnotations = (annotations: Annotations | undefined): string[] =>
  Object.entries(annotations ?? {})
    .filter(([, on]) => on === true)
    .map(([name]) => name);

export function leaveRoom(root: HTMLElement, { annotations }: View): void {
  const shown = shownAnnotations(annotations).join(" ");
  if (root.dataset.annotations !== shown) root.dataset.annotations = shown;
  root.style.setProperty("--annotation-size", String(annotations?.size ?? 1));
}
