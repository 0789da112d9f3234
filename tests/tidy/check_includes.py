#!/usr/bin/env python3
"""Checks that includes follow the table of dependencies in docs/design/overview.md, and which
files include third-party headers. Usage: check_includes.py [ROOT]"""
import itertools
import pathlib
import re
import sys

import tree

PROJECT = pathlib.Path(__file__).resolve().parents[2]
TABLE_HEAD = "| folder | may include |"


def dependencies(text):
    """The Markdown table after TABLE_HEAD: folder -> permitted includes besides itself. A name
    ending in .hpp permits only that header."""
    lines = text.partition(TABLE_HEAD + "\n")[2].splitlines()
    rows = itertools.takewhile(lambda line: line.startswith("|"), lines)
    named = [[re.findall(r"`([^`]+)`", cell) for cell in row.split("|")[1:3]] for row in rows]
    return {folders[0]: allowed for folders, allowed in named if folders}


MAY_INCLUDE = dependencies((PROJECT / "docs/design/overview.md").read_text())

# third-party header -> the files that may include it, or include a project header that does
CONFINED = [
    ("nlohmann/", r"nlohmann/",
     r"protocol/((animation|view)/)?codec\w*\.[ch]pp|"
     r"server/data/formats/(zarr/json|(raw|list)/document)\.cpp|"
     r"server/data/formats/zarr/write/\w+\.[ch]pp|server/convert/\w+\.[ch]pp|"
     r"server/data/formats/plain/json_text\.[ch]pp|server/api/documents/\w+\.[ch]pp|tests/.*"),
    ("ecCodes", r"eccodes\.h", r"server/data/formats/grib/.*|tests/.*"),
    ("PROJ", r"proj\.h",
     r"server/data/cf/grid/(proj_context\.hpp|(projected_columns|crs_wkt)\.cpp)|tests/.*"),
    ("a compressor", r"(blosc|lz4|zlib|zstd)\.h",
     r"server/(data|ground|vtk_loader)/.*|server/(http/gzip|movie/zip)\.cpp|tests/.*"),
    ("VTK", r"vtk\w+\.h", r"server/vtk_loader/.*"),
    ("netCDF", r"netcdf(_\w+)?\.h", r"server/data/.*|tests/.*"),
    ("libcurl", r"curl/", r"server/data/fetch/http_client\.cpp"),
    ("libseccomp", r"seccomp\.h", r"server/data/loader/.*|tests/.*"),
    ("an image library", r"(turbojpeg|jpeglib|png)\.h", r"server/image/.*|tests/.*"),
    ("OpenH264", r"wels/", r"server/image/.*|tests/.*"),
    ("Highway", r"hwy/",
     r"server/engine/kernels/.*|server/image/(ycc_rows|highway_targets)\.cpp|tests/.*"),
    ("Beast or Asio", r"boost/(beast|asio)[/.]",
     r"server/transport/.*|tests/.*"),
    ("Prometheus", r"prometheus/", r"server/metrics/metrics\.cpp|tests/.*"),
    ("CLI11", r"CLI/", r"server/cli/.*|server/main\.cpp"),
]

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^">]+)[">]')


def home_of(path):
    """The folder of MAY_INCLUDE that a file belongs to."""
    fitting = [home for home in MAY_INCLUDE if path == home or path.startswith(home + "/")]
    return max(fitting, key=len, default=None)


def is_allowed(home, included):
    for allowed in [home, *MAY_INCLUDE[home]]:
        if included == allowed or included.startswith(allowed + "/"):
            return True
    return False


def resolved(path, included, known):
    """The included project file: a path relative to the root folder, or in tests to the file."""
    if included in known:
        return included
    beside = f"{path.rpartition('/')[0]}/{included}"
    return beside if path.startswith("tests/") and beside in known else None


def brought_by(headers, known):
    """path -> the indices of the CONFINED headers that it includes, directly or indirectly."""
    brought = {path: {index for _, _, included in lines
                      for index, (_, pattern, _) in enumerate(CONFINED)
                      if re.match(pattern, included)}
               for path, lines in headers.items()}
    grown = True
    while grown:
        grown = False
        for path, lines in headers.items():
            for _, _, included in lines:
                more = brought.get(resolved(path, included, known), set()) - brought[path]
                if more:
                    brought[path] |= more
                    grown = True
    return brought


def complaints_about(path, number, quote, included, known, brought):
    where = f"{path}:{number}"
    ours = resolved(path, included, known)
    for index, (library, pattern, users) in enumerate(CONFINED):
        if re.fullmatch(users, path):
            continue
        if re.match(pattern, included):
            yield f"{where}: {included} may not be named here"
        elif index in brought.get(ours, ()) and re.fullmatch(users, ours):
            yield f"{where}: {included} brings {library}, which may not come here"
    if quote != '"':
        if ours:
            yield f'{where}: <{included}> is our own: write it between ""'
        return
    if not ours:
        yield f"{where}: {included} is no file of the project; name it from the project's folder"
        return
    home = home_of(path)
    if path.startswith("tests/"):
        return
    if home is None:
        yield f"{where}: docs/design/overview.md has no row for this folder"
    elif not is_allowed(home, included):
        yield f"{where}: {home} may not include {included}"


def check(root):
    includes = {}
    for path, file in tree.files(root):
        if path.endswith((".cpp", ".hpp", ".h")) and path.startswith(("server/", "protocol/",
                                                                      "tests/")):
            matches = [(number, INCLUDE.match(line))
                       for number, line in enumerate((tree.text(file) or "").splitlines(), 1)]
            includes[path] = [(number, *match.groups()) for number, match in matches if match]
    brought = brought_by(includes, includes.keys())
    return [complaint for path, lines in includes.items() for line in lines
            for complaint in complaints_about(path, *line, includes.keys(), brought)]


if __name__ == "__main__":
    sys.exit(tree.report("includes", check(pathlib.Path(sys.argv[1] if sys.argv[1:] else PROJECT))))
