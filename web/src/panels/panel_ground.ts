// The ground: whether it is drawn, and what it shows of the Earth.
import type GUI from "lil-gui";
import { groundOptions, showsTheEarth } from "./controls";
import { keyAccess, type PanelKit } from "./panel_kit";

export function addGround(parent: GUI, kit: PanelKit): void {
  const folder = kit.folder(parent, "Ground");
  kit.choice(folder, "show", keyAccess("/ground/show"), groundOptions);
  const color = kit.color(folder, "surface colour", keyAccess("/ground/surfaceColor"));
  if (!showsTheEarth(kit.host.dataset())) {
    kit.showWhen((states) => states.ground, color);
    return;
  }
  const toggle = (label: string, key: string) =>
    kit.toggle(folder, label, keyAccess<boolean>(`/ground/${key}`));
  const lines = [
    toggle("coastlines", "coastlines"),
    toggle("borders", "borders"),
    toggle("graticule", "graticule"),
  ];
  const tint = toggle("tint land and sea", "tint");
  const tints = [
    kit.color(folder, "land", keyAccess("/ground/landColor")),
    kit.color(folder, "sea", keyAccess("/ground/seaColor")),
  ];
  const line = kit.color(folder, "lines", keyAccess("/ground/lineColor"));
  kit.showWhen((states) => states.ground, ...lines, tint, line);
  kit.showWhen((states) => states.ground && states.tint, ...tints);
  kit.showWhen((states) => states.ground && !states.tint, color);
}
