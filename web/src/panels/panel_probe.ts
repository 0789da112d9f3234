// The probe panel: a position in the coordinates of the axes -> the values of all fields there, and
// of one field over time. While the folder is open the probe is on and marked on the picture.
import type GUI from "lil-gui";
import { failureText } from "../base/problem_text";
import type { Position, Series, View } from "@windsplat/client";
import { checkLabel, make, makeSvg, numberBox } from "../base/dom";
import { debounced } from "@windsplat/client/parts";
import { wayText } from "../view/distance";
import { hoverOf, hoverOn } from "../view/hover_setting";
import { sampleOf } from "../view/feature";
import { unitText } from "../view/unit_text";
import type { PanelKit } from "./panel_kit";
import {
  axisNames,
  axisUnit,
  coordinatesOf,
  magnitude,
  nearestIndex,
  placeText,
  positionText,
  valueText,
  type Sample,
} from "../view/sample_position";
import { timeEnds, drawSeries } from "./series_plot";
import { formatNumber } from "../base/ticks";
import { derivedIn } from "../view/view_fields";

const restMs = 150;

// Whether a region leaves something out.
const isPart = (region: View["region"]): boolean =>
  Object.values(region ?? {}).some(
    (part) => part !== null && part !== undefined && !(Array.isArray(part) && part.length === 0),
  );

export class ProbePanel {
  private readonly folder: GUI;
  private sample: Sample;
  private readonly box = make("div", "probe");
  private readonly rows: { slider: HTMLInputElement; number: HTMLInputElement }[] = [];
  private readonly message = make("p", "probe-words");
  private readonly way = make("p", "probe-words"); // from the position that was kept to this one
  private readonly values = make("dl", "probe-values");
  private readonly picker = make("select");
  private readonly plot = makeSvg("svg", { class: "course", role: "img" });
  private readonly maximum = make("p", "probe-words"); // the one that was gone to
  private maximumOf = ""; // scope of that maximum
  private series: Series | null = null;
  private seriesOf = ""; // what was subtracted
  private position: Position | null = null; // that was read last
  private from: Position | null = null;
  private wanted = ""; // key of the last request
  private readonly readSoon = debounced(() => void this.read(), restMs);

  constructor(
    private readonly parent: GUI,
    private readonly kit: PanelKit,
    // the position changed, or the probe was switched on or off
    private readonly changed: () => void,
    place: Sample,
  ) {
    this.folder = kit.folder(parent, "Probe");
    this.sample = place;
    axisNames.forEach((_, axis) => this.addAxis(axis));
    this.message.setAttribute("role", "status");
    this.way.setAttribute("role", "status");
    this.maximum.setAttribute("role", "status");
    this.maximum.hidden = true;
    this.box.append(this.message, this.way, this.values);
    this.addWay();
    this.addMaximum();
    this.addSeries();
    this.addHover();
    this.folder.$children.append(this.box);
    this.folder.onOpenClose(() => {
      this.refresh();
      this.changed();
    });
    kit.onRefresh(() => this.refresh());
    this.showPlace();
  }

  open(): void {
    this.parent.open();
    this.folder.open();
    this.folder.domElement.scrollIntoView({ block: "nearest" });
  }

  close(): void {
    this.folder.close();
  }

  get on(): boolean {
    return !this.folder._closed;
  }

  get place(): Sample {
    return this.sample;
  }

  moveTo(sample: Sample): void {
    if (sample.every((index, axis) => index === this.sample[axis])) return;
    this.sample = sample;
    this.maximum.hidden = true;
    this.series = null;
    this.showPlace();
    this.refresh();
    this.changed();
  }

  refresh(): void {
    if (this.maximumOf !== this.scope()) this.maximum.hidden = true;
    if (!this.on) return;
    if (this.key() !== this.wanted && !this.kit.host.playing()) this.readSoon();
    this.showSeries();
  }

  // What the greatest value is one of.
  private scope(): string {
    const { dataset, step, region, difference } = this.kit.host.explicitView();
    return JSON.stringify([dataset, step ?? 0, region ?? null, difference ?? null]);
  }

