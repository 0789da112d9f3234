// The region: ranges of the axes, a filter by another field, and a polygon from a GeoJSON file.
import type GUI from "lil-gui";
import type { Controller } from "lil-gui";
import { failureText } from "../base/problem_text";
import { make } from "../base/dom";
import { formatNumber } from "../base/ticks";
import { fieldOptions, showsTheEarth } from "./controls";
import { vectorsTitle } from "../view/words";
import { unitText } from "../view/unit_text";
import { axisNames, axisUnit } from "../view/sample_position";
import { polygonFrom } from "../view/geo_polygon";
import type { PanelKit } from "./panel_kit";
import type { Dataset, View } from "@windsplat/client";

type Ends = [number, number];
const everywhere = ""; // no filter

// Lowest and highest coordinate of an axis.
export function extentOf(dataset: Dataset, axis: "x" | "y" | "z"): Ends {
  const { coordinates } = dataset.axes[axis];
  return [Math.min(...coordinates), Math.max(...coordinates)];
}

// The range that the view has, or the whole axis.
export const rangeOf = (dataset: Dataset, view: View, axis: "x" | "y" | "z"): Ends =>
  view.region?.[axis] ?? extentOf(dataset, axis);

function addRanges(folder: GUI, kit: PanelKit): void {
  const dataset = kit.host.dataset();
  for (const axis of axisNames) {
    const { coordinates, name, units } = dataset.axes[axis];
    if (coordinates.length < 2) continue;
    const unit = axisUnit(units);
    kit.range(
      folder,
      name || axis,
      {
        pointer: `/region/${axis}`,
        get: (view) => rangeOf(dataset, view, axis),
        set: (range) => ({ region: { [axis]: range } }),
      },
      unit,
    );
  }
}

// Degrees for columns that have longitudes and latitudes of their own.
const degrees = [
  ["longitudes", "longitude", [-180, 180], "°E"],
  ["latitudes", "latitude", [-90, 90], "°N"],
] as const;

// Of axes that are longitude and latitude themselves they would say the same again.
export const offersDegrees = (dataset: Dataset): boolean =>
  showsTheEarth(dataset) && dataset.axes.x.kind !== "longitude";

function addDegrees(folder: GUI, kit: PanelKit): void {
  if (!offersDegrees(kit.host.dataset())) return;
  for (const [key, label, whole, unit] of degrees) {
    kit.range(
      folder,
      label,
      {
        pointer: `/region/${key}`,
        get: (view) => view.region?.[key] ?? [...whole],
        set: (range) => ({ region: { [key]: range } }),
      },
      unit,
    );
  }
}

function addFilter(folder: GUI, kit: PanelKit): void {
  const dataset = kit.host.dataset();
  const fields = fieldOptions(dataset, "scalar");
  if (Object.keys(fields).length === 0) return;
  let choices = 0; // of fields; answers to earlier ones are too late
  let failure = "";
  const first = () => kit.host.view().region?.where?.[0];
  kit.choice(
    folder,
    `${vectorsTitle(dataset).toLowerCase()} only where`,
    {
      pointer: "/region/where",
      get: () => first()?.field ?? everywhere,
      set: (field) => {
        choices += 1;
        failure = "";
        if (field === everywhere) return { region: { where: [] } };
        void startRange(field);
        return null;
      },
    },
    { everywhere, ...fields },
  );
  // The upper half of the range of the field, from which the user goes on.
  const startRange = async (field: string): Promise<void> => {
    const choice = choices;
    const step = kit.host.view().step ?? 0;
    const isCurrent = () => choice === choices && kit.host.explicitView().dataset === dataset.id;
    try {
      const { difference } = kit.host.view();
      const { range } = await kit.host.api.range(dataset.id, field, step, difference);
      if (!isCurrent()) return;
      const [low, high] = range ?? [0, 1];
      kit.host.change({ region: { where: [{ field, range: [(low + high) / 2, high] }] } });
    } catch (reason) {
      if (isCurrent()) failure = failureText(reason);
      kit.refresh();
    }
  };
  const ends: Controller[] = kit.range(
    folder,
    "its values",
    {
      pointer: "/region/where",
      get: () => first()?.range as Ends | undefined,
      set: (range) => {
        const filter = first();
        if (filter === undefined || range[0] > range[1]) return null;
        return { region: { where: [{ ...filter, range }] } };
      },
    },
    "",
  );
  kit.note(folder, () => {
    if (failure !== "") return failure;
    const filter = first();
    if (filter === undefined) return "";
    const units = unitText(dataset.fields.find(({ name }) => name === filter.field)?.units);
    const [low, high] = filter.range.map((value) => formatNumber(value));
    return (
      `${vectorsTitle(dataset)} where ${filter.field} is ${low} to ${high} ${units}`.trim() + "."
    );
  });
  kit.showWhen(() => first() !== undefined, ...ends);
}

function addPolygon(folder: GUI, kit: PanelKit): void {
  const file = make("input");
  file.type = "file";
  file.accept = ".geojson,.json,application/geo+json";
  file.hidden = true;
  file.setAttribute("aria-label", "GeoJSON file of a polygon");
  let failure = "";
  file.addEventListener("change", () => {
    const chosen = file.files?.[0];
    file.value = "";
    if (chosen === undefined) return;
    void chosen.text().then((text) => {
      failure = "";
      try {
        kit.host.change({ region: { polygon: polygonFrom(text) } });
      } catch (reason) {
        failure = `${chosen.name}: ${reason instanceof Error ? reason.message : "not readable"}`;
      }
      kit.refresh();
    });
  });
  folder.$children.append(file);
  kit.action(folder, "polygon from a file…", "Columns within the polygons of a GeoJSON file", () =>
    file.click(),
  );
  kit.note(folder, () => {
    if (failure !== "") return failure;
    const polygon = kit.host.view().region?.polygon ?? null;
    if (polygon === null) return "";
    const count = polygon.type === "Polygon" ? 1 : polygon.coordinates.length;
    return count === 1 ? "Within a polygon." : `Within ${count} polygons.`;
  });
}

// Its handles over the picture are shown while the folder is open.
export function addRegion(parent: GUI, kit: PanelKit, changed: () => void): GUI {
  const folder = kit.folder(parent, "Region");
  addDegrees(folder, kit);
  addRanges(folder, kit);
  addFilter(folder, kit);
  addPolygon(folder, kit);
  kit.action(folder, "everything", "Draw all of the data again", () =>
    kit.host.change({ region: null }),
  );
  folder.onOpenClose(changed);
  kit.onRefresh(changed);
  return folder;
}
