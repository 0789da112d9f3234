#!/usr/bin/env python3
"""Streams of a store that exceeds the memory: a drag does not wait for the parts that it needs, and
final frames are those of requests for single pictures.

Usage: stand_ins.py --program=PATH [unittest arguments]
"""
import json
import os
import pathlib
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "edge"))

import numpy as np

from levels import CHAIN, LARGE, LIMIT, PROGRAM, made
from served import Daemon
from stores import write_store
from wire_client import TEXT, Target, WebSocket

FINAL = 1
HEADER = 6  # place of its length in a frame


class Session(WebSocket):
    """A session that says what it receives: (rev, whether it is final, report, picture)."""

    def __init__(self, daemon):
        super().__init__(Target("127.0.0.1", int(daemon.host.rpartition(":")[2])), 60, 0)
        self.rev = 0
        self.chosen = {}
        self.stood_in = 0

    def patch(self, patch):
        self.rev += 1
        self.say({"type": "patch", "rev": self.rev, "t": 0, "patch": patch})
        return self.rev

    def next_frame(self):
        while True:
            opcode, payload = self.message()
            if opcode != TEXT:
                break
            message = json.loads(payload)
            assert message["type"] != "error", message
            if message["type"] == "chosen":
                self.chosen[message["seq"]] = message
        seq, rev, _, flags = struct.unpack_from("<4I", payload, 8)
        self.say({"type": "ack", "seq": seq, "decodeMs": 1})
        self.stood_in += "missingBytes" in self.chosen[seq].get("detail", {})
        length = struct.unpack_from("<H", payload, HEADER)[0]
        return rev, bool(flags & FINAL), self.chosen.pop(seq), payload[length:]

    def frame_of(self, rev, final=False):
        while True:
            found = self.next_frame()
            if found[0] == rev and (found[1] or not final):
                return found


def looking_at(x, z, height=0.05):
    return {"projection": "orthographic", "eye": [x, -2, z], "target": [x, 0, z],
            "height": height}


VIEW = {"dataset": "large_store", "vector": {"field": None}, "quality": {"lossless": True},
        "scalars": [{"field": "cloud", "color": {"range": [0, 1e-3]},
                     "extinction": [[0, 0.1], [1e-3, 40]]}],
        "image": {"width": 160, "height": 120}, "camera": looking_at(-0.8, -0.4)}


