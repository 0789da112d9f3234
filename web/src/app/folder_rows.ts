// A folder of the server -> the rows of the file browser. Pure.
import type { Folder } from "@windsplat/client";

export interface FolderRow {
  name: string;
  about: string; // format, size or number of files
  path: string; // relative to the data root
  does: "enter" | "open" | "nothing";
}

export const joined = (folder: string, name: string): string =>
  folder === "" ? name : `${folder}/${name}`;

// "1.5 MB", in powers of 1000 as file managers show it.
export function bytesText(bytes: number): string {
  const units = ["B", "kB", "MB", "GB", "TB"];
  let [value, at] = [bytes, 0];
  while (value >= 999.5 && at < units.length - 1) [value, at] = [value / 1000, at + 1];
  return `${at === 0 || value >= 99.95 ? Math.round(value) : value.toFixed(1)} ${units[at]}`;
}

// Folders first, then groups of files, then single files. A group is listed if its files are: of a
// format that can be opened.
export function folderRows({ folder, entries, groups }: Folder): FolderRow[] {
  const rows = entries.map(({ name, kind, bytes, format }): FolderRow => {
    const path = joined(folder, name);
    if (kind === "folder" && format === null) {
      return { name: `${name}/`, about: "", path, does: "enter" };
    }
    const size = bytes === null ? "" : bytesText(bytes);
    if (format === null) return { name, about: `unknown format · ${size}`, path, does: "nothing" };
    return { name, about: [format, size].filter(Boolean).join(" · "), path, does: "open" };
  });
  const known = entries.filter(({ kind, format }) => kind === "file" && format !== null);
  const series = groups
    .filter(({ pattern }) => known.some(({ name }) => matches(pattern, name)))
    .map(({ pattern, files }): FolderRow => ({
      name: pattern,
      about: `${files} files as one series`,
      path: joined(folder, pattern),
      does: "open",
    }));
  const enter = rows.filter(({ does }) => does === "enter");
  return [...enter, ...series, ...rows.filter(({ does }) => does !== "enter")];
}

// Patterns of the server's groups have * only.
function matches(pattern: string, name: string): boolean {
  const parts = pattern.split("*").map((part) => part.replace(/[\\^$.|?+()[\]{}]/g, "\\$&"));
  return new RegExp(`^${parts.join(".*")}$`).test(name);
}

// The folders above and including this one, from the data root.
export function folderTrail(folder: string): { name: string; path: string }[] {
  const trail = [{ name: "data", path: "" }];
  for (const name of folder.split("/").filter((part) => part !== "")) {
    trail.push({ name, path: joined(trail.at(-1)!.path, name) });
  }
  return trail;
}

export function folderNote({ entries, omitted, cut }: Folder): string {
  const notes: string[] = [];
  if (entries.length === 0) notes.push("Nothing here can be shown.");
  if (omitted > 0) {
    notes.push(`${omitted} not listed: links out of the data folder, or names without letters.`);
  }
  if (cut) notes.push("The folder has more files than the server lists.");
  return notes.join(" ");
}
