// Source of the colour range: the dataset's default, the displayed step, all steps, or numbers
// entered by the user. The picker's choice determines the range in the view.
import { failureText } from "../base/problem_text";
import type { Range } from "@windsplat/client";
import { make } from "../base/dom";

export type RangeMode = "default" | "step" | "all" | "custom";

export interface RangeSource {
  range(): Range | null; // as in the view
  defaultRange(): Range | null; // null: not known
  choose(range: Range | null): void; // null: the default
  quietly(run: () => void): void; // runs a change that adds no undo entry
  of(): string | null; // identifies the field and dataset; an answer for any other is discarded
  read(step: number | null): Promise<Range | null>; // range of that step; null: of all steps
  step(): number | null; // the displayed step; null: during playback
  modes: Map<string, RangeMode>; // modes by key, preserved when the panel is rebuilt
  key: string; // key of this range in `modes`
  steps: number;
}

const near = (a: number, b: number): boolean =>
  Math.abs(a - b) <= 1e-5 * (Math.abs(a) + Math.abs(b));

// Compares ranges regardless of their orientation.
export function sameRange(a: Range | null, b: Range | null): boolean {
  if (a === null || b === null) return a === b;
  return near(Math.min(...a), Math.min(...b)) && near(Math.max(...a), Math.max(...b));
}

export const oriented = (range: Range, like: Range | null): Range =>
  like !== null && like[0] > like[1] ? [range[1], range[0]] : range;

// Keeps the mode consistent with the view: a range set elsewhere (drag, number, link) switches to
// "custom", and in mode "step" the range is read again for each new step.
export class RangeFollower {
  mode: RangeMode;
  private stands: Range | null; // the range last set by the mode; null: none yet
  private readFor: number | null = null; // the step last requested
  private asked = 0;
  private byHand = false; // the user chose the mode, and its range is pending
  private readonly known = new Map<number | null, Range>(); // ranges the mode has set so far

  constructor(
    private readonly source: RangeSource,
    private readonly failed: (text: string) => void,
  ) {
    this.stands = null;
    this.mode = source.modes.get(source.key) ?? "default";
    // a request of the previous panel may have been lost
    if (this.mode === "all") void this.read(null);
    this.follow();
  }

  set(mode: RangeMode): void {
    const { source } = this;
    this.asked += 1;
    this.keep(mode);
    this.byHand = true;
    this.known.clear();
    this.readFor = null;
    this.stands = source.range();
    if (mode === "default") source.choose(null);
    if (mode === "all") void this.read(null);
    this.follow();
  }

  follow(): void {
    const { source, mode } = this;
    const now = source.range();
    if (now !== null && mode !== "custom" && !this.expects(now)) {
      this.asked += 1;
      this.keep(sameRange(now, source.defaultRange()) ? "default" : "custom");
    }
    if (this.mode !== "step") return;
    const step = source.step();
    if (step === null || step === this.readFor) return;
    this.readFor = step;
    void this.read(step);
  }

  private keep(mode: RangeMode): void {
    this.mode = mode;
    this.source.modes.set(this.source.key, mode);
  }

  // Whether the mode explains this range. The default replaces the old range once the server has
  // sent it.
  private expects(now: Range): boolean {
    if (sameRange(now, this.stands)) return true;
    // Undo has restored the range of an earlier step; that of the present step is read again.
    if ([...this.known.values()].some((range) => sameRange(now, range))) {
      this.stands = now;
      this.readFor = null;
      return true;
    }
    const known = this.source.defaultRange();
    if (this.mode === "default" && (known === null || sameRange(now, known))) {
      this.stands = now;
      return true;
    }
    if (this.stands !== null || this.mode === "default") return false;
    this.stands = now; // the panel was rebuilt
    return true;
  }

  private async read(step: number | null): Promise<void> {
    const { source } = this;
    const asked = ++this.asked;
    const of = source.of();
    const late = () => asked !== this.asked || of !== source.of();
    if (of === null) return;
    try {
      const range = await source.read(step);
      if (late() || range === null || range[0] === range[1]) return;
      this.stands = range;
      const now = source.range();
      this.known.set(step, range);
      const choose = () => source.choose(oriented(range, now));
      const byHand = this.byHand;
      this.byHand = false;
      if (sameRange(range, now)) return;
      if (byHand) choose();
      else source.quietly(choose);
    } catch (failure) {
      if (!late()) this.failed(failureText(failure));
    }
  }
}

export class RangeChoice {
  readonly element = make("label", "range-choice", "range");
  private readonly picker = make("select");
  private readonly follower: RangeFollower;

  constructor(source: RangeSource, failed: (text: string) => void) {
    this.follower = new RangeFollower(source, failed);
    const modes: [RangeMode, string][] = [["default", "default"]];
    if (source.steps > 1) modes.push(["step", "this step"], ["all", "all steps"]);
    else modes.push(["step", "of the data"]);
    modes.push(["custom", "custom"]);
    this.picker.append(...modes.map(([mode, text]) => new Option(text, mode)));
    this.element.title =
      "Values at the ends of the colour map. This step: its minimum and maximum, updated when " +
      "playback stops. All steps: reads every step. Custom: typed or dragged.";
    this.element.append(this.picker);
    this.picker.addEventListener("change", () => {
      this.follower.set(this.picker.value as RangeMode);
      this.refresh();
    });
    this.refresh();
  }

  refresh(): void {
    this.follower.follow();
    this.picker.value = this.follower.mode;
  }
}
