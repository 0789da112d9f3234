// Folders of the panel. Their titles are headings, and which of them are open is kept while the
// panels are built anew.
import type GUI from "lil-gui";
import { make } from "../base/dom";

export interface FolderOptions {
  open?: boolean; // at first
  key?: string; // what it is known by among its siblings; default: its title
}

// The control that has the focus: its folder among those of the parent (-1: the parent itself) and
// its label.
export interface ControlPlace {
  folder: number;
  label: string;
}

const labelOf = (row: Element): string => row.querySelector(".lil-name")?.textContent ?? "";

export function focusedControl(parent: GUI): ControlPlace | null {
  const row = document.activeElement?.closest(".lil-controller") ?? null;
  if (row === null || !parent.domElement.contains(row)) return null;
  const folder = parent.folders.findIndex(({ domElement }) => domElement.contains(row));
  return { folder, label: labelOf(row) };
}

// The control at a place, once the controls have been built anew; without it the parent's title.
export function focusControl(parent: GUI, { folder, label }: ControlPlace): void {
  const within = parent.folders[folder] ?? parent;
  const row = within.controllersRecursive().find(({ domElement }) => labelOf(domElement) === label);
  const target = row?.domElement.querySelector<HTMLElement>("select, input, button");
  (target ?? parent.$title).focus();
}

const firstLevel = 2; // the page's own title has level 1

export class Folders {
  private readonly open = new Map<string, boolean>(); // by path, as the user left them
  private readonly paths = new WeakMap<GUI, string>();

  add(parent: GUI, title: string, { open = false, key = title }: FolderOptions = {}): GUI {
    const folder = parent.addFolder(title);
    const path = `${this.paths.get(parent) ?? ""}/${key}`;
    this.paths.set(folder, path);
    const heading = make("div", "panel-heading");
    heading.setAttribute("role", "heading");
    heading.setAttribute("aria-level", String(firstLevel + path.split("/").length - 2));
    heading.append(folder.$title);
    folder.domElement.prepend(heading);
    if (!(this.open.get(path) ?? open)) folder.close();
    return folder;
  }

  // Remembers which folders within `root` are opened and closed.
  watch(root: GUI): void {
    root.onOpenClose((folder) => {
      const path = this.paths.get(folder);
      if (path !== undefined) this.open.set(path, !folder._closed);
    });
  }
}
