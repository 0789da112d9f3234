#!/usr/bin/env python3
"""Checks whether moving frames stay within their budget: runs a daemon and a client that
orbits, and lists for every budget the times, reported errors and settings of frames. Prints
Markdown.

Usage: budgets.py [--program=windsplat] [--dataset=climate ...] [--size=640x480]
       [--budgets=16,33,66,100] [--max-errors=0.05,0.02,0.005] [--frames=120] [--check]

A dataset is any argument of `windsplat serve`. Before the orbits the view rests, so that the daemon
can calibrate it. With --check the exit code is 1 if more than one frame in twenty took more than
1.2 times its budget to render, or a larger budget has a larger error."""
import argparse
import collections
import json
import math
import pathlib
import re
import statistics
import struct
import subprocess
import sys
import time
import urllib.request

from memory import Viewer

METHODS = {1: "kernel", 2: "slab", 3: "reference"}


def frames(viewer):
    """The header fields of every frame with those of its `chosen` message, acknowledged at once."""
    chosen = {}
    while True:
        opcode, payload = viewer.message()
        if opcode == 1:
            message = json.loads(payload)
            if message["type"] == "error":
                raise RuntimeError(message)
            if message["type"] == "chosen":
                chosen = message
            continue
        seq, rev, _, flags = struct.unpack_from("<4I", payload, 8)
        width, height = struct.unpack_from("<2H", payload, 24)
        error, jpeg_error = struct.unpack_from("<2f", payload, 32)
        queue, render, encode, size = struct.unpack_from("<4I", payload, 40)
        viewer.say({"type": "ack", "seq": seq, "decodeMs": 1})
        yield {"rev": rev, "final": bool(flags & 1), "kind": flags & 6, "width": width,
               "height": height, "method": METHODS[payload[30]], "error": error,
               "jpegError": jpeg_error, "queue": queue / 1000, "render": render / 1000,
               "encode": encode / 1000, "bytes": size, "chosen": chosen}


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, math.ceil(share * len(ordered)) - 1)]


class Orbit:
    def __init__(self, viewer, dataset, size):
        self.viewer, self.shown, self.rev, self.turn = viewer, frames(viewer), 0, 0.0
        width, height = map(int, size.split("x"))
        viewer.say({"type": "open", "id": 1, "dataset": dataset})
        self.patch({"dataset": dataset, "image": {"width": width, "height": height}})
        view = self.rest()["chosen"]["view"]
        self.eye, self.target = view["camera"]["eye"], view["camera"]["target"]

    def patch(self, patch):
        self.rev += 1
        self.viewer.say({"type": "patch", "rev": self.rev, "t": 0, "patch": patch})

    def rest(self):
        for frame in self.shown:
            if frame["final"] and frame["rev"] == self.rev:
                return frame

    def move(self):
        self.turn += 0.02
        x, y = (self.eye[i] - self.target[i] for i in (0, 1))
        c, s = math.cos(self.turn), math.sin(self.turn)
        self.patch({"camera": {"eye": [self.target[0] + c * x - s * y,
                                       self.target[1] + s * x + c * y, self.eye[2]]}})

    def run(self, quality, count):
        """Frames of a steady drag with at most 60 moves a second; the first few are omitted."""
        self.patch({"quality": quality})
        kept, begun = [], time.monotonic()
        for n in range(count + 20):
            time.sleep(max(0.0, begun + n / 60 - time.monotonic()))
            self.move()
            frame = next(self.shown)
            while frame["rev"] < self.rev:
                frame = next(self.shown)
            if n >= 20:
                kept.append(frame)
        return kept


def wait_for_calibration(port, seconds):
    """Waits until the daemon has calibrated the view; prints a message on a timeout."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics") as answer:
            told = answer.read().decode()
        if re.search(r'^windsplat_background_jobs_total{result="done"} [1-9]', told, re.M):
            return
        time.sleep(0.2)
    print(f"not calibrated within {seconds} s", file=sys.stderr)


def used(kept):
    counts = collections.Counter(
        f"{f['method']} {f['width']}x{f['height']}" for f in kept).most_common(2)
    return ", ".join(f"{name} ({100 * n // len(kept)} %)" for name, n in counts)


def mean_error(kept):
    return math.exp(statistics.fmean(math.log(max(f["error"], 1e-9)) for f in kept))


def measure(options, dataset):
    daemon = subprocess.Popen(
        [options.program, "serve", dataset, "--listen", "127.0.0.1:0"],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    fine = True
    try:
        port = int(daemon.stdout.readline().strip().rstrip("/").rsplit(":", 1)[1])
        name = pathlib.Path(dataset).stem if "/" in dataset else dataset
        orbit = Orbit(Viewer(port), name, options.size)
        wait_for_calibration(port, options.rest)
        last = math.inf
        for budget in options.budgets:
            kept = orbit.run({"budgetMs": budget, "maxError": None}, options.frames)
            render = [f["render"] for f in kept]
            whole = [f["render"] + f["encode"] for f in kept]
            p95, error = percentile(render, 0.95), mean_error(kept)
            fine = fine and p95 <= 1.2 * budget and error <= 1.05 * last
            last = error
            print(f"| {dataset} | {budget} ms | {statistics.median(render):.1f} | {p95:.1f} | "
                  f"{p95 / budget:.2f} | {percentile(whole, 0.95):.1f} | {error:.2e} | "
                  f"{used(kept)} |", flush=True)
        for bound in options.max_errors:
            kept = orbit.run({"budgetMs": None, "maxError": bound}, options.frames)
            render = [f["render"] for f in kept]
            print(f"| {dataset} | error {bound} | {statistics.median(render):.1f} | "
                  f"{percentile(render, 0.95):.1f} | | | {mean_error(kept):.2e} | {used(kept)} |",
                  flush=True)
        return fine
    finally:
        daemon.terminate()
        daemon.wait()


def numbers(text):
    return [float(word) if "." in word else int(word) for word in text.split(",") if word]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default="build/release/windsplat")
    parser.add_argument("--dataset", action="append", dest="datasets")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--budgets", type=numbers, default=[16, 33, 66, 100])
    parser.add_argument("--max-errors", type=numbers, default=[0.05, 0.02, 0.005])
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--rest", type=float, default=60, help="seconds to wait for calibration")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    print("| data | aim | render ms, median | p95 | p95 / budget | with encoding, p95 | "
          "reported error | setting |")
    print("|---|---|---|---|---|---|---|---|")
    fine = [measure(options, dataset) for dataset in options.datasets or ["climate"]]
    if options.check and not all(fine):
        sys.exit(1)


if __name__ == "__main__":
    main()
