#!/usr/bin/env python3
"""Runs the commands of the tutorial as they stand there, but for those that build, serve, or need
ffmpeg or a server, and compares its excerpt of `inspect` and its figures with the results. Usage:
tutorial.py [--program=FILE]"""
import argparse
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
LEFT_OUT = ("./scripts/", "windsplat serve", "ffmpeg", "curl")


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.M | re.S)


def commands(text):
    joined = "".join(blocks(text, "sh")).replace("\\\n", " ")
    return [line for line in joined.splitlines() if line and not line.startswith(LEFT_OUT)]


def words(text):
    return " ".join(text.split())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default=str(ROOT / "build/release/windsplat"))
    program = str(pathlib.Path(parser.parse_args().program).resolve())
    text = (ROOT / "docs/user/tutorial.md").read_text()
    view, = blocks(text, "json")
    excerpt, = blocks(text, "text")
    output, faults = "", []
    with tempfile.TemporaryDirectory(prefix="windsplat-tutorial-") as name:
        folder = pathlib.Path(name)
        (folder / "storm.json").write_text(view)
        for command in commands(text):
            first, *rest = shlex.split(command, comments=True)
            if first != "windsplat":
                sys.exit(f"an unknown command: {command}")
            run = subprocess.run([program, *rest], cwd=folder, capture_output=True, text=True,
                                 env={**os.environ, "TZ": "UTC"}, check=False)
            if run.returncode:
                sys.exit(f"{command}\nexits with {run.returncode}: {run.stderr}")
            output += run.stdout
        seen = words(output)
        faults += [f"inspect does not say: {line}" for line in excerpt.splitlines()
                   if words(line) not in seen]
        error = json.loads((folder / "report.json").read_text())["error"]["value"]
        stated = re.search(r"an estimate of ([\d.]+) RMS", words(text))[1]
        if f"{error:.4f}" != stated:
            faults.append(f"the report has an error of {error:.4f}, the tutorial {stated}")
        pictures = len(list(folder.glob("flow_*.jpg")))
        if pictures != 40 or "Forty pictures" not in text:
            faults.append(f"the movie has {pictures} pictures")
        faults += [f"{one} was not made" for one in ("first.jpg", "figure.pdf", "figure.jpg")
                   if not (folder / one).exists()]
    print("\n".join(faults) or "the tutorial is true")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
