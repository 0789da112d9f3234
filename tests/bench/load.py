#!/usr/bin/env python3
"""Overload test: many clients request pictures at once. Measures goodput, latency, the speed of
refusals, and whether health checks succeed. Prints a Markdown table. Linux only.

Usage: load.py [--program=windsplat] [--dataset=climate] [--size=640x360] [--seconds=10]
       [--times=1,10] [--addresses=200] [--check] [--smoke] [-- further options of serve]

Unloaded: one request at a time. Peak: the highest rate of answers for 1, 2, 4, 8 or 16 clients that
each send the next request after an answer, or 50 ms after a refusal. Then requests are sent at 1
and 10 times that rate regardless of answers (an open loop), each on a separate connection, from
many addresses of 127.0.0.0/8. All pictures differ, so none is cached. Latency counts from sending
the request; the delay of sending and the CPU time of the client are reported separately, because on
two cores the client slows the daemon. Goodput is the number of 200 answers per second. A
separate process requests /livez every 20 ms on new connections.

Targets: at 10 times the peak the p99 of /livez is below 50 ms, that of admitted requests at most
twice the unloaded one, and goodput at least 80 % of the peak. --check: exit 1 if a target is
missed or a refusal has no Retry-After. --smoke: short, fails only if nothing works."""
import argparse
import collections
import math
import multiprocessing
import os
import pathlib
import resource
import selectors
import socket
import sys
import time

from stream_client import Daemon

HEALTH_EVERY_S = 0.02
HEALTH_P99_S, ADMITTED_TIMES, GOODPUT_SHARE = 0.05, 2, 0.8
WARM_UP_SHARE = 0.2  # fraction of the duration before answers count
PAUSE_S = 0.05  # delay of a client after a refusal
GATHER_S = 8  # time for pending answers at the end
CLOSED = 0  # used in place of a status: no answer

Answer = collections.namedtuple("Answer", "sent took status retry_after")


def quantile(values, share):
    """The smallest value that at least this share of the values does not exceed."""
    ordered = sorted(values)
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)] if ordered else math.nan


class Asker:
    """A connection that requests one picture after another."""

    def __init__(self, selector, port, number, addresses):
        self.selector = selector
        self.socket = socket.socket()
        self.socket.setblocking(False)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.bind((f"127.0.0.{2 + number % addresses}", 0))
        self.socket.connect_ex(("127.0.0.1", port))
        self.out, self.got, self.sent = b"", b"", None
        selector.register(self.socket, selectors.EVENT_WRITE, self)

    def ask(self, request, now):
        self.out, self.got, self.sent = request, b"", now
        self.selector.modify(self.socket, selectors.EVENT_WRITE, self)

    def turn(self, mask):
        """Returns an answer; True if the connection is no longer usable; else None."""
        try:
            if mask & selectors.EVENT_WRITE:
                self.out = self.out[self.socket.send(self.out):] if self.out else b""
                if not self.out:
                    self.selector.modify(self.socket, selectors.EVENT_READ, self)
                return None
            piece = self.socket.recv(1 << 18)
        except BlockingIOError:
            return None
        except OSError:
            piece = b""
        if not piece:
            return self.lost()
        self.got += piece
        return self.whole_answer()

    def lost(self):
        self.close()
        return self.answer(CLOSED, False) if self.sent is not None else True

    def whole_answer(self):
        end = self.got.find(b"\r\n\r\n")
        if end < 0:
            return None
        head = self.got[:end].lower()
        length = int(head.split(b"content-length:")[1].split(b"\r\n")[0])
        if len(self.got) < end + 4 + length:
            return None
        if b"connection: close" in head:
            self.close()
        return self.answer(int(head.split(b" ")[1]), b"retry-after:" in head)

    def answer(self, status, retry_after):
        sent, self.sent = self.sent, None
        return Answer(sent, time.monotonic() - sent, status, retry_after)

    def close(self):
        if self.socket:
            self.selector.unregister(self.socket)
            self.socket.close()
            self.socket = None


