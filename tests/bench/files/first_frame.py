#!/usr/bin/env python3
"""Measures how soon a session sees a dataset: runs a daemon for each row and opens its default
view. Prints a Markdown table. Linux only (/proc).

Usage: first_frame.py [--program=windsplat ...] [--dataset=F.nc ...] [--sides=256,512]
       [--sizes=640x480,1280x720] [--folder=DIR]

Without --dataset raw files are written and deleted: a scalar of each side, positive nearly
everywhere, and for the least side also a wind with a cloud. Several --program are measured in turn,
so that their times are of the same load.

resident: the fields were read before the session opened, by histograms; otherwise they are read for
it from the system's file cache. Seconds from the session's first message to the first frame and to
the first one at full size, with the processor time of the daemon without its loader."""
import argparse
import json
import os
import pathlib
import struct
import sys
import tempfile
import time
import urllib.request

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from stream_client import TEXT, Daemon, Viewer  # noqa: E402


def waves(side, seed, threshold=None):
    """A sum of smooth waves, layer by layer; `threshold`: what exceeds it, otherwise its size."""
    numbers = numpy.random.default_rng(seed)
    x = numpy.arange(side, dtype=numpy.float32) * (2 * numpy.pi / side)
    terms = []
    for _ in range(6):
        terms.append([numpy.sin(numbers.integers(1, 9) * x + numbers.uniform(0, 6.28))
                      .astype(numpy.float32) for _ in range(3)])
    for z in range(side):
        layer = sum(a[:, None] * b[None, :] * c[z] for a, b, c in terms)
        if threshold is None:
            yield numpy.abs(layer)
        else:
            yield numpy.maximum(layer - numpy.float32(threshold), 0) if threshold > 0 else layer


def write_raw(folder, name, side, fields):
    """`fields`: for each one its name, its components, and what waves() takes after the side."""
    with open(folder / f"{name}.bin", "wb") as out:
        for _, components, seed, threshold in fields:
            for n in range(components):
                for layer in waves(side, seed + n, threshold):
                    out.write(layer.astype("<f4").tobytes())
    described = [{"name": field} if components == 1 else
                 {"name": field, "components": ["u", "v", "w"], "layout": "planar"}
                 for field, components, _, _ in fields]
    header = folder / f"{name}.json"
    header.write_text(json.dumps({
        "windsplat": "raw", "file": f"{name}.bin", "type": "float32", "endian": "little",
        "dims": {axis: side for axis in "xyz"}, "steps": {"count": 1}, "fields": described}))
    return header


def generated(folder, sides):
    files = [write_raw(folder, f"scalar{side}", side, [("density", 1, 1, None)]) for side in sides]
    files.append(write_raw(folder, f"wind{min(sides)}", min(sides),
                           [("wind", 3, 10, 0), ("cloud", 1, 20, 0.8)]))
    return files


def processor_seconds(process):
    fields = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def read_fields(port, dataset):
    """Makes the first vector and the first scalar resident, as in a default view."""
    address = f"http://127.0.0.1:{port}/v1/datasets/{dataset}"
    with urllib.request.urlopen(address) as answer:
        fields = json.load(answer)["fields"]
    for is_vector in (True, False):
        for field in fields:
            if (len(field["components"]) > 1) == is_vector:
                urllib.request.urlopen(f"{address}/fields/{field['name']}/histogram").read()
                break


def frames(viewer):
    while True:
        opcode, payload = viewer.message()
        if opcode == TEXT:
            message = json.loads(payload)
            if message["type"] == "error":
                raise RuntimeError(message)
            continue
        seq, rev, _, flags = struct.unpack_from("<4I", payload, 8)
        width, height = struct.unpack_from("<2H", payload, 24)
        viewer.say({"type": "ack", "seq": seq, "decodeMs": 1})
        yield rev, width, height


def measure(program, file, size, is_resident):
    """Of the first frame and of the first one at full size: seconds, processor seconds, size."""
    daemon = Daemon(program, str(file), "--memory-limit", "8G")
    try:
        if is_resident:
            read_fields(daemon.port, file.stem)
        width, height = map(int, size.split("x"))
        used, begun = processor_seconds(daemon.child.pid), time.monotonic()
        viewer = Viewer(daemon.port)
        viewer.say({"type": "patch", "rev": 1, "t": 0, "patch": {
            "dataset": file.stem, "image": {"width": width, "height": height}}})
        found = []
        for rev, wide, high in frames(viewer):
            whole = (wide, high) == (width, height)
            if rev < 1 or (found and not whole):
                continue
            found.append((time.monotonic() - begun,
                          processor_seconds(daemon.child.pid) - used, f"{wide}x{high}"))
            if whole:
                return found[0], found[-1]
    finally:
        daemon.stop()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", action="append", dest="programs")
    parser.add_argument("--dataset", action="append", dest="datasets", type=pathlib.Path)
    parser.add_argument("--sides", default="256,512")
    parser.add_argument("--sizes", default="640x480,1280x720")
    parser.add_argument("--folder", help="for the generated files; a temporary one otherwise")
    options = parser.parse_args()
    programs = options.programs or ["build/release/windsplat"]
    print("| data | resident | view | program | first frame, s | processor, s | its size | "
          "at full size, s | processor, s |\n|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        files = options.datasets or generated(
            pathlib.Path(folder), [int(side) for side in options.sides.split(",")])
        for file in files:
            for is_resident in (False, True):
                for size in options.sizes.split(","):
                    for n, program in enumerate(programs):
                        first, whole = measure(program, file, size, is_resident)
                        print(f"| {file.stem} | {'yes' if is_resident else 'no'} | {size} | "
                              f"{n + 1} | {first[0]:.2f} | {first[1]:.2f} | {first[2]} | "
                              f"{whole[0]:.2f} | {whole[1]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