  private key(): string {
    const view = this.kit.host.view();
    const { step = 0, difference = null } = view;
    const derived = derivedIn(this.kit.host.dataset(), view);
    return JSON.stringify([this.sample, step, this.heights(), difference, derived]);
  }

  private subject(field: string): string {
    return this.kit.host.view().difference ? `difference of ${field}` : field;
  }

  // The field that gives the heights of samples in the view.
  private heights(): string | null {
    return this.kit.host.view().geometry?.heightField ?? null;
  }

  private addAxis(axis: number): void {
    const name = axisNames[axis]!;
    const { coordinates, name: title, units } = this.kit.host.dataset().axes[name];
    const unit = axisUnit(units);
    const row = make("div", "probe-axis");
    const label = make("label", "", unit === "" ? title || name : `${title || name} (${unit})`);
    const number = numberBox();
    number.id = `probe-${name}`;
    label.htmlFor = number.id;
    label.title = label.textContent;
    const slider = make("input");
    slider.type = "range";
    slider.max = String(Math.max(0, coordinates.length - 1));
    slider.disabled = number.disabled = coordinates.length < 2;
    slider.setAttribute("aria-label", `${label.textContent}, by samples`);
    const move = (index: number) => {
      const next: Sample = [...this.sample];
      next[axis] = index;
      this.moveTo(next);
    };
    slider.addEventListener("input", () => move(Number(slider.value)));
    number.addEventListener("change", () => {
      if (Number.isFinite(number.valueAsNumber)) {
        move(nearestIndex(coordinates, number.valueAsNumber));
      }
      this.showPlace(); // shows the position of the sample instead of the typed one
    });
    this.rows.push({ slider, number });
    row.append(label, slider, number);
    this.box.append(row);
  }

  private addHover(): void {
    const box = make("input");
    box.checked = hoverOn.value;
    box.addEventListener("change", () => hoverOn.set(box.checked));
    this.kit.onRefresh(() => (box.checked = hoverOn.value));
    const title = "Shown beside the mouse on the picture (shift + i)";
    this.box.append(checkLabel(box, "values under the cursor", title));
    const level = make("input");
    level.checked = hoverOf.value === "level";
    level.addEventListener("change", () => hoverOf.set(level.checked ? "level" : "feature"));
    const why =
      "Read the slice or the level of the probe under the cursor, not what the picture shows there";
    this.box.append(checkLabel(level, "in the probe's level", why));
  }

  // Moves the probe to the sample with the greatest value of a field at this step, in the region of
  // the view.
  private addMaximum(): void {
    const { fields } = this.kit.host.dataset();
    const drawn = this.kit.host.view().vector?.field;
    const field = make("select");
    field.append(...fields.map(({ name }) => new Option(name, name)));
    if (fields.some(({ name }) => name === drawn)) field.value = drawn!;
    field.setAttribute("aria-label", "Field whose maximum to go to");
    const button = make("button", "", "Go to maximum of this step");
    button.title = "Move the probe to the greatest value of this step; of vectors, the fastest";
    button.addEventListener("click", () => {
      button.disabled = true;
      void this.goToMaximum(field.value).finally(() => (button.disabled = false));
    });
    const row = make("div", "histogram-row");
    row.append(field, button);
    this.box.append(row, this.maximum);
  }

  private async goToMaximum(field: string): Promise<void> {
    const { host } = this.kit;
    try {
      const dataset = host.dataset();
      const whole = host.explicitView();
      const scope = this.scope();
      const within = isPart(whole.region) ? " in the region" : "";
      const step = host.view().step ?? 0;
      const { range, places } =
        within === ""
          ? await host.api.range(dataset.id, field, step, whole.difference)
          : await host.api.rangeIn({ ...whole, step }, dataset.id, field);
      if (scope !== this.scope()) return;
      const sample = places === undefined ? null : sampleOf(places.max);
      if (sample === null) {
        this.showMessage(`${field} has no value${within} at this step`, true);
        return;
      }
      this.moveTo(sample);
      const units = dataset.fields.find(({ name }) => name === field)?.units ?? "";
      this.maximum.textContent =
        `greatest ${this.subject(field)}${within} at this step: ${valueText(range![1], units)} ` +
        `at ${positionText(dataset, places!.max)}`;
      this.maximumOf = scope;
      this.maximum.hidden = false;
    } catch (failure) {
      this.showMessage(failureText(failure), true);
    }
  }

