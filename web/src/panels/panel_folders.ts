// Folders of the panel. Their titles are headings, and which of them are open is kept while the
// panels are built anew.
import type GUI from "lil-gui";
import { make } from "../base/dom";

export interface FolderOptions {
  open?: boolean; // at first
  key?: string; // what it is known by among its siblings; default: its title
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
