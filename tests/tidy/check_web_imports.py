#!/usr/bin/env python3
"""Checks the imports of the page (web/src), of the client package (clients/js/src) and of the
study's report (web/report): permitted imports between folders, no circular imports between files,
and the number of files in a folder. Usage: check_web_imports.py [ROOT]"""
import pathlib
import posixpath
import re
import sys

import tree

PAGE = "web/src"
CLIENT = "clients/js/src"             # the package @windsplat/client, of which the page is made
# Folder -> folders beside it that it may import from besides itself, lowest first. The order is
# the layering: a folder may not import from one listed below it.
MAY_IMPORT = {
    PAGE: {
        "base": [],                       # numbers, text, DOM helpers
        "view": ["base"],                 # parts of the view document: history, legend entries
        "viewport": ["base", "view"],     # the overlays of the picture
        "panels": ["base", "view"],       # the controls at the side
        "save": ["base", "view"],         # pictures, animations, saved views
        "app": ["base", "view", "viewport", "panels", "save"],
        "styles": [],                     # style sheets only
    },
    CLIENT: {
        "generated": [],                  # types of the protocol, made by every build
        "base": [],                       # numbers, sizes of elements
        "wire": ["generated", "base"],    # HTTP and WebSocket: messages, requests, connection
        "view": ["base", "wire"],         # the view document: state, camera, answers
        "client": ["generated", "base", "wire", "view"],   # REST and streams for programs
        "viewport": ["base", "wire", "view"],              # a picture: frames, input
        "element": ["base", "wire", "view", "client", "viewport"],    # <windsplat-view>
    },
}
MODULES = ["index", "parts", "element"]    # of the package; what others may import, by its name
PACKAGE = "@windsplat/client"
REPORT = "web/report"                 # the report of a study; imports nothing of the page
GENERATED = "web/generated"           # types of a study; the report may import them
MAX_FILES = 30                        # per folder

IMPORT = re.compile(r"""(?:\bfrom|\bimport)\s*\(?\s*["']([^"']+)["']""")


def imports_of(path, content):
    """(line, imported path without extension) of every relative import and of those of the
    package."""
    folder = posixpath.dirname(path)
    for match in IMPORT.finditer(content):
        line = content.count("\n", 0, match.start()) + 1
        if match[1].startswith("."):
            yield line, posixpath.normpath(f"{folder}/{match[1]}")
        elif match[1].split("/")[:2] == PACKAGE.split("/"):
            yield line, f"{CLIENT}/{match[1][len(PACKAGE) + 1:] or 'index'}"


def root_of(path):
    return next((root for root in MAY_IMPORT if path.startswith(root + "/")), None)


def folder_of(path):
    """The folder within the root; empty for a file directly in it."""
    return posixpath.dirname(path[len(root_of(path)) + 1:])


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


def is_module(path):
    return path in [f"{CLIENT}/{name}" for name in MODULES]


def complaints_about(path, imports):
    root, folder = root_of(path), folder_of(path)
    own = is_module(path[:-3])            # a module of the package imports from all of its folders
    if not own and folder not in MAY_IMPORT[root]:
        yield f"{path}: no rule for the imports of this folder"
        return
    permitted = MAY_IMPORT[root] if own else [folder, *MAY_IMPORT[root][folder]]
    for line, imported in imports:
        if root == PAGE and is_module(imported):
            continue
        if root_of(imported) != root or (is_module(imported) and not own):
            yield f"{path}:{line}: {imported} is no file of {root}"
        elif not is_module(imported) and folder_of(imported) not in permitted:
            yield f"{path}:{line}: {folder} may not import {imported}"


def check(root):
    complaints, imports, report, counts = [], {}, {}, {}
    for rules in MAY_IMPORT.values():
        for index, (folder, allowed) in enumerate(rules.items()):
            if not set(allowed) <= set(list(rules)[:index]):
                complaints.append(f"MAY_IMPORT: {folder} names a folder that is not above it")
    for path, file in tree.files(root):
        if path.startswith(REPORT + "/") and path.endswith(".ts"):
            report[path[:-3]] = list(imports_of(path, tree.text(file) or ""))
        if root_of(path) is None:
            continue
        depth = len(path[len(root_of(path)):].split("/")) - 2
        if depth != 1 and not is_module(path[:-3]):
            complaints.append(f"{path}: belongs in a folder of {root_of(path)}")
            continue
        place = posixpath.dirname(path)
        counts[place] = counts.get(place, 0) + 1
        if path.endswith(".ts"):
            imports[path[:-3]] = list(imports_of(path, tree.text(file) or ""))
    for path, found in imports.items():
        complaints += complaints_about(path + ".ts", found)
    for path, found in report.items():
        complaints += complaints_about_report(path + ".ts", found)
    complaints += [f"an import cycle: {' -> '.join(path)}"
                   for path in cycles(imports | report)]
    complaints += [f"{place}: {count} files, more than {MAX_FILES}"
                   for place, count in counts.items() if count > MAX_FILES]
    return complaints


if __name__ == "__main__":
    default = pathlib.Path(__file__).resolve().parents[2]
    sys.exit(tree.report("web imports",
                         check(pathlib.Path(sys.argv[1] if sys.argv[1:] else default))))
