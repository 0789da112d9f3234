#!/usr/bin/env python3
"""Hundreds of viewers for many minutes, a tenth of them hostile, a tenth that never read: what the
daemon holds of memory, descriptors and threads, and whether it grows. Markdown on stdout. Linux
only.

Usage: soak.py [--program=windsplat] [--dataset=tornado:32x32x32] [--minutes=20] [--sessions=200]
       [--stay=30] [--size=160x120] [--every=5] [--max-slope=8] [--tls] [--smoke]
       [-- options of serve]

So many sessions at a time; each stays for about --stay seconds and another one of its kind takes
its place. Normal ones change their view, wait for frames and acknowledge them, now and then ask
for a still, save a view or ask by HTTP. Hostile ones send frames that are none, broken JSON,
floods, half a message and a reset, headers letter by letter, half-open connections. Deaf ones ask
and never read. --tls: all of it over TLS, by a certificate that openssl makes; hostile ones then
also leave in the middle of a handshake or speak no TLS. Memory is looked at every --every seconds.
The slope is the least squares' line through the least of each of twelve stretches of the samples
after the first quarter (the warm-up), with its standard error: a large picture takes some 15 MB for
a moment, and whether one is drawn when the clock strikes is chance; what stays shows between them.
The line through the stretches' means, chance and all, is told beside it.

Failures: a daemon that dies, stops answering /livez or ends with another code than 0; a slope
above two standard errors and above --max-slope MB/hour; descriptors, threads or sessions that are
not back at the start once all have left. --smoke: some seconds, without the slope. Exit code 0:
none."""
import argparse
import asyncio
import base64
import json
import math
import os
import pathlib
import random
import resource
import socket
import ssl
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request

from stream_client import Daemon, status_bytes

MB = 1e6
WARM_UP_SHARE, STRETCHES = 0.25, 12
LEAVE_S = 100  # a deaf one is given up after its write's deadline or 60 s of silence
DEAF_SIZE = (1280, 720)
GONE = (OSError, EOFError, asyncio.IncompleteReadError, asyncio.TimeoutError, ConnectionError)