class Clients:
    def __init__(self, options, port):
        self.options, self.port = options, port
        self.selector = selectors.DefaultSelector()
        self.idle, self.made, self.asked = [], 0, 0
        self.answers, self.lateness = [], []

    def request(self):
        self.asked += 1
        width, height = self.options.size.split("x")
        angle = (self.asked * 137.508 + os.getpid()) % 360
        return (f"GET /v1/datasets/{self.options.dataset_id}/frame.jpg?azimuth={angle:.4f}"
                f"&elevation=30&width={width}&height={height} HTTP/1.1\r\n"
                f"Host: 127.0.0.1:{self.port}\r\n\r\n").encode()

    def ask(self, now):
        asker = self.idle.pop() if self.idle else None
        if asker is None:
            asker = Asker(self.selector, self.port, self.made, self.options.addresses)
            self.made += 1
        asker.ask(self.request(), now)

    def gather(self, until):
        """Handles answers until that time; returns the connections that may send again."""
        ready = self.selector.select(max(0, until - time.monotonic()))
        for key, mask in ready:
            outcome = key.data.turn(mask)
            if isinstance(outcome, Answer):
                self.answers.append(outcome)
                if key.data.socket:
                    self.idle.append(key.data)
            elif outcome and key.data in self.idle:
                self.idle.remove(key.data)

    def waiting(self):
        return self.asked - len(self.answers)

    def closed_loop(self, count, seconds):
        end = time.monotonic() + seconds
        paused, seen = collections.deque(), 0  # times at which refused clients may continue
        while time.monotonic() < end:
            now = time.monotonic()
            paused.extend(now + PAUSE_S for a in self.answers[seen:] if a.status != 200)
            seen = len(self.answers)
            while paused and paused[0] <= now:
                paused.popleft()
            while self.waiting() + len(paused) < count:
                self.ask(now)
            self.gather(min([end, *list(paused)[:1]]))

    def open_loop(self, rate, seconds):
        begun = time.monotonic()
        while self.asked < rate * seconds:
            due = begun + self.asked / rate
            now = time.monotonic()
            if now < due:
                self.gather(due)
                continue
            self.lateness.append(now - due)
            self.ask(now)
            if self.asked % 8 == 0:
                self.gather(now)


def ask_for_pictures(options, port, how, much, pipe):
    """Runs in a separate process: loads the daemon and reports the results."""
    clients = Clients(options, port)
    begun = time.monotonic()
    getattr(clients, how)(much, options.seconds)
    ended = time.monotonic()
    while clients.waiting() and time.monotonic() < ended + GATHER_S:
        clients.gather(ended + GATHER_S)
    used = resource.getrusage(resource.RUSAGE_SELF)
    pipe.send({"answers": clients.answers, "lateness": clients.lateness, "begun": begun,
               "ended": ended, "unanswered": clients.waiting(), "connections": clients.made,
               "cpu": (used.ru_utime + used.ru_stime) / (ended - begun)})


def ask_for_health(port, seconds, pipe):
    """Runs in a separate process: seconds that /livez took, and the number of failures."""
    took, failed = [], 0
    begun = time.monotonic()
    request = f"GET /livez HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode()
    beat = begun
    while beat < begun + seconds:
        time.sleep(max(0, beat - time.monotonic()))
        beat = max(beat + HEALTH_EVERY_S, time.monotonic())
        since = time.monotonic()
        try:
            with socket.create_connection(("127.0.0.1", port), timeout=5) as one:
                one.sendall(request)
                fine = b" 200 " in one.recv(4096).split(b"\r\n")[0]
        except OSError:
            fine = False
        took.append(time.monotonic() - since)
        failed += 0 if fine else 1
    pipe.send({"took": took, "failed": failed})


