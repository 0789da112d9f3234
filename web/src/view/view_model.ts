// The page's view: its explicit keys, the open dataset and the view drawn last -> the view with all
// known defaults, and its camera.
import type { Camera } from "./camera";
import { fitView } from "./fit_view";
import type { ChosenMessage, Dataset, View } from "../wire/protocol";
import { completeView, ViewState } from "./view_state";

export class ViewModel {
  readonly state = new ViewState();
  open: Dataset | null = null; // the displayed dataset
  private drawn: View | null = null; // as completed by the server

  // The view of the newest frame, overridden by the explicit keys set since.
  view(): View {
    const explicit = this.state.document;
    const drawn = this.drawn?.dataset === explicit.dataset ? this.drawn : undefined;
    const open = this.open?.id === explicit.dataset ? this.open?.defaultView : undefined;
    return completeView(drawn ?? open ?? {}, explicit);
  }

  dataset(): Dataset {
    if (this.open === null) throw new Error("no dataset is open");
    return this.open;
  }

  camera(): Camera | null {
    const camera = this.view().camera;
    if (this.open === null || !camera?.eye || !camera.target) return null;
    return {
      projection: camera.projection ?? "perspective",
      eye: camera.eye,
      target: camera.target,
      up: camera.up ?? [0, 0, 1],
      fovY: camera.fovY ?? 35,
      height: camera.height ?? 2,
    };
  }

  // For a moving frame the server may choose the method, which can differ from that of the final
  // frame. Only explicit keys of `quality` count: its defaults come from the protocol, and a
  // removed key must not survive from an older frame.
  drew(chosen: ChosenMessage, final: boolean): void {
    const { quality: _quality, ...view } = chosen.view as View;
    const method = final ? view.method : (this.view().method ?? view.method);
    this.drawn = { ...view, method };
  }

  // The view drawn on the canvas if it belongs to the open dataset; null otherwise.
  drawnView(): View | null {
    return this.open !== null && this.drawn?.dataset === this.open.id ? this.drawn : null;
  }

  // The files of the open dataset have changed.
  fitDrawn(dataset: Dataset): void {
    if (this.drawn?.dataset !== dataset.id) return;
    this.drawn = completeView(dataset.defaultView ?? {}, fitView(this.drawn, dataset));
  }
}
