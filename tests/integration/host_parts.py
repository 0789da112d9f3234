#!/usr/bin/env python3
"""Large files on other hosts: only the parts that are read are fetched, all of one state.

Usage: host_parts.py --program=PATH [unittest arguments]
"""
import http.client
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.parse
import urllib.request

import netCDF4
import numpy as np

from data_host_server import DataHost

PROGRAM = None
FIELDS, STEPS, SHAPE = 8, 3, (8, 96, 128)  # 393216 bytes a field and step


def values(field, step):
    rng = np.random.default_rng(100 * field + step)
    return rng.normal(size=SHAPE).astype("f4")


def write(path, kind, first_field=0):
    with netCDF4.Dataset(path, "w", format=kind) as file:
        axes = {"time": (STEPS, "hours since 2000-01-01"), "z": (SHAPE[0], "m"),
                "y": (SHAPE[1], "m"), "x": (SHAPE[2], "m")}
        names = {"z": "height", "y": "projection_y_coordinate", "x": "projection_x_coordinate"}
        for name, (count, units) in axes.items():
            file.createDimension(name, count)
            axis = file.createVariable(name, "f8", (name,))
            axis.units = units
            if name in names:
                axis.standard_name = names[name]
            axis[:] = np.arange(count) * 100
        for field in range(FIELDS):
            chunks = {"chunksizes": (1, *SHAPE)} if kind == "NETCDF4" else {}
            variable = file.createVariable(f"f{field}", "f4", tuple(axes), **chunks)
            variable.units = "1"
            for step in range(STEPS):
                variable[step] = values(first_field + field, step)


def job_of(root, url):
    request = urllib.request.Request(root + "v1/datasets", json.dumps({"path": url}).encode(),
                                     {"Content-Type": "application/json"})
    with urllib.request.urlopen(request) as response:
        return json.load(response)["id"]


def state_of(root, job):
    with urllib.request.urlopen(f"{root}v1/jobs/{job}") as response:
        return json.load(response)


class Daemon:
    def __init__(self, *arguments):
        self.process = subprocess.Popen([PROGRAM, "serve", *arguments, "--listen", "127.0.0.1:0"],
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                        text=True)
        self.root = self.process.stdout.readline().strip()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()

    def get(self, path):
        """Status and body."""
        client = http.client.HTTPConnection(urllib.parse.urlsplit(self.root).netloc, timeout=30)
        client.request("GET", path)
        answer = client.getresponse()
        out = answer.status, answer.read()
        client.close()
        return out

    def finished(self, job, seconds=10):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            state = state_of(self.root, job)
            if state["state"] not in ("queued", "running"):
                return state
            time.sleep(0.02)
        raise AssertionError(state)


