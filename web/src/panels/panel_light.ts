// The sun of the view: where it is, how bright, and how media scatter its light.
import type GUI from "lil-gui";
import type { Controller } from "lil-gui";
import { depthCuePatch } from "./controls";
import { keyAccess, type PanelKit } from "./panel_kit";
import { minuteOf, sunAtStep } from "../view/sun_at";
import type { View } from "@windsplat/client";

type Light = NonNullable<View["light"]>;

export function addLight(gui: GUI, kit: PanelKit): void {
  const folder = kit.folder(gui, "Light");
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
  const by = addSunAt(folder, kit);
  const angles = [
    kit.number(folder, "sun from (°)", angle("azimuth"), { min: 0, max: 360, step: 1 }),
    kit.number(folder, "sun height (°)", angle("elevation"), { min: -10, max: 90, step: 1 }),
  ];
  kit.showWhen((states) => states.sunByAngles, ...angles);
  const brightness = kit.number(folder, "brightness", keyAccess<number>("/light/brightness"), {
    min: 0,
    max: 5,
    step: 0.05,
  });
  const more = kit.folder(folder, "Scattering and shadows");
  const controls = [
    by,
    brightness,
    kit.number(more, "shadows", keyAccess<number>("/light/shadows"), { max: 30, step: 0.1 }),
    kit.number(more, "ambient", keyAccess<number>("/light/ambient"), { step: 0.01 }),
    kit.number(more, "forward scattering", keyAccess<number>("/light/anisotropy"), {
      step: 0.01,
    }),
  ];
  kit.showWhen((states) => states.light, more, ...controls);
  addDepth(folder, kit);
}

// The sun at a time and place; returns the choice between these and a direction.
function addSunAt(folder: GUI, kit: PanelKit): Controller {
  const { host } = kit;
  const sunAt = () => host.view().light?.sunAt ?? null;
  const stepTime = () => sunAtStep(host.dataset(), host.view().step ?? 0);
  const by = kit.choice(
    folder,
    "sun by",
    {
      pointer: "/light/sunAt",
      get: () => (sunAt() === null ? "direction" : "place"),
      set: (kind) => ({ light: { sunAt: kind === "place" ? (sunAt() ?? stepTime()) : null } }),
    },
    { direction: "direction", "time and place": "place" },
  );
  const change = (part: object) => ({ light: { sunAt: { ...sunAt(), ...part } } });
  const time = kit.time(folder, "time (UTC)", {
    pointer: "/light/sunAt/utc",
    get: () => minuteOf(sunAt()?.utc ?? ""),
    set: (minute) => change({ utc: `${minute}Z` }),
  });
  const step = kit.action(folder, "At the time of the step", "The sun at the shown step", () => {
    host.change(change({ utc: stepTime().utc }));
  });
  const place = (["longitude", "latitude"] as const).map((key) =>
    kit.number(
      folder,
      `${key} (°)`,
      {
        pointer: `/light/sunAt/${key}`,
        get: () => sunAt()?.[key],
        set: (value) => change({ [key]: value }),
      },
      { step: 0.1 },
    ),
  );
  const timed = host.dataset().steps.times.some(({ text }) => minuteOf(text) !== null);
  kit.showWhen((states) => states.sunAt, time);
  kit.showWhen((states) => states.sunAt && timed, step);
  // On a globe the time alone counts.
  const flat = () => host.view().geometry?.mapping !== "sphere";
  kit.showWhen((states) => states.sunAt && flat(), ...place);
  return by;
}

// Light that does not come from the sun.
function addDepth(parent: GUI, kit: PanelKit): void {
  const folder = kit.folder(parent, "Depth and background");
  const strength = kit.number(folder, "depth cue", keyAccess("/depthCue/strength"));
  const ends = (["near", "far"] as const).map((end) =>
    kit.number(
      folder,
      end === "near" ? "darkens from" : "darkest at",
      {
        pointer: `/depthCue/${end}`,
        get: (view) => view.depthCue?.[end],
        set: (value) => depthCuePatch(kit.host.view(), end, value),
      },
      { min: -1, max: 2, step: 0.01 },
    ),
  );
  kit.enableWhen((states) => states.lines, strength);
  kit.enableWhen((states) => states.depthCue, ...ends);
  kit.color(folder, "background", keyAccess("/image/background"));
}
