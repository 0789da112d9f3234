// The panels at the picture's side: lines, media, view and quality. Built anew for each dataset.
import GUI from "lil-gui";
import { withProjection, type Camera } from "./camera";
import { unitText } from "./legend_entries";
import { addMedia } from "./panel_media";
import { fieldOptions, keyAccess, PanelKit, type Access, type PanelHost } from "./panel_kit";

const streamBudgetMs = 33; // of a stream whose view names none

export interface PanelActions {
  reset(): void; // back to the dataset's defaults
  camera(): Camera | null;
  setCamera(camera: Camera): void;
}

export class Panels {
  private gui: GUI | null = null;
  private kit: PanelKit | null = null;
  private readonly closed = new Set<string>(["Jitter", "Quality"]);

  constructor(
    private readonly container: HTMLElement,
    private readonly host: PanelHost,
    private readonly actions: PanelActions,
  ) {}

  build(): void {
    this.gui?.destroy();
    const gui = new GUI({ container: this.container, injectStyles: false, title: "View" });
    const kit = new PanelKit(this.host);
    this.gui = gui;
    this.kit = kit;
    this.addLines(gui, kit);
    addMedia(gui, kit);
    this.addCamera(gui, kit);
    this.addQuality(gui, kit);
    kit.action(gui, "All defaults", "Everything back to the dataset's defaults", () =>
      this.actions.reset(),
    );
    gui.onOpenClose((folder) => {
      if (folder._closed) this.closed.add(folder._title);
      else this.closed.delete(folder._title);
    });
    for (const folder of gui.foldersRecursive()) {
      if (this.closed.has(folder._title)) folder.close();
    }
  }

  refresh(): void {
    this.kit?.refresh();
  }

  private addLines(gui: GUI, kit: PanelKit): void {
    const dataset = this.host.dataset();
    const options = fieldOptions(dataset, "vector");
    if (Object.keys(options).length === 0) return;
    const folder = gui.addFolder("Lines");
    let named = Object.values(options)[0]!;
    const shown: Access<boolean> = {
      pointer: "/vector/field",
      get: (view) => view.vector?.field !== null,
      set: (on) => ({ vector: { field: on ? named : null } }),
    };
    kit.toggle(folder, "shown", shown);
    kit.choice(
      folder,
      "field",
      {
        pointer: "/vector/field",
        get: (view) => (named = view.vector?.field ?? named),
        set: (field) => ({ vector: { field } }),
      },
      options,
    );
    const view = this.host.view();
    const units = unitText(dataset.fields.find((field) => field.name === named)?.units);
    const per = units === "" ? "" : ` (${units})`;
    const top = view.vector?.magnitudeRange?.[1] ?? 1;
    const length = view.vector?.length ?? 0.05;
    kit.number(folder, "length", keyAccess("/vector/length"), {
      min: 0,
      max: Math.min(10, Number((5 * length).toPrecision(2))),
    });
    kit.number(
      folder,
      `longest at${per}`,
      {
        pointer: "/vector/magnitudeRange",
        get: (v) => v.vector?.magnitudeRange?.[1],
        set: (value) => {
          const low = this.host.view().vector?.magnitudeRange?.[0] ?? 0;
          return value > low ? { vector: { magnitudeRange: [low, value] } } : null;
        },
      },
      { min: 0, max: 2 * top },
    );
    kit.number(folder, `min |v|${per}`, keyAccess("/vector/minMagnitude"), { min: 0, max: top });
    kit.number(folder, "opacity", keyAccess("/vector/opacity"));
    this.addWidth(folder, kit);
    kit.number(folder, "white of the head", keyAccess("/vector/headDesaturation"));
    kit.number(folder, "bright by |v|", keyAccess("/vector/magnitudeIntensity"));
    kit.number(folder, "every n-th sample", keyAccess("/vector/stride"), {
      min: 1,
      max: 16,
      step: 1,
    });
    kit.number(folder, "kernel span", keyAccess("/vector/span"), { min: 0.5, max: 16 });
    this.addLineColor(folder, kit, per);
    this.addJitter(folder, kit);
  }

