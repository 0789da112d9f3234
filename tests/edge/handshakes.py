#!/usr/bin/env python3
"""One address attempts TLS handshakes as fast as the daemon permits, while another address requests
/livez and receives frames of a stream.

    tests/edge/handshakes.py                  # 4 attacks, 4 s each
    tests/edge/handshakes.py --slack=8        # factor for time limits, on a shared machine

For each attack: requests on an open connection and on new ones must be answered within 50 ms
(the 99th percentile; three times that of the undisturbed run if that is more), the stream must
get at least half of its undisturbed frames, and handshakes may take no more processor time than
the limit of an address. If handshakes are computed, some must be refused once the address's
share is exhausted, and their time must be spent by their own thread, under any load. Exit code
0: all of this holds; 77: openssl is not installed."""
import argparse
import json
import multiprocessing
import os
import pathlib
import re
import sys
import tempfile
import threading
import time

import tls_peer
from wire_client import BINARY, Closed, Connection, Daemon, WebSocket, request

HEALTH_MS = 50
FRAME_EVERY_S = 0.05
THREADS = 8  # threads of the attacker
# Small enough to be exhausted on a slow machine; the burst is ten seconds' worth. Limits on new
# connections are disabled, as they would apply first.
ADDRESS_SHARE = 0.06
ADDRESS_AT_ONCE_S = 10 * ADDRESS_SHARE
LIMITS = [f"--max-handshakes-per-address={1000 * ADDRESS_SHARE:g}", "--max-arrivals=0",
          "--max-arrivals-per-address=0"]
REFUSED_WITHIN_S = 30  # in case the attacker gets little processor time
BYSTANDER_SHARE = 0.1
SKIPPED = 77
THREAD = "handshakes"
# spawn instead of fork: a lock of OpenSSL held by another thread at that moment would stay locked.
PROCESSES = multiprocessing.get_context("spawn")
VIEW = {"image": {"width": 96, "height": 64}}


