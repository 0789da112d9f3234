// Links to views that the server stores: a view too long for an address <-> `#!view=ID`.
import type { FetchLike } from "./frame_request";
import type { View } from "./protocol";
import { notUnderstood, posted, refusalText } from "./requests";
import { isView } from "./view_shape";

export const linkMax = 2000; // characters; mail and chat programs break longer links

export const shortLinkHash = (id: string): string => `#!view=${encodeURIComponent(id)}`;

// null: not a link to a stored view.
export function shortLinkId(hash: string): string | null {
  const id = /^#!view=([\w.~-]{1,128})$/.exec(hash);
  return id === null ? null : id[1]!;
}

interface StoredView {
  id: string;
  view: View;
  kept?: "memory" | "disk"; // memory: until the server stops
}

async function parseStoredView(response: Response): Promise<StoredView> {
  if (!response.ok) throw new Error(await refusalText(response));
  const saved = (await response.json().catch(() => null)) as StoredView | null;
  if (typeof saved?.id === "string" && isView(saved.view)) return saved;
  throw new Error(notUnderstood);
}

export const storeView = async (
  fetch: FetchLike,
  baseUri: string,
  view: View,
): Promise<StoredView> =>
  parseStoredView(await fetch(new URL("v1/views", baseUri).href, posted(view)));

export const loadView = async (
  fetch: FetchLike,
  baseUri: string,
  id: string,
): Promise<StoredView> =>
  parseStoredView(await fetch(new URL(`v1/views/${encodeURIComponent(id)}`, baseUri).href, {}));
