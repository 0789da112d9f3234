#!/usr/bin/env python3
"""Hundreds of sessions for many minutes, a tenth of them hostile, a tenth that never read: memory,
descriptors and threads of the daemon, and their growth. Markdown on stdout. Linux only.

Usage: soak.py [--program=windsplat] [--dataset=tornado:32x32x32] [--minutes=20] [--sessions=200]
       [--mix=normal:8,hostile:1,deaf:1] [--stay=30] [--size=160x120] [--every=5] [--max-slope=8]
       [--samples=FILE] [--tls] [--smoke] [-- options of serve]

--sessions run concurrently; each lasts about --stay seconds and is replaced by one of its kind.
Normal ones change their view, wait for frames and acknowledge them, and sometimes request a still,
save a view or use HTTP. Hostile ones send invalid frames, broken JSON, floods, half a message and a
reset, headers byte by byte, half-open connections. Deaf ones send requests and never read. --mix
also accepts `drag` (permanent view changes), `slow` (reads 20 kB/s) and `cut` (reset within
seconds); the numbers are shares of the sessions. --tls: everything over TLS, with a certificate
made by openssl; hostile ones then also abort handshakes or send plain text. Memory is sampled every
--every seconds. The slope is the least-squares line through the minima of twelve intervals of the
samples after the first quarter (the warm-up), with its 95 % confidence interval: a large picture
takes about 15 MB for a moment, which a sample hits by chance; minima show what remains allocated.
The line through the means of the intervals is printed beside it.

Failures: a daemon that crashes, stops answering /livez or exits with a code other than 0; a slope
above its interval's half width and above --max-slope MB/hour; descriptors, threads or sessions that
do not return to their initial number after all clients have disconnected. --smoke: some seconds,
without the slope. Exit code 0: no failure."""
import argparse
import asyncio
import json
import math
import os
import pathlib
import resource
import ssl
import subprocess
import sys
import tempfile
import time
import urllib.request

from soak_clients import GONE, Counts, kinds_of, seat
from stream_client import Daemon, status_bytes

MB = 1e6
WARM_UP_SHARE, STRETCHES = 0.25, 12
LEAVE_S = 100  # a client that never reads is disconnected after its write deadline or 60 s of
               # silence
# Student's t for 95 %, by degrees of freedom: 1, 2, ...
STUDENT_T = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23]


# --- observed state ------------------------------------------------------------------------------

def state(pid):
    threads = status_bytes(pid, "Threads") // 1024
    return {"rss": status_bytes(pid, "VmRSS"), "fds": len(os.listdir(f"/proc/{pid}/fd")),
            "threads": threads}


def fetch(options, port, target):
    scheme = "https" if options.context else "http"
    with urllib.request.urlopen(f"{scheme}://127.0.0.1:{port}{target}", timeout=60,
                                context=options.context) as answer:
        return answer.read()


def metric(options, port, name):
    for line in fetch(options, port, "/metrics").decode().splitlines():
        if line.startswith(name + " "):
            return float(line.rsplit(" ", 1)[1])
    raise KeyError(name)


