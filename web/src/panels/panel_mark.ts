// How lines show their direction and their order in depth: shape, whitening, dark tails and halos.
import type GUI from "lil-gui";
import { keyAccess, type PanelKit } from "./panel_kit";

const shapes = {
  line: "line",
  "taper (point ahead)": "taper",
  arrow: "arrow",
  "comet (bright end ahead)": "comet",
};

export function addMark(folder: GUI, kit: PanelKit): void {
  kit.choice(folder, "mark of lines", keyAccess("/vector/mark/shape"), shapes);
  const head = { min: 1, max: 30, step: 0.5 };
  const width = kit.number(folder, "head width", keyAccess("/vector/mark/headWidth"), head);
  const length = kit.number(folder, "head length", keyAccess("/vector/mark/headLength"), head);
  kit.showWhen((states) => states.arrow, width, length);
  const white = kit.number(folder, "head whitening", keyAccess("/vector/headDesaturation"));
  kit.showWhen((states) => states.whitened, white);
  kit.number(folder, "tail darkening", keyAccess("/vector/mark/tailDarkening"), {
    min: 0,
    max: 1,
  });
  kit.number(folder, "halo", keyAccess("/vector/mark/halo"), { min: 0, max: 6, step: 0.1 });
}
