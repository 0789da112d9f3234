#!/usr/bin/env python3
"""Datasets on other hosts: the same pictures as from disk, and refusals.

Usage: data_hosts.py --program=PATH [unittest arguments]
"""
import http.client
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.parse
import urllib.request

import numpy as np

import data_host_server
from data_host_server import DataHost

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "fuzz"))
import seeds  # noqa: E402
import zarr3_bytes  # noqa: E402

PROGRAM = None
AXES = {"z": ("height", "m"), "y": ("projection_y_coordinate", "m"),
        "x": ("projection_x_coordinate", "m")}
SHAPE, CHUNKS = (4, 6, 8), (2, 3, 4)


def fields():
    rng = np.random.default_rng(20)
    return {name: rng.normal(size=SHAPE).astype("<f4") for name in ("u", "v")}


def coordinates():
    return {a: np.arange(n, dtype="<f8") * 100 for a, n in zip("zyx", SHAPE)}


def attributes_of(name):
    if name in AXES:
        return {"standard_name": AXES[name][0], "units": AXES[name][1]}
    wind = {"u": "eastward_wind", "v": "northward_wind"}[name]
    return {"standard_name": wind, "units": "m s-1"}


def parts_of(values, chunks):
    for at in np.ndindex(*(n // c for n, c in zip(values.shape, chunks))):
        yield at, values[tuple(slice(i * c, (i + 1) * c)
                               for i, c in zip(at, chunks))].tobytes()


def zarr2(consolidated):
    files = {".zgroup": b'{"zarr_format": 2}', ".zattrs": b'{"Conventions": "CF-1.8"}'}
    for name, values in (coordinates() | fields()).items():
        chunks = CHUNKS if values.ndim == 3 else values.shape
        dims = list("zyx") if values.ndim == 3 else [name]
        meta = {"zarr_format": 2, "shape": values.shape, "chunks": chunks, "order": "C",
                "dtype": values.dtype.str, "filters": None, "fill_value": None,
                "compressor": seeds.coded(b"0", "zlib")[0]}
        files[f"{name}/.zarray"] = json.dumps(meta).encode()
        files[f"{name}/.zattrs"] = json.dumps(
            {"_ARRAY_DIMENSIONS": dims} | attributes_of(name)).encode()
        for at, data in parts_of(values, chunks):
            files[f"{name}/{'.'.join(map(str, at))}"] = seeds.coded(data, "zlib")[1]
    if consolidated:
        metadata = {name: json.loads(data) for name, data in files.items()
                    if name.rpartition("/")[2].startswith(".z")}
        files[".zmetadata"] = json.dumps({"zarr_consolidated_format": 1,
                                          "metadata": metadata}).encode()
    return files


def zarr3_sharded():
    files = {}
    for name, values in (coordinates() | fields()).items():
        is_field = values.ndim == 3
        files |= zarr3_bytes.array(
            name, values.shape, CHUNKS if is_field else values.shape, values.dtype.name,
            dict(parts_of(values, CHUNKS if is_field else values.shape)),
            list("zyx") if is_field else [name], attributes_of(name), compressor="gzip",
            shards=(2, 1, 2) if is_field else None)
    members = {name.rpartition("/")[0]: json.loads(data) for name, data in files.items()
               if name.endswith("zarr.json")}
    return files | {"zarr.json": zarr3_bytes.group({"Conventions": "CF-1.8"}, members)}


def certificate(folder, name):
    """A self-signed certificate and its key."""
    paths = [str(folder / f"{name}.{end}") for end in ("crt", "key")]
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                    "ec_paramgen_curve:P-256", "-nodes", "-days", "2", "-subj", "/CN=test",
                    "-addext", f"subjectAltName={name}", "-out", paths[0], "-keyout", paths[1]],
                   capture_output=True, check=True)
    return paths


