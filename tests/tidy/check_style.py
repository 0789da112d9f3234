#!/usr/bin/env python3
"""Checks the style rules of CONTRIBUTING.md: long lines, functions, files and folders, files of
many bytes, classes with many members, notes of postponed work, machine-specific paths, names of C++
tests, test folders without a test.

Usage: check_style.py [ROOT]"""
import collections
import pathlib
import re
import sys

import classes
import tree

MAX_LINE = 100
MAX_FUNCTION_LINES = 80  # "about 70"
MAX_FILE_BYTES = 1 << 20  # larger ones are written by programs, or fetched
MAX_FILE_LINES = 500
MAX_FOLDER_FILES = 30
MAX_CLASS_MEMBERS = 25  # of the server

ONE_FORMAT = "half of the members implement an interface, the others read one file format"
LARGE_CLASSES = {
    ("server/data/cf/series.hpp", "SeriesFile"): ONE_FORMAT,
    ("server/data/cf/source.cpp", "ArraySource"): ONE_FORMAT,
    ("server/data/formats/grib/file.hpp", "File"): ONE_FORMAT,
    ("server/data/formats/netcdf/file.hpp", "File"): ONE_FORMAT,
    ("server/data/formats/zarr/store.hpp", "Store"): ONE_FORMAT,
    ("server/data/formats/vtk/source.cpp", "VtkSource"): ONE_FORMAT,
    ("server/data/formats/vtk/legacy.cpp", "Reader"): "a function for each section of the format",
    ("server/data/resident/budget.hpp", "Budget"): "all is guarded by one mutex",
    ("server/data/resident/dataset.hpp", "Dataset"): "the handle of a dataset: short queries",
    ("server/engine/slabs.cpp", "SlabSweep"): "the state of one hot loop",
}

CODE = (".cpp", ".hpp", ".h", ".ts", ".mjs", ".js", ".py", ".sh", ".cmake")
# Files written by a program, or read only by programs.
GENERATED = re.compile(r"(.*/)?(package-lock\.json|.*\.generated\.\w+|generated/.*)")

# Assembled from pieces, so that this file passes its own check.
PUT_OFF = re.compile(r"\b(" + "|".join(["TO" + "DO", "FIX" + "ME", "X" * 3]) + r")\b")
MACHINE = re.compile(r"(?<![\w./:$}*-])/(home|root|Users|work|workspace)/")

TEST_NAME = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.M)

OPENS_SCOPE = re.compile(r"(inline )?(namespace|class|struct|union|enum|extern)\b")


def is_code(path, content):
    return path.endswith(CODE) or content.startswith("#!")


def long_functions(path, lines):
    """Blocks at the depth of a free function or a member of a class, as clang-format lays them out.

    A statement runs from its first line to the one that ends in ; { } or :, so that a function is
    known by its whole signature.
    """
    statement, block = [], None
    for number, line in enumerate(lines, 1):
        depth = len(line) - len(line.lstrip(" "))
        if block is not None:
            if depth == block[1] and line.lstrip().startswith("}"):
                length = number - block[0] + 1
                if length > MAX_FUNCTION_LINES:
                    yield f"{path}:{block[0]}: a function of {length} lines"
                block = None
            continue
        if not line.strip() or line.lstrip().startswith(("#", "//")):
            statement = []
            continue
        statement.append((number, depth, line.strip()))
        if line.endswith("{"):
            whole = " ".join(part for _, _, part in statement)
            if statement[0][1] <= 2 and ")" in whole and not OPENS_SCOPE.match(whole):
                block = statement[0][:2]
        if line.endswith((";", "{", "}", ":")):
            statement = []


def large_classes(path, content):
    for number, name, members in classes.sizes(content):
        if members > MAX_CLASS_MEMBERS and (path, name) not in LARGE_CLASSES:
            yield f"{path}:{number}: {name} has {members} members"
        if members <= MAX_CLASS_MEMBERS and (path, name) in LARGE_CLASSES:
            yield f"{path}:{number}: {name} is no longer an exception: mend LARGE_CLASSES"


def stale_exceptions(root):
    """Reports exceptions for classes that are gone."""
    for path, name in LARGE_CLASSES:
        file = root / path
        content = tree.text(file) if file.exists() else None
        if not any(found == name for _, found, _ in classes.sizes(content or "")):
            yield f"{path}: {name} of LARGE_CLASSES is gone"