async def watch(options, daemon, end, samples, failures):
    begun = time.monotonic()
    while time.monotonic() < end:
        await asyncio.sleep(options.every)
        if daemon.child.poll() is not None:
            failures.append(f"the daemon died ({daemon.child.returncode})")
            return
        samples.append((time.monotonic() - begun, state(daemon.child.pid)))
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", daemon.port,
                                                           ssl=options.context)
            writer.write(b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")
            answer = await asyncio.wait_for(reader.read(), 10)
            writer.close()
            if b" 200 " not in answer[:20]:
                failures.append(f"/livez: {answer[:40]!r}")
        except GONE as fault:
            failures.append(f"/livez: {type(fault).__name__}")


def mean(values):
    return sum(values) / len(values)


def slope(samples, of_stretch):
    """The slope in MB/hour, and half of its 95 % confidence interval, of one value per stretch
    after the warm-up. Stretches are long compared with disturbances of a sample; if their residuals
    are still correlated, the interval is widened accordingly."""
    kept = samples[int(WARM_UP_SHARE * len(samples)):]
    count = min(STRETCHES, len(kept))
    if count < 3:
        return math.nan, math.nan
    points = []
    for n in range(count):
        part = kept[n * len(kept) // count:(n + 1) * len(kept) // count]
        points.append((mean([t for t, _ in part]) / 3600,
                       of_stretch([s["rss"] for _, s in part]) / MB))
    mean_x = mean([x for x, _ in points])
    mean_y = mean([y for _, y in points])
    square = sum((x - mean_x) ** 2 for x, _ in points)
    rise = sum((x - mean_x) * (y - mean_y) for x, y in points) / square
    rest = [y - mean_y - rise * (x - mean_x) for x, y in points]
    squares = sum(one * one for one in rest)
    alike = sum(a * b for a, b in zip(rest, rest[1:])) / squares if squares else 0
    widened = math.sqrt((1 + alike) / (1 - alike)) if alike > 0 else 1
    return rise, STUDENT_T[count - 3] * widened * math.sqrt(squares / (count - 2) / square)


def settle(options, daemon, before, failures):
    """Waits until the memory of sessions is released."""
    end = time.monotonic() + LEAVE_S
    while True:
        now, sessions = state(daemon.child.pid), metric(options, daemon.port, "windsplat_sessions")
        # The request for the metrics has a descriptor of its own.
        if now["fds"] <= before["fds"] and now["threads"] <= before["threads"] and sessions == 0:
            return now
        if time.monotonic() > end:
            failures.append(f"still open: {now['fds']} descriptors of {before['fds']}, "
                            f"{now['threads']} threads of {before['threads']}, "
                            f"{sessions:.0f} sessions")
            return now
        time.sleep(0.2)


async def soak(options, daemon, counts, samples, failures):
    end = time.monotonic() + 60 * options.minutes
    await asyncio.gather(watch(options, daemon, end, samples, failures),
                         *(seat(n, options, daemon.port, counts, end)
                           for n in range(options.sessions)))


def report(options, counts, samples, before, after, failures):
    rise, error = slope(samples, min)
    rise_of_means, error_of_means = slope(samples, mean)
    took = samples[-1][0] if samples else 0
    highest = max((s["rss"] for _, s in samples), default=0)
    how = "over TLS " if options.context else ""
    came = ", ".join(f"{n} {kind}" for kind, n in counts.came.items() if n)
    print(f"{options.sessions} concurrent sessions {how}for {took / 60:.1f} minutes: {came}; "
          f"{counts.frames} frames, {counts.requests} requests, {counts.refused} refused. Hostile: "
          + (", ".join(f"{n} {name}" for name, n in sorted(counts.kinds.items())) or "none")
          + ".\n")
    print("| | before | peak | after |\n|---|---|---|---|")
    print(f"| resident, MB | {before['rss'] / MB:.1f} | {highest / MB:.1f} "
          f"| {after['rss'] / MB:.1f} |")
    for name, key in (("descriptors", "fds"), ("threads", "threads")):
        most = max((s[key] for _, s in samples), default=0)
        print(f"| {name} | {before[key]} | {most} | {after[key]} |")
    print("\nSlope of resident memory after the first quarter, with its 95 % interval: "
          f"{rise:.2f} +- {error:.2f} MB/hour of what stays, "
          f"{rise_of_means:.2f} +- {error_of_means:.2f} of the means")
    if not options.smoke and rise > max(error, options.max_slope):
        failures.append(f"memory grows by {rise:.2f} +- {error:.2f} MB/hour")
    asks = "normal" in options.kinds and not options.smoke
    if counts.frames == 0 or counts.requests == 0 and asks:
        failures.append("no session was served")


def parsed_options():
    default = pathlib.Path(__file__).resolve().parents[2] / "build/release/windsplat"
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default=str(default))
    parser.add_argument("--dataset", default="tornado:32x32x32")
    parser.add_argument("--minutes", type=float, default=20)
    parser.add_argument("--sessions", type=int, default=200)
    parser.add_argument("--mix", default="normal:8,hostile:1,deaf:1", help="kinds and shares")
    parser.add_argument("--stay", type=float, default=30, help="approximate seconds of a session")
    parser.add_argument("--size", default="160x120")
    parser.add_argument("--every", type=float, default=5, help="seconds between samples")
    parser.add_argument("--max-slope", type=float, default=8, help="permitted slope in MB/hour")
    parser.add_argument("--samples", help="file for seconds and resident MB, one line per sample")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tls", action="store_true", help="over TLS")
    parser.add_argument("--smoke", action="store_true")
    parser.add_argument("further", nargs="*", help="options of serve, after --")
    options = parser.parse_args()
    if options.smoke:
        options.minutes, options.sessions, options.stay, options.every = 0.1, 30, 2, 0.5
    try:
        options.kinds = kinds_of(options.mix)
    except ValueError as fault:
        parser.error(str(fault))
    options.size = tuple(int(word) for word in options.size.split("x"))
    return options


def certificate(options, folder):
    """Options of serve; the clients trust the certificate created here."""
    options.context = None
    if not options.tls:
        return []
    cert, key = folder / "cert", folder / "key"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2",
                    "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1",
                    "-keyout", key, "-out", cert], check=True, capture_output=True)
    options.context = ssl.create_default_context(cafile=cert)
    return ["--tls-cert", str(cert), "--tls-key", str(key)]


def main():
    with tempfile.TemporaryDirectory(prefix="windsplat-soak-") as folder:
        return measure(parsed_options(), pathlib.Path(folder))


def measure(options, folder):
    tls = certificate(options, folder)
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    daemon = Daemon(options.program, options.dataset, "--max-sessions", str(2 * options.sessions),
                    *tls, *options.further)
    counts, samples, failures = Counts(), [], []
    # A first picture, so that one-time allocations are not counted.
    fetch(options, daemon.port, f"/v1/datasets/{options.dataset}/frame.jpg?width=64&height=48")
    metric(options, daemon.port, "windsplat_sessions")
    time.sleep(0.3)
    before = state(daemon.child.pid)
    asyncio.run(soak(options, daemon, counts, samples, failures))
    if daemon.child.poll() is None:
        after = settle(options, daemon, before, failures)
        if options.samples:
            pathlib.Path(options.samples).write_text(
                "".join(f"{t:.1f} {s['rss'] / MB:.2f}\n" for t, s in samples))
        report(options, counts, samples, before, after, failures)
    daemon.stop()
    if daemon.child.returncode != 0:
        failures.append(f"the daemon ended with {daemon.child.returncode}")
    print(f"\n{len(failures)} failures" + "".join(f"\n- {text}" for text in failures[:20]))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
