#!/usr/bin/env python3
"""Makes library calls fail inside a running daemon: memory, sockets, files, threads. Each call
fails once at every call site that a scripted session reaches; then many consecutive calls fail.
Prints a Markdown table. Linux only; not for sanitizer builds, which have their own allocator.

Usage: inject.py [--program=build/release/windsplat] [--shim=build/release/tests/libfaults_shim.so]
       [--kind=malloc]... [--phase=serve|guarded|start|drain]... [--count=N] [--quick]
       [--seconds=S] [--slack=1]

The session: the page, a picture, values, a histogram, a file loaded by a job, a saved view
created, changed and deleted, a stream with frames, a still and an invalid patch, the metrics.
While it runs one call fails; the affected request may be answered with an error or be cut off, but
must not hang. Afterwards a stream opened before must continue, unless the log says that its own
connection failed, and a new request must succeed. --count and --seconds end a sweep early; the
table gives the number of call sites. Phase guarded: the same on [::1] over TLS, with a token,
limits of one address, logins and SIGHUPs. Phase start: the daemon starts, or exits with a
message and an exit code. Phase drain: it exits with 0 within 10 s. If no call of a kind failed in
a phase, that is a failure, because nothing was tested. Exit code 0: the daemon never crashed,
hung, or refused valid requests afterwards."""
import argparse
import http.client
import json
import os
import pathlib
import secrets
import shutil
import signal
import ssl
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from shim import KINDS, Shim  # noqa: E402
from support import (PATIENCE_S, ROOT, SAMPLE, Closed, Door, Failed, Stream,  # noqa: E402
                     Untried, ask, check_good, check_good_stream, need, picture, small_view,
                     wait_for)

STEP_S = 20  # a step that takes longer counts as hanging
# A job may take longer: it may wait for jobs of sessions that were cut off, and each may take
# loader::Limits::open_time, 60 s.
JOB_S = 200
DRAIN_S = 10
# streams that may end because the failed call was made for them
BYSTANDERS_MAX, BYSTANDERS_SHARE = 2, 0.2
QUIET_ROUNDS = 2  # number of sessions without a new call site that end a sweep
# This library reads its folder at startup and terminates the program if it has no memory.
LIBRARY = "libeccodes"
BURST = 40  # consecutive failing calls
LOG_S = 10  # time limit for a line of the log to appear
# Log messages about the end of a stream, and those that replace them without memory.
ENDS = ("connection failed", "session disconnected", "closing session")
LOST_LINES = ("log line lost", "no memory to log details")
SERVED = [kind for kind in KINDS if kind != "thread"]  # all threads are created at startup
# Kinds of calls that occur in each phase: each must have failed there.
CALLED = {"serve": SERVED, "guarded": SERVED,
          "start": ["malloc", "open", "socket", "thread"], "drain": ["malloc", "send", "recv"]}
PHASES = list(CALLED)
LOST = (OSError, http.client.HTTPException, Closed, json.JSONDecodeError, KeyError, ValueError)


