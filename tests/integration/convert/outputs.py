#!/usr/bin/env python3
"""What windsplat convert replaces and removes: nothing but stores, with --force, and what it made.

Usage: outputs.py --program=PATH [unittest arguments]
"""
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))
from inputs import write_pressures, write_raw
from served import taken_program

PROGRAM = pathlib.Path(taken_program()).resolve()  # also from another folder


def command(*arguments):
    return [PROGRAM, "convert", *map(str, arguments)]


def run(*arguments, **how):
    return subprocess.run(command(*arguments), capture_output=True, text=True, check=False, **how)


class Outputs(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="windsplat-outputs-")
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def written(self, name, seed=3):
        return write_raw(self.folder, name, (200, 131, 1), np.random.default_rng(seed), 400)[0]

    def long(self):
        """24 units: two fields at 12 steps."""
        return write_pressures(self.folder / "long.nc", (3, 30, 40), np.random.default_rng(4),
                               steps=12)

    def ok(self, *arguments, **how):
        done = run(*arguments, **how)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def refused(self, text, *arguments, code=1, **how):
        done = run(*arguments, **how)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertIn(text, done.stderr)

    def letter_in(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "letter.txt").write_text("dear")
        return folder / "letter.txt"

    def begun(self, store, *arguments, units=1):
        """A run that has made some units."""
        process = subprocess.Popen(command(*arguments, "-o", store, "--threads", 1),
                                   stderr=subprocess.PIPE, text=True)
        journal = store.with_name(store.name + ".part") / ".journal"
        while process.poll() is None and not (
                journal.exists() and journal.read_bytes().count(b"\n") > units):
            time.sleep(0.001)
        self.assertIsNone(process.poll())
        return process

    def test_a_folder_that_appears_during_the_run_is_not_replaced(self):
        source, store = self.long(), self.folder / "out.zarr"
        for options in ([], ["--force"]):
            process = self.begun(store, source, *options)
            letter = self.letter_in(store)
            _, text = process.communicate()
            self.assertEqual(process.returncode, 1, text)
            self.assertIn("the new store is complete in", text)
            self.assertTrue(letter.exists())
            letter.unlink()
            store.rmdir()
            self.ok(source, "-o", store)
            self.ok("--verify", store)
            store.rename(self.folder / f"{len(options)}.old")

    def test_links_and_folders_above_lead_to_the_folder_that_is_looked_at(self):
        source = self.written("small")
        (self.folder / "a/b").mkdir(parents=True)
        (self.folder / "e").mkdir()
        (self.folder / "e/link").symlink_to("../a/b")
        letter = self.letter_in(self.folder / "e/out.zarr")
        self.ok(source, "-o", "link/../out.zarr", cwd=self.folder / "e")
        self.assertTrue(letter.exists())
        self.ok("--verify", self.folder / "a/out.zarr/")
        for name in ("..", ".", "/", "x/..", "x/."):
            self.refused("ends in no name of a folder", source, "-o", name, "--force", code=2,
                         cwd=self.folder / "e")

    def test_the_input_is_not_replaced_and_gets_no_store_within(self):
        source, store = self.written("small"), self.folder / "in.zarr"
        self.ok(source, "-o", store)
        for out in (store, store / "x.zarr", store / "0/x.zarr"):
            for name in (store, store / "0"):
                if name == store / "0" and out == store / "x.zarr":
                    continue
                self.refused("is, contains or is within", name, "-o", out, "--force", code=2)
        inner = self.folder / "in.zarr/small.json"
        for name in ("small.json", "small.raw"):
            (self.folder / name).rename(store / name)
        self.refused("is, contains or is within", inner, "-o", store, "--force", code=2)
        self.assertTrue(inner.exists())

    def test_two_restarts_at_once_do_not_mix(self):
        source, store = self.long(), self.folder / "out.zarr"
        process = self.begun(store, source)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        for _ in range(3):
            runs = [subprocess.Popen(command(source, "-o", store, "--threads", 1, "--restart",
                                             "--force", "--compression", how),
                                     stderr=subprocess.PIPE, text=True)
                    for how in ("lz4", "none")]
            texts = [one.communicate()[1] for one in runs]
            self.assertIn(0, [one.returncode for one in runs], texts)
            self.ok("--verify", store)

    def test_a_run_that_was_ended_after_the_renaming_is_completed(self):
        source, store = self.long(), self.folder / "out.zarr"
        part = self.folder / "out.zarr.part"
        self.ok(source, "-o", store, "--field", "t")
        replaced = self.folder / "replaced"
        store.rename(replaced)
        process = self.begun(store, source)
        letter = self.letter_in(store)  # so that it is not renamed
        process.communicate()
        letter.unlink()
        store.rmdir()
        # As --force has exchanged both: the journal is in the new store.
        part.rename(store)
        replaced.rename(part)
        self.ok(source, "-o", store, "--force")
        self.assertFalse(part.exists())
        self.assertFalse((store / ".journal").exists())
        self.ok("--verify", store)

    def test_an_unfinished_store_that_was_renamed_by_hand_is_not_taken_for_complete(self):
        source, store = self.long(), self.folder / "out.zarr"
        process = self.begun(store, source)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        store.with_name("out.zarr.part").rename(store)
        self.refused("--force replaces it", source, "-o", store)

    def test_verify_removes_only_what_it_made(self):
        source, store = self.written("small"), self.folder / "out.zarr"
        self.ok(source, "-o", store)
        letter = self.letter_in(self.folder / "out.zarr.verify")
        self.ok("--verify", store)
        self.refused("differs", "--verify", store, self.written("other", seed=5), code=3)
        self.assertTrue(letter.exists())
        self.assertEqual([one.name for one in self.folder.glob("*.verify*")], ["out.zarr.verify"])

    def test_workers_keep_within_the_files_that_may_be_open(self):
        # Three units of each field, with five levels that they make.
        source, _ = write_raw(self.folder, "long", (17000, 131, 1), np.random.default_rng(3), 400)
        store = self.folder / "out.zarr"
        for soft, hard in ((50, 4096), (90, 90)):
            self.ok(source, "-o", store, "--threads", 3, "--force",
                    preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard)))
        self.ok("--verify", store)

    def test_a_stride_beyond_the_last_step_gives_the_first(self):
        source = write_pressures(self.folder / "gcm.nc", (3, 20, 30), np.random.default_rng(4))
        self.ok(source, "-o", self.folder / "out.zarr", "--steps", "1:1:2147483647")


if __name__ == "__main__":
    unittest.main()
