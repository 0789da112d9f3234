// Views that the server stores.
import type { FetchLike } from "./frame_request";
import type { View } from "./protocol";
import { notUnderstood, posted, refusal } from "./requests";
import { isView } from "./view_shape";

export interface StoredView {
  id: string;
  view: View;
  kept?: "memory" | "disk"; // memory: until the server stops
}

async function parseStoredView(response: Response): Promise<StoredView> {
  if (!response.ok) throw await refusal(response);
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
