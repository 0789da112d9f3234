#!/usr/bin/env python3
"""Checks that every route of server/api/routes.cpp is a row of the table "Resources" in
docs/user/api.md."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROUTE = re.compile(r'Route\{"([A-Z]+)",\s*(?:"([^"]+)"|(route_stream))')
# Paths in one row that differ only in the format of the picture.
FORMATS = ("frame.jpg", "frame.png", "frame.npy", "frame.pdf", "frame.svg")


def routes_of(source):
    for method, path, stream in ROUTE.findall(source):
        path = "/v1/stream" if stream else path
        for name in FORMATS:
            path = path.replace(name, "frame.{jpg,png,npy,pdf,svg}")
        yield method, path.replace("/references/{id}", "/references/{id}.png")


def check(root):
    complaints = []
    source = (root / "server/api/routes.cpp").read_text()
    rows = [line for line in (root / "docs/user/api.md").read_text().splitlines()
            if line.startswith("| `")]
    found = list(routes_of(source))
    if len(found) < source.count("Route{"):
        complaints.append("server/api/routes.cpp: a route is not in the form that this check reads")
    for method, path in found:
        names = re.compile(r"(?<![\w/}])" + re.escape(path) + r"(?=[`?])")
        if not any(names.search(row) and method in row for row in rows):
            complaints.append(f"docs/user/api.md: no row for {method} {path}")
    return complaints


def main(root=ROOT):
    found = check(root)
    print("\n".join([*found, f"routes: {len(found)} complaints"]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
