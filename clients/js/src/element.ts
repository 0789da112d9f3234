// Defines <windsplat-view>.
import type { WindsplatEvents } from "./element/events";
import { WindsplatView } from "./element/windsplat_view";

export type * from "./element/events";
export { WindsplatView };

declare global {
  interface HTMLElementTagNameMap {
    "windsplat-view": WindsplatView;
  }
  interface GlobalEventHandlersEventMap extends WindsplatEvents {} // they bubble
}

// Servers that render pages have no registry.
if (globalThis.customElements?.get("windsplat-view") === undefined) {
  globalThis.customElements?.define("windsplat-view", WindsplatView);
}
