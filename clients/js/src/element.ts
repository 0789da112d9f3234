// Defines <windsplat-view>.
import type { WindsplatEvents } from "./element/events";
import { WindsplatView } from "./element/windsplat_view";

export type * from "./element/events";
export { WindsplatView };

declare global {
  interface HTMLElementTagNameMap {
    "windsplat-view": WindsplatView;
  }
  interface HTMLElementEventMap extends WindsplatEvents {}
}

if (customElements.get("windsplat-view") === undefined) {
  customElements.define("windsplat-view", WindsplatView);
}
