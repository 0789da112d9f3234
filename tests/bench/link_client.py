"""A client of the stream that simulates a drag and records the frames it receives. One thread
reads, another sends the camera changes."""
import json
import pathlib
import socket
import struct
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "edge"))
from wire_client import BINARY, TEXT, Closed, Target, WebSocket  # noqa: E402

FINAL = 1  # bits of the frame header's flags
KEY = 16
H264 = 3  # codec of the frame header
FRAME_HEADER_BYTES = 64


class Frame:
    """A frame as it arrived. Times in seconds."""

    def __init__(self, payload, text_bytes, now):
        self.seq, self.rev, _, flags = struct.unpack_from("<4I", payload, 8)
        self.width, self.height = struct.unpack_from("<2H", payload, 24)
        self.codec, self.quality, self.level = payload[28], payload[29], payload[31]
        self.key = bool(flags & KEY)
        self.queue_s, self.render_s, self.encode_s = (
            us * 1e-6 for us in struct.unpack_from("<3I", payload, 40))
        self.t = struct.unpack_from("<d", payload, 56)[0] * 1e-3
        self.final = bool(flags & FINAL)
        self.bytes = len(payload)
        self.wire_bytes = len(payload) + text_bytes
        self.arrived = now


class LinkViewer(WebSocket):
    def __init__(self, host, port):
        super().__init__(Target(host, port), 60)
        self.frames = []
        self.waits = {}   # id of an open -> time it was sent
        self.answers = []  # seconds from request to answer
        self.fault = None
        self.open = True
        self.rev = 0
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def announce_video(self):
        self.say({"type": "video", "codecs": ["avc1.640033"]})

    def patch(self, patch):
        self.rev += 1
        self.say({"type": "patch", "rev": self.rev, "t": time.monotonic() * 1e3, "patch": patch})

    def ask(self):
        """Sends a request that is answered at once, with an error that contains the id."""
        number = 1000 + len(self.answers) + len(self.waits)
        self.waits[number] = time.monotonic()
        self.say({"type": "open", "id": number, "dataset": "nowhere"})

    def read(self):
        text_bytes = 0
        try:
            while True:
                opcode, payload = self.message()
                now = time.monotonic()
                if opcode == TEXT:
                    text_bytes += len(payload) + 4
                    self.on_text(json.loads(payload), now)
                elif opcode == BINARY:
                    frame = Frame(payload, text_bytes, now)
                    self.say({"type": "ack", "seq": frame.seq, "decodeMs": 0})
                    self.frames.append(frame)
                    text_bytes = 0
        except (OSError, Closed) as fault:
            if self.open:
                self.fault = fault

    def on_text(self, message, now):
        if message["type"] != "error":
            return
        asked = self.waits.pop(message.get("id"), None)
        if asked is None:
            self.fault = RuntimeError(message)
        else:
            self.answers.append(now - asked)

    def wait_for_final(self, seconds):
        """The final frame of the newest rev, or None."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if self.fault:
                raise self.fault
            for frame in self.frames[-2:]:
                if frame.final and frame.rev == self.rev:
                    return frame
            time.sleep(0.002)
        return None

    def close(self):
        self.open = False
        self.socket.shutdown(socket.SHUT_RDWR)
        self.reader.join()
        self.socket.close()