class StandIns(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="windsplat-stand-ins-")
        store = pathlib.Path(cls.folder.name) / "large_store.zarr"
        axes = [100.0 * np.arange(n) for n in LARGE]
        write_store(store, made(LARGE, 1, masked=False), axes, 1, CHAIN, 3)
        cls.store = store
        cls.daemon = Daemon(PROGRAM, store, f"--memory-limit={LIMIT}M")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.end()
        cls.folder.cleanup()

    def signal_loaders(self, which):
        found = subprocess.run(["pgrep", "-P", str(self.daemon.process.pid)],
                               capture_output=True, text=True, check=True).stdout.split()
        for process in found:
            os.kill(int(process), which)
        return len(found)

    def picture(self, view):
        answer = self.daemon.ask("POST", "/v1/frames", json.dumps(view),
                                 {"Content-Type": "application/json", "Accept": "image/png"})
        self.assertEqual(answer.status, 200, answer.body[:2000])
        return answer.body

    def settled(self, session):
        """Moves the view a little, and waits until the level that stands in is in memory too."""
        session.frame_of(session.patch(VIEW), final=True)
        session.frame_of(session.patch({"camera": looking_at(-0.8001, -0.4)}), final=True)
        before = None
        while before != (reads := self.reads()) or self.daemon.metric("windsplat_bricks_waiting"):
            before = reads
            time.sleep(1)

    def reads(self):
        metrics = self.daemon.get("/metrics").body.decode()
        return [line for line in metrics.splitlines()
                if line.startswith("windsplat_volume_loads_total")]

    def test_a_drag_goes_on_while_the_loader_hangs_and_says_what_is_missing(self):
        session = Session(self.daemon)
        self.addCleanup(session.close)
        self.settled(session)
        stood_in = self.daemon.metric("windsplat_frames_stand_in_total") - session.stood_in
        self.assertEqual(self.daemon.metric("windsplat_bricks_waiting"), 0)
        self.assertGreater(self.signal_loaders(signal.SIGSTOP), 0)
        try:
            begin = time.monotonic()
            missing = []
            for n in range(40):
                camera = looking_at(-0.8 + 0.04 * n, -0.4 + 0.02 * n)
                rev = session.patch({"camera": camera})
                _, final, chosen, _ = session.frame_of(rev)
                self.assertFalse(final)
                missing.append(chosen["detail"].get("missingBytes", 0))
                if missing[-1] > 0:
                    self.assertGreater(chosen["detail"]["drawn"]["halvings"], [0, 0, 0])
                if n % 10 == 9:
                    time.sleep(0.4)  # the final frame waits, until the drag goes on
            self.assertLess(time.monotonic() - begin, 15)
            self.assertGreater(sum(n > 0 for n in missing), 20)
            self.assertGreater(self.daemon.metric("windsplat_bricks_waiting"), 0)
        finally:
            self.signal_loaders(signal.SIGCONT)
        _, _, chosen, picture = session.frame_of(rev, final=True)
        self.assertNotIn("missingBytes", chosen["detail"])
        self.assertEqual(self.daemon.metric("windsplat_frames_stand_in_total"),
                         stood_in + session.stood_in)
        self.assertEqual(picture, self.picture({**VIEW, "camera": camera}))

    def test_the_first_picture_is_one_of_a_level_that_takes_little(self):
        with Daemon(PROGRAM, self.store, f"--memory-limit={LIMIT}M") as daemon:
            session = Session(daemon)
            self.addCleanup(session.close)
            rev = session.patch(VIEW)
            _, final, first, _ = session.frame_of(rev)
            self.assertFalse(final)
            self.assertEqual(first["detail"]["wanted"]["halvings"], [0, 0, 0])
            self.assertGreaterEqual(first["detail"]["drawn"]["halvings"], [2, 2, 2])
            self.assertGreater(first["detail"]["missingBytes"], 0)
            _, _, last, picture = session.frame_of(rev, final=True)
            self.assertEqual(last["detail"]["drawn"]["halvings"], [0, 0, 0])
            self.assertEqual(picture, self.picture(VIEW))

    def test_what_is_missing_arrives_while_the_view_moves(self):
        session = Session(self.daemon)
        self.addCleanup(session.close)
        self.settled(session)
        for n in range(1000):
            camera = looking_at(0.7 + 1e-5 * n, 0.4)
            _, final, chosen, _ = session.frame_of(session.patch({"camera": camera}))
            self.assertFalse(final)
            if "missingBytes" not in chosen["detail"]:
                break
            time.sleep(0.01)
        self.assertEqual(chosen["detail"]["drawn"]["halvings"], [0, 0, 0])
        self.assertGreater(n, 0)

    def test_final_frames_do_not_depend_on_earlier_cameras(self):
        rng = random.Random(5)
        session = Session(self.daemon)
        self.addCleanup(session.close)
        session.patch(VIEW)
        for _ in range(12):
            for _ in range(rng.randrange(1, 6)):
                camera = looking_at(rng.uniform(-0.9, 0.9), rng.uniform(-0.5, 0.5),
                                    rng.choice((0.03, 0.1, 0.3)))
                rev = session.patch({"camera": camera})
                session.frame_of(rev)
            _, _, chosen, picture = session.frame_of(rev, final=True)
            self.assertNotIn("missingBytes", chosen["detail"])
            self.assertEqual(picture, self.picture({**VIEW, "camera": camera}))


if __name__ == "__main__":
    unittest.main()
