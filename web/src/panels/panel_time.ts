// What changes with time: the step that is shown and the motion of the lines.
import type GUI from "lil-gui";
import { fieldOptions } from "./controls";
import { keyAccess, type PanelKit } from "./panel_kit";
import type { Dataset } from "@windsplat/client";

export interface FlowSwitch {
  flowing(): boolean;
  flow(on: boolean): void;
}

// The shown step as text, counted from 1.
export function stepText(dataset: Dataset, step: number): string {
  const { count, times } = dataset.steps;
  const time = times[step]?.text ?? "";
  return `Step ${step + 1} of ${count}${time === "" ? "" : `: ${time}`}.`;
}

export function addTime(gui: GUI, kit: PanelKit, flow: FlowSwitch): void {
  const dataset = kit.host.dataset();
  const moves = Object.keys(fieldOptions(dataset, "vector")).length > 0;
  const several = dataset.steps.count > 1;
  if (!moves && !several) return;
  const folder = kit.folder(gui, "Time");
  if (several) kit.note(folder, () => stepText(dataset, kit.host.view().step ?? 0));
  if (moves) addMotion(folder, kit, flow);
}

// Motion of the texture along the lines.
function addMotion(folder: GUI, kit: PanelKit, flow: FlowSwitch): void {
  const texture = kit.choice(folder, "texture", keyAccess("/vector/motion/mode"), {
    still: "still",
    "moves along the lines": "phase",
  });
  const rate = kit.number(folder, "cycles a step", keyAccess("/vector/motion/rate"), {
    min: -4,
    max: 4,
    step: 0.05,
  });
  const time = kit.number(folder, "time (steps)", keyAccess("/vector/motion/time"), {
    field: true,
  });
  const animate = kit.toggle(folder, "animate lines", {
    pointer: "/vector/motion/time",
    get: () => flow.flowing(),
    set: (on) => {
      flow.flow(on);
      return null;
    },
  });
  kit.showWhen((states) => states.lines, texture, animate);
  kit.showWhen((states) => states.motion, rate, time);
}
