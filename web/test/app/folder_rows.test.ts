// The rows of the file browser for folders as the server lists them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { bytesText, folderNote, folderRows, folderTrail } from "../../src/app/folder_rows";
import type { Folder } from "@windsplat/client";

const folder: Folder = {
  folder: "runs",
  entries: [
    { name: "a.nc", kind: "file", bytes: 1_500_000, format: "netCDF" },
    { name: "may", kind: "folder", bytes: null, format: null },
    { name: "notes.txt", kind: "file", bytes: 12, format: null },
    { name: "s_1.nc", kind: "file", bytes: 10, format: "netCDF" },
    { name: "s_2.nc", kind: "file", bytes: 10, format: "netCDF" },
    { name: "t_1.log", kind: "file", bytes: 10, format: null },
    { name: "t_2.log", kind: "file", bytes: 10, format: null },
    { name: "x.zarr", kind: "folder", bytes: null, format: "Zarr" },
  ],
  groups: [
    { pattern: "s_*.nc", files: 2 },
    { pattern: "t_*.log", files: 2 },
  ],
  next: null,
  omitted: 0,
  cut: false,
};

test("folders come first, then series, then files; what cannot be opened is no button", () => {
  assert.deepEqual(
    folderRows(folder).map(({ name, about, path, does }) => [name, about, path, does]),
    [
      ["may/", "", "runs/may", "enter"],
      ["s_*.nc", "2 files as one series", "runs/s_*.nc", "open"],
      ["a.nc", "netCDF · 1.5 MB", "runs/a.nc", "open"],
      ["notes.txt", "unknown format · 12 B", "runs/notes.txt", "nothing"],
      ["s_1.nc", "netCDF · 10 B", "runs/s_1.nc", "open"],
      ["s_2.nc", "netCDF · 10 B", "runs/s_2.nc", "open"],
      ["t_1.log", "unknown format · 10 B", "runs/t_1.log", "nothing"],
      ["t_2.log", "unknown format · 10 B", "runs/t_2.log", "nothing"],
      ["x.zarr", "Zarr", "runs/x.zarr", "open"],
    ],
  );
});

test("sizes are shown as file managers do", () => {
  const texts = [0, 999, 1000, 1_500_000, 99_960_000, 999_600_000, 3e12].map(bytesText);
  assert.deepEqual(texts, ["0 B", "999 B", "1.0 kB", "1.5 MB", "100 MB", "1.0 GB", "3.0 TB"]);
});

test("the trail leads from the data root to the folder", () => {
  assert.deepEqual(folderTrail(""), [{ name: "data", path: "" }]);
  assert.deepEqual(
    folderTrail("a/b").map(({ path }) => path),
    ["", "a", "a/b"],
  );
});

test("a note says what is missing from the list", () => {
  assert.equal(folderNote(folder), "");
  assert.match(folderNote({ ...folder, entries: [] }), /Nothing here/);
  assert.match(folderNote({ ...folder, omitted: 2, cut: true }), /^2 not listed.*more files/);
});
