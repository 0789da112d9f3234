#!/usr/bin/env python3
"""Measures a store that is larger than the memory: its conversion, the first picture from a cold
start, a turn, and a zoom from the whole to a single sample. Prints Markdown. Linux only (/proc).

Usage: large_store.py [--program=windsplat] [--data=tornado:768x768x512] [--fields=wind,cloud]
       [--store=F.zarr] [--memory-limit=1G] [--size=1280x720] [--seconds=20] [--target=0,0,0]
       [--folder=DIR] [--disk-mib=1024]

--store: a store that exists is measured without a conversion. Before the daemon starts the files
of the store leave the cache of the system. Rates of writing are relative to a file of
--disk-mib of random bytes, written in the same folder before the conversion. Memory is the
proportional set size of all processes. --target: a place in the world, which the zoom approaches;
each of its pictures is half as high as the one before."""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from process_memory import PeakPss, bytes_of  # noqa: E402
from stream_client import Daemon, Viewer  # noqa: E402

MIB = 1 << 20


def files_of(store):
    return [path for path in store.rglob("*") if path.is_file()]


def bytes_stored(store):
    return sum(path.stat().st_size for path in files_of(store))


def write_rate(folder, blocks):
    """Bytes a second of a file of so many MiB that is written and synchronised."""
    block = os.urandom(MIB)
    path = folder / "rate.bin"
    begun = time.monotonic()
    with path.open("wb") as file:
        for _ in range(blocks):
            file.write(block)
        file.flush()
        os.fsync(file.fileno())
    seconds = time.monotonic() - begun
    path.unlink()
    return blocks * len(block) / seconds


def leave_cache(store):
    for path in files_of(store):
        with path.open("rb") as file:
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def convert(options, store):
    rate = write_rate(store.parent, options.disk_mib)
    fields = [f"--field={name}" for name in options.fields.split(",") if name]
    begun, used = time.monotonic(), os.times()
    process = subprocess.Popen([options.program, "convert", options.data, "-o", store, *fields,
                                "--steps", "0:0", "--memory-limit", options.memory_limit],
                               stdout=subprocess.DEVNULL)
    memory = PeakPss(process.pid, 0.1)
    if process.wait() != 0:
        raise SystemExit(f"convert ended with {process.returncode}")
    seconds, after = time.monotonic() - begun, os.times()
    processor = (after.children_user + after.children_system - used.children_user -
                 used.children_system)
    written = bytes_stored(store)
    limit = bytes_of(options.memory_limit)
    print(f"conversion: {written / MIB:.0f} MiB in {seconds:.0f} s, {processor:.0f} s of processor "
          f"time; {written / seconds / rate:.2f} of the rate of the disk; "
          f"memory {memory.stop() / limit:.2f} of the limit", flush=True)


class Measured(Viewer):
    """A session that tells the time, the level and the report of frames."""

    def __init__(self, port, dataset, size):
        super().__init__(port)
        width, height = map(int, size.split("x"))
        self.rev, self.reports = 0, {}
        self.view = {"dataset": dataset, "image": {"width": width, "height": height}}

    def patch(self, camera=None):
        self.rev += 1
        patch = dict(self.view, **({"camera": camera} if camera else {}))
        self.say({"type": "patch", "rev": self.rev, "t": 0, "patch": patch})

    def next_frame(self, final=False):
        """The next frame of the newest revision: whether it is final, and its report."""
        while True:
            message, seq, rev, is_final = self.received()
            if message:
                if message["type"] == "chosen":
                    self.reports[message["seq"]] = message
                continue
            report = self.reports.pop(seq)
            if rev == self.rev and (is_final or not final):
                return is_final, report


def told(error):
    return "unknown" if error is None else f"{error:.2g}"


def level(report):
    detail = report.get("detail")
    if detail is None:
        return "all samples"
    return "{} of {}".format(*("/".join(map(str, detail[of]["halvings"]))
                               for of in ("drawn", "wanted")))


