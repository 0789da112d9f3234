// The section of the data that is drawn, the place of the data in the world, and the camera.
import type GUI from "lil-gui";
import { withProjection, type Camera, type Dataset } from "@windsplat/client";
import {
  exaggerationText,
  fieldOptions,
  heightOptions,
  mappingOptions,
  endTrace,
  ownHeight,
  obliquePlane,
  planePatch,
  shapePatch,
  sliceIndexMax,
  sliceOptions,
  slicePatch,
  sliceText,
  wholeVolume,
} from "./controls";
import { addAnnotations } from "./panel_annotations";
import { addCameraNumbers } from "./panel_camera";
import { addGround } from "./panel_ground";
import { keyAccess, type PanelKit } from "./panel_kit";

type Mapping = Dataset["mappings"][number];

export interface CameraSwitch {
  camera(): Camera | null;
  setCamera(camera: Camera): void;
}

export function addPlace(gui: GUI, kit: PanelKit, camera: CameraSwitch): void {
  const folder = kit.folder(gui, "Place");
  addShape(folder, kit);
  addGround(folder, kit);
  addAnnotations(folder, kit);
  addCamera(folder, kit, camera);
}

function addShape(folder: GUI, kit: PanelKit): void {
  const dataset = kit.host.dataset();
  const mappings = mappingOptions(dataset);
  const mapping = kit.choice(
    folder,
    "shape",
    {
      ...keyAccess<string>("/geometry/mapping"),
      set: (shape) => shapePatch(kit.host.view(), { mapping: shape as Mapping }),
    },
    mappings,
  );
  if (Object.keys(mappings).length < 2) {
    kit.showWhen(() => kit.host.view().geometry?.mapping !== "flat", mapping);
  }
  addStretch(folder, kit, "vertical stretch", 2);
  kit.note(folder, () => exaggerationText(dataset, kit.host.view()));
  kit.choice(folder, "vertical axis", keyAccess("/geometry/vertical"), {
    automatic: "auto",
    linear: "linear",
    "log p": "logp",
    index: "index",
    "to scale": "metric",
  });
  if (Object.keys(fieldOptions(dataset, "scalar")).length > 0) {
    kit.choice(
      folder,
      "height field",
      {
        pointer: "/geometry/heightField",
        get: (view) => view.geometry?.heightField ?? ownHeight,
        set: (name) =>
          shapePatch(kit.host.view(), { heightField: name === ownHeight ? null : name }),
      },
      heightOptions(dataset),
    );
  }
  const more = kit.more(folder);
  addStretch(more, kit, "stretch in x", 0);
  addStretch(more, kit, "stretch in y", 1);
}

function addStretch(folder: GUI, kit: PanelKit, label: string, axis: 0 | 1 | 2): void {
  kit.number(
    folder,
    label,
    {
      pointer: "/geometry/scale",
      get: (view) => view.geometry?.scale?.[axis],
      set: (factor) => {
        const scale = [...(kit.host.view().geometry?.scale ?? [1, 1, 1])];
        scale[axis] = factor;
        return { geometry: { scale } };
      },
    },
    { min: 0.1, max: 10 },
  );
}

export function addSection(parent: GUI, kit: PanelKit): void {
  const folder = kit.folder(parent, "Section");
  const dataset = kit.host.dataset();
  const slice = () => kit.host.view().geometry?.slice ?? null;
  kit.choice(
    folder,
    "slice",
    {
      pointer: "/geometry/slice",
      get: (view) => slice()?.axis ?? (view.geometry?.plane ? obliquePlane : wholeVolume),
      set: (axis) => endTrace(kit.host.view(), slicePatch(dataset, axis)),
    },
    (view) => sliceOptions(dataset, view),
  );
  const index = kit.number(
    folder,
    "layer",
    {
      pointer: "/geometry/slice/index",
      get: () => Math.floor(slice()?.index ?? 0),
      set: (layer) => {
        const axis = slice()?.axis;
        return axis === undefined ? null : { geometry: { slice: { axis, index: layer } } };
      },
    },
    { min: 0, max: sliceIndexMax(dataset, slice()?.axis ?? "z"), step: 1 },
  );
  const between = kit.number(
    folder,
    "toward the next layer",
    {
      pointer: "/geometry/slice/index",
      get: () => (slice()?.index ?? 0) % 1,
      set: (part) => {
        const { axis, index: at } = slice() ?? {};
        if (axis === undefined || at === undefined) return null;
        const next = Math.min(Math.floor(at) + part, sliceIndexMax(dataset, axis));
        return { geometry: { slice: { axis, index: next } } };
      },
    },
    { min: 0, max: 0.95, step: 0.05 },
  );
  let axis = slice()?.axis;
  kit.onRefresh(() => {
    const next = slice()?.axis;
    if (next === undefined || next === axis) return;
    axis = next;
    index.max(sliceIndexMax(dataset, next));
    index.updateDisplay();
  });
  kit.showWhen((states) => states.slice, index, between);
  addPlane(folder, kit);
  kit.note(folder, () => sliceText(dataset, kit.host.view()));
}

function addPlane(folder: GUI, kit: PanelKit): void {
  const { min, max } = kit.host.dataset().world;
  const numbers = (["point", "normal"] as const).flatMap((key) =>
    (["x", "y", "z"] as const).map((axis, at) =>
      kit.number(
        folder,
        `plane ${key} ${axis}`,
        {
          pointer: `/geometry/plane/${key}`,
          get: (view) => view.geometry?.plane?.[key][at],
          set: (to) => planePatch(kit.host.view(), key, at, to),
        },
        key === "point"
          ? { min: min[at], max: max[at], step: 0.01 }
          : { min: -1, max: 1, step: 0.01 },
      ),
    ),
  );
  kit.showWhen((states) => states.plane, ...numbers);
}

function addCamera(parent: GUI, kit: PanelKit, camera: CameraSwitch): void {
  const folder = kit.folder(parent, "Camera");
  kit.choice(
    folder,
    "projection",
    {
      pointer: "/camera/projection",
      get: (view) => view.camera?.projection,
      set: (projection) => {
        const now = camera.camera();
        if (now === null) return { camera: { projection } };
        camera.setCamera(withProjection(now, projection as Camera["projection"]));
        return null;
      },
    },
    { perspective: "perspective", orthographic: "orthographic" },
  );
  const fovY = kit.number(folder, "field of view (°)", keyAccess("/camera/fovY"), {
    min: 5,
    max: 120,
  });
  kit.showWhen((states) => states.fovY, fovY);
  addCameraNumbers(folder, kit, () => camera.camera());
}
