"""Shared by the benchmarks: a daemon, and a session that receives frames."""
import json
import math
import pathlib
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "edge"))
from wire_client import TEXT, Daemon, Target, WebSocket, status_bytes  # noqa: E402, F401

FINAL = 1  # bit of the frame header's flags


class Viewer(WebSocket):
    """A session that implements the part of the protocol needed to receive frames."""

    def __init__(self, port, receive_buffer=0):
        super().__init__(Target("127.0.0.1", port), 120, receive_buffer)
        self.final_bytes = {}  # payload size of the newest final frame, by seq

    def final_frame(self, rev):
        """Receives frames until the final one of that revision; returns its payload size."""
        while True:
            opcode, payload = self.message()
            if opcode == TEXT:
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
