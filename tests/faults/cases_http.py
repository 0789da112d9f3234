"""Malformed and slow requests: a short version of the HTTP edge cases (tests/edge has all of
them)."""
import re
import shutil
import socket
import subprocess
import threading
import time

from support import (MIB, PATIENCE_S, SAMPLE, Failed, Untried, ask, case, check_good, need, picture,
                     rss, status_of, talk, wait_for)

CUT_S = 5  # deadline of an incomplete header or body
SLACK_S = 4  # tolerance for a loaded machine
SIZES = [0, 1, 4095, 4096, 8191, 8192, 16383, 16384, 65535, 65536, 66000, 131072, 1 << 20]


def refused(port, request, allowed):
    """Expects one of these statuses and then the end of the connection, or the end at once.
    Returns the status, 0 for none."""
    got, took = talk(port, request)
    need(took < CUT_S + SLACK_S, f"closed after {took:.1f} s: {request[:60]!r}")
    if not got:
        return 0
    status = status_of(got)
    need(status in allowed, f"answered by {status}: {request[:60]!r}")
    return status


def by_size(world, count, make, allowed):
    """Sends sizes around the limits repeatedly; the daemon's memory must not grow with them."""
    daemon = world.daemon()
    for size in SIZES:
        refused(daemon.port, make(size), allowed)
    before = rss(daemon.pid)
    seen = {}
    for n in range(count):
        status = refused(daemon.port, make(SIZES[n % len(SIZES)] + n // len(SIZES)), allowed)
        seen[status] = seen.get(status, 0) + 1
    more = rss(daemon.pid) - before
    need(more <= MIB, f"the daemon's memory grew by {more / MIB:.1f} MiB")
    result = ", ".join(f"{status or 'no answer'} {n} times" for status, n in sorted(seen.items()))
    return f"{result}; closed; memory +{max(0, more) / MIB:.2f} MiB"


def head(more):
    return f"POST /v1/frames HTTP/1.1\r\nHost: 127.0.0.1\r\n{more}\r\n\r\n".encode()


@case("chunked trailers", 130, 13)
def trailers(world, count):
    def make(size):
        return (head("Transfer-Encoding: chunked\r\nTrailer: X")
                + b"2\r\n{}\r\n0\r\nX: " + b"a" * size + b"\r\n\r\n")
    return by_size(world, count, make, {400, 411, 501})


@case("chunk extensions", 130, 13)
def extensions(world, count):
    def make(size):
        return (head("Transfer-Encoding: chunked") + b"2;e=" + b"a" * size + b"\r\n{}\r\n0\r\n\r\n")
    return by_size(world, count, make, {400, 411, 501})


@case("headers of 9 KB and more", 130, 13)
def large_headers(world, count):
    def make(size):
        return head("X-Long: " + "a" * (9216 + size))
    return by_size(world, count, make, {431})


@case("Content-Length of 2^63 and similar values", 60, 6)
def lengths(world, count):
    daemon = world.daemon()
    wrong = ["9223372036854775808", "9223372036854775807", "18446744073709551616",
             "18446744073709551615", "-1", "1e3", "0x10", "65537", "1, 2", "+5",
             "99999999999999999999999"]
    seen = {}
    for n in range(count):
        status = refused(daemon.port, head(f"Content-Length: {wrong[n % len(wrong)]}") + b"{}",
                         {400, 413})
        seen[status] = seen.get(status, 0) + 1
    return ", ".join(f"{status or 'no answer'} {n} times" for status, n in sorted(seen.items()))


class Slow(threading.Thread):
    """Sends a request one byte at a time; returns how long the connection stayed open."""

    def __init__(self, port, request, at_once):
        super().__init__(daemon=True)
        self.port, self.request, self.at_once = port, request, at_once
        self.took = None

    def run(self):
        since = time.monotonic()
        with socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE_S) as one:
            try:
                one.sendall(self.request[:self.at_once])
                one.settimeout(0.2)
                for byte in self.request[self.at_once:]:
                    one.sendall(bytes([byte]))
                    try:
                        if not one.recv(4096):
                            break
                    except socket.timeout:
                        continue
            except OSError:
                pass
        self.took = time.monotonic() - since


def slowly(world, count, request, at_once):
    daemon = world.daemon()
    slow = [Slow(daemon.port, request, at_once) for _ in range(count)]
    for one in slow:
        one.start()
    slowest, served = 0.0, 0
    while any(one.is_alive() for one in slow):
        since = time.monotonic()
        check_good(daemon.port)
        slowest = max(slowest, time.monotonic() - since)
        served += 1
        time.sleep(0.1)
    longest = max(one.took for one in slow)
    need(served > 0 and longest < CUT_S + SLACK_S, f"one stayed open for {longest:.1f} s")
    need(min(one.took for one in slow) > CUT_S - 1, "one was closed before the deadline")
    return (f"cut after {longest:.1f} s at most; {served} pictures meanwhile, the slowest in "
            f"{1000 * slowest:.0f} ms")


@case("slow headers", 100, 20)
def slow_headers(world, count):
    return slowly(world, count, head("X-Long: " + "a" * 400), 20)


@case("slow bodies", 100, 20)
def slow_bodies(world, count):
    request = head("Content-Type: application/json\r\nContent-Length: 400")
    return slowly(world, count, request + b"{" + b" " * 398 + b"}", len(request))


@case("slow headers, by slowhttptest", 200, 30)
def slow_by_tool(world, count):
    if not shutil.which("slowhttptest"):
        raise Untried("slowhttptest is not installed: its slow headers and bodies were not tried")
    daemon = world.daemon()
    result = []
    for how in ("-H", "-B"):
        seconds = str(CUT_S + SLACK_S)
        done = subprocess.run(
            ["slowhttptest", how, "-c", str(count), "-r", "100", "-i", "1", "-l", seconds,
             "-p", "3", "-u", f"http://127.0.0.1:{daemon.port}/v1"], capture_output=True, text=True,
            timeout=PATIENCE_S, check=False)
        text = re.sub(r"\x1b\[[0-9;]*m", "", done.stdout)
        available = re.findall(r"service available:\s+(\w+)", text)
        ended = re.findall(r"Test ended on (\d+)\w+ second\s+Exit status:\s*(.*)", text)
        need(ended and available, f"cannot parse the output of slowhttptest: {text[-200:]}")
        need(set(available) == {"YES"}, f"slowhttptest {how} found the service not available")
        need("No open connections left" in ended[0][1], f"connections are still held: {ended[0]}")
        part = "headers" if how == "-H" else "bodies"
        result.append(f"{part}: all closed by second {ended[0][0]}")
    return "; ".join(result) + "; service available throughout"


@case("clients that disconnect in the middle of a request", 200, 20)
def leave(world, count):
    daemon = world.daemon()
    request = head("Content-Type: application/json\r\nContent-Length: 20") + b"{}" + b" " * 18
    for n in range(count):
        with socket.create_connection(("127.0.0.1", daemon.port)) as one:
            if n % 2:  # by a reset
                one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            one.sendall(request[:1 + n * 7 % len(request)])
    quiet = wait_for(lambda: picture(daemon.port).status in (200, 429), PATIENCE_S, "no picture")
    need(quiet, "no picture")
    return "a new request is served at once"


@case("control characters in request ids and targets", 60, 12)
def control_characters(world, count):
    """CR, LF and ESC in client input: log lines stay single and printable."""
    daemon = world.start("--data-root", str(world.new_folder()), SAMPLE)
    evil = ["a%0d%0ainjected%20line", "%1b%5b31mred", "%00", "%0a", "%e2%80%ae", "x" * 3000]
    for n in range(count):
        word = evil[n % len(evil)]
        raw = word.replace("%1b", "\x1b").replace("%5b", "[").replace("%0d%0a", "\t")
        ask(daemon.port, "GET", f"/v1/datasets/{word}")
        ask(daemon.port, "GET", f"/v1/datasets/{SAMPLE}/probe?x={word}")
        ask(daemon.port, "POST", "/v1/datasets", {"path": raw + "\r\ninjected\x1b[2J"})
        ask(daemon.port, "POST", "/v1/frames", {"dataset": raw + "\ninjected\x1b[2J"})
        ask(daemon.port, "GET", "/v1", headers={"X-Request-Id": "injected " + word})
    daemon.stop()
    for line in daemon.lines:
        need(line.isprintable(), f"a control character in the log: {line!r}")
        need(not re.match(r"\s*injected", line), f"a log line injected by a client: {line!r}")
        need(len(line) < 4096, f"a line of {len(line)} characters")
    need(len(daemon.lines) >= 5 * count, "the log has too few lines for this test")
    return f"{len(daemon.lines)} log lines, each one line without control characters"


@case("labels of metrics", 200, 40)
def labels(world, count):
    daemon = world.daemon()

    def series():
        text = ask(daemon.port, "GET", "/metrics").body.decode()
        return {line.rsplit(" ", 1)[0] for line in text.splitlines() if not line.startswith("#")}
    before = series()
    for n in range(count):
        ask(daemon.port, "GET", f"/v1/datasets/never-{n}/frame.jpg?width={n}&x{n}=1")
        ask(daemon.port, f"VERB{n}", f"/{n}/metrics?name={n}", headers={"Accept": f"text/{n}"})
        ask(daemon.port, "GET", f"/metrics?{n}", headers={"User-Agent": f"agent {n}"})
    after = series()
    need(after == before, f"new series: {sorted(after - before)[:3]}")
    if not before:
        raise Failed("there are no series at all")
    return f"{len(after)} series before and after {3 * count} requests"
