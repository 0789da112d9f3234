"""Stores of Zarr, which are folders, as files that can be uploaded."""
from __future__ import annotations

import contextlib
import os
import pathlib
import tempfile
import zipfile
from typing import Iterator

MARKS = (".zgroup", ".zarray", ".zmetadata", "zarr.json")  # one of them is in the folder


def _fail(error: OSError) -> None:
    raise error


@contextlib.contextmanager
def packed(store: pathlib.Path) -> Iterator[pathlib.Path]:
    """A ZIP file of a store, without compression, since chunks have their own; it is removed at the
    end of the `with` block. Raises ValueError for a folder without a store, and one with links that
    lead out of it or to folders, or other things that are no files; OSError, also without room for
    temporary files."""
    if not any((store / mark).is_file() for mark in MARKS):
        raise ValueError(f"'{store}' is a folder without a Zarr store (no {', '.join(MARKS)}): "
                         "what can be uploaded is one file, or a Zarr store, which is sent as ZIP")
    with tempfile.TemporaryDirectory(prefix="windsplat-") as folder:
        archive = pathlib.Path(folder) / f"{store.resolve().stem}.zip"
        # Copies of object stores may have times before 1980, which ZIP does not have.
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED, strict_timestamps=False) as file:
            for here, folders, names in os.walk(store, onerror=_fail):
                for path in (pathlib.Path(here, name) for name in (*folders, *names)):
                    if path.is_file() and path.resolve().is_relative_to(store.resolve()):
                        file.write(path, path.relative_to(store))
                    elif path.is_symlink() or not path.is_dir():
                        raise ValueError(f"'{path}' is neither a file nor a folder of the store")
        yield archive
