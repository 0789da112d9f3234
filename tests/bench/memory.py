#!/usr/bin/env python3
"""Peak memory of a real daemon: climate's winds and clouds resident, then sessions at 1280 x 720
that turn the camera and take every frame. Table as Markdown on stdout. Linux only (/proc).

Usage: memory.py [--program=windsplat] [--frames=20] [--sessions=4] [--size=1280x720]
       [--dims=320x160x19 | --built-in] [--max-mb=N]

It serves a netCDF file of the sample; with --built-in the sample itself. Exit 1 where the first
session's peak is above N MB."""
import argparse
import base64
import json
import math
import os
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile

MB = 1e6
FINAL = 1  # of a frame header's flags


def status_bytes(pid, key):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(key + ":"):
            return 1024 * int(line.split()[1])
    raise KeyError(key)


class Viewer:
    """A session: as much of RFC 6455 and the stream's protocol as taking frames needs."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=120)
        self.buffer = b""
        self.final_bytes = {}  # by seq, of the newest
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((
            "GET /v1/stream HTTP/1.1\r\n"
            f"Host: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: windsplat.v1\r\n\r\n").encode())
        while b"\r\n\r\n" not in self.buffer:
            self.receive()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise RuntimeError(f"the stream was refused: {head.decode()}")

    def receive(self):
        bytes_ = self.socket.recv(1 << 16)
        if not bytes_:
            raise RuntimeError("the daemon closed the stream")
        self.buffer += bytes_

    def take(self, count):
        while len(self.buffer) < count:
            self.receive()
        out, self.buffer = self.buffer[:count], self.buffer[count:]
        return out

    def say(self, message):
        self.send(1, json.dumps(message).encode())

    def send(self, opcode, payload):
        size = len(payload)
        length = bytes([0x80 | size]) if size < 126 else b"\xfe" + struct.pack(">H", size)
        mask = os.urandom(4)
        masked = bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))
        self.socket.sendall(bytes([0x80 | opcode]) + length + mask + masked)

    def message(self):
        """Opcode of the first fragment and the whole payload; pings are answered."""
        opcode, payload = None, b""
        while True:
            first, second = self.take(2)
            size = second & 0x7F
            if size == 126:
                size = struct.unpack(">H", self.take(2))[0]
            elif size == 127:
                size = struct.unpack(">Q", self.take(8))[0]
            part = self.take(size)
            kind = first & 0x0F
            if kind == 8:
                raise RuntimeError(f"the daemon closed the stream: {part[2:].decode()}")
            if kind == 9:
                self.send(10, part)
            if kind >= 8:
                continue
            opcode = kind or opcode
            payload += part
            if first & 0x80:
                return opcode, payload

    def final_frame(self, rev):
        """Takes frames until the final one that shows that revision; its payload's bytes."""
        while True:
            opcode, payload = self.message()
            if opcode == 1:
                message = json.loads(payload)
                if message["type"] == "error":
                    raise RuntimeError(message)
                if message["type"] == "unchanged" and message["rev"] == rev:
                    return self.final_bytes[message["seq"]]
                continue
            seq, frame_rev, _, flags = struct.unpack_from("<4I", payload, 8)
            self.say({"type": "ack", "seq": seq, "decodeMs": 1})
            if flags & FINAL:
                self.final_bytes = {seq: len(payload) - 64}
                if frame_rev == rev:
                    return self.final_bytes[seq]

    def turn(self, view, frames):
        for rev in range(1, frames + 1):
            angle = math.radians(20 + rev)
            patch = dict(view, camera={"eye": [2.4 * math.sin(angle), -2.4 * math.cos(angle), 1.6]})
            self.say({"type": "patch", "rev": rev, "t": rev, "patch": patch})
            self.final_frame(rev)


class Daemon:
    def __init__(self, program, dataset):
        self.child = subprocess.Popen([program, "serve", "--listen", "127.0.0.1:0", dataset],
                                      stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        url = self.child.stdout.readline()
        if not url:
            sys.exit("memory.py: the daemon did not start")
        self.port = int(url.rstrip().rstrip("/").rsplit(":", 1)[1])

    def memory(self):
        return {key: status_bytes(self.child.pid, key) for key in ("VmRSS", "VmHWM")}

    def stop(self):
        self.child.terminate()
        self.child.wait()


def measure(daemon, options):
    """Rows of name, resident and peak bytes; and the resident bytes a further session costs."""
    width, height = map(int, options.size.split("x"))
    rows = [("started, nothing loaded", daemon.memory())]
    first = Viewer(daemon.port)
    first.turn({"dataset": "climate", "image": {"width": 1, "height": 1}}, 1)
    rows.append(("winds + clouds resident", daemon.memory()))
    view = {"dataset": "climate", "image": {"width": width, "height": height}}
    first.turn(view, options.frames)
    rows.append((f"1 session, {options.size}, {options.frames} final frames", daemon.memory()))
    idle = []
    for _ in range(options.sessions - 1):
        idle.append(Viewer(daemon.port))
        idle[-1].turn(view, 2)
    rows.append((f"{options.sessions} sessions, {options.size}", daemon.memory()))
    return rows


def main():
    default = pathlib.Path(__file__).resolve().parents[2] / "build/release/windsplat"
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(default))
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--sessions", type=int, default=4)
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--dims", default="320x160x19")
    parser.add_argument("--built-in", action="store_true")
    parser.add_argument("--max-mb", type=float)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        dataset = f"{folder}/climate.nc"
        subprocess.run([options.program, "synth", "climate", "--steps", "1", "--dims", options.dims,
                        "-o", dataset], check=True)
        daemon = Daemon(options.program, "climate" if options.built_in else dataset)
        try:
            rows = measure(daemon, options)
        finally:
            daemon.stop()
    print("| daemon | resident, MB | peak, MB |\n|---|---|---|")
    for name, memory in rows:
        print(f"| {name} | {memory['VmRSS'] / MB:.1f} | {memory['VmHWM'] / MB:.1f} |")
    voxels = math.prod(map(int, options.dims.split("x")))
    resident = [memory["VmRSS"] for _, memory in rows]
    print(f"\nBytes a voxel resident: {(resident[1] - resident[0]) / voxels:.1f} "
          "(winds and clouds, with what reading them leaves behind)")
    if options.sessions > 1:
        more = (resident[3] - resident[2]) / (options.sessions - 1)
        print(f"Bytes a further session: {more / MB:.2f} MB")
    peak = rows[2][1]["VmHWM"] / MB
    if options.max_mb is not None and peak > options.max_mb:
        sys.exit(f"memory.py: the peak, {peak:.1f} MB, is above {options.max_mb:g} MB")


main()
