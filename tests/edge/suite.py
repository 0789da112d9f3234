"""Runs groups of cases against one daemon. After every group it must be alive, hold at most 1 MiB
more memory, and serve a well-behaved client."""
import argparse
import collections
import json
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

from wire_client import Closed, Daemon, Target, WebSocket, request, status_bytes

# `section`: of the RFC or of the project's documents; `expected`: the required reaction;
# `run(target)` raises on any other reaction. Slow cases run concurrently.
Case = collections.namedtuple("Case", "id section what expected run slow", defaults=(False,))
KIB = 1024


class Wrong(AssertionError):
    """The reaction differs from the expected one."""


def require(truth, what):
    if not truth:
        raise Wrong(what)


def parser_of(description):
    default = pathlib.Path(__file__).resolve().parents[2] / "build/release/windsplat"
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--program", default=str(default), help="program whose daemon is started")
    parser.add_argument("--url", help="URL of a running daemon")
    parser.add_argument("--pid", type=int, help="process id of that daemon, to measure its memory")
    parser.add_argument("--ca", help="certificate that verifies the daemon's (https)")
    parser.add_argument("--token-file", help="file of the token that the daemon requires")
    parser.add_argument("--serve-option", action="append", default=[], metavar="OPTION",
                        help="option for the started daemon; repeatable")
    parser.add_argument("--edge", type=int, default=0, metavar="N",
                        help="serve a tornado of N^3 samples instead of the built-in one")
    parser.add_argument("--only", default="", help="prefix of the ids of cases to run")
    parser.add_argument("--growth-kib", type=int, default=KIB,
                        help="permitted growth of resident memory in a group; 0: not checked")
    parser.add_argument("--list", action="store_true", help="print the cases as a Markdown table")
    parser.add_argument("--verbose", action="store_true", help="print every case")
    return parser


class Watched:
    """A daemon under test: started here, or already running."""

    def __init__(self, options):
        self.growth_max = options.growth_kib * KIB
        self.child, self.log = None, None
        if options.url:
            self.target = Target.of_url(options.url, options.ca, options.token_file)
            self.pid = options.pid
            return
        self.log = tempfile.NamedTemporaryFile("w+", prefix="windsplat-edge-", suffix=".log")
        given = [f"--token-file={options.token_file}"] if options.token_file else []
        dataset = "tornado"
        if options.edge:  # a file of that name has the same id
            self.folder = tempfile.TemporaryDirectory(prefix="windsplat-edge-")
            dataset = f"{self.folder.name}/tornado.nc"
            subprocess.run([options.program, "synth", "tornado", "--dims",
                            "x".join(3 * [str(options.edge)]), "-o", dataset], check=True)
        self.daemon = Daemon(options.program, dataset, *given, *options.serve_option,
                             errors=self.log,
                             target=lambda url: Target.of_url(url, options.ca, options.token_file))
        self.child, self.target = self.daemon.child, self.daemon.target
        self.pid = self.child.pid

    def check_good_client(self):
        """A well-behaved client: a request, a picture and a session must succeed."""
        require(self.child is None or self.child.poll() is None, "the daemon died")
        require(request(self.target, "GET", "livez").status == 200, "/livez does not answer 200")
        view = {"dataset": "tornado", "image": {"width": 32, "height": 24}}
        picture = request(self.target, "POST", "v1/frames", {"Content-Type": "application/json"},
                          json.dumps(view).encode())
        require(picture.status == 200 and picture.body[:2] == b"\xff\xd8",
                f"no picture: {picture.status} {picture.body[:300]!r}")
        with WebSocket(self.target) as viewer:
            hello = viewer.text("hello")
            require(hello["datasets"], f"no datasets: {hello}")
            viewer.say({"type": "open", "id": 7, "dataset": "nowhere"})
            require(viewer.text("error")["id"] == 7, "a well-behaved session is not answered")

    def resident(self):
        return status_bytes(self.pid, "VmRSS") if self.pid else 0

    def forget_peak(self):
        if self.pid:
            pathlib.Path(f"/proc/{self.pid}/clear_refs").write_text("5")

    def peak(self):
        return status_bytes(self.pid, "VmHWM") if self.pid else 0

    def settled_growth(self, before):
        """Memory and descriptors that remain after the daemon has detected closed connections."""
        end = time.monotonic() + (3 if self.growth_max else 0)
        while self.resident() - before > self.growth_max and time.monotonic() < end:
            time.sleep(0.1)
        return self.resident() - before

    def stop(self):
        """Stops the daemon; returns its exit code."""
        code = self.daemon.stop() if self.child else 0
        if self.log and code != 0:
            self.log.seek(0)
            print("".join(self.log.readlines()[-60:]), file=sys.stderr)
        return code


