// The page's view: its explicit keys, the open dataset and the view drawn last -> the view with all
// known defaults, and its camera. Keys removed since the last picture have their defaults at once.
import type { Camera } from "./camera";
import { fitView } from "./fit_view";
import type { ChosenMessage, Dataset, View } from "../wire/protocol";
import { isObject } from "../base/values";
import { completeView, ViewState } from "./view_state";

// `drawn` without the keys that were explicit in `before` and are no longer: they have their values
// in `defaults`, if these are known. Values beside another field than that of `defaults` belong to
// this field and stay until the next picture.
function withoutRemoved(drawn: unknown, before: unknown, now: unknown, defaults: unknown): unknown {
  if (!isObject(drawn) || !isObject(before)) return drawn;
  const kept = { ...drawn };
  const [known, left] = [isObject(defaults) ? defaults : {}, isObject(now) ? now : {}];
  if ("field" in left && left.field !== known.field) return drawn;
  for (const [key, value] of Object.entries(before)) {
    if (key in left) kept[key] = withoutRemoved(kept[key], value, left[key], known[key]);
    else if (key in known) kept[key] = known[key];
    else delete kept[key];
  }
  return kept;
}

export class ViewModel {
  readonly state = new ViewState();
  open: Dataset | null = null; // the displayed dataset
  private drawn: View | null = null; // as completed by the server
  private drawnKeys: View = {}; // its explicit keys

  // The view of the newest frame, changed by the explicit keys set and removed since. A camera that
  // was removed is known with the next frame: its default depends on all of the view.
  view(): View {
    const explicit = this.state.document;
    const drawn = this.drawn?.dataset === explicit.dataset ? this.drawn : undefined;
    const open = this.open?.id === explicit.dataset ? this.open?.defaultView : undefined;
    if (drawn === undefined) return completeView(open ?? {}, explicit);
    const { camera: _camera, ...keys } = this.drawnKeys;
    return completeView(withoutRemoved(drawn, keys, explicit, open) as View, explicit);
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
    this.drawnKeys = this.state.settled;
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