def daemon_cpu_s(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run(options, daemon, how, much):
    """Runs one load with concurrent health checks."""
    ends = [multiprocessing.Pipe(False) for _ in range(2)]
    cpu = daemon_cpu_s(daemon.child.pid)
    workers = [
        multiprocessing.Process(target=ask_for_pictures,
                                args=(options, daemon.port, how, much, ends[0][1])),
        multiprocessing.Process(target=ask_for_health,
                                args=(daemon.port, options.seconds, ends[1][1]))]
    for worker in workers:
        worker.start()
    load, health = (end[0].recv() for end in ends)
    for worker in workers:
        worker.join()
    load["health"] = health
    load["daemon cpu"] = (daemon_cpu_s(daemon.child.pid) - cpu) / options.seconds
    return load


def judged(options, load):
    """The figures of one load."""
    since = load["begun"] + WARM_UP_SHARE * options.seconds
    span = load["ended"] - since
    counted = [a for a in load["answers"] if a.sent >= since]
    admitted = [a.took for a in counted if a.status == 200]
    refused = [a for a in counted if a.status in (429, 503)]
    arrived = sum(1 for a in load["answers"]
                  if a.status == 200 and since <= a.sent + a.took < load["ended"])
    others = collections.Counter(a.status for a in counted if a.status not in (200, 429, 503))
    return {"offered": len(counted) / span, "goodput": arrived / span,
            "p50": quantile(admitted, 0.5), "p99": quantile(admitted, 0.99),
            "refused": len(refused), "refused p99": quantile([a.took for a in refused], 0.99),
            "no retry": sum(1 for a in refused if not a.retry_after), "others": dict(others),
            "health p50": quantile(load["health"]["took"], 0.5),
            "health p99": quantile(load["health"]["took"], 0.99),
            "health failed": load["health"]["failed"], "client cpu": load["cpu"],
            "daemon cpu": load["daemon cpu"], "late": quantile(load["lateness"], 0.99),
            "unanswered": load["unanswered"], "connections": load["connections"]}


def row(name, r):
    def ms(seconds):
        return "-" if math.isnan(seconds) else f"{1000 * seconds:.1f}"
    return (f"| {name} | {r['offered']:.1f} | {r['goodput']:.1f} | {ms(r['p50'])} "
            f"| {ms(r['p99'])} | {r['refused']} | {ms(r['refused p99'])} | {ms(r['health p50'])} "
            f"| {ms(r['health p99'])} | {r['health failed']} | {100 * r['client cpu']:.0f} "
            f"| {100 * r['daemon cpu']:.0f} | {ms(r['late'])} | {r['connections']} |")


COLUMNS = ["load", "offered/s", "goodput/s", "admitted p50, ms", "p99", "refused", "p99",
           "/livez p50", "p99", "failed", "client CPU, %", "daemon CPU, %", "sent late p99",
           "connections"]


def targets(unloaded, peak, high):
    """The targets under the highest load, and whether they are met."""
    ratio = high["p99"] / unloaded["p99"]
    share = high["goodput"] / peak
    return [
        (f"/livez p99 {1000 * high['health p99']:.1f} ms < {1000 * HEALTH_P99_S:.0f} ms, "
         f"{high['health failed']} failed",
         high["health p99"] < HEALTH_P99_S and high["health failed"] == 0),
        (f"admitted p99 {ratio:.2f} times unloaded <= {ADMITTED_TIMES}", ratio <= ADMITTED_TIMES),
        (f"goodput {100 * share:.0f} % of the peak >= {100 * GOODPUT_SHARE:.0f} %",
         share >= GOODPUT_SHARE),
        (f"{high['no retry']} of {high['refused']} refusals without Retry-After",
         high["no retry"] == 0),
        (f"{high['unanswered']} requests without an answer; other answers: "
         f"{high['others'] or 'none'}", high["unanswered"] == 0 and not high["others"])]


def measure(options, daemon):
    print(f"{options.dataset}, {options.size}, {options.seconds:g} s per load, "
          f"{options.addresses} addresses, {os.cpu_count()} processors for daemon and clients. "
          "Times in ms.\n")
    print("| " + " | ".join(COLUMNS) + " |\n" + "|---" * len(COLUMNS) + "|")
    ramp = {}
    for count in options.ramp:
        ramp[count] = judged(options, run(options, daemon, "closed_loop", count))
        print(row("unloaded" if count == 1 else f"{count} clients", ramp[count]), flush=True)
    peak = max(r["goodput"] for r in ramp.values())
    loads = {}
    for times in options.times:
        loads[times] = judged(options, run(options, daemon, "open_loop", max(1, times * peak)))
        print(row(f"{times:g} times the peak", loads[times]), flush=True)
    high = loads[max(loads)]
    print(f"\nPeak: {peak:.1f} answers/s. At {max(loads):g} times that:\n")
    fine = True
    for text, kept in targets(ramp[options.ramp[0]], peak, high):
        print(f"- {'kept' if kept else 'MISSED'}: {text}")
        fine = fine and kept
    return fine, peak > 0 and high["goodput"] > 0 and high["health failed"] == 0


def parsed_options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default="build/release/windsplat")
    parser.add_argument("--dataset", default="climate")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--times", type=lambda text: [float(t) for t in text.split(",")],
                        default=[1, 10])
    parser.add_argument("--addresses", type=int, default=200)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--smoke", action="store_true")
    parser.add_argument("further", nargs="*", help="options of serve, after --")
    options = parser.parse_args()
    options.dataset_id = (pathlib.Path(options.dataset).stem if "/" in options.dataset
                          else options.dataset)
    options.ramp = [1, 2, 4, 8, 16]
    if options.smoke:
        options.size, options.seconds, options.ramp = "320x180", 1.5, [1, 4]
    return options


def main():
    options = parsed_options()
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    daemon = Daemon(options.program, options.dataset, *options.further)
    try:
        fine, works = measure(options, daemon)
        alive = daemon.child.poll() is None
    finally:
        daemon.stop()
    if not alive:
        sys.exit("load.py: the daemon died")
    if not works:
        sys.exit("load.py: no picture was received, or health checks failed")
    return 1 if options.check and not options.smoke and not fine else 0


if __name__ == "__main__":
    sys.exit(main())
