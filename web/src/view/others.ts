// The datasets that can be compared with the open one: the others of the list, and the other
// entries (members of an ensemble and the like) of its own files.
import type { Dataset, DatasetSummary } from "@windsplat/client";

type Known = Pick<DatasetSummary, "id" | "title" | "state">;

const entriesMax = 50; // of one dimension

// id -> text, without the open dataset. Ids of entries need not be open yet.
export function otherDatasets(
  open: Pick<Dataset, "id" | "choices">,
  listed: readonly Known[],
): Map<string, string> {
  const others = new Map<string, string>();
  const from = listed
    .map(({ id }) => id)
    .filter((id) => open.id === id || open.id.startsWith(`${id},`))
    .sort((a, b) => a.length - b.length)[0];
  const choices = open.choices ?? [];
  for (const choice of choices) {
    for (const value of choice.values.slice(0, entriesMax)) {
      if (value === choice.chosen || from === undefined) continue;
      const rest = choices.filter(({ name }) => name !== choice.name);
      const selection = [...rest.map(({ name, chosen }) => `${name}=${chosen}`)];
      selection.push(`${choice.name}=${value}`);
      others.set(`${from},${selection.join(",")}`, `${choice.name} ${value}`);
    }
  }
  for (const { id, title, state } of listed) {
    if (id !== open.id && state !== "failed") others.set(id, title || id);
  }
  return others;
}
