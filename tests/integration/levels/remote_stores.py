#!/usr/bin/env python3
"""Zarr stores on other hosts: chunks of shards, fetched by several requests at a time.

Usage: remote_stores.py --program=PATH [unittest arguments]
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))

from data_host_server import DataHost
from served import taken_program

PROGRAM = taken_program()
DELAY_S = 0.02  # of a request, so that requests made at the same time overlap


class Meter:
    """Delays each part that a host sends, and counts how many are under way."""

    def __init__(self):
        self.lock = threading.Lock()
        self.now, self.most = 0, 0

    def __call__(self, first, part, sent):
        with self.lock:
            self.now += 1
            self.most = max(self.most, self.now)
        time.sleep(DELAY_S)
        with self.lock:
            self.now -= 1
        return part


class Gate:
    """Holds the first part of these files that is asked for until parts of all of them were."""

    def __init__(self, host, paths):
        self.host, self.paths = host, {f"/{path}" for path in paths}
        self.came = threading.Condition()
        self.was_held = self.has_opened = False

    def asked(self):
        with self.host.lock:
            return self.paths & {path for path, _, _ in self.host.parts}

    def __call__(self, first, part, sent):
        with self.came:
            self.came.notify_all()
            if self.asked() and not self.was_held:
                self.was_held = True
                self.has_opened = self.came.wait_for(lambda: self.asked() == self.paths, timeout=5)
        return part


class RemoteStores(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="windsplat-stores-"))
        rng = np.random.default_rng(7)
        values = rng.normal(size=(4, 96, 320, 256)).astype("<f4")  # does not compress
        (cls.folder / "noise.bin").write_bytes(values.tobytes())
        (cls.folder / "noise.json").write_text(
            '{"windsplat": "raw", "file": "noise.bin", "type": "float32", "endian": "little",'
            '"dims": {"x": 256, "y": 320, "z": 96}, "steps": {"count": 4},'
            '"fields": [{"name": "a"}]}')
        wind = rng.normal(size=(3, 96, 192, 192)).astype("<f4")
        (cls.folder / "wind.bin").write_bytes(wind.tobytes())
        (cls.folder / "wind.json").write_text(
            '{"windsplat": "raw", "file": "wind.bin", "type": "float32", "endian": "little",'
            '"dims": {"x": 192, "y": 192, "z": 96}, "steps": {"count": 1}, "fields":'
            '[{"name": "wind", "components": ["u", "v", "w"], "layout": "planar"}]}')
        subprocess.run([PROGRAM, "convert", cls.folder / "wind.json", "-o",
                        cls.folder / "wind.zarr"], check=True, capture_output=True)
        (cls.folder / "wind.bin").unlink()
        for version in ("3", "2"):
            subprocess.run([PROGRAM, "convert", cls.folder / "noise.json", "-o",
                            cls.folder / f"v{version}.zarr", "--zarr-format", version], check=True,
                           capture_output=True)
        (cls.folder / "noise.bin").unlink()
        cls.host = DataHost()
        for path in cls.folder.rglob("*"):
            if path.is_file() and ".zarr" in str(path):
                cls.host.files[str(path.relative_to(cls.folder))] = path.read_bytes()

    @classmethod
    def tearDownClass(cls):
        cls.host.end()
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.host.parts = []
        self.host.asked()
        self.meter = self.host.altered = Meter()
        self.cache = pathlib.Path(tempfile.mkdtemp(dir=self.folder)) / "cache"

    def picture(self, name, *options, step=2):
        path = self.cache.parent / "picture.npy"
        done = subprocess.run(
            [PROGRAM, "render", name, "--step", str(step), "--size", "96x64", "-o", path,
             *map(str, options)], capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        return np.load(path)

    def far(self, store, *options, step=2):
        return self.picture(f"{self.host.origin}/{store}", "--allow-private-data-hosts",
                            "--data-cache", self.cache, "--data-host", self.host.origin, *options,
                            step=step)

    def test_chunks_of_a_shard_are_fetched_by_several_requests_at_a_time(self):
        np.testing.assert_array_equal(self.far("v3.zarr"), self.picture(self.folder / "v3.zarr"))
        self.assertGreaterEqual(self.meter.most, 4)
        self.assertLessEqual(self.meter.most, 9, "8 of the daemon, and the reader's own")
        blocks = [(path, first + at) for path, first, count in self.host.parts
                  for at in range(0, count, 1 << 16)]
        self.assertEqual(len(blocks), len(set(blocks)), "nothing is fetched twice")

    def test_opening_reads_no_index_of_a_shard(self):
        subprocess.run([PROGRAM, "inspect", f"{self.host.origin}/v3.zarr", "--ranges", "none",
                        "--allow-private-data-hosts", "--data-cache", self.cache, "--data-host",
                        self.host.origin], check=True, capture_output=True, timeout=60)
        self.assertEqual(self.host.parts, [])

    def test_shards_of_all_components_are_opened_at_the_same_time(self):
        for level, limit in ((0, "1G"), (2, "192M")):
            self.setUp()
            gate = self.host.altered = Gate(
                self.host, [f"wind.zarr/{level}/{name}/c/0/0/0/0" for name in "uvw"])
            self.far("wind.zarr", "--memory-limit", limit, step=0)
            self.assertTrue(gate.has_opened, level)

    def test_of_a_store_only_what_is_read_is_fetched(self):
        self.far("v3.zarr")
        all_bytes = sum(len(body) for name, body in self.host.files.items()
                        if name.startswith("v3.zarr/"))
        self.assertLess(sum(count for _, _, count in self.host.parts), all_bytes / 2)
        shards = [path for path in self.host.asked() if "/a/c/" in path]
        parts = [path for path, _, _ in self.host.parts if "/a/c/" in path]
        self.assertGreater(len(parts), 0)
        self.assertEqual(sorted(shards), sorted(parts), "no shard is sent as a whole")
        self.assertEqual(len(set(shards)), 1, "of one step")

    def test_a_small_cache_holds_what_is_fetched_until_it_is_read(self):
        near = self.picture(self.folder / "v3.zarr")
        limits = ("--data-cache-size", "40M", "--max-download", "40M")
        np.testing.assert_array_equal(self.far("v3.zarr", *limits), near)
        sent = sum(count for _, _, count in self.host.parts)
        self.setUp()
        self.far("v3.zarr")
        self.assertLess(sent, 1.2 * sum(count for _, _, count in self.host.parts))

    def test_files_of_single_chunks_are_the_same(self):
        np.testing.assert_array_equal(self.far("v2.zarr"), self.picture(self.folder / "v2.zarr"))
        asked = [path for path in self.host.asked() if not path.endswith("/zarr.json")]
        self.assertEqual(len(asked), len(set(asked)), "nothing that is there is asked for twice")

    def test_a_part_that_fails_is_the_error_of_the_picture(self):
        self.host.altered = lambda first, part, _: None if first else part
        done = subprocess.run(
            [PROGRAM, "render", f"{self.host.origin}/v3.zarr", "-o", self.cache.parent / "p.png",
             "--allow-private-data-hosts", "--data-cache", self.cache, "--data-host",
             self.host.origin], capture_output=True, text=True, check=False, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("is answered with status 500", done.stderr)


if __name__ == "__main__":
    unittest.main()