class Session:
    """The requests of one session. Each step is independent; `lost` counts failed steps."""

    def __init__(self, port, turn):
        self.port, self.turn, self.lost, self.faults, self.words = port, turn, 0, [], []
        self.steps = [self.page, self.rest, self.values, self.load, self.views, self.stream,
                      self.others]

    def run(self):
        for step in self.steps:
            since = time.monotonic()
            patience = JOB_S + STEP_S if step == self.load else STEP_S
            try:
                step()
            except LOST as fault:
                self.lost += 1
                self.words.append(f"{step.__name__}: {type(fault).__name__} {fault}")
            except Failed as slow:
                self.faults.append(f"{step.__name__}: {slow}")
            if time.monotonic() - since > patience:
                self.faults.append(f"{step.__name__} took {time.monotonic() - since:.0f} s")
        return self

    def get(self, method, target, body=None, headers=None):
        got = ask(self.port, method, target, body, headers, timeout=STEP_S)
        if got.status >= 500 and got.status not in (500, 503, 507):
            raise Failed(f"{target} is answered by {got.status}")
        if got.status >= 400:
            problem = json.loads(got.body)
            need("title" in problem, f"{target} is answered by {got.body[:80]!r}")
            raise KeyError(got.status)
        return got

    def page(self):
        self.get("GET", "/")
        self.get("GET", "/v1")

    def rest(self):
        got = picture(self.port, SAMPLE, azimuth=self.turn, timeout=STEP_S)
        if got.status != 200:
            raise KeyError(got.status)
        view = {"dataset": SAMPLE, "image": {"width": 48, "height": 32},
                "camera": {"eye": [0.3, -2 - 0.001 * self.turn, 1]}}
        self.get("POST", "/v1/frames", view, {"Accept": "image/png"})

    def values(self):
        self.get("GET", "/v1/datasets")
        self.get("GET", f"/v1/datasets/{SAMPLE}")
        self.get("GET", f"/v1/datasets/{SAMPLE}/probe?x=0&y=0&z=0.5")
        self.get("GET", f"/v1/datasets/{SAMPLE}/fields/cloud/histogram?bins=16")

    def load(self):
        got = self.get("POST", "/v1/datasets", {"path": "small.nc"})
        job = json.loads(got.body)
        end = time.monotonic() + JOB_S
        while job["state"] in ("queued", "running"):
            late = time.monotonic() > end
            time.sleep(0.01)
            job = json.loads(self.get("GET", f"/v1/jobs/{job['id']}").body)
            # Only a query that started after the deadline counts: this process may have been
            # stopped.
            if late and job["state"] in ("queued", "running"):
                jobs = self.get("GET", "/v1/jobs").body.decode()
                raise Failed(f"the job stays {job['state']}; all jobs: {jobs}")
        if job["state"] != "done":
            raise KeyError(job["state"])
        name = job["result"]
        try:
            self.get("GET", f"/v1/datasets/{name}/frame.jpg?width=32&height=24")
        finally:
            self.get("DELETE", f"/v1/datasets/{name}?forget=true")

    def views(self):
        got = self.get("POST", "/v1/views", {"dataset": SAMPLE})
        name = json.loads(got.body)["id"]
        self.get("PATCH", f"/v1/views/{name}", {"step": 0},
                 {"Content-Type": "application/merge-patch+json"})
        self.get("GET", f"/v1/views/{name}")
        self.get("DELETE", f"/v1/views/{name}")

    def stream(self):
        with Stream(self.port, timeout=STEP_S) as one:
            if one.status != 101:
                raise KeyError(one.status)
            for n in range(2):
                one.patch(small_view(turn=0.001 * self.turn + 0.1 * n, size=(64, 48)))
                one.answer_to_patch()
            one.patch({"camera": {"fovY": "wide"}})
            one.answer_to_patch()
            one.say({"type": "still", "id": 7, "width": 40, "height": 30, "format": "png",
                     "scale": 1})
            while b'"id":7' not in (got := one.message())[1] and got[0] == 1:
                pass

    def others(self):
        self.get("GET", "/metrics")
        self.get("POST", "/v1/forecasts", {"dataset": SAMPLE})
        self.get("GET", "/readyz")


class GuardedSession(Session):
    """A session that also logs in with the right token and a wrong one, while the daemon reloads
    its configuration, token and certificate."""

    def __init__(self, port, turn, pid):
        super().__init__(port, turn)
        self.pid = pid
        self.steps += [self.hang_up, self.login, self.page]

    def hang_up(self):
        os.kill(self.pid, signal.SIGHUP)
        self.get("GET", "/livez")

    def login(self):
        form = {"Content-Type": "application/x-www-form-urlencoded",
                "Origin": f"https://[::1]:{self.port.port}"}
        for token, status in ((self.port.token, 303), ("not-the-token-at-all", 401)):
            got = ask(self.port._replace(token=None), "POST", "/login", f"token={token}", form,
                      timeout=STEP_S)
            if got.status != status:
                raise KeyError(got.status)


