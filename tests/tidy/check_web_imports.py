#!/usr/bin/env python3
"""Checks the imports of the page (web/src) and of the study's report (web/report): permitted
imports between folders, no circular imports between files, and the number of files in a folder.
Usage: check_web_imports.py [ROOT]"""
import pathlib
import posixpath
import re
import sys

import tree

# Folder of web/src -> folders it may import from besides itself, lowest first. The order is the
# page's layering: a folder may not import from one listed below it.
MAY_IMPORT = {
    "base": [],                       # numbers, text, DOM helpers
    "wire": ["base"],                 # HTTP and WebSocket: messages, requests, connection
    "view": ["base", "wire"],         # the view document: state, camera, history, legend entries
    "viewport": ["base", "wire", "view"],          # the picture and its overlays
    "panels": ["base", "wire", "view"],            # the controls at the side
    "save": ["base", "wire", "view"],              # pictures, animations, saved views
    "app": ["base", "wire", "view", "viewport", "panels", "save"],
    "styles": [],                     # style sheets only
}
REPORT = "web/report"                 # the report of a study; imports nothing of the page
GENERATED = "web/generated"           # types of the protocol; any folder may import them
MAX_FILES = 30                        # per folder

IMPORT = re.compile(r"""(?:\bfrom|\bimport)\s*\(?\s*["']([^"']+)["']""")


def imports_of(path, content):
    """(line, imported path without extension) of every relative import."""
    folder = posixpath.dirname(path)
    for match in IMPORT.finditer(content):
        if match[1].startswith("."):
            line = content.count("\n", 0, match.start()) + 1
            yield line, posixpath.normpath(f"{folder}/{match[1]}")


def folder_of(path):
    return path.split("/")[2]


def cycles(imports):
    """Every import cycle once, as the paths along it."""
    found, finished, trail = [], set(), []

    def visit(path):
        if path in trail:
            found.append(trail[trail.index(path):] + [path])
        elif path not in finished:
            trail.append(path)
            for _, imported in imports.get(path, []):
                visit(imported)
            trail.pop()
            finished.add(path)

    for path in imports:
        visit(path)
    return found


def complaints_about_report(path, imports):
    for line, imported in imports:
        if posixpath.dirname(imported) not in (REPORT, GENERATED):
            yield f"{path}:{line}: the report may not import {imported}"


def complaints_about(path, imports):
    folder = folder_of(path)
    if folder not in MAY_IMPORT:
        yield f"{path}: no rule for the imports of this folder"
        return
    for line, imported in imports:
        if imported.startswith(GENERATED + "/"):
            continue
        if not imported.startswith("web/src/"):
            yield f"{path}:{line}: {imported} is no file of the page"
        elif folder_of(imported) not in [folder, *MAY_IMPORT[folder]]:
            yield f"{path}:{line}: {folder} may not import {imported}"


def check(root):
    complaints, imports, report, counts = [], {}, {}, {}
    for index, (folder, allowed) in enumerate(MAY_IMPORT.items()):
        if not set(allowed) <= set(list(MAY_IMPORT)[:index]):
            complaints.append(f"MAY_IMPORT: {folder} names a folder that is not above it")
    for path, file in tree.files(root):
        if path.startswith(REPORT + "/") and path.endswith(".ts"):
            report[path[:-3]] = list(imports_of(path, tree.text(file) or ""))
        if not path.startswith("web/src/"):
            continue
        if path.count("/") != 3:
            complaints.append(f"{path}: belongs in a folder of web/src")
            continue
        counts[folder_of(path)] = counts.get(folder_of(path), 0) + 1
        if path.endswith(".ts"):
            imports[path[:-3]] = list(imports_of(path, tree.text(file) or ""))
    for path, found in imports.items():
        complaints += complaints_about(path + ".ts", found)
    for path, found in report.items():
        complaints += complaints_about_report(path + ".ts", found)
    complaints += [f"an import cycle: {' -> '.join(path)}"
                   for path in cycles(imports | report)]
    complaints += [f"web/src/{folder}: {count} files, more than {MAX_FILES}"
                   for folder, count in counts.items() if count > MAX_FILES]
    return complaints


if __name__ == "__main__":
    default = pathlib.Path(__file__).resolve().parents[2]
    sys.exit(tree.report("web imports",
                         check(pathlib.Path(sys.argv[1] if sys.argv[1:] else default))))
