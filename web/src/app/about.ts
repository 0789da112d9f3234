// "About this dataset": what the file has, how it was read and what was left out of it.
import { byId, make } from "../base/dom";
import { formatBytes, formatNumber } from "../base/ticks";
import { readableTime } from "@windsplat/client/parts";
import { unitText } from "../view/unit_text";
import { axisUnit, valueOnAxis } from "../view/sample_position";
import type { Dataset } from "@windsplat/client";

type Axis = Dataset["axes"]["x"];
type Level = NonNullable<Dataset["levels"]>[number];
type Row = readonly [name: string, text: string];

export interface AboutSection {
  title: string;
  rows: Row[];
}

const withUnits = (text: string, units: string): string =>
  units === "" ? text : `${text} ${units}`;

function axisRow(axis: Axis): Row {
  const { coordinates } = axis;
  const [first, last] = [coordinates[0] ?? NaN, coordinates.at(-1) ?? NaN];
  const text = (value: number): string => valueOnAxis(value, axis.units);
  // One unit serves both unless one lies west or south.
  const isPlace = axisUnit(axis.units).startsWith("°");
  const from = isPlace && Math.min(first, last) < 0 ? text(first) : formatNumber(first);
  const range = coordinates.length > 1 ? `${from} to ${text(last)}` : text(first);
  const samples = coordinates.length === 1 ? "one sample" : `${coordinates.length} samples`;
  return [axis.name, `${range}, ${samples}`];
}

function stepsText({ count, times }: Dataset["steps"]): string {
  const first = readableTime(times[0]?.text ?? "");
  const last = readableTime(times.at(-1)?.text ?? "");
  if (count === 1) return first === "" ? "one" : first;
  return `${count}, from ${first} to ${last}`;
}

function fieldRow(field: Dataset["fields"][number]): Row {
  const units = unitText(field.units);
  const range = field.range
    ? withUnits(`${formatNumber(field.range[0])} to ${formatNumber(field.range[1])}`, units)
    : units;
  const long = field.longName ?? "";
  return [field.name, [long === field.name ? "" : long, range].filter((part) => part).join("; ")];
}

function levelRow({ dims, bricks, storedBytes, residentBytes }: Level, number: number): Row {
  const count = bricks === 1 ? "one brick" : `${bricks} bricks`;
  const stored = storedBytes === undefined ? "" : `, ${formatBytes(storedBytes)} on disk`;
  const resident = residentBytes === 0 ? "" : `, ${formatBytes(residentBytes)} in memory`;
  const samples = `${dims.x} x ${dims.y} x ${dims.z} samples`;
  return [String(number), `${samples} in ${count}${stored}${resident}`];
}

// Only what the description has: a dataset without notes has no section of notes.
export function aboutSections(dataset: Dataset): AboutSection[] {
  const { axes, fields, leftOut, levels, notes, source, format, steps } = dataset;
  const sections: AboutSection[] = [
    {
      title: "Data",
      rows: [
        ["source", `${source} (${format})`],
        axisRow(axes.x),
        axisRow(axes.y),
        axisRow(axes.z),
        ["steps", stepsText(steps)],
      ],
    },
    { title: "Fields", rows: fields.map(fieldRow) },
    { title: "Levels of detail", rows: (levels ?? []).map(levelRow) },
    { title: "Left out", rows: leftOut.map(({ name, reason }) => [name, reason] as const) },
    { title: "Notes", rows: notes.map((note) => ["", note] as const) },
  ];
  return sections.filter(({ rows }) => rows.length > 0);
}

export class About {
  private readonly dialog = byId("about", HTMLDialogElement);
  private readonly title = byId("about-title", HTMLElement);
  private readonly body = byId("about-body", HTMLElement);
  private shown = "";

  constructor(private readonly describe: (id: string) => Promise<Dataset>) {}

  // Of a dataset with levels it is asked for what is in memory by now.
  show(dataset: Dataset): void {
    this.shown = dataset.id;
    this.fill(dataset);
    this.dialog.showModal();
    if (dataset.levels === undefined) return;
    this.describe(dataset.id).then(
      (now) => {
        if (this.dialog.open && this.shown === now.id) this.fill(now);
      },
      () => {}, // on failure it keeps what was known
    );
  }

  private fill(dataset: Dataset): void {
    this.title.textContent = dataset.title;
    this.body.replaceChildren(...aboutSections(dataset).flatMap(sectionElements));
  }
}

// Rows with names are a list of definitions, others one of items.
function sectionElements({ title, rows }: AboutSection): HTMLElement[] {
  const named = rows.every(([name]) => name !== "");
  const list = make(named ? "dl" : "ul");
  for (const [name, text] of rows) {
    if (named) list.append(make("dt", "", name), make("dd", "", text));
    else list.append(make("li", "", text));
  }
  return [make("h3", "", title), list];
}
