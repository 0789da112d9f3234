// Seeds as points: a box of text, one point a line in the coordinates of the axes, and clicks on
// the picture that add points. Text -> points -> the view, and back.
import type GUI from "lil-gui";
import { make } from "../base/dom";
import { nameKey } from "../base/key_words";
import { explain } from "./help_texts";
import { axisNames, type Sample } from "../view/sample_position";
import { failureText } from "../base/problem_text";
import type { PanelKit } from "./panel_kit";
import type { Dataset, View } from "@windsplat/client";

export type Place = [number, number, number];

const pointsMax = 1000; // of the view's schema
const digits = 6; // of points that are picked, and of those shown

const rounded = (value: number): number => Number(value.toPrecision(digits));

export const pointsOf = (view: View): Place[] =>
  (view.vector?.trace?.seeds?.points ?? []) as Place[];

const axisWords = (dataset: Dataset): string =>
  axisNames.map((axis) => dataset.axes[axis].name || axis).join(" ");

export const pointsText = (points: Place[]): string =>
  points.map((point) => point.map(rounded).join(" ")).join("\n");

// One point a line, its numbers separated by spaces or commas. Throws an Error with a message.
export function pointsFrom(text: string, dataset: Dataset): Place[] {
  const lines = text.split(/[\n;]/).filter((line) => line.trim() !== "");
  if (lines.length === 0) throw new Error("Type at least one point.");
  if (lines.length > pointsMax)
    throw new Error(`At most ${pointsMax} points, not ${lines.length}.`);
  return lines.map((line, n) => {
    const numbers = line
      .replaceAll("\u2212", "-")
      .trim()
      .split(/[\s,]+/)
      .map(Number);
    if (numbers.length !== 3 || !numbers.every(Number.isFinite)) {
      throw new Error(`Point ${n + 1} needs three numbers: ${axisWords(dataset)}.`);
    }
    return numbers as Place;
  });
}

// With one point more; the same place is taken once. null: there are as many as are allowed.
export function withPoint(points: Place[], point: Place): Place[] | null {
  const next = point.map(rounded) as Place;
  if (points.some((one) => one.every((value, n) => rounded(value) === next[n]))) return points;
  return points.length < pointsMax ? [...points, next] : null;
}

// The controls of points, and the click that adds one.
export class SeedPoints {
  private readonly row = make("div", "seed-points");
  private readonly text = make("textarea");
  private readonly picks = make("button", "", "Pick in the picture");
  private readonly words = make("p", "panel-note");
  private shown = "";

  constructor(
    folder: GUI,
    private readonly kit: PanelKit,
    private readonly applies: () => boolean,
  ) {
    const dataset = kit.host.dataset();
    const label = make("label", "", `points: ${axisWords(dataset)}, one a line`);
    nameKey("/vector/trace/seeds/points", "points");
    explain(this.row, "/vector/trace/seeds/points");
    this.text.rows = 4;
    this.text.spellcheck = false;
    this.words.setAttribute("role", "status");
    this.picks.setAttribute("aria-pressed", "false");
    this.picks.title = "Clicks on the picture add points; press again to end";
    this.picks.addEventListener("click", () => this.pick(!this.picking));
    this.text.addEventListener("change", () => this.typed());
    label.append(this.text);
    this.row.append(label, this.picks, this.words);
    folder.$children.append(this.row);
    kit.onRefresh(() => this.show());
    this.show();
  }

  // Whether a click on the picture adds a point.
  get picking(): boolean {
    return this.picks.getAttribute("aria-pressed") === "true" && this.applies();
  }

  // Adds the position of a sample that was clicked at; null: there is none. The server knows its
  // longitude and latitude where the axes are rows and columns.
  async addSample(sample: Sample | null): Promise<void> {
    if (sample === null) {
      this.tell("There is nothing to pick at this place.");
      return;
    }
    const { host } = this.kit;
    try {
      const of = { step: host.view().step ?? 0 };
      const answer = await host.api.probe(host.dataset().id, sample, null, of);
      const { x, y, z } = answer.position;
      if (this.row.isConnected) this.add([x, y, z]);
    } catch (failure) {
      this.tell(failureText(failure));
    }
  }

  private add(point: Place): void {
    const points = pointsOf(this.kit.host.view());
    const next = withPoint(points, point);
    if (next === null) this.tell(`There are ${pointsMax} points, and no more are drawn.`);
    else if (next !== points) this.set(next);
  }

  private pick(on: boolean): void {
    this.picks.setAttribute("aria-pressed", String(on));
    this.picks.textContent = on ? "End picking" : "Pick in the picture";
    this.tell(on ? "Click on the picture: each click adds a point." : "");
  }

  private typed(): void {
    try {
      this.set(pointsFrom(this.text.value, this.kit.host.dataset()));
    } catch (reason) {
      this.tell((reason as Error).message);
    }
  }

  private set(points: Place[]): void {
    this.tell("");
    this.kit.host.change({ vector: { trace: { seeds: { points } } } });
  }

  private tell(text: string): void {
    this.words.textContent = text;
    this.words.hidden = text === "";
  }

  private show(): void {
    const applies = this.applies();
    this.row.hidden = !applies;
    if (!applies && this.picks.getAttribute("aria-pressed") === "true") this.pick(false);
    const text = pointsText(pointsOf(this.kit.host.view()));
    if (text === this.shown) return;
    this.shown = text;
    this.text.value = text;
  }
}
