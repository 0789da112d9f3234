// Events of <windsplat-view>. All of them bubble and cross shadow roots.
import type { Camera } from "../view/camera";
import type { Feature } from "../wire/api";
import type { FrameHeader, Problem, View } from "../wire/protocol";

export interface FrameDetail {
  header: FrameHeader;
  final: boolean; // no better picture follows until the view changes
  step: number;
  view: View | null; // as drawn, with all values that the server chose; null: not told
}

export interface ViewDetail {
  view: View; // its explicit keys, without the size of the picture
  camera: Camera | null; // null: not known yet
  step: number;
}

/**
 * connection: no stream; login: the token is missing or wrong; dataset, view: the server refuses
 * it; attribute: not understood; frame: could not be decoded; pick: the server refuses a pick.
 */
export type ErrorKind =
  "connection" | "login" | "dataset" | "view" | "attribute" | "frame" | "pick";

export interface ErrorDetail {
  kind: ErrorKind;
  message: string;
  problem: Problem | null; // as the server told it
}

export interface PickDetail {
  x: number; // fractions of the picture from its upper left corner
  y: number;
  feature: Feature | null; // null: nothing of the data is seen there
}

export interface WindsplatEvents {
  "windsplat-frame": CustomEvent<FrameDetail>;
  "windsplat-view": CustomEvent<ViewDetail>;
  "windsplat-error": CustomEvent<ErrorDetail>;
  "windsplat-pick": CustomEvent<PickDetail>;
}

/**
 * What JSX may set on the element, for the declarations of frameworks
 * (`JSX.IntrinsicElements`).
 */
export type WindsplatProperties = {
  src?: string | undefined;
  dataset?: string | undefined;
  view?: View | string | undefined;
  token?: string | undefined;
  step?: number | undefined;
  label?: string | undefined;
  controls?: boolean | undefined;
  interactive?: boolean | "true" | "false" | undefined;
  pick?: boolean | undefined;
} & { [K in keyof WindsplatEvents as `on${K}`]?: (event: WindsplatEvents[K]) => void };
