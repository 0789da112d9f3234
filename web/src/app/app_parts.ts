// The parts of the page that the application controller drives.
import type { BesidePicture } from "./beside";
import type { Cards } from "./dataset_cards";
import type { DatasetList } from "./dataset_list";
import type { EntryPicker } from "./entry_picker";
import type { Gizmo } from "../viewport/gizmo";
import type { HoverView } from "../viewport/hover_view";
import type { Hud } from "../viewport/hud";
import type { Legend } from "../viewport/legend";
import type { Login } from "./login";
import type { Panels } from "../panels/panels";
import type { Probe } from "../viewport/probe";
import type { Status } from "./status";
import type { TimeBar } from "./time_bar";
import type { Viewport } from "@windsplat/client/parts";

export interface AppParts {
  viewport: Viewport;
  hud: Hud;
  beside: Pick<BesidePicture, "follow" | "suffix" | "take">;
  legend: Legend;
  gizmo: Gizmo;
  panels: Panels;
  timeBar: TimeBar;
  status: Status;
  login: Pick<Login, "ask" | "done">;
  picker: HTMLSelectElement;
  entries: EntryPicker;
  probe: Probe;
  hover: HoverView;
  list: DatasetList;
  cards: Pick<Cards, "show">;
  facts: HTMLElement; // dimensions and number of steps of the dataset
}
