#!/usr/bin/env python3
"""SIGTERM, SIGKILL and SIGHUP to a daemon under load, repeatedly. A Markdown table on stdout.
Linux only.

Usage: signals.py [--program=build/release/windsplat] [--rounds=50] [--signal=TERM]... [--quick]
       [--slack=1]

TERM: /readyz fails first, streams are closed with 1001, the daemon exits with 0 within 10 s.
KILL: the next daemon on the same state folder has every acknowledged view and no partial one; a
client that reconnects and sends its view gets the same picture. HUP: an invalid configuration is
logged and the old one remains in effect. Exit code 0: all of this holds."""
import argparse
import http.client
import json
import pathlib
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from support import (PATIENCE_S, ROOT, SAMPLE, Closed, Daemon, Failed, Stream,  # noqa: E402
                     Untried, ask, check_good, check_good_stream, need, small_view, wait_for)

DRAIN_S = 10
SEEN_S = 1  # from the signal until /readyz fails
LOST = (OSError, http.client.HTTPException, Closed, Failed)
# The clients of a load open a connection for each request, where the machine is idle more than the
# 500 a second that an address may. Beyond its limit the daemon closes connections unanswered,
# those of the assertions too.
UNLIMITED = ("--max-arrivals=0", "--max-arrivals-per-address=0")


class Load(threading.Thread):
    """A client that requests pictures, rotates a view of a stream or saves views until stopped."""

    def __init__(self, port, number):
        super().__init__(daemon=True)
        self.port, self.number, self.over = port, number, False
        self.code = None  # close code of its stream
        self.done = 0
        self.saved = {}  # id -> the last acknowledged step, or the two possible ones

    def run(self):
        work = (self.stream, self.pictures, self.views)[self.number % 3]
        while not self.over:
            try:
                work()
            except Closed as end:
                self.code = end.code
                return
            except LOST:
                if not self.over:
                    time.sleep(0.02)

    def pictures(self):
        ask(self.port, "GET", f"/v1/datasets/{SAMPLE}/frame.jpg?width=320&height=240"
            f"&azimuth={self.done * 1.7 + self.number:.2f}", timeout=20)
        self.done += 1

    def stream(self):
        with Stream(self.port, timeout=20) as one:
            need(one.status == 101, "no stream")
            while not self.over:
                one.patch(small_view(turn=0.01 * self.done, size=(480, 320)))
                one.answer_to_patch()
                self.done += 1

    def views(self):
        """Saves a view, changes it, and records the acknowledged states."""
        got = ask(self.port, "POST", "/v1/views", {"dataset": SAMPLE, "step": 0}, timeout=20)
        if got.status != 201:
            return
        name = json.loads(got.body)["id"]
        self.saved[name] = {0}
        for step in range(1, 4):
            self.saved[name] = self.saved[name] | {step}  # either, until the answer arrives
            got = ask(self.port, "PATCH", f"/v1/views/{name}", {"step": step},
                      {"Content-Type": "application/merge-patch+json"}, timeout=20)
            if got.status == 200:
                self.saved[name] = {step}
        self.done += 1


def loaded(port, count=6):
    out = [Load(port, n) for n in range(count)]
    for one in out:
        one.start()
    return out


def stop_all(loads):
    for one in loads:
        one.over = True
    for one in loads:
        one.join(PATIENCE_S)
        need(not one.is_alive(), "a request neither ended nor failed")


def not_ready(connection, port):
    """The status of /readyz on an existing connection, or on a new one if that is closed;
    "closed" if no connection is possible."""
    try:
        connection.request("GET", "/readyz")
        answer = connection.getresponse()
        answer.read()
        return None if answer.status == 200 else answer.status
    except LOST:
        connection.close()
    try:
        got = ask(port, "GET", "/readyz", timeout=5)
        return None if got.status == 200 else got.status
    except LOST:
        return "closed"


