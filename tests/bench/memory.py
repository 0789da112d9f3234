#!/usr/bin/env python3
"""Peak memory of a real daemon: climate's winds and clouds resident, then sessions at 1280 x 720
that turn the camera and take every frame. Table as Markdown on stdout. Linux only (/proc).

Usage: memory.py [--program=windsplat] [--frames=20] [--sessions=4] [--size=1280x720]
       [--dims=320x160x19 | --built-in] [--max-mb=N]

Serves a netCDF file of the sample, or with --built-in the sample itself. Exit 1 if the peak of
the first session exceeds N MB."""
import argparse
import math
import pathlib
import subprocess
import sys
import tempfile

from stream_client import Daemon, Viewer

MB = 1e6


def measure(daemon, options):
    """Rows of name, resident and peak bytes; and the resident bytes of an additional session."""
    width, height = map(int, options.size.split("x"))
    rows = [("started, nothing loaded", daemon.memory())]
    first = Viewer(daemon.port)
    first.turn({"dataset": "climate", "image": {"width": 1, "height": 1}}, 1)
    rows.append(("winds + clouds resident", daemon.memory()))
    view = {"dataset": "climate", "image": {"width": width, "height": height}}
    first.turn(view, options.frames)
    rows.append((f"1 session, {options.size}, {options.frames} final frames", daemon.memory()))
    idle = []
    for _ in range(options.sessions - 1):
        idle.append(Viewer(daemon.port))
        idle[-1].turn(view, 2)
    rows.append((f"{options.sessions} sessions, {options.size}", daemon.memory()))
    return rows


def main():
    default = pathlib.Path(__file__).resolve().parents[2] / "build/release/windsplat"
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(default))
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--sessions", type=int, default=4)
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--dims", default="320x160x19")
    parser.add_argument("--built-in", action="store_true")
    parser.add_argument("--max-mb", type=float)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        dataset = f"{folder}/climate.nc"
        subprocess.run([options.program, "synth", "climate", "--steps", "1", "--dims", options.dims,
                        "-o", dataset], check=True)
        daemon = Daemon(options.program, "climate" if options.built_in else dataset)
        try:
            rows = measure(daemon, options)
        finally:
            daemon.stop()
    print("| daemon | resident, MB | peak, MB |\n|---|---|---|")
    for name, memory in rows:
        print(f"| {name} | {memory['VmRSS'] / MB:.1f} | {memory['VmHWM'] / MB:.1f} |")
    voxels = math.prod(map(int, options.dims.split("x")))
    resident = [memory["VmRSS"] for _, memory in rows]
    print(f"\nResident bytes per voxel: {(resident[1] - resident[0]) / voxels:.1f} "
          "(winds and clouds, with what reading them leaves behind)")
    if options.sessions > 1:
        more = (resident[3] - resident[2]) / (options.sessions - 1)
        print(f"An additional session: {more / MB:.2f} MB")
    peak = rows[2][1]["VmHWM"] / MB
    if options.max_mb is not None and peak > options.max_mb:
        sys.exit(f"memory.py: the peak, {peak:.1f} MB, is above {options.max_mb:g} MB")


if __name__ == "__main__":
    main()
