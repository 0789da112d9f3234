#!/usr/bin/env python3
"""Playback of a long series by a real daemon: steps shown a second, how old they were, and what
memory the daemon and its loaders took meanwhile. Table as Markdown on stdout. Linux only (/proc).

Usage: playback.py [--program=windsplat] [--file=F.nc] [--steps=240] [--dims=320x160x19]
       [--memory-limit=4G ...] [--size=640x480] [--fps=24] [--loops=2] [--storage=float32]
       [--min-fps=N] [--check-memory]

Without --file it makes one with `synth climate`. Each --memory-limit is a row with the rate of
every loop: in the first the steps are read, later what fits is resident. Exit 1 where the last loop
shows fewer than --min-fps steps a second, or with --check-memory where memory exceeded the limit by
a tenth."""
import argparse
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import threading
import time

from stream_client import Viewer

UNITS = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30}


def bytes_of(text):
    return int(text[:-1]) * UNITS[text[-1]] if text[-1] in UNITS else int(text)


def status(pid, key):
    try:
        for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith(key + ":"):
                return 1024 * int(line.split()[1])
    except (FileNotFoundError, ProcessLookupError):
        pass
    return 0


def children(pid):
    try:
        tasks = pathlib.Path(f"/proc/{pid}/task").iterdir()
        return [int(child) for task in tasks
                for child in (task / "children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return []


class Watch(threading.Thread):
    """The most that a daemon and its loaders held at a time. Pages of a volume that both have
    mapped count twice while it is handed over, so this errs upwards."""

    def __init__(self, pid):
        super().__init__(daemon=True)
        self.pid, self.peak, self.over = pid, 0, False

    def run(self):
        while not self.over:
            held = sum(status(p, "VmRSS") for p in [self.pid, *children(self.pid)])
            self.peak = max(self.peak, held)
            time.sleep(0.01)


def frames(viewer):
    """Step and level (0: full resolution) of every frame, acknowledged at once."""
    while True:
        opcode, payload = viewer.message()
        if opcode == 1:
            message = json.loads(payload)
            if message["type"] == "error":
                raise RuntimeError(message)
            continue
        seq, _, step, _ = struct.unpack_from("<4I", payload, 8)
        viewer.say({"type": "ack", "seq": seq, "decodeMs": 1})
        yield step, payload[31]


def play(port, dataset, steps, options):
    """Of every loop the steps shown a second, none dropped, and the share at full resolution."""
    viewer = Viewer(port)
    width, height = map(int, options.size.split("x"))
    viewer.say({"type": "open", "id": 1, "dataset": dataset})
    viewer.say({"type": "patch", "rev": 1, "t": 0,
                "patch": {"dataset": dataset, "image": {"width": width, "height": height}}})
    shown = frames(viewer)
    next(shown)
    viewer.say({"type": "play", "from": 0, "to": steps - 1, "fps": options.fps, "loop": True,
                "drop": False})
    rates, last, count, full, begun = [], None, 0, 0, time.monotonic()
    for step, level in shown:
        if step == last:
            continue
        if last is not None and step != (last + 1) % steps:
            raise RuntimeError(f"step {step} came after {last}")
        last, count, full = step, count + 1, full + (level == 0)
        if count == steps:
            now = time.monotonic()
            rates.append((count / (now - begun), full / count))
            count, full, begun = 0, 0, now
            if len(rates) == options.loops:
                return rates


def measure(options, path, limit):
    daemon = subprocess.Popen(
        [options.program, "serve", path, "--listen", "127.0.0.1:0", "--memory-limit", limit,
         "--storage", options.storage],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        port = int(daemon.stdout.readline().strip().rstrip("/").rsplit(":", 1)[1])
        watch = Watch(daemon.pid)
        watch.start()
        rates = play(port, pathlib.Path(path).stem, options.steps, options)
        watch.over = True
        watch.join()
        return rates, watch.peak
    finally:
        daemon.terminate()
        daemon.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default="build/release/windsplat")
    parser.add_argument("--file")
    parser.add_argument("--steps", type=int, default=240)
    parser.add_argument("--dims", default="320x160x19")
    parser.add_argument("--memory-limit", action="append", dest="limits")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--fps", type=float, default=24)
    parser.add_argument("--loops", type=int, default=2)
    parser.add_argument("--storage", default="float32")
    parser.add_argument("--min-fps", type=float, default=0)
    parser.add_argument("--check-memory", action="store_true")
    options = parser.parse_args()
    fine = True
    with tempfile.TemporaryDirectory() as folder:
        path = options.file or os.path.join(folder, "series.nc")
        if not options.file:
            subprocess.run([options.program, "synth", "climate", "--steps", str(options.steps),
                            "--dims", options.dims, "-o", path], check=True)
        print(f"{options.steps} steps, {options.size}, {options.storage}\n")
        print("| memory limit | steps/s (at full resolution), loop by loop "
              "| peak of daemon and loaders | of the limit |")
        print("|---|---|---|---|")
        for limit in options.limits or ["4G", "1G"]:
            rates, peak = measure(options, path, limit)
            share = peak / bytes_of(limit)
            told = ", ".join(f"{rate:.1f} ({100 * full:.0f} %)" for rate, full in rates)
            print(f"| {limit} | {told} | {peak / 1e6:.0f} MB | {100 * share:.0f} % |",
                  flush=True)
            fine = fine and rates[-1][0] >= options.min_fps
            fine = fine and (not options.check_memory or share <= 1.1)
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
