#!/usr/bin/env python3
"""Many sessions with the same data and rotating cameras: rate, latency and fairness of frames, and
their cost. Tables as Markdown on stdout. Linux only (/proc).

Usage: viewers.py [--program=windsplat] [--dataset=climate] [--viewers=16] [--seconds=20]
       [--size=640x480] [--video=0] [--mixed] [--deaf=20] [--ended=200]
       [--min-jain=0.95] [--max-spread=0] [--smoke]
       viewers.py --compare=VIEW.json [--rounds=5] [--seconds=20] [--size=1280x720] [--dataset=...]

A session sends the next camera with every frame it receives. --video: of the sessions, so many
announce H.264 and acknowledge frames as late as over a link of 2 Mbit/s. --mixed adds one session
at 1920x1080 and one that never reads. --deaf: sessions that request frames of 2560x1440 and never
read, for the memory of each. --ended: short sessions, for the memory that they leave allocated,
as many as fit into a minute. 0: none. Exit 1 if Jain's index of the frame rates,
(sum x)^2 / (n sum x^2), is below
--min-jain, the p99 of the latency is above --max-spread times its median (0: any), a session that
never reads takes more than two frames and 256 KiB, or a session gets no answer for 30 s.
--compare: in place of all that, one moving camera over the default view and over the view of a file
in turn: processor time and time of a whole picture by both methods (POST /v1/frames, JPEG), and the
frames of a session that rotates its camera, with their processor time and size; medians of the
rounds, and of their ratios.
--smoke: small and short; fails only if nothing works."""
import argparse
import json
import math
import os
import pathlib
import statistics
import struct
import sys
import threading
import time
import urllib.request

from stream_client import Daemon, Viewer

MB = 1e6
KIB = 1024
BIG, DEAF_VIEW = (1920, 1080), (2560, 1440)
ANSWER_S = 30  # until an answer is missing
ENDED_S = 60   # for the sessions that end
SLOW_BYTES_PER_S = 250e3  # with --video
H264 = 3       # codec of the frame header
DISTANCE = 2.4  # distance of the eye from the centre of the data


def camera(angle):
    return {"eye": [DISTANCE * math.sin(angle), -DISTANCE * math.cos(angle), 1.6]}


class Orbit(threading.Thread):
    """A client that rotates the camera until stopped."""

    def __init__(self, port, dataset, size, first_angle, video=False, view=None):
        super().__init__(daemon=True)
        self.view, self.pixels = view or {}, 0
        self.video, self.videos = video, 0
        self.viewer = Viewer(port)
        self.viewer.socket.settimeout(ANSWER_S)
        self.size, self.angle, self.dataset = size, first_angle, dataset
        self.sent, self.rev = {}, 0
        self.frames, self.latencies, self.bytes = 0, [], 0
        self.counting = self.over = False
        self.fault = None

    def patch(self):
        self.rev += 1
        self.angle += math.radians(2)
        view = {"camera": camera(self.angle)}
        if self.rev == 1:
            width, height = self.size
            view = dict(self.view, dataset=self.dataset, camera=view["camera"],
                        image={"width": width, "height": height})
        self.sent[self.rev] = time.monotonic()
        self.viewer.say({"type": "patch", "rev": self.rev, "t": self.rev, "patch": view})

    def run(self):
        try:
            if self.video:
                self.viewer.say({"type": "video", "codecs": ["avc1.640033"]})
            self.patch()
            while not self.over:
                self.take(*self.viewer.message())
        except (OSError, RuntimeError) as fault:
            self.fault = fault

    def take(self, opcode, payload):
        if opcode == 1:
            message = json.loads(payload)
            if message["type"] == "error":
                raise RuntimeError(message)
            if message["type"] == "unchanged" and message["rev"] == self.rev:
                self.patch()  # a picture that shows nothing is not sent again
            return
        if self.video:
            time.sleep(len(payload) / SLOW_BYTES_PER_S)
        now = time.monotonic()
        seq, rev = struct.unpack_from("<2I", payload, 8)
        self.viewer.say({"type": "ack", "seq": seq, "decodeMs": 1})
        if self.counting:
            self.frames += 1
            self.bytes += len(payload)
            self.videos += payload[28] == H264
            self.pixels += math.prod(struct.unpack_from("<2H", payload, 24))
            self.latencies.append(1000 * (now - self.sent[rev]))
        for old in [known for known in self.sent if known < rev]:
            del self.sent[old]
        self.patch()


