#!/usr/bin/env python3
"""Checks the spelling of code, comments and documents with codespell; correct words that it
rejects are in spelling_ignored.txt. Usage: check_spelling.py [ROOT]"""
import pathlib
import subprocess
import sys

import tree
from check_style import GENERATED

IGNORED = pathlib.Path(__file__).parent / "spelling_ignored.txt"
PICTURES = (".svg", ".json")  # numbers and names of other programs


def check(root):
    names = [path for path, file in tree.files(root)
             if not GENERATED.fullmatch(path) and not path.endswith(PICTURES)
             and path != IGNORED.relative_to(pathlib.Path(__file__).parents[2]).as_posix()
             and tree.text(file) is not None]
    done = subprocess.run(["codespell", "--quiet-level=2", f"--ignore-words={IGNORED}", *names],
                          cwd=root, stdout=subprocess.PIPE, text=True, check=False)
    return done.stdout.splitlines()


if __name__ == "__main__":
    default = pathlib.Path(__file__).resolve().parents[2]
    sys.exit(tree.report("spelling", check(pathlib.Path(sys.argv[1] if sys.argv[1:] else default))))