class DataHosts(unittest.TestCase):
    local = {}  # path -> picture and description

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="windsplat-hosts-"))
        cls.netcdf = cls.folder / "storm.nc"
        subprocess.run([PROGRAM, "synth", "tornado", "--dims", "8x8x8", "--steps", "2", "-o",
                        cls.netcdf], check=True, capture_output=True)
        cls.stores = {"v2.zarr": zarr2(True), "plain.zarr": zarr2(False),
                      "v3.zarr": zarr3_sharded()}
        for store, files in cls.stores.items():
            for name, data in files.items():
                path = cls.folder / store / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
        cls.pair = certificate(cls.folder, "IP:127.0.0.1")
        cls.plain = DataHost()
        cls.tls = DataHost(cls.pair, cls.plain.port)
        cls.other = DataHost(certificate(cls.folder, "DNS:other.example"))
        for host in (cls.plain, cls.tls, cls.other):
            host.files = {"a%20 dir/storm.nc".replace("%20", ""): cls.netcdf.read_bytes(),
                          "storm.nc": cls.netcdf.read_bytes()}
            for store, files in cls.stores.items():
                host.files |= {f"{store}/{name}": data for name, data in files.items()}

    @classmethod
    def tearDownClass(cls):
        for host in (cls.plain, cls.tls, cls.other):
            host.end()
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.cache = pathlib.Path(tempfile.mkdtemp(dir=self.folder)) / "cache"

    def options(self, *hosts, **more):
        out = ["--allow-private-data-hosts", "--data-cache", self.cache]
        for host in hosts or (self.tls,):
            out += ["--data-host", getattr(host, "origin", host)]
        if "ca" not in more:
            out += ["--data-ca", self.pair[0]]
        return out

    def run_program(self, *arguments, env=None):
        clean = {key: value for key, value in os.environ.items()
                 if not key.startswith(("AWS_", "WINDSPLAT_"))}
        return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False,
                              timeout=60, env=clean | (env or {}))

    def picture(self, dataset, *options, env=None):
        path = self.cache.parent / "picture.npy"
        done = self.run_program("render", dataset, "--size", "64x48", "-o", path, *options, env=env)
        self.assertEqual(done.returncode, 0, done.stderr)
        return np.load(path)

    def inspected(self, dataset, *options, env=None):
        done = self.run_program("inspect", dataset, "--json", "--ranges", "all", *options, env=env)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def same(self, url, local, *options, env=None):
        if local not in self.local:
            self.local[local] = self.picture(local), self.inspected(local)
        pixels, info = self.local[local]
        np.testing.assert_array_equal(self.picture(url, *options, env=env), pixels)
        far = self.inspected(url, *options, env=env)
        own = [note for note in far["notes"] if note not in info["notes"]]
        self.assertEqual(len(own), str(local).endswith(".zarr"), own)
        self.assertTrue(all("absent chunks are not counted" in note for note in own), own)
        far["notes"] = info["notes"]
        self.assertEqual(far, info)

    def refused(self, url, *texts, options=None, code=None, env=None):
        began = time.monotonic()
        done = self.run_program("inspect", url, *(self.options() if options is None else options),
                                env=env)
        self.assertNotEqual(done.returncode, 0, done.stdout)
        for text in texts:
            self.assertIn(text, done.stderr)
        if code:
            self.assertEqual(done.returncode, code, done.stderr)
        self.assertLess(time.monotonic() - began, 10)
        left = [path.name for path in self.cache.glob("part-*")]
        self.assertEqual(left, [], "partial files are removed")
        return done.stderr

    # --- what is read -------------------------------------------------------------------------

    def test_a_netcdf_file_draws_the_same_pixels(self):
        self.same(self.tls.origin + "/storm.nc", self.netcdf, *self.options())
        self.assertEqual(self.inspected(self.tls.origin + "/storm.nc",
                                        *self.options())["steps"]["count"], 2)

    def test_zarr_stores_draw_the_same_pixels(self):
        for store in ("v2.zarr", "v3.zarr"):
            with self.subTest(store):
                self.same(f"{self.tls.origin}/{store}", self.folder / store, *self.options())

    def test_values_are_those_that_were_written(self):
        info = self.inspected(self.tls.origin + "/v2.zarr", *self.options())
        wind = next(field for field in info["fields"] if field["kind"] == "vector")
        speed = np.hypot(*fields().values())
        np.testing.assert_allclose(wind["range"], [speed.min(), speed.max()], rtol=1e-6)

    def test_chunks_are_fetched_when_they_are_read(self):
        self.tls.asked()
        self.run_program("inspect", self.tls.origin + "/v2.zarr", "--ranges", "none",
                         *self.options())
        asked = self.tls.asked()
        self.assertIn("/v2.zarr/x/0", asked)
        self.assertEqual([path for path in asked if "/u/" in path], [])

    def test_an_unlisted_store_needs_consolidated_metadata(self):
        self.refused(self.tls.origin + "/plain.zarr", "consolidated", code=3)

    def test_unchanged_files_are_confirmed_and_changed_ones_fetched_again(self):
        url = self.plain.origin + "/storm.nc"
        options = self.options(self.plain)
        before = self.picture(url, *options)
        size = sum(path.stat().st_size for path in self.cache.iterdir())
        np.testing.assert_array_equal(self.picture(url, *options), before)
        self.assertEqual(size, sum(path.stat().st_size for path in self.cache.iterdir()))
        kept = self.plain.files["storm.nc"]
        subprocess.run([PROGRAM, "synth", "tornado", "--dims", "9x8x8", "--steps", "3", "-o",
                        self.folder / "new.nc"], check=True, capture_output=True)
        self.plain.files["storm.nc"] = (self.folder / "new.nc").read_bytes()
        try:
            self.assertEqual(self.inspected(url, *options)["steps"]["count"], 3)
            self.assertEqual(len(list(self.cache.iterdir())), 2)
        finally:
            self.plain.files["storm.nc"] = kept

    def test_redirects_to_the_same_host_are_followed(self):
        self.same(self.tls.origin + "/to-same-host/storm.nc", self.netcdf, *self.options())

    def test_the_rest_of_a_file_is_asked_for_if_its_connection_ends(self):
        self.tls.asked()
        self.same(self.tls.origin + "/flaky/storm.nc", self.netcdf, *self.options())
        self.assertEqual(self.tls.asked()[:3], ["/flaky/storm.nc"] * 3)
        for fault in ("mutated", "spliced", "short"):
            self.refused(f"{self.tls.origin}/{fault}/storm.nc", "the rest of the same file")

    # --- S3 -----------------------------------------------------------------------------------

    def s3_options(self):
        return self.options(self.plain) + ["--s3-endpoint", self.plain.origin]

    def test_s3_stores_are_listed(self):
        self.plain.buckets = {"winds": {f"runs/a b/{store}/{name}": data
                                        for store, files in self.stores.items()
                                        for name, data in files.items()}}
        self.plain.signed = False
        for store in ("plain.zarr", "v3.zarr"):
            with self.subTest(store):
                self.same(f"s3://winds/runs/a%20b/{store}", self.folder / store,
                          *self.s3_options())

    def test_s3_requests_are_signed_with_the_key_of_the_environment(self):
        self.plain.buckets = {"winds": {f"a b/plain.zarr/{name}": data
                                        for name, data in self.stores["plain.zarr"].items()}}
        self.plain.signed = True
        key = {"AWS_ACCESS_KEY_ID": data_host_server.KEY_ID,
               "AWS_SECRET_ACCESS_KEY": data_host_server.SECRET,
               "AWS_SESSION_TOKEN": data_host_server.TOKEN,
               "AWS_REGION": data_host_server.REGION}
        try:
            self.same("s3://winds/a%20b/plain.zarr", self.folder / "plain.zarr",
                      *self.s3_options(), env=key)
            self.refused("s3://winds/a%20b/plain.zarr", "status 403", options=self.s3_options())
            told = self.refused("s3://winds/a%20b/plain.zarr", "status 403",
                                options=self.s3_options(),
                                env=key | {"AWS_SECRET_ACCESS_KEY": "wrong-one"})
            self.assertNotIn("wrong-one", told)
        finally:
            self.plain.signed = False

    # --- refusals -----------------------------------------------------------------------------

    def test_nothing_is_fetched_unless_its_host_is_permitted(self):
        self.tls.asked()
        url = self.tls.origin + "/storm.nc"
        self.refused(url, "--data-host", options=[], code=2)
        self.refused(url, "--data-host", options=self.options("data.example"), code=2)
        self.refused(url, "--data-host", options=self.options(self.plain), code=2)
        self.refused("s3://bucket/x.nc", "s3.us-east-1.amazonaws.com", code=2)
        self.assertEqual(self.tls.asked(), [])

    def test_private_addresses_are_refused(self):
        self.tls.asked()
        options = [one for one in self.options() if one != "--allow-private-data-hosts"]
        self.refused(self.tls.origin + "/storm.nc", "private", options=options)
        options = [one for one in self.options(f"https://localhost:{self.tls.port}")
                   if one != "--allow-private-data-hosts"]
        self.refused(f"https://localhost:{self.tls.port}/storm.nc", "private", options=options)
        self.assertEqual(self.tls.asked(), [])

    def test_redirects_elsewhere_are_refused(self):
        self.plain.asked()
        self.refused(self.tls.origin + "/to-other-host/storm.nc", "redirected")
        self.refused(self.plain.origin + "/to-other-host/storm.nc", "another host",
                     options=self.options(self.plain))
        self.refused(self.tls.origin + "/to-plain-http/storm.nc", "from https to http",
                     options=self.options(self.tls, self.plain))
        self.refused(self.tls.origin + "/round/storm.nc", "more than 5 times")
        self.assertEqual(self.plain.asked(), ["/to-other-host/storm.nc"])

    def test_certificates_are_verified(self):
        self.refused(self.tls.origin + "/storm.nc", "certificate",
                     options=self.options(ca=None))
        self.refused(self.other.origin + "/storm.nc", "cannot be fetched",
                     options=self.options(self.other, ca=None) +
                     ["--data-ca", self.folder / "DNS:other.example.crt"])
        self.assertEqual(self.other.asked(), [])

    def test_limits_end_a_download(self):
        small = ["--max-download", "200K", *self.options()]
        self.refused(self.tls.origin + "/announced/x.nc", "--max-download", options=small)
        self.refused(self.tls.origin + "/endless/x.nc", "--max-download", options=small)
        self.refused(self.tls.origin + "/stalled/x.nc", "--max-download-time",
                     options=["--max-download-time", "1", *self.options()])
        self.refused(self.tls.origin + "/headers/x.nc", "header")

    def test_faulty_answers_are_refused(self):
        for path, text in (("truncated/storm.nc", "incompletely"),
                           ("unbounded/storm.nc", "without a length"),
                           ("identity/storm.nc", "without a length"),
                           ("coded/storm.nc", "content coding 'gzip'"),
                           ("denied/storm.nc", "status 403"), ("absent.nc", "status 404"),
                           ("absent.zarr", "no metadata of a Zarr store"),
                           ("denied/x.zarr", "status 403")):
            with self.subTest(path):
                self.refused(f"{self.tls.origin}/{path}", text)

    # --- the daemon ---------------------------------------------------------------------------

    def test_posted_urls_are_opened_from_permitted_hosts_only(self):
        with subprocess.Popen([PROGRAM, "serve", "tornado", "--listen", "127.0.0.1:0",
                               *self.options()], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True) as daemon:
            try:
                root = daemon.stdout.readline().strip()
                status, _ = post(root, "https://user:hunter2@data.example/x.nc")
                self.assertEqual(status, 422)
                status, problem = post(root, "https://data.example/x.nc")
                self.assertEqual((status, "--data-host" in problem["detail"]), (422, True))
                status, problem = post(root, "x.nc")
                self.assertEqual((status, "--data-root" in problem["detail"]), (422, True))
                status, job = post(root, self.tls.origin + "/v3.zarr")
                self.assertEqual(status, 202)
                for _ in range(100):
                    job = json.load(urllib.request.urlopen(f"{root}v1/jobs/{job['id']}"))
                    if job["state"] not in ("waiting", "running", "queued"):
                        break
                    time.sleep(0.05)
                found = json.load(urllib.request.urlopen(f"{root}v1/datasets"))
                self.assertIn("v3", [one["id"] for one in found["datasets"]], job)
            finally:
                daemon.terminate()
                log = daemon.stderr.read()
        self.assertNotIn("hunter2", log)


    def test_deleting_a_dataset_ends_what_is_fetched_for_it(self):
        url = self.plain.origin + "/v2.zarr"
        self.plain.stalled = {"v2.zarr/u/1.1.1"}
        self.plain.waits.clear()
        self.plain.left.clear()
        with subprocess.Popen([PROGRAM, "serve", url, "--listen", "127.0.0.1:0",
                               *self.options(self.plain)], stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, text=True) as daemon:
            try:
                root = daemon.stdout.readline().strip()
                client = http.client.HTTPConnection(urllib.parse.urlsplit(root).netloc)
                client.request("GET", "/v1/datasets/v2/frame.jpg?width=64&height=48")
                self.assertTrue(self.plain.waits.wait(10), "the chunk is asked for")
                with urllib.request.urlopen(urllib.request.Request(root + "v1/datasets/v2",
                                                                   method="DELETE")) as answer:
                    self.assertEqual(answer.status, 204)
                self.assertTrue(self.plain.left.wait(5), "and the request given up")
                self.assertEqual(client.getresponse().status, 409)
                client.close()
            finally:
                self.plain.stalled = set()
                daemon.terminate()


def post(root, path):
    request = urllib.request.Request(root + "v1/datasets", json.dumps({"path": path}).encode(),
                                     {"Content-Type": "application/json"})
    try:
        with urllib.request.urlopen(request) as response:
            return response.status, json.load(response)
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)


if __name__ == "__main__":
    options = [one for one in sys.argv[1:] if one.startswith("--program=")]
    PROGRAM = str(pathlib.Path(options[0].partition("=")[2]).resolve())
    unittest.main(argv=[sys.argv[0], *(one for one in sys.argv[1:] if one not in options)])
