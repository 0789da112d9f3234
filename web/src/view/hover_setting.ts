// Settings for the browser's session: whether values under the cursor are shown, and of what.
import { Observable } from "../base/observable";
import { orNull } from "../base/storage";

const storageKey = "windsplat.hover";
const subjectKey = "windsplat.hoverOf";

// feature: the sample that the picture shows there; level: the one in the slice or the probe's
// level.
export type HoverSubject = "feature" | "level";

export const hoverOn = new Observable(orNull(() => sessionStorage.getItem(storageKey)) !== "off");
hoverOn.watch((on) => orNull(() => sessionStorage.setItem(storageKey, on ? "on" : "off")));

export const hoverOf = new Observable<HoverSubject>(
  orNull(() => sessionStorage.getItem(subjectKey)) === "level" ? "level" : "feature",
);
hoverOf.watch((of) => orNull(() => sessionStorage.setItem(subjectKey, of)));
