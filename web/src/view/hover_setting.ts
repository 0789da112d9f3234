// Setting for the browser's session: whether the value under the cursor is shown.
import { Observable } from "../base/observable";
import { orNull } from "../base/storage";

const storageKey = "windsplat.hover";

export const hoverOn = new Observable(orNull(() => sessionStorage.getItem(storageKey)) !== "off");
hoverOn.watch((on) => orNull(() => sessionStorage.setItem(storageKey, on ? "on" : "off")));
