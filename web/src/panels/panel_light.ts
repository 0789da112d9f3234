// The sun of the view: where it is, how bright, and how media scatter its light.
import type GUI from "lil-gui";
import { keyAccess, type PanelKit } from "./panel_kit";
import type { View } from "../wire/protocol";

type Light = NonNullable<View["light"]>;

export function addLight(gui: GUI, kit: PanelKit): void {
  const folder = gui.addFolder("Light");
  let last: Light = {}; // before it was switched off
  kit.toggle(folder, "sunlight", {
    pointer: "/light",
    get: (view) => (view.light ?? null) !== null,
    set: (on) => {
      last = kit.host.view().light ?? last;
      return { light: on ? { ...last } : null };
    },
  });
  // A direction replaces one that follows from time and place.
  const angle = (key: "azimuth" | "elevation") => ({
    pointer: `/light/${key}`,
    get: (view: View) => view.light?.[key],
    set: (value: number) => ({ light: { [key]: value, sunAt: null } }),
  });
  const controls = [
    kit.number(folder, "sun from (°)", angle("azimuth"), { min: 0, max: 360, step: 1 }),
    kit.number(folder, "sun height (°)", angle("elevation"), { min: -10, max: 90, step: 1 }),
    kit.number(folder, "brightness", keyAccess<number>("/light/brightness"), {
      min: 0,
      max: 5,
      step: 0.05,
    }),
    kit.number(folder, "shadows", keyAccess<number>("/light/shadows"), { max: 30, step: 0.1 }),
    kit.number(folder, "ambient", keyAccess<number>("/light/ambient"), { step: 0.01 }),
    kit.number(folder, "forward scattering", keyAccess<number>("/light/anisotropy"), {
      step: 0.01,
    }),
  ];
  kit.showWhen((states) => states.light, ...controls);
}
