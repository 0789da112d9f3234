// The panels beside the picture, ordered by task: data, vectors, volumes, surfaces, place, light,
// time and quality, each only where the dataset can use it. Rebuilt for each dataset.
import GUI from "lil-gui";
import {
  compositingHints,
  compositingOptions,
  detailHints,
  detailOptions,
  hasErrorLimit,
  methodHints,
  methodOptions,
  qualityHint,
} from "./controls";
import { errorMetric } from "../base/error_text";
import { ForecastPlot } from "./forecast_plot";
import { addSection, addPlace, type CameraSwitch } from "./panel_geometry";
import { Kept, keyAccess, PanelKit, type PanelHost } from "./panel_kit";
import { addDifference, type DifferenceActions } from "./panel_difference";
import { addLight } from "./panel_light";
import { addLines } from "./panel_lines";
import { addMedia } from "./panel_media";
import type { SeedPoints } from "./seed_points";
import { ProbePanel } from "./panel_probe";
import { addPresets, type PresetSwitch } from "./panel_presets";
import { addRegion } from "./panel_region";
import { addSurfaces } from "./panel_surfaces";
import { addTime, type FlowSwitch } from "./panel_time";
import { middleSample, sampleWithin, type Sample } from "../view/sample_position";
import { videoUse, type VideoUse } from "../view/video_setting";

const streamBudgetMs = 33; // for streams whose view names no budget
const firstLimit = 0.01; // initial error limit when one is switched on; linear RMSE

export interface PanelActions extends CameraSwitch, FlowSwitch, PresetSwitch, DifferenceActions {
  reset(): void; // restores the dataset's defaults
  probed(): void; // the probe was moved or switched
  cropped(): void; // the region may have changed, or its folder was opened or closed
}

export class Panels {
  private gui: GUI | null = null;
  private kit: PanelKit | null = null;
  probe: ProbePanel | null = null;
  seeds: SeedPoints | null = null;
  cropping = (): boolean => false; // the folder of the region is open
  private readonly kept = new Kept();
  private of = ""; // id of the dataset for which the panels were built

  constructor(
    private readonly container: HTMLElement,
    private readonly host: PanelHost,
    private readonly actions: PanelActions,
  ) {
    errorMetric.watch(() => this.refresh());
  }

  build(): void {
    this.gui?.destroy();
    const gui = new GUI({
      container: this.container,
      title: "View",
      injectStyles: false, // the page's style sheet includes lil-gui's styles
    });
    const kit = new PanelKit(this.host, this.kept);
    this.gui = gui;
    this.kit = kit;
    addPresets(gui, kit, this.actions);
    const data = kit.folder(gui, "Data");
    addSection(data, kit);
    const region = addRegion(data, kit, () => this.actions.cropped());
    this.cropping = () => !region._closed;
    this.probe = new ProbePanel(data, kit, () => this.actions.probed(), this.probePlace());
    this.seeds = addLines(gui, kit);
    addMedia(gui, kit);
    addSurfaces(gui, kit);
    addPlace(gui, kit, this.actions);
    addLight(gui, kit);
    addTime(gui, kit, this.actions);
    addDifference(gui, kit, this.actions);
    addQuality(gui, kit);
    kit.action(gui, "All defaults", "Everything back to the dataset's defaults", () =>
      this.actions.reset(),
    );
    this.kept.folders.watch(gui);
  }

  // The last probe position in this dataset.
  private probePlace(): Sample {
    const dataset = this.host.dataset();
    const before = this.of === dataset.id ? this.probe : null;
    this.of = dataset.id;
    return before === null ? middleSample(dataset) : sampleWithin(dataset, before.place);
  }

  refresh(): void {
    this.kit?.refresh();
  }
}

function addMethod(parent: GUI, kit: PanelKit): void {
  const folder = kit.folder(parent, "Method");
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
  const folder = kit.folder(gui, "Quality");
  const { host } = kit;
  const budget = () => host.view().quality?.budgetMs ?? streamBudgetMs;
  kit.number(
    folder,
    "moving budget (ms)",
    {
      pointer: "/quality/budgetMs",
      get: budget,
      set: (budgetMs) => ({ quality: { budgetMs } }),
    },
    { min: 1, max: 500, step: 1 },
  );
  const plot = new ForecastPlot({
    view: () => host.view(),
    playing: () => host.playing(),
    frame: () => host.frame(),
    load: (view) => host.api.forecast(view),
    budget,
    setBudget: (budgetMs) => host.change({ quality: { budgetMs } }),
    maxError: () => host.view().quality?.maxError ?? null,
    setMaxError: (maxError) => host.change({ quality: { maxError } }),
  });
  folder.$children.append(plot.element);
  kit.onRefresh(() => plot.refresh());
  let lastLimit = firstLimit;
  kit.toggle(folder, "limit the error", {
    pointer: "/quality/maxError",
    get: hasErrorLimit,
    set: (on) => ({ quality: { maxError: on ? lastLimit : null } }),
  });
  const limit = kit.logarithmic(folder, "max error (linear RMSE)", {
    pointer: "/quality/maxError",
    get: (view) => view.quality?.maxError,
    set: (maxError) => {
      lastLimit = maxError;
      return { quality: { maxError } };
    },
  });
  kit.showWhen((states) => states.errorLimit, limit);
  kit.note(folder, () => qualityHint(host.view()));
  kit.toggle(folder, "lossless final", keyAccess("/quality/lossless"));
  const video = { value: videoUse.value };
  folder
    .add(video, "value", ["auto", "never"] satisfies VideoUse[])
    .name("video for slow links")
    .onChange((use: VideoUse) => videoUse.set(use));
  addMethod(folder, kit);
}