def measure_first(viewer, begun):
    viewer.patch()
    is_final, report = viewer.next_frame()
    print(f"first picture: {time.monotonic() - begun:.2f} s after the start of the daemon, level "
          f"{level(report)}", flush=True)
    if not is_final:
        _, report = viewer.next_frame(final=True)
        print(f"final picture: {time.monotonic() - begun:.2f} s, level {level(report)}", flush=True)


def measure_turn(viewer, seconds):
    """The eye circles the data once a minute; a new camera follows each frame."""
    begun = last = time.monotonic()
    gaps, stood_in, levels = [], 0, {}
    while last - begun < seconds:
        angle = 2 * math.pi * (last - begun) / 60
        viewer.patch({"eye": [2.4 * math.sin(angle), -2.4 * math.cos(angle), 1.2]})
        _, report = viewer.next_frame()
        now = time.monotonic()
        gaps.append(now - last)
        last = now
        stood_in += "missingBytes" in report.get("detail", {})
        levels[level(report)] = levels.get(level(report), 0) + 1
    gaps.sort()
    told = ", ".join(f"{name}: {count}" for name, count in sorted(levels.items()))
    median, late = (gaps[int(share * len(gaps))] for share in (0.5, 0.95))
    print(f"turn: {len(gaps) / (last - begun):.1f} frames a second, gaps of {median:.3f} s "
          f"(median), {late:.3f} (p95), {gaps[-1]:.3f} (longest); "
          f"{stood_in} of {len(gaps)} stood in; levels {told}", flush=True)


def measure_zoom(viewer, target, spacing):
    print("\n| height of the picture, samples | level | final, s | error | of detail |\n"
          "|---|---|---|---|---|")
    height = 2.4
    while True:
        viewer.patch({"projection": "orthographic", "target": target, "height": height,
                      "eye": [target[0] + 1.2, target[1] - 1.6, target[2] + 0.9]})
        begun = time.monotonic()
        _, report = viewer.next_frame(final=True)
        error = report.get("error") or {}
        detail = (report.get("detail") or {}).get("error")
        print(f"| {height / spacing:.1f} | {level(report)} | {time.monotonic() - begun:.2f} | "
              f"{told(error.get('value'))} {error.get('kind', '')} | {told(detail)} |", flush=True)
        if height <= spacing:
            return
        height = max(height / 2, spacing)


def spacing_of(port, dataset):
    """The smallest distance of samples in the world, whose longest axis has the length 2."""
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/v1/datasets/{dataset}") as answer:
        return 2 / (max(json.load(answer)["dims"].values()) - 1)


def serve(options, store):
    leave_cache(store)
    begun = time.monotonic()
    daemon = Daemon(options.program, str(store), "--memory-limit", options.memory_limit)
    memory = PeakPss(daemon.child.pid, 0.02)
    try:
        viewer = Measured(daemon.port, store.stem, options.size)
        measure_first(viewer, begun)
        measure_turn(viewer, options.seconds)
        measure_zoom(viewer, [float(x) for x in options.target.split(",")],
                     spacing_of(daemon.port, store.stem))
    finally:
        daemon.stop()
    print(f"\nmemory of the daemon and its loaders: {memory.stop() / MIB:.0f} MiB at most, "
          f"{memory.peak / bytes_of(options.memory_limit):.2f} of the limit")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--program", default="build/release/windsplat")
    parser.add_argument("--data", default="tornado:768x768x512")
    parser.add_argument("--fields", default="wind,cloud")
    parser.add_argument("--store", type=pathlib.Path)
    parser.add_argument("--memory-limit", default="1G")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--target", default="0,0,0")
    parser.add_argument("--disk-mib", type=int, default=1024)
    parser.add_argument("--folder", help="for the converted store; a temporary one otherwise")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        store = options.store or pathlib.Path(folder) / "large.zarr"
        if not options.store:
            convert(options, store)
        serve(options, store)


if __name__ == "__main__":
    main()
