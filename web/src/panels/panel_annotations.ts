// What the server draws and writes around the data: box, axes, legend and the like.
import type GUI from "lil-gui";
import { keyAccess, patchAt, type PanelKit } from "./panel_kit";

const parts: readonly [label: string, key: string][] = [
  ["box", "box"],
  ["axes", "axes"],
  ["north arrow", "north"],
  ["scale bar", "scaleBar"],
  ["legend in the picture", "legend"],
  ["title", "title"],
  ["time", "stepTime"],
  ["numbers on contours", "contourLabels"],
];

export function addAnnotations(parent: GUI, kit: PanelKit): void {
  const folder = kit.folder(parent, "Axes and labels");
  for (const [label, key] of parts) {
    kit.toggle(folder, label, keyAccess<boolean>(`/annotations/${key}`));
  }
  const pointer = "/annotations/titleText";
  kit.text(folder, "own title", {
    pointer,
    get: (view) => view.annotations?.titleText,
    set: (text) => patchAt(pointer, text === "" ? null : text),
  });
  kit.number(folder, "text size", keyAccess<number>("/annotations/size"), { step: 0.05 });
}
