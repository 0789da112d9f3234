// The available datasets: the server's list and later reports on single datasets -> the entries of
// the picker and the dataset to open first.
import type { Dataset, DatasetSummary } from "@windsplat/client";

export interface PickerEntry {
  id: string;
  text: string;
  hint: string; // why it cannot be read
}

type Known = Pick<DatasetSummary, "id" | "state" | "notes">;

const firstChoice = "climate"; // the sample dataset that shows the most features

// Datasets with the same title are distinguished by id.
export function pickerEntries(datasets: DatasetSummary[]): PickerEntry[] {
  const titleOf = ({ id, title }: DatasetSummary): string => title || id;
  const counts = new Map<string, number>();
  for (const one of datasets) counts.set(titleOf(one), (counts.get(titleOf(one)) ?? 0) + 1);
  return datasets.map((one) => {
    const title = titleOf(one);
    const name = counts.get(title) === 1 ? title : `${title} (${one.id})`;
    const failed = one.state === "failed";
    return {
      id: one.id,
      text: failed ? `${name} — failed` : name,
      hint: failed ? failureNote(one) : "",
    };
  });
}

// undefined: no dataset is likely to open.
export function bestDataset(datasets: DatasetSummary[]): string | undefined {
  const usable = datasets.filter((dataset) => dataset.state !== "failed");
  return (usable.find((dataset) => dataset.id === firstChoice) ?? usable[0])?.id;
}

// The last of the server's notes says why a file can no longer be read.
export const failureNote = ({ notes }: Pick<Dataset, "notes">): string =>
  notes.at(-1) ?? "The files of this dataset cannot be read any more.";

// The list with the new state of one dataset; the same object if nothing changed.
export function withState(
  datasets: DatasetSummary[],
  { id, state, notes }: Known,
): DatasetSummary[] {
  const known = datasets.find((dataset) => dataset.id === id);
  const reported = JSON.stringify([state, notes]);
  if (known === undefined || JSON.stringify([known.state, known.notes]) === reported)
    return datasets;
  return datasets.map((dataset) => (dataset === known ? { ...known, state, notes } : dataset));
}

export class DatasetList {
  private datasets: DatasetSummary[] = [];
  private added: string | null = null; // the entry of another dataset that was opened last

  constructor(private readonly picker: HTMLSelectElement) {}

  set(datasets: DatasetSummary[]): void {
    this.datasets = datasets;
    this.write();
  }

  get all(): DatasetSummary[] {
    return this.datasets;
  }

  has(id: string): boolean {
    return this.datasets.some((dataset) => dataset.id === id);
  }

  best(): string | undefined {
    return bestDataset(this.datasets);
  }

  // A dataset in state "failed" may still be displayed as it was before the failure.
  first(): string | undefined {
    return this.best() ?? this.datasets[0]?.id;
  }

  learn(dataset: Known): void {
    const before = this.datasets;
    this.datasets = withState(before, dataset);
    if (this.datasets !== before) this.write();
  }

  // A dataset that this page opened. It replaces the one before, so that stepping through the
  // members of an ensemble does not fill the list.
  add({ id, title, state, fields, steps, residentBytes, notes }: Dataset): void {
    if (this.has(id)) return;
    const summary = { id, title, state, fields, steps: steps.count, residentBytes, notes };
    this.datasets = [...this.datasets.filter((known) => known.id !== this.added), summary];
    this.added = id;
    this.write();
  }

  failed(id: string, note: string): void {
    this.learn({ id, state: "failed", notes: [note] });
  }

  show(id: string): void {
    this.picker.value = id;
  }

  // A failed dataset may be chosen again: the server then reports the reason, or succeeds.
  private write(): void {
    const chosen = this.picker.value;
    this.picker.replaceChildren(
      ...pickerEntries(this.datasets).map(({ id, text, hint }) => {
        const option = new Option(text, id);
        option.title = hint;
        return option;
      }),
    );
    this.show(chosen);
  }
}