def percentile(values, share):
    """The smallest value that at least this share of the values does not exceed."""
    ordered = sorted(values)
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)] if ordered else math.nan


def jain(rates):
    squares = sum(rate * rate for rate in rates)
    return sum(rates) ** 2 / (len(rates) * squares) if squares else 0.0


class Deaf:
    """Requests pictures one after the other without reading them; its receive buffer is small."""

    def __init__(self, port, dataset, size):
        self.viewer = Viewer(port, receive_buffer=4 * KIB)
        self.rev, self.dataset, self.size = 0, dataset, size

    def ask(self):
        self.rev += 1
        width, height = self.size
        self.viewer.say({"type": "patch", "rev": self.rev, "t": self.rev, "patch": {
            "dataset": self.dataset, "image": {"width": width, "height": height},
            "camera": camera(0.1 * self.rev)}})


def run(orbits, seconds, besides=None):
    """Waits for the start-up, then measures for this time; returns the elapsed seconds."""
    for orbit in orbits:
        orbit.start()
    time.sleep(min(5.0, seconds / 4))
    begun = time.monotonic()
    for orbit in orbits:
        orbit.counting = True
    while time.monotonic() - begun < seconds:
        time.sleep(0.1)
        if besides:
            besides()
    for orbit in orbits:
        orbit.counting = False
    took = time.monotonic() - begun
    for orbit in orbits:
        orbit.over = True
    for orbit in orbits:
        orbit.join(ANSWER_S + 10)
        if orbit.is_alive() or orbit.fault:
            sys.exit(f"viewers.py: a session failed: {orbit.fault or 'it does not end'}")
        orbit.viewer.socket.close()
    return took


def row(name, orbit, took):
    return (f"| {name} | {orbit.size[0]}x{orbit.size[1]} | {orbit.frames / took:.2f} "
            f"| {statistics.median(orbit.latencies or [math.nan]):.0f} "
            f"| {percentile(orbit.latencies, 0.99):.0f} "
            f"| {orbit.bytes / max(1, orbit.frames) / KIB:.0f} |")


def measure(daemon, options, size, count, mixed):
    """Prints the table of one run; returns whether its limits are kept."""
    orbits = [Orbit(daemon.port, options.dataset_id, size, 2 * math.pi * i / count,
                    i < options.video and count > 1) for i in range(count)]
    big = [Orbit(daemon.port, options.dataset_id, BIG, 0)] if mixed else []
    deaf = Deaf(daemon.port, options.dataset_id, BIG) if mixed else None
    took = run(orbits + big, options.seconds, deaf.ask if deaf else None)
    held = daemon.memory()["VmRSS"]
    print("| viewer | view | frames/s | latency, ms: median | p99 | KiB per frame |")
    print("|---|---|---|---|---|---|")
    for i, orbit in enumerate(orbits):
        print(row(i + 1, orbit, took))
    for orbit in big:
        print(row("large", orbit, took))
    rates = [orbit.frames / took for orbit in orbits]
    together = [latency for orbit in orbits for latency in orbit.latencies]
    index = jain(rates)
    print(f"\n{count} viewers{', a large one and one that never reads' if mixed else ''}: "
          f"{sum(rates):.1f} frames/s together, Jain's index {index:.4f}, latency "
          f"{statistics.median(together or [math.nan]):.0f} ms median and "
          f"{percentile(together, 0.99):.0f} ms p99, RSS {held / MB:.1f} MB\n", flush=True)
    slow = [orbit for orbit in orbits if orbit.video]
    if slow:
        fast = [orbit for orbit in orbits if not orbit.video]
        print(f"{len(slow)} of them on slow links: "
              f"{sum(o.frames for o in slow) / took:.1f} frames/s together "
              f"({sum(o.videos for o in slow) / took:.1f} of H.264), the others "
              f"{sum(o.frames for o in fast) / took:.1f}\n", flush=True)
    spread = percentile(together, 0.99) / statistics.median(together or [math.nan])
    return index >= options.min_jain and not spread > (options.max_spread or math.inf)


def settled(daemon):
    """Resident bytes once they are constant."""
    last = 0
    for _ in range(50):
        now = daemon.memory()["VmRSS"]
        if abs(now - last) < 64 * KIB:
            return now
        last = now
        time.sleep(0.3)
    return last