  // Distance and direction to the next positions from the one that is kept.
  private addWay(): void {
    const button = make("button", "", "Measure from here");
    button.title = "Distance and direction from this position to the next ones; again to end";
    button.addEventListener("click", () => {
      this.from = this.from === null ? this.position : null;
      button.textContent = this.from === null ? "Measure from here" : "End measuring";
      this.showWay();
    });
    const row = make("div", "histogram-row");
    row.append(button);
    this.box.append(row);
    this.showWay();
  }

  private showWay(): void {
    const { from, position } = this;
    this.way.hidden = from === null || position === null;
    if (from === null || position === null) return;
    const way = wayText(this.kit.host.dataset(), from, position);
    this.way.textContent = `from the first position: ${way}`;
  }

  private addSeries(): void {
    const dataset = this.kit.host.dataset();
    if (dataset.steps.count < 2) return;
    this.picker.append(...dataset.fields.map(({ name }) => new Option(name, name)));
    this.picker.setAttribute("aria-label", "Field to show over time");
    const button = make("button", "", "Over time");
    button.title = "Read this position at every step";
    button.addEventListener("click", () => {
      button.disabled = true;
      void this.readSeries().finally(() => (button.disabled = false));
    });
    this.picker.addEventListener("change", () => {
      this.series = null;
      this.showSeries();
    });
    const row = make("div", "histogram-row");
    row.append(this.picker, button);
    this.box.append(row);
    this.plot.toggleAttribute("hidden", true);
    this.box.append(this.plot);
  }

  private showPlace(): void {
    const coordinates = coordinatesOf(this.kit.host.dataset(), this.sample);
    this.rows.forEach(({ slider, number }, axis) => {
      const text = formatNumber(coordinates[axis]!, 7);
      slider.value = String(this.sample[axis]);
      slider.setAttribute("aria-valuetext", text);
      number.value = text;
    });
  }

  private showMessage(text: string, failed = false): void {
    this.message.textContent = text;
    this.message.hidden = text === "";
    this.message.classList.toggle("failed", failed);
  }

  private async read(): Promise<void> {
    const { host } = this.kit;
    const key = this.key();
    if (!this.on || !this.box.isConnected || key === this.wanted || host.playing()) return;
    this.wanted = key;
    const dataset = host.dataset();
    try {
      const view = host.view();
      const { step = 0, difference } = view;
      const of = { step, difference, derived: derivedIn(dataset, view) };
      const answer = await host.api.probe(dataset.id, this.sample, this.heights(), of);
      const { values } = answer;
      if (key !== this.wanted) return;
      this.values.replaceChildren(
        ...Object.entries(values).flatMap(([name, { value, units }]) => [
          make("dt", "", difference ? `${name} (difference)` : name),
          make("dd", "", valueText(value, units)),
        ]),
      );
      this.position = answer.position;
      this.showWay();
      this.showMessage(placeText(dataset, answer));
    } catch (failure) {
      if (key !== this.wanted) return;
      this.values.replaceChildren();
      this.showMessage(failureText(failure), true);
    }
  }

  private async readSeries(): Promise<void> {
    const { host } = this.kit;
    const dataset = host.dataset();
    const [sample, field] = [this.sample, this.picker.value];
    this.showMessage("reading every step…");
    try {
      const { difference } = host.view();
      const series = await host.api.series(dataset.id, field, sample, this.heights(), difference);
      if (sample === this.sample && field === this.picker.value) this.series = series;
      this.seriesOf = JSON.stringify(difference ?? null);
      this.showMessage("");
    } catch (failure) {
      this.showMessage(failureText(failure), true);
    }
    this.showSeries();
  }

  private showSeries(): void {
    const { plot } = this;
    if (this.seriesOf !== JSON.stringify(this.kit.host.view().difference ?? null)) {
      this.series = null;
    }
    const { series } = this;
    plot.toggleAttribute("hidden", series === null);
    if (series === null) return;
    drawSeries(
      plot,
      series.values.map(magnitude),
      unitText(series.units),
      timeEnds(series.times),
      this.kit.host.view().step ?? 0,
    );
  }
}