class Client:
    def __init__(self, options, port, chance, number):
        self.options, self.port, self.chance = options, port, chance
        # Limits are those of addresses: each seat has its own, beside the one that looks at health.
        self.address = f"127.0.{1 + number // 250}.{2 + number % 250}"
        self.reader = self.writer = None
        self.rev = 0

    async def connect(self, limit=1 << 16, plain=False):
        context = None if plain else self.options.context
        self.reader, self.writer = await asyncio.wait_for(
            asyncio.open_connection("127.0.0.1", self.port, limit=limit, ssl=context,
                                    local_addr=(self.address, 0)), 20)

    async def upgrade(self):
        key = base64.b64encode(os.urandom(16)).decode()
        self.writer.write((
            f"GET /v1/stream HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\nUpgrade: websocket\r\n"
            f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: windsplat.v1\r\n\r\n").encode())
        head = await asyncio.wait_for(self.reader.readuntil(b"\r\n\r\n"), 20)
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise EOFError("refused")

    def send(self, opcode, payload, fin=True, length=None):
        size = len(payload) if length is None else length
        if size < 126:
            told = bytes([0x80 | size])
        elif size < 65536:
            told = b"\xfe" + struct.pack(">H", size)
        else:
            told = b"\xff" + struct.pack(">Q", size)
        self.writer.write(bytes([(0x80 if fin else 0) | opcode]) + told + bytes(4) + payload)

    def patch(self, size):
        self.rev += 1
        angle = self.chance.uniform(0, 6.28)
        view = {"dataset": self.options.dataset, "image": {"width": size[0], "height": size[1]},
                "camera": {"eye": [2.4 * math.sin(angle), -2.4 * math.cos(angle), 1.2]}}
        self.send(1, json.dumps({"type": "patch", "rev": self.rev, "t": self.rev,
                                 "patch": view}).encode())

    async def message(self):
        first, second = await self.reader.readexactly(2)
        size = second & 0x7F
        if size == 126:
            size = struct.unpack(">H", await self.reader.readexactly(2))[0]
        elif size == 127:
            size = struct.unpack(">Q", await self.reader.readexactly(8))[0]
        payload = await self.reader.readexactly(size)
        if first & 0x0F == 8:
            raise EOFError("closed")
        if first & 0x0F == 9:
            self.send(10, payload)
        return first & 0x0F, payload

    def close(self, reset=False):
        if self.writer is None:
            return
        if reset:
            self.writer.transport.abort()
        else:
            self.writer.close()


class Counts:
    def __init__(self):
        self.came = {"normal": 0, "hostile": 0, "deaf": 0}
        self.refused = self.frames = self.requests = 0
        self.kinds = {}


async def normal(client, counts, until):
    await client.connect(1 << 20)
    await client.upgrade()
    client.patch(client.options.size)
    while time.monotonic() < until:
        opcode, payload = await asyncio.wait_for(client.message(), 60)
        if opcode != 2:
            if b'"unchanged"' in payload or b'"error"' in payload:
                client.patch(client.options.size)
            continue
        counts.frames += 1
        seq = struct.unpack_from("<I", payload, 8)[0]
        client.send(1, json.dumps({"type": "ack", "seq": seq, "decodeMs": 2}).encode())
        await asyncio.sleep(client.chance.uniform(0.2, 2))  # somebody looks at it
        turn = client.chance.random()
        if turn < 0.05:
            client.send(1, json.dumps({"type": "still", "id": client.rev + 1, "width": 64,
                                       "height": 48, "format": "png", "scale": 1}).encode())
        elif turn < 0.15:
            await request(client, counts)
        client.patch(client.options.size)
        await client.writer.drain()
    if client.chance.random() < 0.5:
        client.send(8, struct.pack(">H", 1000))
        await client.writer.drain()


async def request(client, counts):
    """A picture or a saved view by HTTP."""
    reader, writer = await asyncio.open_connection("127.0.0.1", client.port,
                                                   ssl=client.options.context,
                                                   local_addr=(client.address, 0))
    try:
        body = json.dumps({"dataset": client.options.dataset}).encode()
        target, more = client.chance.choice([
            (f"GET /v1/datasets/{client.options.dataset}/frame.jpg?width=64&height=48"
             f"&azimuth={client.chance.uniform(0, 360):.3f}", b""),
            ("GET /metrics", b""), ("GET /v1/datasets", b""), ("POST /v1/views", body)])
        writer.write((f"{target} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n"
                      "Content-Type: application/json\r\n"
                      f"Content-Length: {len(more)}\r\n\r\n").encode() + more)
        answer = await asyncio.wait_for(reader.read(), 30)
        counts.requests += 1
        if b" 201 " in answer[:20]:
            name = json.loads(answer.split(b"\r\n\r\n", 1)[1])["id"]
            await delete(client, name)
    finally:
        writer.close()


async def delete(client, name):
    reader, writer = await asyncio.open_connection("127.0.0.1", client.port,
                                                   ssl=client.options.context,
                                                   local_addr=(client.address, 0))
    writer.write((f"DELETE /v1/views/{name} HTTP/1.1\r\nHost: 127.0.0.1\r\n"
                  "Connection: close\r\n\r\n").encode())
    await asyncio.wait_for(reader.read(), 30)
    writer.close()


async def deaf(client, _counts, until):
    await client.connect(1024)
    await client.upgrade()
    client.writer.transport.pause_reading()  # over TLS Python still takes 256 KiB
    while time.monotonic() < until and not client.writer.is_closing():
        client.patch(DEAF_SIZE)
        await asyncio.wait_for(client.writer.drain(), 5)
        await asyncio.sleep(1)


# --- what hostile ones do ------------------------------------------------------------------------

async def bad_frames(client):
    await client.upgrade()
    spoil = client.chance.choice([(3, b"", True, None), (2, b"xx", True, None),
                                  (1, b"\xff", True, None), (1, b"{}", True, 1 << 63),
                                  (0, b"", True, None), (9, bytes(126), True, None)])
    client.send(*spoil)
    while True:
        await asyncio.wait_for(client.message(), 20)


async def bad_json(client):
    await client.upgrade()
    for _ in range(50):
        client.send(1, client.chance.choice([b"{", b"[" * 4000, b'{"type": "ack", "seq": 1e9}',
                                             b'{"type": "patch", "rev": 1, "patch": {"a": 1}}']))
        await asyncio.wait_for(client.message(), 20)


async def flood(client):
    await client.upgrade()
    for n in range(400):
        client.patch((32, 24))
        if n % 50 == 0:
            await asyncio.wait_for(client.writer.drain(), 20)
            await asyncio.sleep(0.01)


async def half_message(client):
    await client.upgrade()
    client.send(1, b'{"type": "pa', length=4000)
    await client.writer.drain()
    await asyncio.sleep(client.chance.uniform(0, 3))


async def slow_header(client):
    for letter in b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"a" * 100:
        client.writer.write(bytes([letter]))
        await client.writer.drain()
        await asyncio.sleep(0.25)


async def half_open(client):
    client.writer.write(b"POST /v1/frames HTTP/1.1\r\nHost: 127.0.0.1\r\n"
                        b"Content-Length: 100\r\n\r\n{")
    await client.writer.drain()
    client.writer.get_extra_info("socket").shutdown(socket.SHUT_WR)  # over TLS no goodbye of its
    await asyncio.wait_for(client.reader.read(), 20)


async def fragments(client):
    await client.upgrade()
    client.send(1, b"", fin=False)
    for _ in range(2000):
        client.send(0, b"", fin=False)
        await client.writer.drain()
        await asyncio.sleep(0.005)


async def half_handshake(client):
    hello = bytes.fromhex("1603010200010001fc0303") + bytes(32)
    client.writer.write(hello[:client.chance.randrange(1, len(hello))])
    await client.writer.drain()
    await asyncio.sleep(client.chance.uniform(0, 8))


async def no_tls(client):
    client.writer.write(client.chance.choice([b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
                                              b"\x16\x03\x01\xff\xff" + bytes(70000), b"\0"]))
    await asyncio.wait_for(client.reader.read(), 20)


BEFORE_TLS = [half_handshake, no_tls]
HOSTILE = [bad_frames, bad_json, flood, half_message, slow_header, half_open, fragments]


async def hostile(client, counts, until):
    way = client.chance.choice(HOSTILE + (BEFORE_TLS if client.options.context else []))
    counts.kinds[way.__name__] = counts.kinds.get(way.__name__, 0) + 1
    await client.connect(plain=way in BEFORE_TLS)
    await asyncio.wait_for(way(client), max(1, until - time.monotonic()))


WAYS = {"normal": normal, "hostile": hostile, "deaf": deaf}


async def seat(number, options, port, counts, end):
    """One place, taken by one client after the other of its kind."""
    chance = random.Random(number + options.seed)
    kind = {0: "hostile", 1: "deaf"}.get(number % 10, "normal")
    await asyncio.sleep(chance.uniform(0, min(5, options.stay)))
    while time.monotonic() < end:
        client = Client(options, port, chance, number)
        until = min(end, time.monotonic() + chance.uniform(0.2, 1.8) * options.stay)
        counts.came[kind] += 1
        try:
            await WAYS[kind](client, counts, until)
        except GONE as fault:
            if isinstance(fault, EOFError) and "refused" in str(fault):
                counts.refused += 1
                await asyncio.sleep(1)  # as its Retry-After asks, at least
        finally:
            client.close(reset=kind != "normal" or chance.random() < 0.3)
        await asyncio.sleep(chance.uniform(0, 0.5))


# --- what is looked at ---------------------------------------------------------------------------

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
    """MB/hour and its standard error, of one figure a stretch of what came after the warm-up."""
    kept = samples[int(WARM_UP_SHARE * len(samples)):]
    count = min(STRETCHES, len(kept))
    if count < 3:
        return math.nan, math.nan
    points = []
    for n in range(count):
        part = kept[n * len(kept) // count:(n + 1) * len(kept) // count]
        points.append((mean([t for t, _ in part]) / 3600,
                       of_stretch([s["rss"] for _, s in part]) / MB))
    mean_x = sum(x for x, _ in points) / count
    mean_y = sum(y for _, y in points) / count
    square = sum((x - mean_x) ** 2 for x, _ in points)
    rise = sum((x - mean_x) * (y - mean_y) for x, y in points) / square
    rest = sum((y - mean_y - rise * (x - mean_x)) ** 2 for x, y in points)
    return rise, math.sqrt(rest / (count - 2) / square)


def settle(options, daemon, before, failures):
    """Waits until what sessions held is given back."""
    end = time.monotonic() + LEAVE_S
    while True:
        now, sessions = state(daemon.child.pid), metric(options, daemon.port, "windsplat_sessions")
        # The request for the metrics has a descriptor of its own.
        if now["fds"] <= before["fds"] and now["threads"] <= before["threads"] and sessions == 0:
            return now
        if time.monotonic() > end:
            failures.append(f"not back at the start: {now['fds']} descriptors of {before['fds']}, "
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
    print(f"{options.sessions} sessions {how}at a time for {took / 60:.1f} minutes: "
          f"{counts.came['normal']} normal ones came, {counts.came['hostile']} hostile, "
          f"{counts.came['deaf']} that never read; {counts.frames} frames, {counts.requests} "
          f"requests, {counts.refused} refused. Hostile: "
          + ", ".join(f"{n} {name}" for name, n in sorted(counts.kinds.items())) + ".\n")
    print("| | before | most | after |\n|---|---|---|---|")
    print(f"| resident, MB | {before['rss'] / MB:.1f} | {highest / MB:.1f} "
          f"| {after['rss'] / MB:.1f} |")
    for name, key in (("descriptors", "fds"), ("threads", "threads")):
        most = max((s[key] for _, s in samples), default=0)
        print(f"| {name} | {before[key]} | {most} | {after[key]} |")
    print("\nSlope of resident memory after the first quarter: "
          f"{rise:.2f} +- {error:.2f} MB/hour of what stays, "
          f"{rise_of_means:.2f} +- {error_of_means:.2f} of the means")
    if not options.smoke and rise > max(2 * error, options.max_slope):
        failures.append(f"memory grows by {rise:.2f} +- {error:.2f} MB/hour")
    if counts.frames == 0 or counts.requests == 0 and not options.smoke:
        failures.append("no viewer was ever served")


def parsed_options():
    default = pathlib.Path(__file__).resolve().parents[2] / "build/release/windsplat"
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default=str(default))
    parser.add_argument("--dataset", default="tornado:32x32x32")
    parser.add_argument("--minutes", type=float, default=20)
    parser.add_argument("--sessions", type=int, default=200)
    parser.add_argument("--stay", type=float, default=30, help="seconds of a session, about")
    parser.add_argument("--size", default="160x120")
    parser.add_argument("--every", type=float, default=5, help="seconds between samples")
    parser.add_argument("--max-slope", type=float, default=8, help="MB/hour that are no failure")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tls", action="store_true", help="over TLS")
    parser.add_argument("--smoke", action="store_true")
    parser.add_argument("further", nargs="*", help="options of serve, after --")
    options = parser.parse_args()
    if options.smoke:
        options.minutes, options.sessions, options.stay, options.every = 0.1, 30, 2, 0.5
    options.size = tuple(int(word) for word in options.size.split("x"))
    return options


def certificate(options, folder):
    """Options of serve; the clients trust what is made here."""
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
    # A picture first: what is made once is there before anything is counted.
    fetch(options, daemon.port, f"/v1/datasets/{options.dataset}/frame.jpg?width=64&height=48")
    metric(options, daemon.port, "windsplat_sessions")
    time.sleep(0.3)
    before = state(daemon.child.pid)
    asyncio.run(soak(options, daemon, counts, samples, failures))
    if daemon.child.poll() is None:
        after = settle(options, daemon, before, failures)
        report(options, counts, samples, before, after, failures)
    daemon.stop()
    if daemon.child.returncode != 0:
        failures.append(f"the daemon ended with {daemon.child.returncode}")
    print(f"\n{len(failures)} failures" + "".join(f"\n- {text}" for text in failures[:20]))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
