#!/usr/bin/env python3
"""Measures playback of a long series by a real daemon: steps per second, their age, and the memory
of the daemon and its loaders. Prints a Markdown table. Linux only (/proc).

Usage: playback.py [--program=windsplat] [--file=F.nc] [--steps=240] [--dims=320x160x19]
       [--memory-limit=4G ...] [--size=640x480] [--fps=24] [--loops=2] [--storage=float32]
       [--min-fps=N] [--check-memory]
       playback.py --sessions=8 [--seconds=20] [--at-most=60] [--apart] [--steps=40]
       [--dims=256x256x64] ...

Without --file it creates one with `synth climate`. Each --memory-limit is a row with the rate of
every loop: the first loop reads the steps, later loops use those that are resident. Memory is the
proportional set size. Exit 1 if the last loop shows fewer than --min-fps steps a second, or with
--check-memory if memory exceeded the limit.

--sessions: number of concurrent sessions, which play for --seconds, prolonged up to --at-most
while one of them has no frame yet (the machine may be busy); with --apart they start at
different steps. Without --file the data are a scalar field in a netCDF classic file, 16 MiB a
step. Each row has the frames of all sessions and of the slowest session, the longest wait for a
new step, and the errors. Exit 1 if a session had no frame or an error, or with --check-memory as
above."""
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

from process_memory import PeakPss, bytes_of
from series import write_series
from stream_client import Viewer


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
    """For every loop the steps shown a second (none dropped), and the share at full resolution."""
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
            raise RuntimeError(f"step {step} followed {last}")
        last, count, full = step, count + 1, full + (level == 0)
        if count == steps:
            now = time.monotonic()
            rates.append((count / (now - begun), full / count))
            count, full, begun = 0, 0, now
            if len(rates) == options.loops:
                return rates


class Watcher(threading.Thread):
    """A session that plays from its own first step. An error ends playback, so it starts again."""

    def __init__(self, port, dataset, first, options, everyone):
        super().__init__(daemon=True)
        self.viewer = Viewer(port)
        self.dataset, self.first, self.options = dataset, first, options
        self.rev, self.frames, self.errors, self.longest, self.fault = 0, 0, [], 0.0, None
        self.everyone, self.begun = everyone, time.monotonic()

    def done(self):
        waited = time.monotonic() - self.begun
        served = all(watcher.frames > 0 for watcher in self.everyone)
        options = self.options
        return waited >= (options.seconds if served else max(options.seconds, options.at_most))

    def play(self):
        width, height = map(int, self.options.size.split("x"))
        self.rev += 1
        self.viewer.say({"type": "patch", "rev": self.rev, "t": 0, "patch": {
            "dataset": self.dataset, "step": self.first,
            "image": {"width": width, "height": height}}})
        self.viewer.say({"type": "play", "from": 0, "to": self.options.steps - 1,
                         "fps": self.options.fps, "loop": True, "drop": False})

    def run(self):
        try:
            self.watch()
        except (OSError, RuntimeError) as fault:
            self.fault = str(fault)

    def watch(self):
        self.play()
        newest, last = time.monotonic(), None
        while not self.done():
            opcode, payload = self.viewer.message()
            if opcode == 1:
                message = json.loads(payload)
                if message["type"] == "error":
                    self.errors.append(message["problem"].get("detail", str(message)))
                    time.sleep(0.1)
                    self.play()
                continue
            seq, _, step, _ = struct.unpack_from("<4I", payload, 8)
            self.viewer.say({"type": "ack", "seq": seq, "decodeMs": 1})
            if step != last:
                now = time.monotonic()
                self.longest, newest, last = max(self.longest, now - newest), now, step
                self.frames += 1
        self.longest = max(self.longest, time.monotonic() - newest)
        self.viewer.close()


def play_together(options, path, limit):
    """Runs the sessions; returns them and the peak memory of the daemon and its loaders."""
    daemon, port = start(options, path, limit)
    try:
        watch = PeakPss(daemon.pid)
        apart = options.steps // options.sessions if options.apart else 0
        watchers = []
        watchers += [Watcher(port, pathlib.Path(path).stem, i * apart, options, watchers)
                     for i in range(options.sessions)]
        for watcher in watchers:
            watcher.start()
        for watcher in watchers:
            watcher.join()
        return watchers, watch.stop(), watch.parts
    finally:
        daemon.terminate()
        daemon.wait()


def report_together(options, path):
    """Prints a row for each limit; returns whether all checks passed."""
    print(f"{options.sessions} sessions, {options.steps} steps, {options.size}, {options.storage}, "
          f"{options.seconds:g} s\n")
    print("| memory limit | frames (fewest of a session) | longest wait | errors "
          "| peak of daemon + loaders | of the limit |\n|---|---|---|---|---|---|")
    fine = True
    for limit in options.limits or ["1G", "200M"]:
        watchers, peak, parts = play_together(options, path, limit)
        counts = [watcher.frames for watcher in watchers]
        errors = [error for watcher in watchers for error in watcher.errors]
        errors += [watcher.fault for watcher in watchers if watcher.fault]
        share = peak / bytes_of(limit)
        each = " + ".join(f"{part / (1 << 20):.0f}" for part in parts)
        print(f"| {limit} | {sum(counts)} ({min(counts)}) "
              f"| {max(watcher.longest for watcher in watchers):.1f} s | {len(errors)} "
              f"| {peak / (1 << 20):.1f} MiB ({each}) | {100 * share:.0f} % |", flush=True)
        for error in sorted(set(errors)):
            print(f"{errors.count(error)} x {error}", file=sys.stderr)
        fine = fine and min(counts) > 0 and not errors
        fine = fine and (not options.check_memory or share <= 1)
    return fine


def start(options, path, limit):
    daemon = subprocess.Popen(
        [options.program, "serve", path, "--listen", "127.0.0.1:0", "--memory-limit", limit,
         "--storage", options.storage],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    url = daemon.stdout.readline().strip()
    if not url:
        sys.exit(f"playback.py: the daemon did not start with --memory-limit {limit}")
    return daemon, int(url.rstrip("/").rsplit(":", 1)[1])


def measure(options, path, limit):
    daemon, port = start(options, path, limit)
    try:
        watch = PeakPss(daemon.pid)
        rates = play(port, pathlib.Path(path).stem, options.steps, options)
        return rates, watch.stop()
    finally:
        daemon.terminate()
        daemon.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default="build/release/windsplat")
    parser.add_argument("--file")
    parser.add_argument("--steps", type=int)
    parser.add_argument("--dims")
    parser.add_argument("--memory-limit", action="append", dest="limits")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--fps", type=float, default=24)
    parser.add_argument("--loops", type=int, default=2)
    parser.add_argument("--storage", default="float32")
    parser.add_argument("--min-fps", type=float, default=0)
    parser.add_argument("--check-memory", action="store_true")
    parser.add_argument("--sessions", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--at-most", type=float, default=60)
    parser.add_argument("--apart", action="store_true")
    options = parser.parse_args()
    options.steps = options.steps or (40 if options.sessions else 240)
    options.dims = options.dims or ("256x256x64" if options.sessions else "320x160x19")
    fine = True
    with tempfile.TemporaryDirectory() as folder:
        path = options.file or os.path.join(folder, "series.nc")
        if options.sessions:
            if not options.file:
                write_series(path, tuple(map(int, options.dims.split("x"))), options.steps)
            return 0 if report_together(options, path) else 1
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
            fine = fine and (not options.check_memory or share <= 1)
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