def terminate(program, folder, rounds, slack=1):
    """SIGTERM under load."""
    slowest, codes, ready = 0.0, {}, {}
    for _ in range(rounds):
        daemon = Daemon(program, *UNLIMITED, "--state-dir", str(folder / "state"), SAMPLE)
        loads = loaded(daemon.port)
        held = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=20)
        held.connect()  # opened before the drain, used during it
        time.sleep(random.uniform(0.2, 0.8))
        since = time.monotonic()
        daemon.child.send_signal(signal.SIGTERM)
        status = wait_for(lambda at=daemon.port, one=held: not_ready(one, at), SEEN_S * slack,
                          "/readyz still returns 200")
        held.close()
        # No further signal is sent: a second one would terminate the daemon at once.
        code = daemon.stop(0, patience=3 * DRAIN_S * slack)
        took = time.monotonic() - since
        stop_all(loads)
        need(code == 0, f"ended with {code}: {' / '.join(daemon.lines[-3:])}")
        need(took < DRAIN_S * slack, f"a drain of {took:.1f} s")
        need(status in (503, "closed"), f"/readyz says {status} in a drain")
        ready[status] = ready.get(status, 0) + 1
        slowest = max(slowest, took)
        for one in loads:
            if one.number % 3 == 0:
                codes[one.code] = codes.get(one.code, 0) + 1
    need(set(codes) <= {1001, 0, None} and codes.get(1001, 0) > 0, f"streams ended by {codes}")
    parts = list((folder / "state").rglob("*.part"))
    need(not parts, f"left behind: {parts[:3]}")
    return (f"exit code 0, longest drain {slowest:.2f} s; streams ended by "
            f"{times_each(codes, 'a close')}; /readyz {times_each(ready, '')}")


def times_each(counts, nothing):
    return ", ".join(f"{what or nothing} {n} times" for what, n in counts.items())


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def saved_views(port, loads, tell):
    """Every acknowledged view exists, in its acknowledged state or that of the last request."""
    kept = 0
    for name, steps in ((n, s) for one in loads for n, s in one.saved.items()):
        got = ask(port, "GET", f"/v1/views/{name}")
        need(got.status == 200, f"{tell}: a saved view is lost: {got.status}")
        step = json.loads(got.body)["view"].get("step", 0)
        need(step in steps, f"{tell}: a saved view has step {step}, acknowledged was {steps}")
        kept += 1
    return kept


def kill(program, folder, rounds, _slack=1):
    """SIGKILL under load, then the next one on the same port and state."""
    state, kept, parts = folder / "state", 0, 0
    view = small_view(size=(96, 64))
    view["quality"] = {"budgetMs": None, "maxError": None}
    picture = None
    listen = f"127.0.0.1:{free_port()}"

    def start():
        return Daemon(program, *UNLIMITED, "--state-dir", str(state), SAMPLE, listen=listen)

    everything = []
    for n in range(rounds):
        daemon = start()
        if n % 10 == 0:  # checks all views saved so far
            kept += saved_views(daemon.port, everything, f"round {n}")
        with Stream(daemon.port) as viewer:
            got = viewer.final_frame(view)[64:]
        need(picture in (None, got), "a reconnecting client gets another picture")
        picture = got
        for line in daemon.lines:
            need("ignoring an unreadable" not in line,
                 f"a file in the state folder cannot be read: {line}")
        loads = loaded(daemon.port)
        time.sleep(random.uniform(0.05, 0.6))
        daemon.stop(signal.SIGKILL)
        stop_all(loads)
        parts += len(list(state.rglob("*.part")))
        after = start()
        kept += saved_views(after.port, loads, f"round {n}")
        after.stop(signal.SIGKILL)
        everything += loads
    last = start()
    kept += saved_views(last.port, everything, "in the end")
    check_good_stream(last.port)
    code = last.stop()
    need(code == 0, f"ended with {code}")
    left = [p.name for p in state.rglob("*") if p.is_file() and not p.name.endswith(".json")]
    need(kept > 0, "no view was saved")
    need(not left, f"left behind: {left[:3]}")
    return (f"{kept} checks of saved views, none lost or incomplete; the client's picture is the "
            f"same each time; {parts} incomplete files removed")


