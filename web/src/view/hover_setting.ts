// Whether the value under the cursor is shown, for the browser's session.
import { Observable } from "../base/observable";

const storageKey = "windsplat.hover";

// A browser may refuse storage; then the setting lasts until a reload.
function orNull<T>(run: () => T): T | null {
  try {
    return run();
  } catch {
    return null;
  }
}

export const hoverOn = new Observable(orNull(() => sessionStorage.getItem(storageKey)) !== "off");
hoverOn.watch((on) => orNull(() => sessionStorage.setItem(storageKey, on ? "on" : "off")));
