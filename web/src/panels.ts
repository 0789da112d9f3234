// The panels at the picture's side: lines, media, geometry, camera, method and quality. Built anew
// for each dataset.
import GUI from "lil-gui";
import {
  compositingHints,
  compositingOptions,
  detailHints,
  detailOptions,
  methodHints,
  methodOptions,
} from "./controls";
import { addLines, type FlowSwitch } from "./panel_lines";
import { addMedia } from "./panel_media";
import { keyAccess, PanelKit, type PanelHost } from "./panel_kit";
import { addCamera, addGeometry, type CameraSwitch } from "./panel_space";

const streamBudgetMs = 33; // of a stream whose view names none

export interface PanelActions extends CameraSwitch, FlowSwitch {
  reset(): void; // back to the dataset's defaults
}

export class Panels {
  private gui: GUI | null = null;
  private kit: PanelKit | null = null;
  private readonly closed = new Set<string>([
    "Line shape",
    "Kernels and jitter",
    "Motion",
    "Geometry",
    "Camera and depth",
    "Method",
    "Quality",
  ]);

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
    addLines(gui, kit, this.actions);
    addMedia(gui, kit);
    addGeometry(gui, kit);
    addCamera(gui, kit, this.actions);
    addMethod(gui, kit);
    addQuality(gui, kit);
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
}

function addMethod(gui: GUI, kit: PanelKit): void {
  const folder = gui.addFolder("Method");
  const { host } = kit;
  kit.choice(folder, "method", keyAccess("/method/name"), methodOptions);
  kit.note(folder, () => methodHints[host.view().method?.name ?? ""] ?? "");
  const thickness = kit.number(folder, "slab thickness", keyAccess("/method/slabThickness"), {
    min: 0.05,
    max: 8,
    step: 0.05,
  });
  kit.showWhen((states) => states.slab, thickness);
  kit.choice(folder, "compositing", keyAccess("/method/compositing"), compositingOptions);
  kit.note(folder, () => compositingHints[host.view().method?.compositing ?? ""] ?? "");
  kit.choice(folder, "detail", keyAccess("/method/detail"), detailOptions);
  kit.note(folder, () => detailHints[host.view().method?.detail ?? ""] ?? "");
  kit.number(folder, "stop transmittance", keyAccess("/method/stopTransmittance"), {
    min: 0,
    max: 0.05,
    step: 0.0001,
  });
}

function addQuality(gui: GUI, kit: PanelKit): void {
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
}
