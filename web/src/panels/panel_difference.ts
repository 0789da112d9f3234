// The difference: what is subtracted from the fields, another step or another dataset.
import type GUI from "lil-gui";
import { failureText } from "../base/problem_text";
import { keyAccess, type PanelKit } from "./panel_kit";

export interface DifferenceActions {
  others(): Map<string, string>; // datasets that may be subtracted: id -> text
  openOther(id: string): Promise<string>; // opens an entry that is not listed; its id
  compare(): void; // shows a second picture beside the first, or closes it
}

const nothing = "nothing";
const step = "a step";
const other = "a dataset";

export function addDifference(gui: GUI, kit: PanelKit, actions: DifferenceActions): void {
  const folder = kit.folder(gui, "Compare");
  const { host } = kit;
  const steps = host.dataset().steps.count;
  let choices = 0; // answers to earlier ones are too late
  let failure = "";
  const offered = (): Record<string, string> => ({
    [nothing]: nothing,
    ...(steps > 1 ? { [step]: step } : {}),
    ...(actions.others().size > 0 ? { [other]: other } : {}),
  });
  const subtract = async (id: string): Promise<void> => {
    const choice = ++choices;
    const open = host.dataset().id;
    const isCurrent = () => choice === choices && host.explicitView().dataset === open;
    failure = "";
    try {
      const dataset = await actions.openOther(id);
      if (isCurrent()) host.change({ difference: { dataset, step: null } });
    } catch (reason) {
      if (isCurrent()) failure = failureText(reason);
    }
    kit.refresh();
  };
  kit.choice(
    folder,
    "subtract",
    {
      pointer: "/difference",
      get: ({ difference }) =>
        !difference ? nothing : (difference.dataset ?? null) === null ? step : other,
      set: (what) => {
        choices += 1;
        failure = "";
        if (what === nothing) return { difference: null };
        if (what === step) return { difference: { dataset: null, step: 0 } };
        const [first] = actions.others().keys();
        if (first !== undefined) void subtract(first);
        return null;
      },
    },
    offered,
  );
  if (steps > 1) {
    const number = kit.number(
      folder,
      `step subtracted (1 to ${steps})`,
      {
        pointer: "/difference/step",
        get: ({ difference }) => (difference?.step ?? 0) + 1,
        set: (counted) => ({ difference: { step: counted - 1 } }),
      },
      { min: 1, max: steps, step: 1 },
    );
    kit.showWhen((states) => states.minusStep, number);
  }
  const dataset = kit.choice(
    folder,
    "dataset subtracted",
    {
      ...keyAccess<string>("/difference/dataset"),
      set: (id) => {
        void subtract(id);
        return null;
      },
    },
    () => Object.fromEntries([...actions.others()].map(([id, text]) => [text, id])),
  );
  kit.showWhen((states) => states.minusDataset, dataset);
  kit.note(folder, () => failure);
  kit.note(folder, () =>
    host.view().difference ? "Histograms, probes and ranges are of the difference, too." : "",
  );
  kit.action(folder, "Side by side", "A second picture with the same camera (c)", () =>
    actions.compare(),
  );
}
