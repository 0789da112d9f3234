#!/usr/bin/env python3
"""Checks that relative links between the documents lead to existing files and headings, and that
documents named elsewhere in the project exist. Usage: check_links.py [ROOT]"""
import pathlib
import posixpath
import re
import sys

import tree

LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"#{1,6} +(.*)")
# Names of documents and their folders in comments, scripts and messages.
MENTION = re.compile(r"(?<![\w./-])(docs/[\w./-]*\w|[A-Z]{4,}\.md\b)")


def prose(text):
    """(number, line) outside fenced code."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, line


def anchors(text):
    """The anchors that GitHub generates for the headings."""
    found = {}
    for _, line in prose(text):
        if match := HEADING.fullmatch(line.rstrip()):
            plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", match[1]).lower()
            name = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
            count = found[name] = found.get(name, -1) + 1
            if count:
                found[f"{name}-{count}"] = 0
    return found.keys()


def broken_links(root, path, text, headings):
    for number, line in prose(text):
        for link in LINK.findall(line):
            if re.match(r"[a-z]+:", link):
                continue
            file, _, anchor = link.partition("#")
            target = posixpath.normpath(posixpath.join(posixpath.dirname(path), file))
            target = target if file else path
            if not (root / target).exists() or anchor and anchor not in headings.get(target, ()):
                yield f"{path}:{number}: {link} leads nowhere"


def check(root):
    texts = {path: text for path, file in tree.files(root) if (text := tree.text(file))}
    headings = {path: anchors(text) for path, text in texts.items() if path.endswith(".md")}
    complaints = []
    for path, text in texts.items():
        if path in headings:
            complaints += broken_links(root, path, text, headings)
        elif path != "tests/tidy/self_test.py":
            complaints += [f"{path}:{number}: {name} does not exist"
                           for number, line in enumerate(text.splitlines(), 1)
                           for name in MENTION.findall(line) if not (root / name).exists()]
    return complaints


if __name__ == "__main__":
    default = pathlib.Path(__file__).resolve().parents[2]
    sys.exit(tree.report("links", check(pathlib.Path(sys.argv[1] if sys.argv[1:] else default))))
