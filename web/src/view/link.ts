// View <-> the part of the address after `#`: `#!{...}`, so that a link restores the view. The
// picture size depends on the window and is omitted.
import type { View } from "@windsplat/client";
import { isView } from "@windsplat/client/parts";

const start = "#!";

export function viewOfHash(hash: string): View | null {
  if (!hash.startsWith(start)) return null;
  try {
    const view: unknown = JSON.parse(decodeURIComponent(hash.slice(start.length)));
    return isView(view) ? withoutSize(view) : null;
  } catch {
    return null;
  }
}

export function hashOfView(view: View): string {
  // Characters that are safe in a fragment are not percent-encoded.
  const readable = encodeURIComponent(JSON.stringify(withoutSize(view))).replace(
    /%(?:7B|7D|3A|2C|5B|5D)/g,
    decodeURIComponent,
  );
  return start + readable;
}

export function withoutSize(view: View): View {
  const { image, ...rest } = view;
  if (typeof image !== "object" || image === null) return rest;
  const { width: _width, height: _height, ...kept } = image;
  return Object.keys(kept).length === 0 ? rest : { ...rest, image: kept };
}