class HostParts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="windsplat-parts-"))
        cls.host = DataHost()
        cls.bodies = {}
        for name, kind in (("four.nc", "NETCDF4"), ("classic.nc", "NETCDF3_64BIT_OFFSET")):
            write(cls.folder / name, kind)
            cls.bodies[name] = (cls.folder / name).read_bytes()
        write(cls.folder / "other.nc", "NETCDF4", first_field=50)

    @classmethod
    def tearDownClass(cls):
        cls.host.end()
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.host.files = dict(self.bodies)
        self.host.ranges, self.host.if_range = True, True
        self.host.etag_mark, self.host.date = "", ""
        self.host.parts, self.host.stalled, self.host.altered = [], set(), None
        self.host.asked()
        self.cache = pathlib.Path(tempfile.mkdtemp(dir=self.folder)) / "cache"

    def options(self):
        return ["--allow-private-data-hosts", "--data-cache", self.cache, "--data-host",
                self.host.origin]

    def run_program(self, *arguments):
        clean = {key: value for key, value in os.environ.items()
                 if not key.startswith(("AWS_", "WINDSPLAT_"))}
        return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True,
                              check=False, timeout=60, env=clean)

    def picture(self, dataset, field, step, *options):
        path = self.cache.parent / "picture.npy"
        done = self.run_program("render", dataset, "--step", step, "--set",
                                f'/scalars=[{{"field": "f{field}"}}]', "--size", "64x48", "-o",
                                path, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return np.load(path)

    def left_in_cache(self):
        return [path.name for path in self.cache.iterdir()]

    def test_only_the_parts_that_are_read_are_fetched(self):
        for name, body in self.bodies.items():
            with self.subTest(name):
                self.host.parts = []
                self.host.asked()
                for field, step in ((2, 1), (5, 2)):
                    np.testing.assert_array_equal(
                        self.picture(f"{self.host.origin}/{name}", field, step, *self.options()),
                        self.picture(self.folder / name, field, step))
                sent = sum(part[2] for part in self.host.parts)
                self.assertLess(sent / 2, len(body) / 2, "of two programs")
                self.assertEqual(len(self.host.asked()), len(self.host.parts))
                self.assertEqual(self.left_in_cache(), [], "parts have no names")

    def test_parts_are_kept_while_the_daemon_runs(self):
        with Daemon(self.host.origin + "/four.nc", *self.options()) as daemon:
            frame = "/v1/datasets/four/frame.npy?width=64&height=48&step="
            first = daemon.get(frame + "1")
            sent = len(self.host.parts)
            self.assertEqual(first[0], 200, first[1])
            request = urllib.request.Request(daemon.root + "v1/datasets/four", method="DELETE")
            urllib.request.urlopen(request).close()  # drops what is in memory
            self.assertEqual(daemon.get(frame + "1"), first)
            self.assertEqual(len(self.host.parts), sent)
        self.assertEqual(self.left_in_cache(), [], "also if it is killed")

    def test_a_file_that_changes_is_an_error_and_never_a_mixture(self):
        frame = "/v1/datasets/four/frame.npy?width=64&height=48&step="
        for heeds in (True, False):
            with self.subTest(if_range=heeds):
                self.setUp()
                self.host.if_range = heeds
                with Daemon(self.host.origin + "/four.nc", *self.options()) as daemon:
                    before = daemon.get(frame + "0")
                    self.assertEqual(before[0], 200)
                    self.host.files["four.nc"] = (self.folder / "other.nc").read_bytes()
                    self.assertEqual(len(self.host.files["four.nc"]), len(self.bodies["four.nc"]),
                                     "only the ETag tells")
                    status, body = daemon.get(frame + "2")
                    self.assertNotEqual(status, 200)
                    self.assertIn("has changed on its host since it was opened",
                                  json.loads(body)["detail"])
                    self.assertEqual(daemon.get(frame + "0"), before)

    def test_a_longer_file_can_be_opened_after_the_error(self):
        frame = "/v1/datasets/four/frame.npy?width=64&height=48&step="
        url = self.host.origin + "/four.nc"
        with Daemon("tornado", *self.options()) as daemon:
            daemon.finished(job_of(daemon.root, url))
            before = daemon.get(frame + "0")
            self.assertEqual(before[0], 200, before[1])
            other = (self.folder / "other.nc").read_bytes()
            self.host.files["four.nc"] = other + bytes(100_000)
            status, body = daemon.get(frame + "2")
            self.assertEqual(status, 422, body)
            self.assertIn("has changed on its host since it was opened",
                          json.loads(body)["detail"])
            request = urllib.request.Request(daemon.root + "v1/datasets/four?forget=true",
                                             method="DELETE")
            urllib.request.urlopen(request).close()
            state = daemon.finished(job_of(daemon.root, url))
            self.assertEqual(state["state"], "done", state)
            after = daemon.get(frame + "0")
            self.assertEqual(after[0], 200, after[1])
            self.assertNotEqual(after, before)

    def test_parts_that_do_not_fit_together_are_replaced_by_the_whole_file(self):
        def tagged(tag):
            def alter(first, part, sent):
                sent["ETag"] = tag if first else sent["ETag"]
                return part
            return alter
        near = self.picture(self.folder / "four.nc", 2, 1)
        for name, altered in (
                ("no ETag", tagged(None)), ("weak ETag", tagged('W/"1"')),
                ("mirror", tagged('"of a mirror"')),
                ("longer", lambda first, part, _: part + b"xxxx" if first else part),
                ("shorter", lambda first, part, _: part[:-4] if first else part),
                ("empty", lambda first, part, _: b""),
                ("empty later", lambda first, part, _: b"" if first else part)):
            with self.subTest(name):
                self.setUp()
                self.host.altered = altered
                np.testing.assert_array_equal(
                    self.picture(self.host.origin + "/four.nc", 2, 1, *self.options()), near)
                self.assertLessEqual(len(self.host.asked()), 4)
                self.assertIn(len(self.bodies["four.nc"]),
                              [path.stat().st_size for path in self.cache.iterdir()])

    def test_a_part_that_fails_ends_the_reading(self):
        self.host.altered = lambda first, part, _: None if first else part
        self.assertIn("is answered with status 500", self.refusal("/four.nc"))
        self.assertLessEqual(len(self.host.asked()), 2)

    def test_a_coded_part_is_refused_as_such(self):
        def alter(first, part, sent):
            if first:
                sent |= {"Content_Encoding": "gzip", "ETag": 'W/"coded"'}
            return part[:100] if first else part
        self.host.altered = alter
        self.assertIn("content coding 'gzip'", self.refusal("/four.nc"))

    def inspect_all(self, *options):
        return self.run_program("inspect", self.host.origin + "/classic.nc", "--ranges", "all",
                                *options, *self.options())

    def test_a_file_that_was_read_to_its_end_is_kept(self):
        first = self.inspect_all()
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertIn(len(self.bodies["classic.nc"]),
                      [path.stat().st_size for path in self.cache.iterdir()])
        self.host.parts = []
        self.host.asked()
        again = self.inspect_all()
        self.assertEqual(again.stdout, first.stdout)
        self.assertEqual((self.host.parts, len(self.host.asked())), ([], 1), "confirmed only")

    def test_a_whole_file_that_left_the_cache_while_in_use_is_still_the_same(self):
        self.assertEqual(self.inspect_all().returncode, 0)
        self.host.parts = []
        frame = "/v1/datasets/classic/frame.npy?width=64&height=48&step="
        with Daemon(self.host.origin + "/classic.nc", *self.options()) as daemon:
            self.assertEqual(daemon.get(frame + "0")[0], 200)
            self.assertEqual(self.host.parts, [], "the file is in the cache")
            for path in self.cache.iterdir():
                path.unlink()
            children = pathlib.Path(f"/proc/{daemon.process.pid}/task/{daemon.process.pid}/"
                                    "children").read_text().split()
            self.assertTrue(children, "a loader")
            for child in children:
                os.kill(int(child), signal.SIGKILL)
            status, body = daemon.get(frame + "1")
            if status != 200:  # the call during which the loader ended
                status, body = daemon.get(frame + "1")
            self.assertEqual(status, 200, body)

    def test_whole_files_are_fetched_where_parts_have_no_state(self):
        for what in ({"ranges": False}, {"etag_mark": "W/"},
                     {"date": "Wed, 01 Jan 2020 00:00:00 GMT"}):
            with self.subTest(**what):
                self.setUp()
                for name, value in what.items():
                    setattr(self.host, name, value)
                np.testing.assert_array_equal(
                    self.picture(self.host.origin + "/four.nc", 2, 1, *self.options()),
                    self.picture(self.folder / "four.nc", 2, 1))
                self.assertIn(len(self.bodies["four.nc"]),
                              [path.stat().st_size for path in self.cache.iterdir()])

    def test_an_older_file_is_told_from_a_newer_one_by_its_date(self):
        self.host.date = "Wed, 01 Jan 2020 00:00:00 GMT"
        url = self.host.origin + "/four.nc"
        newer = self.picture(url, 2, 1, *self.options())
        np.testing.assert_array_equal(self.picture(url, 2, 1, *self.options()), newer)
        self.host.date = "Tue, 01 Jan 2019 00:00:00 GMT"
        self.host.files["four.nc"] = (self.folder / "other.nc").read_bytes()
        np.testing.assert_array_equal(self.picture(url, 2, 1, *self.options()),
                                      self.picture(self.folder / "other.nc", 2, 1))

    def test_parts_of_a_file_are_limited_and_its_size_is_not(self):
        size = str(len(self.bodies["classic.nc"]) // 2)
        self.picture(self.host.origin + "/classic.nc", 2, 1, "--max-download", size,
                     *self.options())
        done = self.run_program("inspect", self.host.origin + "/classic.nc", "--ranges", "all",
                                "--max-download", size, *self.options())
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("--max-download", done.stderr)

    def refusal(self, path):
        done = self.run_program("inspect", self.host.origin + path, *self.options())
        self.assertNotEqual(done.returncode, 0)
        return done.stderr

    def test_a_pattern_in_a_list_on_a_host_is_refused_as_such(self):
        self.host.files["all.json"] = b'{"windsplat": "files", "files": ["*.nc"]}'
        self.assertIn("a list on a host must name each file", self.refusal("/all.json"))

    def test_a_host_is_asked_for_no_file_of_another_format(self):
        self.refusal("/absent.zarr")
        asked = self.host.asked()
        self.assertIn("/absent.zarr/.zgroup", asked)
        self.assertEqual([path for path in asked if "control" in path], [])

    def test_a_dataset_of_an_opendap_service_draws_the_same_pixels(self):
        path = self.folder / "packed.nc"
        axes = {"lev": ([1000.0, 500.0], "hPa"), "lat": (np.linspace(50, 20, 5), "degrees_north"),
                "lon": (np.arange(0, 60, 10.0), "degrees_east"),
                "time": ([0.0, 6.0], "hours since 2001-01-01")}
        stored = np.arange(2 * 2 * 5 * 6).reshape(2, 2, 5, 6).astype("i2") * 100
        packing = {"scale_factor": 0.01, "add_offset": 250.0}
        served = {name: (np.array(values, dtype="f8"), (name,), {"units": units})
                  for name, (values, units) in axes.items()}
        served["t"] = (stored, ("time", "lev", "lat", "lon"), {"units": "K"} | packing)
        with netCDF4.Dataset(path, "w") as file:
            for name, (array, dims, attributes) in served.items():
                for dim, size in zip(dims, array.shape):
                    if dim not in file.dimensions:
                        file.createDimension(dim, size)
                variable = file.createVariable(name, array.dtype, dims)
                variable.set_auto_maskandscale(False)
                variable.setncatts(attributes)
                variable[:] = array
        self.host.served = {"packed.nc": served}
        url = self.host.origin + "/dodsC/packed.nc"
        far, near = (self.run_program("inspect", name, "--json", "--ranges", "all", *options)
                     for name, options in ((url, self.options()), (path, ())))
        self.assertEqual(far.returncode, 0, far.stderr)
        self.assertEqual(json.loads(far.stdout)["fields"], json.loads(near.stdout)["fields"])
        field = json.loads(far.stdout)["fields"][0]
        np.testing.assert_allclose(field["range"], [250, 250 + 119], rtol=1e-6)
        pictures = []
        for name, options in ((url, self.options()), (path, ())):
            out = self.cache.parent / "picture.npy"
            done = self.run_program("render", name, "--step", 1, "--size", "64x48", "-o", out,
                                    *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            pictures.append(np.load(out))
        np.testing.assert_array_equal(*pictures)
        for wrong, text in (("/dodsC/none.nc", "404"), ("/dodsC/packed.nc.dds", "without this")):
            done = self.run_program("inspect", self.host.origin + wrong, *self.options())
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(text, done.stderr)

    def test_cancelling_a_job_ends_its_request(self):
        self.host.stalled = {"a.nc", "b.nc"}
        with Daemon("tornado", *self.options()) as daemon:
            for _ in range(2):
                self.host.left.clear()
                jobs = [job_of(daemon.root, f"{self.host.origin}/{name}") for name in
                        ("a.nc", "b.nc")]
                waiting = job_of(daemon.root, self.host.origin + "/classic.nc")
                while sum(path in ("/a.nc", "/b.nc") for path in self.host.requests) < 2:
                    time.sleep(0.01)
                self.host.asked()
                for job in jobs:
                    request = urllib.request.Request(f"{daemon.root}v1/jobs/{job}",
                                                     method="DELETE")
                    urllib.request.urlopen(request).close()
                self.assertEqual(daemon.finished(waiting)["state"], "done")
                self.assertTrue(self.host.left.wait(5))
                self.assertEqual([daemon.finished(job)["state"] for job in jobs],
                                 ["cancelled", "cancelled"])


if __name__ == "__main__":
    options = [one for one in sys.argv[1:] if one.startswith("--program=")]
    PROGRAM = str(pathlib.Path(options[0].partition("=")[2]).resolve())
    unittest.main(argv=[sys.argv[0], *(one for one in sys.argv[1:] if one not in options)])
