"""The files of the project for the tidy tests: everything except files that were built, fetched
or found by a fuzzer."""
import os
import pathlib

NOT_OURS = {".git", "build", "node_modules", "dist", "__pycache__", ".test-build", "corpus"}


def files(root):
    """(path relative to root with forward slashes, absolute path), sorted."""
    found = []
    for folder, names, leaves in os.walk(root):
        names[:] = [name for name in names if name not in NOT_OURS]
        for leaf in leaves:
            path = pathlib.Path(folder) / leaf
            found.append((path.relative_to(root).as_posix(), path))
    return sorted(found)


def text(path):
    """The file's text, or None for binary files."""
    try:
        content = path.read_bytes()
        return None if b"\0" in content else content.decode("utf-8")
    except UnicodeDecodeError:
        return None


def report(name, complaints):
    """Prints the complaints; returns the exit code."""
    for complaint in complaints:
        print(complaint)
    print(f"{name}: {len(complaints)} complaints")
    return 1 if complaints else 0
