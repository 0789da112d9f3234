// A folder below the server's data root, and what can be opened in it.

export interface FolderEntry {
  name: string;
  kind: "file" | "folder";
  bytes: number | null; // null: a folder
  format: string | null; // null: none that is known
}

export interface Folder {
  folder: string; // relative to the data root; empty: the data root itself
  entries: FolderEntry[];
  groups: { pattern: string; files: number }[]; // on the first page
  next: string | null; // `after` of the next page
  omitted: number;
  cut: boolean; // the folder has more names than the server reads
}