class Sweep:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        root = folder / "root"
        root.mkdir()
        subprocess.run([options.program, "synth", "tornado", "--dims", "8x8x8", "--steps", "1",
                        "-o", root / "small.nc"], check=True, capture_output=True)
        self.arguments = ["--data-root", str(root), "--state-dir", str(folder / "state"),
                          "--threads", "2", SAMPLE]
        self.shim = Shim(options.shim, folder)
        self.daemon = self.bystander = None
        self.guards = None  # only in phase guarded: options, TLS context, token
        self.door = None
        self.turn = self.bystanders_ended = 0
        self.failures = []

    def make_guards(self):
        if not shutil.which("openssl"):
            raise Untried("openssl is not installed: no certificate, so no TLS was tried")
        cert, key, file = (self.folder / name for name in ("cert", "key", "token"))
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2",
                        "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:::1",
                        "-keyout", key, "-out", cert], check=True, capture_output=True)
        token = secrets.token_hex(24)
        file.write_text(token + "\n")
        file.chmod(0o600)
        config = self.folder / "config"
        config.write_text(json.dumps({"allow-origin": ["https://elsewhere.example"]}))
        # Limits that are counted but never reached: an answer of 429 would be a failed step.
        options = ["--tls-cert", str(cert), "--tls-key", str(key), "--token-file", str(file),
                   "--config", str(config), "--max-render-per-address", "1000000",
                   "--max-bytes-per-address", "1000000000",
                   "--max-failed-logins-per-address", "1000000"]
        return options, ssl.create_default_context(cafile=cert), token

    def start(self):
        more, how = [], {}
        if self.guards:
            more, how = self.guards[0], {"listen": "[::1]:0"}
        self.daemon = self.shim.start(self.options.program, *more, *self.arguments, **how)
        self.door = (Door("::1", self.daemon.port, *self.guards[1:]) if self.guards
                     else Door("127.0.0.1", self.daemon.port))
        # Without faults every step must succeed; this also makes all one-time allocations.
        first = self.session()
        need(not first.words and not first.faults, f"without a fault: {first.words + first.faults}")
        self.new_bystander()

    def session(self):
        turn = self.next_turn()
        one = (GuardedSession(self.door, turn, self.daemon.pid) if self.guards
               else Session(self.door, turn))
        return one.run()

    def next_turn(self):
        self.turn += 1
        return self.turn % 300

    def fail(self, text):
        """Records the failure, and starts a new daemon if this one is no longer usable."""
        log = self.daemon.lines[-14:] if self.daemon else []
        self.failures.append(f"{text}; log: {' / '.join(log)}"[:2500])
        print(f"FAILED: {self.failures[-1]}", file=sys.stderr, flush=True)

    def new_bystander(self):
        self.bystander = Stream(self.door)
        self.bystander.final_frame(small_view(turn=0.01 * self.next_turn(), size=(32, 24)))
        self.bystander.round_trip()

    def judge(self, what, session, failed, log_from):
        """After a session with that many failed calls: the daemon must run and serve others."""
        time.sleep(0.01)
        try:
            need(self.daemon.alive(), f"{what}: the daemon exited ({self.daemon.child.poll()})")
            for fault in session.faults:
                raise Failed(f"{what}: {fault}")
            self.ask_bystander(failed, log_from)
            check_good(self.door)
            if self.turn % 8 == 0:
                check_good_stream(self.door)
            return
        except (Failed, *LOST) as fault:
            self.fail(f"{what}: {type(fault).__name__} {fault}")
        self.renew()

    def ask_bystander(self, failed, log_from):
        """Requests the bystander's next frame. A failed call may have belonged to the bystander
        itself: the end of its last frame, a timer, a refinement at rest. Only in that case may
        it end."""
        try:
            self.bystander.final_frame(small_view(turn=0.01 * self.next_turn(), size=(32, 24)))
            self.bystander.round_trip()  # so that the next failing call does not hit its pending
                                         # work
        except (Closed, ConnectionError, ssl.SSLError) as end:
            need(failed, f"no call failed, but the bystander's stream ended: {end!r}")
            wait_for(lambda: self.says_why(log_from), LOG_S,
                     f"the log does not say why the bystander's stream ended ({end!r})")
            self.bystanders_ended += 1
            self.bystander.close()
            self.new_bystander()

    def says_why(self, log_from):
        """Whether the log names the bystander's own connection as failed, or reports lost lines."""
        own = f"request={self.bystander.request_id()}"
        return any(any(words in line for words in LOST_LINES) or
                   own in line and any(words in line for words in ENDS)
                   for line in self.daemon.lines[log_from:])

    def renew(self):
        if self.bystander:
            self.bystander.close()
        if self.daemon and self.daemon.alive():
            self.daemon.stop(signal.SIGKILL)
        self.start()

    def out_of_time(self, since, rounds):
        return (rounds >= self.options.count or
                time.monotonic() - since > self.options.seconds)

    def serve(self, kind):
        """Every call site once; then runs of consecutive failing calls."""
        since, rounds, quiet, hit, lost = time.monotonic(), 0, 0, 0, 0
        self.bystanders_ended = 0
        while quiet < QUIET_ROUNDS and not self.out_of_time(since, rounds):
            log_from = len(self.daemon.lines)
            self.shim.arm_sites(kind)
            session = self.session()
            failed = self.shim.disarm(kind)
            rounds += 1
            hit += failed
            lost += session.lost
            quiet = 0 if failed else quiet + 1
            self.judge(f"{kind}, a new place", session, failed, log_from)
        all_met = quiet >= QUIET_ROUNDS
        bursts = 0
        calls = self.calls_of_a_session(kind)
        while calls and bursts < (1 if self.options.quick else 10):
            log_from = len(self.daemon.lines)
            self.shim.arm(kind, at=1 + bursts * calls // 10, times=BURST)
            session = self.session()
            failed = self.shim.disarm(kind)
            hit += failed
            lost += session.lost
            bursts += 1
            self.judge(f"{kind}, {BURST} calls in a row", session, failed, log_from)
        result = "every call site reached" if all_met else "stopped at its limit"
        phase = "guarded" if self.guards else "serve"
        self.must_have_failed(kind, phase, hit)
        if self.bystanders_ended > max(BYSTANDERS_MAX, (rounds + bursts) * BYSTANDERS_SHARE):
            self.fail(f"{kind}, {phase}: the bystander ended {self.bystanders_ended} times")
        return (f"| {kind} | {phase} | {calls} | {self.shim.get(kind, 'known')} ({result}) | {hit} "
                f"| {lost} of {len(session.steps) * (rounds + bursts)} steps, "
                f"the bystander ended {self.bystanders_ended} times |")

    def must_have_failed(self, kind, phase, hit):
        """Reports kinds of which no call failed, because nothing was tested."""
        if hit == 0:
            self.fail(f"{kind}, {phase}: no call failed")

    def calls_of_a_session(self, kind):
        self.shim.arm(kind, at=1 << 40)
        self.session()
        seen = self.shim.get(kind, "seen")
        self.shim.disarm(kind)
        return seen

    def at_start(self, kind):
        """Restarts the daemon until a start reaches no new call site."""
        since, rounds, started, ended, hit, quiet = time.monotonic(), 0, 0, 0, 0, 0
        aborts = 0
        while quiet < QUIET_ROUNDS and not self.out_of_time(since, rounds):
            self.shim.arm_sites(kind)
            self.daemon = self.shim.start(self.options.program, *self.arguments, must_start=False)
            failed = self.shim.disarm(kind)
            rounds += 1
            hit += failed
            quiet = 0 if failed else quiet + 1
            try:
                if self.daemon.port is None:
                    code = self.daemon.child.wait(PATIENCE_S)
                    self.daemon.reader.join(5)
                    ended += 1
                    if code == -signal.SIGABRT and LIBRARY in self.daemon.log():
                        aborts += 1
                        continue
                    need(code in (1, 2, 3), f"it exited with {code}")
                    need(any(self.daemon.lines), "it exited without a message")
                else:
                    started += 1
                    check_good(self.daemon.port)
                    need(self.daemon.stop() == 0, "it was stopped and did not exit with 0")
            except (Failed, *LOST) as fault:
                self.fail(f"{kind} at the start: {fault}")
                if self.daemon.alive():
                    self.daemon.stop(signal.SIGKILL)
        result = "every call site reached" if quiet >= QUIET_ROUNDS else "stopped at its limit"
        self.must_have_failed(kind, "start", hit)
        return (f"| {kind} | start | - | {self.shim.get(kind, 'known')} ({result}) | {hit} "
                f"| {ended} ended with a message, {started} started, {aborts} were ended by "
                "ecCodes' own checks |")

    def at_drain(self, kind):
        since, rounds, hit, quiet, slowest = time.monotonic(), 0, 0, 0, 0.0
        while quiet < QUIET_ROUNDS and not self.out_of_time(since, rounds):
            self.daemon = self.shim.start(self.options.program, *self.arguments)
            with Stream(self.daemon.port) as one:
                one.patch(small_view(turn=0.001 * self.next_turn(), size=(640, 480)))
                self.shim.arm_sites(kind)
                begun = time.monotonic()
                try:
                    code = self.daemon.stop(patience=3 * DRAIN_S)
                except Failed as fault:
                    code = str(fault)
                took = time.monotonic() - begun
                failed = self.shim.disarm(kind)
            rounds += 1
            hit += failed
            quiet = 0 if failed else quiet + 1
            slowest = max(slowest, took)
            if code != 0 or took > DRAIN_S * self.options.slack:
                self.fail(f"{kind} in a drain: ended with {code} after {took:.1f} s")
        result = "every call site reached" if quiet >= QUIET_ROUNDS else "stopped at its limit"
        self.must_have_failed(kind, "drain", hit)
        return (f"| {kind} | drain | - | {self.shim.get(kind, 'known')} ({result}) | {hit} "
                f"| {rounds} drains, the longest {slowest:.1f} s |")

    def run(self):
        print("| call | while it | calls per session | places that failed | calls that failed "
              "| steps that went wrong |\n|---|---|---|---|---|---|", flush=True)
        for phase in self.options.phase:
            serves = phase in ("serve", "guarded")
            self.guards = self.make_guards() if phase == "guarded" else None
            if serves:
                self.start()
            for kind in self.options.kind or CALLED[phase]:
                self.shim.forget(kind)
                print({"serve": self.serve, "guarded": self.serve, "start": self.at_start,
                       "drain": self.at_drain}[phase](kind), flush=True)
            if serves:
                self.bystander.close()
                code = self.daemon.stop()
                need(code == 0, f"the daemon that survived them exited with {code}")
        return self.failures


def parsed_options(words=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default=str(ROOT / "build/release/windsplat"))
    parser.add_argument("--shim")
    parser.add_argument("--kind", action="append", choices=KINDS)
    parser.add_argument("--phase", action="append", choices=PHASES)
    parser.add_argument("--count", type=int, default=100000, help="greatest number of rounds")
    parser.add_argument("--seconds", type=float, default=1800, help="time limit on a sweep")
    parser.add_argument("--slack", type=float, default=1, help="factor for time limits")
    parser.add_argument("--quick", action="store_true", help="a few rounds of every sweep")
    options = parser.parse_args(words)
    options.phase = options.phase or PHASES
    if options.quick:
        options.count, options.seconds = min(options.count, 2), min(options.seconds, 8)
    options.shim = options.shim or str(pathlib.Path(options.program).resolve().parent
                                       / "tests/libfaults_shim.so")
    return options


def main():
    options = parsed_options()
    with tempfile.TemporaryDirectory(prefix="windsplat-inject-") as folder:
        try:
            failures = Sweep(options, pathlib.Path(folder)).run()
        except Untried as why:
            print(f"inject.py: {why}")
            return 1
    print(f"\n{len(failures)} failures")
    for text in failures:
        print(f"- {text}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
