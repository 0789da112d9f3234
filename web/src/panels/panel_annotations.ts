// What the server draws and writes around the data: box, axes, legend and the like.
import type GUI from "lil-gui";
import { inkOn } from "../view/contrast_color";
import { keyAccess, patchAt, type PanelKit } from "./panel_kit";

type Key =
  "box" | "axes" | "north" | "scaleBar" | "legend" | "title" | "stepTime" | "contourLabels";

// name: of the part in the labels of its size and colour, short enough for these; null: it has none
// of its own.
const parts: readonly { label: string; key: Key; name: string | null }[] = [
  { label: "box", key: "box", name: "box" },
  { label: "axes", key: "axes", name: "axes" },
  { label: "north arrow", key: "north", name: "arrow" },
  { label: "scale bar", key: "scaleBar", name: "bar" },
  { label: "legend in the picture", key: "legend", name: "legend" },
  { label: "title", key: "title", name: "title" },
  { label: "time", key: "stepTime", name: "time" },
  { label: "numbers on contours", key: "contourLabels", name: null },
];

export function addAnnotations(parent: GUI, kit: PanelKit): void {
  const folder = kit.folder(parent, "Axes and labels");
  for (const { label, key } of parts) {
    kit.toggle(folder, label, keyAccess<boolean>(`/annotations/${key}`));
  }
  const pointer = "/annotations/titleText";
  kit.text(folder, "own title", {
    pointer,
    get: (view) => view.annotations?.titleText,
    set: (text) => patchAt(pointer, text === "" ? null : text),
  });
  kit.number(folder, "text size", keyAccess<number>("/annotations/size"), { step: 0.05 });
  addStyles(folder, kit);
}

// Size and colour of each part that is shown.
function addStyles(parent: GUI, kit: PanelKit): void {
  const folder = kit.folder(parent, "Size and colour of each");
  const shows = (key: Key): boolean => kit.host.view().annotations?.[key] === true;
  addColor(folder, kit, "text", "/annotations/textColor", () => true);
  for (const { key, name } of parts) {
    if (name === null) continue;
    const style = `/annotations/${key}Style`;
    const size = kit.number(folder, `${name} size`, keyAccess<number>(`${style}/size`), {
      step: 0.05,
    });
    kit.showWhen(() => shows(key), size);
    addColor(folder, kit, name, `${style}/textColor`, () => shows(key));
  }
}

// A colour of one's own, or null: the one that follows from the others.
function addColor(
  folder: GUI,
  kit: PanelKit,
  name: string,
  pointer: string,
  shown: () => boolean,
): void {
  const { get } = keyAccess<string>(pointer);
  const own = (): boolean => typeof get(kit.host.view()) === "string";
  const choose = kit.toggle(folder, `own ${name} colour`, {
    pointer,
    get: own,
    set: (on) => patchAt(pointer, on ? inkOn(kit.host.view().image?.background) : null),
  });
  const color = kit.color(folder, `${name} colour`, keyAccess<string>(pointer));
  kit.showWhen(shown, choose);
  kit.showWhen(() => shown() && own(), color);
}
