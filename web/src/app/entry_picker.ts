// The entries of dimensions besides space and time: the choices of the open dataset -> a labelled
// list for each, whose elements persist while its entries are the same, so that stepping through
// them with the keyboard keeps the focus.
import { make } from "../base/dom";
import { readableTime } from "@windsplat/client/parts";
import type { Dataset } from "@windsplat/client";

type Choice = Dataset["choices"][number];

// What a control shows of a dimension. Of a long one the description lists the first entries only:
// its control is a text box.
export interface EntryControl {
  name: string;
  title: string;
  listed: { value: string; text: string }[];
  isWhole: boolean; // whether all entries are listed
}

export function entryControls(choices: readonly Choice[]): EntryControl[] {
  return choices
    .filter(({ length }) => length > 1)
    .map(({ name, length, values }) => ({
      name,
      title:
        `${name}: one of ${length} entries` +
        (length > values.length ? `; the first ${values.length} are listed, type others` : ""),
      listed: values.map((value) => ({ value, text: readableTime(value) })),
      isWhole: length === values.length,
    }));
}

const reasonId = "entries-reason";

export class EntryPicker {
  private built = "";
  private refusal = "";
  private readonly boxes = new Map<string, HTMLSelectElement | HTMLInputElement>();

  constructor(
    private readonly element: HTMLElement,
    private readonly choose: (dimension: string, value: string) => void,
  ) {}

  show(choices: readonly Choice[]): void {
    const controls = entryControls(choices);
    const built = JSON.stringify([controls, this.refusal]);
    if (built !== this.built) this.build(controls);
    this.built = built;
    for (const { name, chosen } of choices) {
      const box = this.boxes.get(name);
      if (box !== undefined) box.value = chosen;
    }
  }

  // Why no other entry may be chosen; empty: it may. Call show() afterwards.
  refuse(reason: string): void {
    this.refusal = reason;
  }

  private build(controls: EntryControl[]): void {
    this.boxes.clear();
    this.element.replaceChildren(...controls.flatMap((control, n) => this.rowOf(control, n)));
    this.element.hidden = controls.length === 0;
    if (this.refusal === "" || controls.length === 0) return;
    const reason = make("p", "entries-reason", this.refusal);
    reason.id = reasonId;
    this.element.append(reason);
  }

  private rowOf({ name, title, listed, isWhole }: EntryControl, n: number): HTMLElement[] {
    const row = make("div", "entry");
    const label = make("label", "", name);
    const box = isWhole ? make("select") : make("input");
    box.id = label.htmlFor = `entry-${n}`;
    const options = listed.map(({ value, text }) => new Option(text, value));
    const extra: HTMLElement[] = [];
    if (box instanceof HTMLSelectElement) {
      box.append(...options);
    } else {
      const list = make("datalist");
      list.id = `entries-of-${n}`;
      list.append(...options);
      box.setAttribute("list", list.id);
      extra.push(list);
    }
    box.disabled = this.refusal !== "";
    if (box.disabled) box.setAttribute("aria-describedby", reasonId);
    row.title = box.disabled ? this.refusal : title;
    box.addEventListener("change", () => {
      if (box.value !== "") this.choose(name, box.value);
    });
    row.append(label, box);
    this.boxes.set(name, box);
    return [row, ...extra];
  }
}