def test_names(path, content):
    for match in TEST_NAME.finditer(content):
        suite, name = match.groups()
        if not re.fullmatch(r"[A-Z][A-Za-z0-9]*", suite + name) or not name[0].isupper():
            number = content.count("\n", 0, match.start()) + 1
            yield f"{path}:{number}: test name {suite}.{name} is not CamelCase"


def complaints_about(path, content):
    lines = content.splitlines()
    for number, line in enumerate(lines, 1):
        if PUT_OFF.search(line):
            yield f"{path}:{number}: a note of work put off: open an issue instead"
        if MACHINE.search(line):
            yield f"{path}:{number}: a path of one machine"
    if not is_code(path, content):
        return
    for number, line in enumerate(lines, 1):
        if len(line) > MAX_LINE:
            yield f"{path}:{number}: {len(line)} columns"
    if len(lines) > MAX_FILE_LINES:
        yield f"{path}: {len(lines)} lines"
    if path.endswith((".cpp", ".hpp")):
        yield from long_functions(path, lines)
        yield from test_names(path, content)
        if path.startswith("server/"):
            yield from large_classes(path, content)


def empty_test_folders(root, files):
    """CMake silently accepts a test folder without sources."""
    listing = root / "tests" / "CMakeLists.txt"
    if listing.exists():
        for name, named in re.findall(r"^windsplat_test\((\w+)\s+(\S+)", listing.read_text(), re.M):
            for folder in named.strip('"').split(";"):
                here = [file for path, file in files
                        if re.fullmatch(rf"tests/{folder}/.+\.cpp", path)]
                if not any(re.search(r"^(TYPED_)?TEST(_[FP])?\(", tree.text(file) or "", re.M)
                           for file in here):
                    yield f"tests/{folder}: no test in it ({name})"
    for folder in sorted((root / "tests").glob("**/")):
        inside = folder.relative_to(root).as_posix()
        if not tree.NOT_OURS & set(folder.parts[len(root.parts):]):
            if not any(path.startswith(inside + "/") for path, _ in files):
                yield f"{inside}: an empty folder"


def tests_left_out(root, files):
    """Test sources in no listed folder, and those of which sanitized builds omit a part but which
    run in no other build."""
    listing = root / "tests" / "CMakeLists.txt"
    if not listing.exists():
        return
    call = r"^windsplat_test\((\w+)\s+(\"[^\"]*\"|\S+)([^)]*)\)"
    tests = re.findall(call, listing.read_text(), re.M)
    listed = []
    for name, named, options in tests:
        folders = tuple(f"tests/{folder}/" for folder in named.strip('"').split(";"))
        listed += folders
        release = re.search(r"\bRELEASE ([^-]\S*)", options)
        if not re.search(r"ASAN \*", options) and not release:
            continue
        repeated = release.group(1).replace(".*", "").split(":") if release else []
        for path, file in files:
            text = (tree.text(file) or "") if path.startswith(folders) else ""
            suites = set(re.findall(r"^TEST(?:_F|_P)?\((\w+),", text, re.M))
            if "WINDSPLAT_SANITIZED" in text and not suites & set(repeated):
                yield f"{path}: {name} runs under sanitizers only, which omit a part of it"
    for path, _ in files:
        if re.fullmatch(r"tests/unit/.+_test\.cpp", path) and not path.startswith(tuple(listed)):
            yield f"{path}: not in a folder of tests/CMakeLists.txt"


def full_folders(files):
    """Reports source folders with too many files."""
    count = collections.Counter(path.rpartition("/")[0] for path, _ in files if path.endswith(CODE))
    for folder, number in sorted(count.items()):
        if number > MAX_FOLDER_FILES:
            yield f"{folder}: {number} files"


def check(root):
    files = tree.files(root)
    complaints = [*empty_test_folders(root, files), *tests_left_out(root, files),
                  *full_folders(files)]
    if (root / "server" / "main.cpp").exists():
        complaints += stale_exceptions(root)
    for path, file in files:
        if file.stat().st_size > MAX_FILE_BYTES:
            complaints.append(f"{path}: {file.stat().st_size} bytes")
        content = tree.text(file)
        if content is not None and not GENERATED.fullmatch(path):
            complaints += complaints_about(path, content)
    return complaints


if __name__ == "__main__":
    default = pathlib.Path(__file__).resolve().parents[2]
    sys.exit(tree.report("style", check(pathlib.Path(sys.argv[1] if sys.argv[1:] else default))))