SPOILED = ["", "{", '{"nothing": 1}', '{"listen": 7}', "\0\1\2", '{"max-sessions": -5}', "[]",
           '{"\\u001b[31m\\n": 1}', "x" * 100000, '{"log-level": "loud"}',
           # The valid half must not be applied either.
           '{"allow-origin": ["https://second.example"], "log-level": "loud"}']
ORIGINS = ["https://first.example", "https://second.example"]


def hang_up(program, folder, rounds, _slack=1):
    """SIGHUP under load with a valid, an invalid and a missing configuration."""
    text = subprocess.run([program, "serve", "--help"], capture_output=True, text=True,
                          check=True).stdout
    if "--config" not in text:
        raise Untried("this windsplat has no --config: SIGHUP was not tried")
    config = folder / "config"
    allowed, other = ORIGINS
    config.write_text(json.dumps({"allow-origin": [allowed]}))
    daemon = Daemon(program, *UNLIMITED, "--config", str(config), SAMPLE)
    taken = 0
    try:
        loads = loaded(daemon.port, 3)
        for n in range(rounds):
            how = n % (len(SPOILED) + 2)
            if how < len(SPOILED):
                config.write_text(SPOILED[how])
            elif how == len(SPOILED):
                config.unlink(missing_ok=True)
            else:
                allowed, other = other, allowed
                config.write_text(json.dumps({"allow-origin": [allowed]}))
                taken += 1
            said = len(daemon.lines)
            daemon.child.send_signal(signal.SIGHUP)
            if how <= len(SPOILED):
                wait_for(lambda at=said: [line for line in daemon.lines[at:]
                                          if " warn " in line or " error " in line],
                         PATIENCE_S, f"no log message about an invalid configuration ({how})")
            else:
                wait_for(lambda at=said: [line for line in daemon.lines[at:]
                                          if "configuration reloaded" in line],
                         PATIENCE_S, "no log message about a valid configuration")
            for origin, status in ((allowed, 101), (other, 403)):
                with Stream(daemon.port, [("Origin", origin)]) as one:
                    need(one.status == status, f"after config {how} {origin} is answered by "
                         f"{one.status}, not {status}")
            check_good(daemon.port)
        stop_all(loads)
        need(daemon.alive(), "the daemon exited")
        need(all(line.isprintable() for line in daemon.lines), "control characters in the log")
        code = daemon.stop()
        need(code == 0, f"ended with {code}")
    finally:
        if daemon.alive():
            daemon.stop(signal.SIGKILL)
    return (f"{taken} times the new origin is accepted and the old one refused; the old config "
            "remains in effect after each invalid one, which is logged; streams continue")


LOOPS = {"TERM": terminate, "KILL": kill, "HUP": hang_up}
QUICK_ROUNDS = {"TERM": 3, "KILL": 3, "HUP": len(SPOILED) + 2}  # HUP: each config once


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default=str(ROOT / "build/release/windsplat"))
    parser.add_argument("--rounds", type=int, default=50)
    parser.add_argument("--signal", action="append", choices=list(LOOPS))
    parser.add_argument("--slack", type=float, default=1, help="factor for time limits")
    parser.add_argument("--quick", action="store_true", help="few rounds of each")
    options = parser.parse_args()
    failed = 0
    print("| signal | rounds | result | |\n|---|---|---|---|", flush=True)
    for name in options.signal or list(LOOPS):
        rounds = QUICK_ROUNDS[name] if options.quick else options.rounds
        with tempfile.TemporaryDirectory(prefix="windsplat-signals-") as folder:
            try:
                outcome = LOOPS[name](options.program, pathlib.Path(folder), rounds, options.slack)
                verdict = "ok"
            except Untried as why:
                outcome, verdict, rounds = str(why), "NOT TRIED", "-"
            except LOST as fault:
                outcome, verdict = f"{type(fault).__name__}: {fault}", "FAILED"
        failed += verdict == "FAILED"
        print(f"| SIG{name} | {rounds} | {outcome} | {verdict} |", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
