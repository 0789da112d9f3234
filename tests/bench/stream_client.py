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
        self.payload_bytes = 0  # of the newest frame

    def received(self):
        """A message, or a frame, which is acknowledged: (message, None, None, None), or None, its
        number, its revision and whether it is final. The size of its payload is kept."""
        opcode, payload = self.message()
        if opcode == TEXT:
            message = json.loads(payload)
            if message["type"] == "error":
                raise RuntimeError(message)
            return message, None, None, None
        seq, rev, _, flags = struct.unpack_from("<4I", payload, 8)
        self.payload_bytes = len(payload) - 64
        self.say({"type": "ack", "seq": seq, "decodeMs": 1})
        return None, seq, rev, bool(flags & FINAL)

    def final_frame(self, rev):
        """Receives frames until the final one of that revision; returns its payload size."""
        while True:
            message, seq, frame_rev, final = self.received()
            if message:
                if message["type"] == "unchanged" and message["rev"] == rev:
                    return self.final_bytes[message["seq"]]
                continue
            if final:
                self.final_bytes = {seq: self.payload_bytes}
                if frame_rev == rev:
                    return self.final_bytes[seq]

    def turn(self, view, frames):
        for rev in range(1, frames + 1):
            angle = math.radians(20 + rev)
            patch = dict(view, camera={"eye": [2.4 * math.sin(angle), -2.4 * math.cos(angle), 1.6]})
            self.say({"type": "patch", "rev": rev, "t": rev, "patch": patch})
            self.final_frame(rev)
