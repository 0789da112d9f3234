// Streamlets and streamlines: lines that follow the flow.
import type GUI from "lil-gui";
import { keyAccess, type PanelKit } from "./panel_kit";
import { addSeeds, kindOf } from "./panel_seeds";

export function addTrace(folder: GUI, kit: PanelKit): void {
  const follows = kit.toggle(folder, "follow the flow", {
    pointer: "/vector/trace",
    get: (view) => (view.vector?.trace ?? null) !== null,
    set: (on) => ({ vector: { trace: on ? {} : null } }),
  });
  const segments = kit.number(folder, "pieces of a line", keyAccess("/vector/trace/segments"), {
    min: 1,
    max: 64,
    step: 1,
  });
  kit.showWhen((states) => states.traceable || states.traced, follows);
  const eachSample = (): boolean => kindOf(kit.host.view()) === "none";
  kit.showWhen((states) => states.traced && eachSample(), segments);
  addSeeds(folder, kit);
}