def attack(port, hello, until, answered, refused, nice):
    """Runs in a separate process with low priority, so that it does not disturb the measurement."""
    os.nice(nice)
    context = tls_peer.trusting_context()
    lock = threading.Lock()

    def again_and_again():
        while time.monotonic() < until:
            try:
                done = tls_peer.replay(port, hello) if hello else tls_peer.shake(port, context)
            except OSError:
                done = False
            with lock:
                (answered if done else refused).value += 1

    threads = [threading.Thread(target=again_and_again) for _ in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def percentile(times, share):
    times = sorted(times)
    return times[min(len(times) - 1, int(share * len(times)))] if times else float("inf")


class Bystander:
    """The measurements of another address during `seconds`."""

    def __init__(self, target, seconds):
        self.target, self.until = target, time.monotonic() + seconds
        self.open_ms, self.fresh_ms, self.frames, self.faults = [], [], 0, []
        self.threads = [threading.Thread(target=self.guarded, args=(call,))
                        for call in (self.ask_open, self.ask_fresh, self.watch)]
        for thread in self.threads:
            thread.start()

    def join(self):
        for thread in self.threads:
            thread.join()

    def guarded(self, call):
        try:
            call()
        except (OSError, Closed, RuntimeError, ValueError) as fault:
            self.faults.append(f"{call.__name__}: {fault!r}")

    def ask_open(self):
        with Connection(self.target, timeout=60) as one:
            while (begin := time.monotonic()) < self.until:
                one.raw(f"GET /livez HTTP/1.1\r\nHost: {self.target.authority()}\r\n\r\n".encode())
                if one.answer().status != 200:
                    raise RuntimeError("not 200")
                self.open_ms.append(1000 * (time.monotonic() - begin))
                time.sleep(0.02)

    def ask_fresh(self):
        while (begin := time.monotonic()) < self.until:
            if request(self.target, "GET", "/livez").status != 200:
                raise RuntimeError("not 200")
            self.fresh_ms.append(1000 * (time.monotonic() - begin))
            time.sleep(0.05)

    def watch(self):
        with WebSocket(self.target, timeout=60) as viewer:
            rev = 0
            while (begin := time.monotonic()) < self.until:
                rev += 1
                angle = {"camera": {"eye": [0.4 + 0.01 * rev, -2.2, 1.4]}}
                first = {"dataset": self.dataset(viewer)} if rev == 1 else {}
                viewer.say({"type": "patch", "rev": rev, "t": rev,
                            "patch": {**VIEW, **angle, **first}})
                while not self.shows(viewer, rev):
                    pass
                self.frames += 1
                time.sleep(max(0, begin + FRAME_EVERY_S - time.monotonic()))

    def dataset(self, viewer):
        return viewer.text("hello")["datasets"][0]["id"]

    def shows(self, viewer, rev):
        """Reads a message; returns whether it was a frame of that revision."""
        opcode, payload = viewer.message()
        if opcode != BINARY:
            message = json.loads(payload)
            if message["type"] == "error":
                raise RuntimeError(message)
            return False
        seq = int.from_bytes(payload[8:12], "little")
        viewer.say({"type": "ack", "seq": seq, "decodeMs": 1})
        return int.from_bytes(payload[12:16], "little") == rev


class Counts:
    """The counters of the daemon, and the CPU times of its threads."""

    def __init__(self, daemon):
        text = request(daemon.target, "GET", "/metrics").body.decode()

        def metric(name):
            return float(re.search(rf"^{re.escape(name)} (\S+)$", text, re.MULTILINE)[1])

        self.cpu_s = metric("windsplat_tls_handshake_seconds_total")
        self.refused = metric('windsplat_refused_total{limit="handshakes"}')
        self.thread_s = sum(cpu_of(task) for task in
                            pathlib.Path(f"/proc/{daemon.child.pid}/task").iterdir()
                            if (task / "comm").read_text().strip() == THREAD)


def cpu_of(task):
    """User and system seconds."""
    fields = (task / "stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


class Phase:
    def __init__(self, name, daemon, seconds, hello=None, attacked=True, computed=False):
        self.name, self.computed = name, computed
        counts = [PROCESSES.Value("q", 0) for _ in range(2)]
        before, begin = Counts(daemon), time.monotonic()
        bystander = Bystander(daemon.target, seconds)

        def go_on(until, nice):
            attacker = PROCESSES.Process(
                target=attack, args=(daemon.target.port, hello, until, *counts, nice))
            attacker.start()
            attacker.join()

        if attacked:
            go_on(bystander.until, nice=19)
        bystander.join()
        while (computed and Counts(daemon).refused == before.refused and
               time.monotonic() < bystander.until + REFUSED_WITHIN_S):
            go_on(time.monotonic() + 1, nice=0)
        after = Counts(daemon)
        self.seconds = time.monotonic() - begin
        self.cpu_s, self.thread_s = after.cpu_s - before.cpu_s, after.thread_s - before.thread_s
        self.limited = after.refused - before.refused
        self.answered, self.refused = (count.value for count in counts)
        self.open_ms = percentile(bystander.open_ms, 0.99)
        self.fresh_ms = percentile(bystander.fresh_ms, 0.99)
        self.frames, self.faults = bystander.frames, bystander.faults

    def __str__(self):
        return (f"{self.name:<32}{self.answered:>9}{self.refused:>9}{self.open_ms:>10.1f}"
                f"{self.fresh_ms:>10.1f}{self.frames:>8}{self.cpu_s:>8.2f}")

    def wrong(self, quiet, slack):
        out = [f"{self.name}: {fault}" for fault in self.faults]
        for what in ("open_ms", "fresh_ms"):
            most = slack * max(HEALTH_MS, 3 * getattr(quiet, what))
            if getattr(self, what) > most:
                out.append(f"{self.name}: {what} is {getattr(self, what):.0f}, not {most:.0f}")
        if self.frames < quiet.frames / 2:
            out.append(f"{self.name}: {self.frames} frames, undisturbed {quiet.frames}")
        most_s = ADDRESS_AT_ONCE_S + (ADDRESS_SHARE + BYSTANDER_SHARE) * self.seconds
        # Handshakes in progress when the limit was reached: 64, each a few milliseconds.
        if self.cpu_s > most_s + 0.3:
            out.append(f"{self.name}: handshakes took {self.cpu_s} s, not {most_s:.1f} s")
        # Less if the attacker gets too little processor time to exhaust the address's share.
        if self.computed and self.limited == 0 and (
                self.cpu_s > ADDRESS_AT_ONCE_S + ADDRESS_SHARE * self.seconds):
            out.append(f"{self.name}: none was refused for the time that handshakes took")
        if self.computed and self.thread_s < self.cpu_s / 2:
            out.append(f"{self.name}: of {self.cpu_s:.2f} s of handshakes their thread took"
                       f" {self.thread_s:.2f} s")
        return out


def main():
    default = pathlib.Path(__file__).resolve().parents[2] / "build/release/windsplat"
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(default))
    parser.add_argument("--seconds", type=float, default=4)
    parser.add_argument("--slack", type=float, default=1)
    options = parser.parse_args()
    if not tls_peer.has_openssl():
        print("skipped: openssl, which creates certificates and ClientHellos, is not installed")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="windsplat-handshakes-") as folder:
        cert, key = tls_peer.make_certificate(pathlib.Path(folder))
        daemon = Daemon(options.program, "tornado:24x24x24", f"--tls-cert={cert}",
                        f"--tls-key={key}", *LIMITS,
                        target=lambda url: tls_peer.TargetFrom(
                            tls_peer.BYSTANDER, int(url.rstrip("/").rsplit(":", 1)[1]), cert))
        print(f"{'':<32}{'answered':>9}{'refused':>9}{'open ms':>10}{'fresh ms':>10}{'frames':>8}"
              f"{'CPU s':>8}")
        quiet = Phase("undisturbed", daemon, options.seconds, attacked=False)
        print(quiet, flush=True)
        faults = [f"undisturbed: {fault}" for fault in quiet.faults]
        for name, groups, computed in (("ClientHello, ffdhe8192", "ffdhe8192", False),
                                       ("ClientHello, P-384", "P-384", False),
                                       ("ClientHello, X25519", "X25519", True),
                                       ("whole handshakes", None, True)):
            hello = tls_peer.client_hello(groups) if groups else None
            phase = Phase(name, daemon, options.seconds, hello, computed=computed)
            print(phase, flush=True)
            faults += phase.wrong(quiet, options.slack)
        code = daemon.stop()
        if code != 0:
            faults.append(f"the daemon exited with {code}")
    for fault in faults:
        print("FAILED " + fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
