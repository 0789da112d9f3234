// The files below the server's data root, in the dialog of the datasets: folder -> rows -> the
// dataset that is opened. Without a data root the server lists nothing, and a hint says how to add
// data.
import { byId, make } from "../base/dom";
import { failureText } from "../base/problem_text";
import type { Api, Folder } from "@windsplat/client";
import { resultOf } from "./entries";
import { folderNote, folderRows, folderTrail, type FolderRow } from "./folder_rows";

export interface FileBrowserHost {
  api: Pick<Api, "folder" | "openPath" | "job" | "cancelJob">;
  opened(id: string): Promise<void>; // the dataset is ready to be shown
  sleep(ms: number): Promise<void>;
}

export class FileBrowser {
  private readonly section = byId("files", HTMLElement);
  private readonly trail = byId("files-trail", HTMLElement);
  private readonly list = byId("files-list", HTMLElement);
  private readonly more = byId("files-more", HTMLButtonElement);
  private readonly note = byId("files-note", HTMLElement);
  private readonly hint = byId("files-hint", HTMLElement);
  private readonly failure = byId("files-error", HTMLElement);
  private readonly progress = byId("files-progress", HTMLElement);
  private folder = "";
  private next: string | null = null;
  private asked = 0; // number of the newest request, whose answer alone counts

  constructor(private readonly host: FileBrowserHost) {
    this.more.addEventListener("click", () => void this.read(this.folder, this.next ?? ""));
  }

  show(): void {
    void this.read(this.folder, "");
  }

  // Cancels what is being opened.
  hide(): void {
    this.asked += 1;
    this.tell("");
  }

  private async read(folder: string, after: string): Promise<void> {
    const asked = ++this.asked;
    try {
      const found = await this.host.api.folder(folder, after);
      if (asked !== this.asked) return;
      this.section.hidden = found === null;
      this.hint.hidden = found !== null;
      if (found !== null) this.fill(found, after !== "");
    } catch (failure) {
      if (asked !== this.asked) return;
      this.section.hidden = false;
      if (folder !== "") {
        this.folder = ""; // the folder may have been removed
        await this.read("", "");
      }
      this.fail(failureText(failure));
    }
  }

  private fill(found: Folder, further: boolean): void {
    this.folder = found.folder;
    this.next = found.next;
    this.fail("");
    this.more.hidden = found.next === null;
    this.note.textContent = folderNote(found);
    const rows = folderRows(found).map((row) => this.row(row));
    if (further) {
      this.list.append(...rows);
      rows[0]?.querySelector("button")?.focus();
      return;
    }
    const inside = this.section.contains(document.activeElement);
    this.list.replaceChildren(...rows);
    this.trail.replaceChildren(...folderTrail(found.folder).map((part) => this.step(part)));
    if (inside) this.list.querySelector("button")?.focus();
  }

  private step({ name, path }: { name: string; path: string }): HTMLElement {
    if (path === this.folder) {
      const here = make("span", "", name);
      here.setAttribute("aria-current", "location");
      return here;
    }
    const button = make("button", "", name);
    button.addEventListener("click", () => void this.read(path, ""));
    return button;
  }

  private row({ name, about, path, does }: FolderRow): HTMLElement {
    const item = make("li");
    const box = make(does === "nothing" ? "div" : "button", `file-row file-${does}`);
    box.append(make("span", "file-name", name), make("span", "quiet", about));
    item.append(box);
    if (does === "enter") box.addEventListener("click", () => void this.read(path, ""));
    if (does === "open") box.addEventListener("click", () => void this.open(path));
    return item;
  }

  private async open(path: string): Promise<void> {
    const asked = ++this.asked;
    const wanted = (): boolean => asked === this.asked;
    this.fail("");
    this.tell(`Opening ${path}…`);
    try {
      const job = await this.host.api.openPath(path);
      const id = await resultOf(this.host.api, job, wanted, (ms) => this.host.sleep(ms));
      if (id === null || !wanted()) return;
      this.tell("");
      await this.host.opened(id);
    } catch (failure) {
      if (!wanted()) return;
      this.tell("");
      this.fail(`${path} cannot be opened: ${failureText(failure)}`);
    }
  }

  private tell(text: string): void {
    this.progress.textContent = text;
  }

  private fail(text: string): void {
    this.failure.textContent = text;
    this.failure.hidden = text === "";
  }
}