class Run:
    def __init__(self, daemon, options):
        self.daemon, self.options = daemon, options
        self.lock = threading.Lock()
        self.failures = []
        self.passed = 0

    def one(self, case):
        try:
            case.run(self.daemon.target)
        except (Wrong, Closed, ValueError, KeyError, OSError, RuntimeError) as fault:
            with self.lock:
                self.failures.append(
                    f"{case.id} ({case.section}) {case.what}: expected {case.expected}; "
                    f"{type(fault).__name__}: {str(fault)[:600]}")
            verdict = "FAILED"
        else:
            with self.lock:
                self.passed += 1
            verdict = "passed"
        if self.options.verbose:
            print(f"  {verdict} {case.id} {case.what}")

    def group(self, name, cases):
        cases = [case for case in cases if case.id.startswith(self.options.only)]
        if not cases:
            return
        failed, passed = len(self.failures), self.passed
        begun, before = time.monotonic(), self.daemon.resident()
        self.daemon.forget_peak()
        slow = [threading.Thread(target=self.one, args=(case,)) for case in cases if case.slow]
        for thread in slow:
            thread.start()
        for case in cases:
            if not case.slow:
                self.one(case)
        for thread in slow:
            thread.join()
        seconds = time.monotonic() - begun
        growth, peak = self.daemon.settled_growth(before), self.daemon.peak() - before
        self.look_after(name, growth)
        print(f"{name:<44} {self.passed - passed:>4} passed {len(self.failures) - failed:>3} failed"
              f"{growth / KIB:>8.0f} KiB more, peak {peak / KIB:>6.0f}, {seconds:.1f} s",
              flush=True)

    def look_after(self, name, growth):
        if self.daemon.growth_max and growth > self.daemon.growth_max:
            self.failures.append(f"{name}: the daemon holds {growth / KIB:.0f} KiB more")
        try:
            self.daemon.check_good_client()
        except (Wrong, RuntimeError, OSError, ValueError, KeyError) as fault:
            self.failures.append(f"after {name}: {fault}")


def print_table(groups):
    for name, cases in groups:
        print(f"\n### {name}\n\n| id | where | case | expected |\n|---|---|---|---|")
        for case in cases:
            cells = [case.id, case.section, case.what, case.expected]
            print("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")


def main(groups, options):
    """Runs (name, cases) pairs; returns the exit code."""
    ids = collections.Counter(case.id for _, cases in groups for case in cases)
    repeated = [name for name, count in ids.items() if count > 1]
    if repeated:
        sys.exit(f"duplicate ids: {repeated}")
    if options.list:
        print_table(groups)
        return 0
    daemon = Watched(options)
    run = Run(daemon, options)
    for _ in range(3):  # one-time allocations do not count as growth
        daemon.check_good_client()
    for name, cases in groups:
        run.group(name, cases)
    code = daemon.stop()
    if code != 0:
        run.failures.append(f"the daemon exited with {code}")
    print(f"{run.passed} passed, {len(run.failures)} failures")
    for failure in run.failures:
        print("FAILED " + failure)
    return 1 if run.failures else 0