def kernel_bytes():
    """Bytes in the sockets of this network namespace, including the peers' receive buffers."""
    for line in pathlib.Path("/proc/net/sockstat").read_text().splitlines():
        words = line.split()
        if words[0] == "TCP:":
            return os.sysconf("SC_PAGE_SIZE") * int(words[words.index("mem") + 1])
    return 0


def metric(daemon, name):
    """The sum of a family's series."""
    with urllib.request.urlopen(f"http://127.0.0.1:{daemon.port}/metrics", timeout=60) as answer:
        lines = answer.read().decode().splitlines()
    return sum(float(line.rsplit(" ", 1)[1]) for line in lines
               if line.split(" ")[0].split("{")[0] == name)


def ask_all(daemon, deaf):
    """Lets the clients request pictures until the daemon renders no more of them."""
    for _ in range(3):
        for one in deaf:
            one.ask()
        drawn, since = -1, time.monotonic()
        while time.monotonic() - since < 2:
            now = metric(daemon, "windsplat_stage_seconds_count")
            if now != drawn:
                drawn, since = now, time.monotonic()
            time.sleep(0.1)


def measure_deaf(daemon, options, size):
    """The resident bytes of a session that never reads, compared with two frames and 256 KiB."""
    reader = Viewer(daemon.port)
    view = {"dataset": options.dataset_id, "image": {"width": size[0], "height": size[1]},
            "camera": camera(0.1)}
    reader.say({"type": "patch", "rev": 1, "t": 1, "patch": view})
    frame = reader.final_frame(1)
    reader.socket.close()
    first = [Deaf(daemon.port, options.dataset_id, size) for _ in range(3)]
    ask_all(daemon, first)  # one-time allocations of the renderer are complete after these
    held_before = metric(daemon, "windsplat_unsent_bytes")
    before, kernel_before = settled(daemon), kernel_bytes()
    deaf = [Deaf(daemon.port, options.dataset_id, size) for _ in range(options.deaf)]
    ask_all(daemon, deaf)
    held = (metric(daemon, "windsplat_unsent_bytes") - held_before) / options.deaf
    each = (settled(daemon) - before) / options.deaf
    kernel = (kernel_bytes() - kernel_before) / options.deaf
    limit = 2 * frame + 256 * KIB
    print(f"A session that never reads, {size[0]}x{size[1]}: {each / KIB:.0f} KiB of the daemon's "
          f"({held / KIB:.0f} KiB of them messages) and {kernel / KIB:.0f} KiB of the kernel's "
          f"(mean of {options.deaf}); a final frame has {frame / KIB:.0f} KiB, two of them and "
          f"256 KiB are {limit / KIB:.0f} KiB")
    for one in first + deaf:
        one.viewer.socket.close()
    return each + max(0, kernel) <= limit


