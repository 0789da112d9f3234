#!/usr/bin/env python3
"""Measures how soon a Zarr store on another host is drawn: a host on loopback that delays each
request and limits the bytes per second. Prints a Markdown table.

Usage: remote_store.py [--program=windsplat ...] [--store=F.zarr] [--side=384] [--size=640x480]
       [--memory-limit=256M] [--delay=0.05] [--rate=12.5e6] [--runs=1] [--folder=DIR]

Without --store a wind and a cloud of that side are converted. Each row is `render` with an empty
cache of fetched files: of the store on disk, of the host as it is, and of the host when it answers
one request after the other, as if nothing were fetched ahead. Seconds (the least of the runs),
their ratio to those of the host as it is, requests, how many were under way at a time, and bytes
sent, also as a share of the store and as the seconds that they take alone."""
import argparse
import contextlib
import http.server
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from first_frame import write_raw  # noqa: E402

MEBI = 1 << 20
PIECE = 1 << 14  # bytes sent at a time


class Link:
    """What all connections share: the line, and counts of what was asked for."""

    def __init__(self, delay, rate, at_a_time=None):
        self.delay, self.rate = delay, rate
        self.turns = threading.Semaphore(at_a_time) if at_a_time else contextlib.nullcontext()
        self.lock = threading.Lock()
        self.free_at = 0.0
        self.requests = self.sent = self.now = self.most = 0

    @contextlib.contextmanager
    def request(self):
        with self.turns:
            with self.lock:
                self.requests += 1
                self.now += 1
                self.most = max(self.most, self.now)
            time.sleep(self.delay)
            try:
                yield
            finally:
                with self.lock:
                    self.now -= 1

    def wait_for(self, count):
        with self.lock:
            begun = time.monotonic()
            self.free_at = max(self.free_at, begun) + count / self.rate
            self.sent += count
        time.sleep(max(0.0, self.free_at - begun))


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    wbufsize = -1

    def log_message(self, *_):
        pass

    def setup(self):
        super().setup()
        time.sleep(self.server.link.delay)  # of the connection

    def do_GET(self):
        with self.server.link.request(), contextlib.suppress(OSError):
            self.answer(self.server.folder / self.path.lstrip("/"))

    def answer(self, path):
        if not path.is_file():
            self.send_response(404)
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        size, wanted = path.stat().st_size, self.headers.get("Range")
        first, last = 0, size - 1
        if wanted:
            first, last = map(int, wanted.removeprefix("bytes=").split("-"))
        with open(path, "rb") as file:
            file.seek(first)
            body = file.read(last + 1 - first)
        self.send_response(206 if wanted else 200)
        if wanted:
            self.send_header("Content-Range", f"bytes {first}-{first + len(body) - 1}/{size}")
        self.send_header("ETag", f'"{path.stat().st_mtime_ns}"')
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        for at in range(0, len(body), PIECE):
            self.server.link.wait_for(len(body[at:at + PIECE]))
            self.wfile.write(body[at:at + PIECE])


@contextlib.contextmanager
def serving(folder, link):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads, server.folder, server.link = True, folder, link
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()


def rendered(program, store, folder, options, far=()):
    begun = time.monotonic()
    subprocess.run([program, "render", store, "--size", options.size, "-o", folder / "picture.png",
                    "--memory-limit", options.memory_limit, *far], check=True,
                   stdout=subprocess.DEVNULL)
    return time.monotonic() - begun


def measured(program, store, options, at_a_time):
    """The least seconds of the runs, and the link of that run."""
    best = None
    for _ in range(options.runs):
        link = Link(options.delay, options.rate, at_a_time)
        with tempfile.TemporaryDirectory(dir=options.folder) as cache, \
                serving(store.parent, link) as origin:
            far = ("--data-host", origin, "--allow-private-data-hosts", "--data-cache", cache)
            taken = rendered(program, f"{origin}/{store.name}", pathlib.Path(cache), options, far)
        if best is None or taken < best[0]:
            best = taken, link
    return best


def made_store(program, folder, side):
    raw = write_raw(folder, "far", side, [("wind", 3, 10, 0), ("cloud", 1, 20, 0.8)])
    store = folder / "far.zarr"
    subprocess.run([program, "convert", raw, "-o", store], check=True, stdout=subprocess.DEVNULL)
    raw.with_suffix(".bin").unlink()
    return store


def table(program, store, options):
    stored = sum(path.stat().st_size for path in store.rglob("*") if path.is_file())
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        near = min(rendered(program, store, pathlib.Path(folder), options)
                   for _ in range(options.runs))
    rows = [(name, *measured(program, store, options, limit))
            for name, limit in (("host", None), ("host, one at a time", 1))]
    print(f"{program}: {store.name} of {stored / MEBI:.0f} MiB, {options.delay * 1e3:.0f} ms, "
          f"{options.rate * 8 / 1e6:.0f} Mbit/s, memory {options.memory_limit}\n")
    print("| store | seconds | ratio | requests | at a time | MiB | share | their seconds |")
    print("|---|---|---|---|---|---|---|---|")
    far = rows[0][1]
    print(f"| on disk | {near:.2f} | {near / far:.2f} | | | | | |")
    for name, taken, link in rows:
        print(f"| {name} | {taken:.2f} | {taken / far:.2f} | {link.requests} | {link.most} | "
              f"{link.sent / MEBI:.1f} | {link.sent / stored:.3f} | "
              f"{link.sent / options.rate:.2f} |")
    print(flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--program", action="append")
    parser.add_argument("--store", type=pathlib.Path)
    parser.add_argument("--side", type=int, default=384)
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--memory-limit", default="256M")
    parser.add_argument("--delay", type=float, default=0.05)
    parser.add_argument("--rate", type=float, default=12.5e6)
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--folder")
    options = parser.parse_args()
    programs = options.program or ["windsplat"]
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        store = options.store or made_store(programs[0], pathlib.Path(folder), options.side)
        for program in programs:
            table(program, store.resolve(), options)


if __name__ == "__main__":
    main()
