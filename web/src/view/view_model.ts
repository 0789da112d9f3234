// The page's view: its explicit keys, the dataset that is open and what was drawn
// last -> the view with every default that is known, and its camera.
import type { Camera } from "./camera";
import { fitView } from "./fit_view";
import type { ChosenMessage, Dataset, View } from "../wire/protocol";
import { completeView, ViewState } from "./view_state";

export class ViewModel {
  readonly state = new ViewState();
  open: Dataset | null = null; // what is shown
  private drawn: View | null = null; // as the server completed it

  // The view of the newest frame, under the explicit keys set since.
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

  // The method of a moving frame may be the server's own choice for its budget, and is not what
  // the final one will be drawn with. Of `quality` only explicit keys count: its defaults
  // are the wire's, and what was taken back is not to live on in an older frame.
  drew(chosen: ChosenMessage, final: boolean): void {
    const { quality: _quality, ...view } = chosen.view as View;
    const method = final ? view.method : (this.view().method ?? view.method);
    this.drawn = { ...view, method };
  }

  // What the frame on the canvas shows of the dataset that is open; null: nothing.
  drawnView(): View | null {
    return this.open !== null && this.drawn?.dataset === this.open.id ? this.drawn : null;
  }

  // The files of what is open have changed.
  fitDrawn(dataset: Dataset): void {
    if (this.drawn?.dataset !== dataset.id) return;
    this.drawn = completeView(dataset.defaultView ?? {}, fitView(this.drawn, dataset));
  }
}