def measure_ended(daemon, options, size):
    """Memory that remains allocated after sessions have ended, in bytes each."""
    view = {"dataset": options.dataset_id, "image": {"width": size[0], "height": size[1]}}

    def visit(most, seconds):
        count, end = 0, time.monotonic() + seconds
        while count < most and (count == 0 or time.monotonic() < end):
            viewer = Viewer(daemon.port)
            viewer.turn(view, 2)
            viewer.socket.close()
            count += 1
        return count, settled(daemon)

    others, first = visit(max(1, options.ended // 4), ENDED_S / 4)
    count, last = visit(options.ended, ENDED_S)
    print(f"An ended session leaves {(last - first) / count / KIB:.1f} KiB allocated (mean of "
          f"{count}, after {others} others)")


def cpu_seconds(daemon):
    """Processor time that the daemon has used, to a tick of the system (mostly 10 ms)."""
    stat = pathlib.Path(f"/proc/{daemon.child.pid}/stat").read_text()
    return sum(map(int, stat.rpartition(")")[2].split()[11:13])) / os.sysconf("SC_CLK_TCK")


def whole_pictures(daemon, view, seconds):
    """Processor ms and ms of a picture while the camera turns."""
    def draw(number):
        body = json.dumps(dict(view, camera=camera(math.radians(2 * number)))).encode()
        request = urllib.request.Request(
            f"http://127.0.0.1:{daemon.port}/v1/frames", body,
            {"Content-Type": "application/json", "Accept": "image/jpeg"})
        with urllib.request.urlopen(request, timeout=ANSWER_S) as answer:
            answer.read()

    draw(0)  # loads, traces and meshes what the view needs
    begun, cpu, count = time.monotonic(), cpu_seconds(daemon), 0
    while count == 0 or time.monotonic() - begun < seconds:
        count += 1
        draw(count)
    return (1000 * (cpu_seconds(daemon) - cpu) / count,
            1000 * (time.monotonic() - begun) / count)


def compare(daemon, options, size):
    """Prints the table of --compare."""
    shown = json.loads(pathlib.Path(options.compare).read_text())
    image = {"width": size[0], "height": size[1]}
    names = ("slab: processor ms", "ms", "kernel: processor ms", "ms", "session: frames/s",
             "processor ms a frame", "share of the pixels", "latency, ms")
    rounds = {"default": [], "view": []}
    for _ in range(options.rounds):
        for name, view in (("default", {}), ("view", shown)):
            view = dict(view, dataset=options.dataset_id, image=image)
            whole = [value for method in ("slab", "kernel") for value in
                     whole_pictures(daemon, dict(view, method={"name": method}),
                                    options.seconds / 4)]
            orbit = Orbit(daemon.port, options.dataset_id, size, 0, view=view)
            cpu = cpu_seconds(daemon)
            took = run([orbit], options.seconds)
            cpu = 1000 * (cpu_seconds(daemon) - cpu)
            frames = max(1, orbit.frames)
            rounds[name].append((*whole, frames / took, cpu / max(1, orbit.rev),
                                 orbit.pixels / frames / math.prod(size),
                                 statistics.median(orbit.latencies or [math.nan])))
    medians = {name: [statistics.median(values) for values in zip(*taken)]
               for name, taken in rounds.items()}
    ratios = [statistics.median(b / a for a, b in zip(plain, other)) for plain, other in
              zip(zip(*rounds["default"]), zip(*rounds["view"]))]
    print("| of one moving camera | " + " | ".join(names) + " |")
    print("|---" * (len(names) + 1) + "|")
    for name, values in {**medians, "view / default": ratios}.items():
        print(f"| {name} | " + " | ".join(f"{value:.2f}" for value in values) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    default = pathlib.Path(__file__).resolve().parents[2] / "build/release/windsplat"
    parser.add_argument("--program", default=str(default))
    parser.add_argument("--dataset", default="climate")
    parser.add_argument("--viewers", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--video", type=int, default=0)
    parser.add_argument("--mixed", action="store_true")
    parser.add_argument("--deaf", type=int, default=20)
    parser.add_argument("--ended", type=int, default=200)
    parser.add_argument("--min-jain", type=float, default=0.95)
    parser.add_argument("--max-spread", type=float, default=0)
    parser.add_argument("--compare")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--smoke", action="store_true")
    options = parser.parse_args()
    deaf_view = DEAF_VIEW
    if options.smoke:
        options.dataset, options.size, options.viewers = "climate:32x16x8", "64x48", 3
        options.seconds, options.min_jain, options.deaf, options.mixed = 0.5, 0, 2, True
        options.ended = 4
        deaf_view = (64, 48)
    size = tuple(map(int, options.size.split("x")))
    daemon = Daemon(options.program, options.dataset, "--max-sessions-per-address",
                    str(options.viewers + 8))
    fine = True
    try:
        print(f"{os.cpu_count()} processors, {options.dataset}; started: RSS "
              f"{daemon.memory()['VmRSS'] / MB:.1f} MB\n")
        hello = json.loads(Viewer(daemon.port).message()[1])
        options.dataset_id = hello["datasets"][0]["id"]
        if options.compare:
            compare(daemon, options, size)
            return 0
        first = Viewer(daemon.port)
        first.turn({"dataset": options.dataset_id,
                    "image": {"width": size[0], "height": size[1]}}, 1)
        first.socket.close()
        print(f"After one final frame: RSS {daemon.memory()['VmRSS'] / MB:.1f} MB\n")
        for count in (1, options.viewers):
            fine = measure(daemon, options, size, count, False) and fine
        if options.mixed:
            fine = measure(daemon, options, size, options.viewers, True) and fine
    finally:
        daemon.stop()
    if options.deaf or options.ended:
        # a fresh process, whose memory is not fragmented
        daemon = Daemon(options.program, options.dataset)
        try:
            if options.ended:
                measure_ended(daemon, options, size)
            if options.deaf:
                fine = (measure_deaf(daemon, options, deaf_view) or options.smoke) and fine
        finally:
            daemon.stop()
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
