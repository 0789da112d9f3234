// The camera in numbers: eye and target as boxes, and the whole camera as text to copy and paste.
import type GUI from "lil-gui";
import { make } from "../base/dom";
import { formatNumber } from "../base/ticks";
import type { Vec3 } from "@windsplat/client/parts";
import { distanceOf, type Camera } from "@windsplat/client";
import { cameraChange, cameraPatch, cameraText } from "../view/camera_text";
import type { PanelKit } from "./panel_kit";

const axes = ["x", "y", "z"] as const;

export function addCameraNumbers(parent: GUI, kit: PanelKit, camera: () => Camera | null): void {
  const folder = kit.folder(parent, "Camera in numbers");
  for (const point of ["eye", "target"] as const) {
    axes.forEach((axis, at) => {
      kit.number(
        folder,
        `${point} ${axis}`,
        {
          pointer: `/camera/${point}`,
          get: () => camera()?.[point][at],
          set: (value) => {
            const now = camera();
            if (now === null || !Number.isFinite(value)) return null;
            const moved: Vec3 = [...now[point]];
            moved[at] = value;
            return distanceOf({ ...now, [point]: moved }) > 0
              ? cameraChange(now, { [point]: moved })
              : null;
          },
        },
        { field: true },
      );
    });
  }
  addText(folder, kit, camera);
  kit.note(folder, () => {
    const now = camera();
    if (now === null) return "";
    return (
      `World units: the longest edge of the box is 2, its centre the origin. ` +
      `The eye is ${formatNumber(distanceOf(now))} from the target.`
    );
  });
}

// Copied by the button or by hand; pasted text counts once it is complete.
function addText(folder: GUI, kit: PanelKit, camera: () => Camera | null): void {
  const box = make("input", "camera-text");
  box.type = "text";
  box.spellcheck = false;
  box.autocomplete = "off";
  box.setAttribute("aria-label", "Camera as text");
  box.title = "The camera as text: copy it, or paste another and press Enter";
  const why = make("p", "panel-note camera-refused");
  why.setAttribute("role", "alert");
  why.hidden = true;
  const copy = make("button", "", "Copy camera");
  copy.type = "button";
  const row = make("div", "camera-row");
  row.append(box, copy);
  folder.$children.append(row, why);

  const show = (): void => {
    const now = camera();
    if (now === null || box === document.activeElement) return;
    box.value = cameraText(now);
  };
  const refuse = (text: string): void => {
    why.textContent = text;
    why.hidden = text === "";
  };
  const take = (): void => {
    const now = camera();
    if (now === null) return;
    try {
      if (box.value !== cameraText(now)) kit.host.change(cameraPatch(box.value, now));
      refuse("");
    } catch (failure) {
      refuse((failure as Error).message);
    }
  };
  box.addEventListener("focus", () => box.select());
  box.addEventListener("blur", () => {
    refuse("");
    show();
  });
  box.addEventListener("change", take);
  box.addEventListener("paste", () => setTimeout(take)); // once the box has the text
  copy.addEventListener("click", () => {
    navigator.clipboard.writeText(box.value).then(
      () => (copy.textContent = "Copied"),
      () => box.focus(), // without access to the clipboard the text is selected instead
    );
    setTimeout(() => (copy.textContent = "Copy camera"), 2000);
  });
  kit.onRefresh(show);
  show();
}
