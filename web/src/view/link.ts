// View <-> the part of the address after `#`: `#!{...}`, so that a link restores the view. The
// picture size depends on the window and is omitted.
import type { View } from "@windsplat/client";
import { isView, withoutSize } from "@windsplat/client/parts";

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
