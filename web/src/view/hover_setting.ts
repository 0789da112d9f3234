// Setting for the browser's session: whether the value under the cursor is shown.
import { Observable } from "../base/observable";

const storageKey = "windsplat.hover";

// If the browser refuses storage, the setting lasts until a reload.
function orNull<T>(run: () => T): T | null {
  try {
    return run();
  } catch {
    return null;
  }
}

export const hoverOn = new Observable(orNull(() => sessionStorage.getItem(storageKey)) !== "off");
hoverOn.watch((on) => orNull(() => sessionStorage.setItem(storageKey, on ? "on" : "off")));
