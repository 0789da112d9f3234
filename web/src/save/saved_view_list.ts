// The list of saved views in the Save dialog: open, rename, delete, add.
import { byId, make } from "../base/dom";
import { SavedViews, nameMax, type SavedView } from "./saved_views";
import { withoutSize } from "@windsplat/client/parts";
import type { Jobs } from "./save_jobs";
import type { SaveHost } from "./save_work";

// Returns the function that refreshes the list.
export function savedViewList(
  host: SaveHost,
  baseUri: string,
  dialog: HTMLDialogElement,
  jobs: Jobs,
): () => void {
  const views = new SavedViews(
    () => window.localStorage,
    `windsplat-views:${new URL(baseUri).pathname}`,
  );
  const newName = byId("keep-name", HTMLInputElement);

  function change(run: () => void): void {
    jobs.clear();
    try {
      run();
    } catch (failure) {
      jobs.fail(failure);
    }
  }

  function row({ id, name: oldName, date, view, beside }: SavedView): HTMLElement {
    const name = make("input");
    name.value = oldName;
    name.maxLength = nameMax;
    name.ariaLabel = "Name";
    const act = (text: string, run: () => void): HTMLElement => {
      const one = make("button", "", text);
      one.addEventListener("click", run);
      return one;
    };
    const open = act("Open", () => {
      dialog.close();
      host.openSaved(view, beside ?? null);
    });
    const remove = act("×", () => {
      change(() => views.remove(id));
      show();
      newName.focus();
    });
    const label = (): void => {
      open.ariaLabel = `Open ${name.value}`;
      remove.ariaLabel = `Delete ${name.value}`;
    };
    label();
    // The row is not rebuilt, which preserves the focus and the target of a pending click.
    name.addEventListener("change", () =>
      change(() => {
        views.rename(id, name.value);
        label();
      }),
    );
    const item = make("li");
    const day = new Date(date).toLocaleDateString();
    const text = beside === undefined ? day : `two pictures, ${day}`;
    item.append(name, make("time", "", text), open, remove);
    return item;
  }

  function show(): void {
    if (host.isOpen())
      newName.value = `${host.dataset().id}, step ${(host.explicitView().step ?? 0) + 1}`;
    byId("kept", HTMLElement).replaceChildren(...views.list().map(row));
  }

  byId("keep-form", HTMLFormElement).addEventListener("submit", (event) => {
    event.preventDefault();
    const view = withoutSize(host.explicitView());
    change(() => views.add(newName.value.trim(), view, Date.now(), host.beside()));
    show();
  });
  return show;
}
