#!/usr/bin/env python3
"""windsplat convert that is ended, runs out of space, or is given too little memory; and stores
that were changed afterwards.

Usage: interrupted.py --program=PATH [unittest arguments]
"""
import filecmp
import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))
from inputs import read_netcdf, write_pressures, write_raw
from served import taken_program

PROGRAM = taken_program()
SIDES = (36000, 131, 1)  # 5 units for each of two fields


def command(*arguments):
    return [PROGRAM, "convert", *map(str, arguments)]


def run(*arguments, **how):
    return subprocess.run(command(*arguments), capture_output=True, text=True, check=False, **how)


def files_of(folder):
    return {path.relative_to(folder): path for path in sorted(folder.rglob("*")) if path.is_file()}


class Interrupted(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """The source of most tests and the store of a run that nothing interrupts, made once."""
        kept = tempfile.TemporaryDirectory(prefix="windsplat-whole-")
        cls.addClassCleanup(kept.cleanup)
        folder = pathlib.Path(kept.name)
        cls.source, _ = write_raw(folder, "long", SIDES, np.random.default_rng(3), 400)
        cls.whole = folder / "whole.zarr"
        done = run(cls.source, "-o", cls.whole, "--threads", 1)
        assert done.returncode == 0, done.stderr

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="windsplat-interrupted-")
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def ok(self, *arguments, **how):
        done = run(*arguments, **how)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def assert_same(self, one, other):
        files, others = files_of(one), files_of(other)
        self.assertEqual(set(files), set(others))
        for name, path in files.items():
            self.assertTrue(filecmp.cmp(path, others[name], shallow=False), name)

    def lines(self, store):
        journal = store.with_name(store.name + ".part") / ".journal"
        return journal.read_bytes().count(b"\n") - 1 if journal.exists() else 0

    def kill_after(self, units, how, store, *arguments):
        """False: it was complete before."""
        process = subprocess.Popen(command(*arguments, "-o", store), stderr=subprocess.DEVNULL)
        while process.poll() is None and self.lines(store) < units:
            time.sleep(0.002)
        process.send_signal(how)
        return process.wait() != 0

    def test_a_run_that_is_killed_at_any_unit_is_continued_to_equal_bytes(self):
        store = self.folder / "parts.zarr"
        killed = 0
        for units in range(0, 10, 2):
            if not self.kill_after(units, signal.SIGKILL, store, self.source, "--threads",
                                   1 + units // 2 % 3):
                break
            killed += 1
            self.assertFalse(store.exists())
        self.assertGreaterEqual(killed, 4)
        done = self.ok(self.source, "-o", store, "--threads", 2, "-v")
        kept = int(re.search(r"(\d+) of 10 units were there", done.stderr)[1])
        self.assertGreaterEqual(kept, 8)
        self.assert_same(self.whole, store)

    def test_an_interrupt_keeps_what_is_done(self):
        store = self.folder / "out.zarr"
        process = subprocess.Popen(command(self.source, "-o", store, "--threads", 1),
                                   stderr=subprocess.PIPE, text=True)
        while process.poll() is None and self.lines(store) < 3:
            time.sleep(0.001)
        process.send_signal(signal.SIGINT)
        _, text = process.communicate()
        self.assertEqual(process.returncode, 130, text)
        self.assertIn("the same command continues it", text)
        self.assertGreaterEqual(self.lines(store), 3)

    def test_other_options_and_other_input_do_not_continue_it(self):
        source, _ = write_raw(self.folder, "long", SIDES, np.random.default_rng(3), 400)
        store = self.folder / "out.zarr"
        self.assertTrue(self.kill_after(2, signal.SIGKILL, store, source))
        for options, what in ((["--compression", "none"], "compression"),
                              (["--field", "q"], "fields"), (["--zarr-format", 2], "zarr")):
            refused = run(source, "-o", store, *options)
            self.assertEqual(refused.returncode, 1)
            self.assertIn(f"({what}: ", refused.stderr)
            self.assertIn("--restart discards it", refused.stderr)
        with open(self.folder / "long.raw", "r+b") as file:
            file.write(b"\0\0\0\0")
        refused = run(source, "-o", store)
        self.assertIn("(digest of the input: ", refused.stderr)
        self.ok(source, "-o", store, "--restart", "--field", "q")

    def test_a_journal_that_was_cut_off_is_continued(self):
        store = self.folder / "out.zarr"
        self.assertTrue(self.kill_after(6, signal.SIGKILL, store, self.source, "--threads", 1))
        journal = self.folder / "out.zarr.part/.journal"
        text = journal.read_bytes()
        journal.write_bytes(text[:-30])
        files = sorted((self.folder / "out.zarr.part/0").rglob("c/0/*/*/*"))
        files[0].write_bytes(files[0].read_bytes()[:-1])  # its unit is made again
        self.ok(self.source, "-o", store)
        self.assert_same(self.whole, store)

    def test_a_full_disk_ends_it_and_more_space_continues_it(self):
        store = self.folder / "out.zarr"
        # As on a disk without room: a file of this size cannot be written.
        full = run(self.source, "-o", store, preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_FSIZE, (1 << 20, 1 << 20)))
        self.assertEqual(full.returncode, 1, full.stderr)
        self.assertIn("too large", full.stderr)
        self.assertIn("the same command continues it", full.stderr)
        self.assertFalse(store.exists())
        self.ok(self.source, "-o", store)
        self.assert_same(self.whole, store)

    def test_memory_of_all_processes_stays_within_the_limit(self):
        sides = (1024, 1024, 160)  # two and a half times the limit
        document = {"windsplat": "raw", "file": "large.raw", "dims": dict(zip("xyz", sides)),
                    "type": "float32", "endian": "little", "fields": [{"name": "q"}]}
        source = self.folder / "large.json"
        source.write_text(json.dumps(document))
        with open(self.folder / "large.raw", "wb") as file:
            size = 4 * sides[0] * sides[1] * sides[2]
            file.truncate(size)
            for place in (0, 12345678, size - 4):
                file.seek(place // 4 * 4)
                file.write(np.float32(3).tobytes())
        process = subprocess.Popen(
            command(source, "-o", self.folder / "large.zarr", "--memory-limit", "256M"),
            stderr=subprocess.PIPE, text=True)
        most = [0]

        def watch():
            while process.poll() is None:
                most[0] = max(most[0], memory_of(process.pid))
                time.sleep(0.02)
        watcher = threading.Thread(target=watch)
        watcher.start()
        _, text = process.communicate()
        watcher.join()
        self.assertEqual(process.returncode, 0, text)
        print(f"peak of all processes: {most[0] / 1024:.0f} MiB", file=sys.stderr)
        self.assertGreater(most[0], 32 << 10)
        self.assertLess(most[0], 256 << 10, "KiB")

    def test_a_limit_below_one_worker_is_refused_with_one_that_suffices(self):
        source, _ = write_raw(self.folder, "thick", (600, 130, 140), np.random.default_rng(3))
        # Derived fields are read as a whole, by every worker.
        named = subprocess.run([PROGRAM, "inspect", "--json", source], capture_output=True,
                               text=True, check=True)
        derived = [one["name"] for one in json.loads(named.stdout)["fields"]
                   if one["dtype"] == "derived"]
        options = ["-o", self.folder / "out.zarr", "--field", derived[0]]
        refused = run(source, *options, "--memory-limit", "192M")
        self.assertEqual(refused.returncode, 1, refused.stderr)
        enough = re.search(r"--memory-limit (\w+) would suffice", refused.stderr)
        self.assertTrue(enough, refused.stderr)
        self.ok(source, *options, "--memory-limit", enough[1])

    def test_verify_finds_one_flipped_bit_anywhere(self):
        source = write_pressures(self.folder / "gcm.nc", (12, 150, 170), np.random.default_rng(4))
        store = self.folder / "gcm.zarr"
        self.ok(source, "-o", store, "--verify")
        self.assertIn("is sound", self.ok("--verify", store).stderr)
        self.assertIn("is sound", self.ok("--verify", store, source).stderr)
        rng = np.random.default_rng(5)
        files = list(files_of(store).values())
        shards = [path for path in files if "c" in path.relative_to(store).parts]
        chosen = [(path, int(rng.integers(path.stat().st_size))) for path in
                  [*rng.choice(shards, 6), *rng.choice(files, 6), store / "zarr.json",
                   store / "checksums.crc32c"]]
        chosen += [(shards[0], shards[0].stat().st_size - 3)]  # its index
        root = (store / "zarr.json").read_bytes()
        chosen += [(store / "zarr.json", root.index(b'"contents"') + 16)]
        for path, at in chosen:
            whole = path.read_bytes()
            data = bytearray(whole)
            data[at] ^= 1 << int(rng.integers(8))
            path.write_bytes(data)
            changed = run("--verify", store)
            self.assertEqual(changed.returncode, 3, f"{path} {at}: {changed.stderr}")
            path.write_bytes(whole)
        self.assertIn("is sound", self.ok("--verify", store).stderr)
        (store / "1/more").write_text("x")
        self.assertIn("'1/more' does not belong to the store", run("--verify", store).stderr)

    def test_verify_finds_other_numbers_with_right_checksums(self):
        source = write_pressures(self.folder / "gcm.nc", (5, 150, 170), np.random.default_rng(4))
        other = write_pressures(self.folder / "other.nc", (5, 150, 170), np.random.default_rng(6))
        store = self.folder / "gcm.zarr"
        self.ok(source, "-o", store)
        differs = run("--verify", store, other)
        self.assertEqual(differs.returncode, 3)
        self.assertRegex(differs.stderr, "'0/.*' differs from what is made of 'other.nc'")
        self.assertFalse((self.folder / "gcm.zarr.verify").exists())

    def test_stores_of_version_2_are_read_by_xarray(self):
        import xarray
        source = write_pressures(self.folder / "gcm.nc", (20, 150, 170), np.random.default_rng(4))
        store = self.folder / "gcm.zarr"
        self.ok(source, "-o", store, "--zarr-format", 2, "--verify")
        with xarray.open_zarr(str(store), group="0", consolidated=False) as dataset:
            self.assertEqual(dataset["t"].dims, ("time", "level", "lat", "lon"))
            self.assertEqual(str(dataset["time"].values[1])[:13], "2001-01-01T06")
            found = dataset["t"].values
        self.assertTrue(np.array_equal(found, read_netcdf(source, "t", (1, 2)), equal_nan=True))
        with xarray.open_zarr(str(store), group="1", consolidated=False) as dataset:
            self.assertEqual(dataset["t"].shape[-1], 85)


def memory_of(pid):
    """KiB of a process and those that it started, shared pages divided among their users."""
    total = 0
    waiting = [pid]
    while waiting:
        one = waiting.pop()
        try:
            with open(f"/proc/{one}/smaps_rollup", encoding="ascii") as file:
                total += int(re.search(r"^Pss:\s+(\d+)", file.read(), re.M)[1])
            for task in os.listdir(f"/proc/{one}/task"):
                with open(f"/proc/{one}/task/{task}/children", encoding="ascii") as file:
                    waiting += map(int, file.read().split())
        except (OSError, TypeError):
            continue
    return total


if __name__ == "__main__":
    unittest.main()