  // r1 <= r2 always: moving one beyond the other takes it along.
  private addWidth(folder: GUI, kit: PanelKit): void {
    const r = (key: "r1" | "r2") => this.host.view().vector?.[key] ?? 1;
    kit.number(
      folder,
      "core radius r1",
      {
        pointer: "/vector/r1",
        get: (view) => view.vector?.r1,
        set: (r1) => ({ vector: { r1, r2: Math.max(r1, r("r2")) } }),
      },
      { min: 0, max: 6 },
    );
    kit.number(
      folder,
      "edge radius r2",
      {
        pointer: "/vector/r2",
        get: (view) => view.vector?.r2,
        set: (r2) => ({ vector: { r1: Math.min(r("r1"), r2), r2 } }),
      },
      { min: 0, max: 8 },
    );
  }

  private addLineColor(parent: GUI, kit: PanelKit, per: string): void {
    const folder = parent.addFolder("Line colour");
    kit.choice(
      folder,
      "tells",
      {
        pointer: "/vector/color/by",
        get: (view) => view.vector?.color?.by,
        // The old range has another unit: back to the default of what is told now.
        set: (by) => ({ vector: { color: { by, range: null } } }),
      },
      {
        height: "worldZ",
        "distance from the eye": "screenZ",
        "height and rise": "rise",
        [`magnitude${per}`]: "magnitude",
        "nothing: one colour": "constant",
      },
    );
    const map = kit.map(folder, "map", keyAccess("/vector/color/map"));
    const start = folder.controllers.length;
    kit.range(folder, "colours", keyAccess("/vector/color/range"), "");
    const auto = kit.action(folder, "Default range", "Colour range back to the default", () =>
      this.host.change({ vector: { color: { range: null } } }),
    );
    const ranged = [map, auto, ...folder.controllers.slice(start)];
    const weight = kit.number(folder, "share of rise", keyAccess("/vector/color/riseWeight"));
    const constant = kit.color(folder, "colour", keyAccess("/vector/color/constant"));
    const reveal = () => {
      const by = this.host.view().vector?.color?.by;
      for (const controller of ranged) controller.show(by !== "constant");
      weight.show(by === "rise");
      constant.show(by === "constant");
    };
    kit.onRefresh(reveal);
    reveal();
  }

  private addJitter(parent: GUI, kit: PanelKit): void {
    const folder = parent.addFolder("Jitter");
    kit.number(folder, "line centre", keyAccess("/vector/jitter/center"));
    kit.number(folder, "kernel (stride)", keyAccess("/vector/jitter/stride"));
    kit.toggle(folder, "kernels overlap", keyAccess("/vector/jitter/overlap"));
    kit.number(folder, "pattern", keyAccess("/vector/jitter/seed"), { min: 0, max: 99, step: 1 });
    kit.toggle(folder, "new each step", keyAccess("/vector/jitter/perStep"));
  }

  private addCamera(gui: GUI, kit: PanelKit): void {
    const folder = gui.addFolder("Space");
    kit.choice(
      folder,
      "projection",
      {
        pointer: "/camera/projection",
        get: (view) => view.camera?.projection,
        set: (projection) => {
          const camera = this.actions.camera();
          if (camera === null) return { camera: { projection } };
          this.actions.setCamera(withProjection(camera, projection as Camera["projection"]));
          return null;
        },
      },
      { perspective: "perspective", orthographic: "orthographic" },
    );
    kit.number(folder, "field of view (°)", keyAccess("/camera/fovY"), { min: 5, max: 120 });
    kit.number(folder, "depth cue", keyAccess("/depthCue/strength"));
    kit.choice(folder, "vertical axis", keyAccess("/geometry/vertical"), {
      automatic: "auto",
      linear: "linear",
      "log p": "logp",
      index: "index",
    });
    kit.number(
      folder,
      "vertical stretch",
      {
        pointer: "/geometry/scale",
        get: (view) => view.geometry?.scale?.[2],
        set: (z) => {
          const scale = this.host.view().geometry?.scale ?? [1, 1, 1];
          return { geometry: { scale: [scale[0], scale[1], z] } };
        },
      },
      { min: 0.1, max: 10 },
    );
    kit.color(folder, "background", keyAccess("/image/background"));
  }

  private addQuality(gui: GUI, kit: PanelKit): void {
    const folder = gui.addFolder("Quality");
    kit.number(
      folder,
      "moving budget (ms)",
      {
        pointer: "/quality/budgetMs",
        get: (view) => view.quality?.budgetMs ?? streamBudgetMs,
        set: (budgetMs) => ({ quality: { budgetMs } }),
      },
      { min: 5, max: 500, step: 1 },
    );
    kit.number(folder, "stop transmittance", keyAccess("/method/stopTransmittance"), {
      min: 0,
      max: 0.05,
      step: 0.0001,
    });
  }
}
