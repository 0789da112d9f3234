#!/usr/bin/env python3
"""Uploads: received within a quota, checked, opened, and removed with their datasets.

Usage: uploads.py --program=PATH [unittest arguments]
"""
import base64
import hashlib
import http.client
import io
import json
import os
import pathlib
import socket
import stat
import subprocess
import tempfile
import time
import unittest
import zipfile

import netCDF4
import numpy as np

from served import Daemon, taken_program

PROGRAM = taken_program()
LIMIT = 4 << 20


def digest_of(body):
    return "sha-256=:" + base64.b64encode(hashlib.sha256(body).digest()).decode() + ":"


def cube(seed=1):
    return np.random.default_rng(seed).normal(size=(4, 5, 6)).astype("f4")


def netcdf(values, folder):
    """The bytes of a netCDF-4 file with a scalar of the axes z, y, x."""
    path = pathlib.Path(folder) / "made.nc"
    with netCDF4.Dataset(path, "w") as file:
        for name, count in zip("zyx", values.shape):
            file.createDimension(name, count)
            axis = file.createVariable(name, "f8", (name,))
            axis.units = "m"
            axis[:] = np.arange(count)
        file.createVariable("q", "f4", ("z", "y", "x"))[:] = values
    return path.read_bytes()


class WithUploads(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="windsplat-uploads-")
        self.state = pathlib.Path(self.folder.name) / "state"
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state, "--upload-limit", "4M")

    def tearDown(self):
        self.daemon.end()
        self.folder.cleanup()

    def put(self, name, body, query="", **headers):
        return self.daemon.ask("PUT", f"/v1/uploads/{name}{query}", body,
                               {key.replace("_", "-"): text for key, text in headers.items()})

    def opened(self, name):
        """The id of the dataset."""
        answer = self.daemon.post("/v1/datasets", {"upload": name})
        self.assertEqual(answer.status, 202, answer.body)
        state = self.daemon.finished(answer.headers["Location"])
        self.assertEqual(state["state"], "done", state)
        return state["result"]

    def values(self, dataset, field="q"):
        answer = self.daemon.get(f"/v1/datasets/{dataset}/fields/{field}/values.npy")
        self.assertEqual(answer.status, 200, answer.body)
        return np.load(io.BytesIO(answer.body))

    def files(self):
        return sorted(str(path.relative_to(self.state / "uploads"))
                      for path in (self.state / "uploads").rglob("*") if path.is_file())

    def assert_refused(self, answer, status, *texts):
        found, detail = answer.detail()
        self.assertEqual(found, status, detail)
        for text in texts:
            self.assertIn(text, detail)

    def wait_until(self, condition, seconds=20):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, "waited in vain")
            time.sleep(0.05)


class Uploads(WithUploads):
    def test_a_file_is_opened_and_has_its_values(self):
        body = netcdf(cube(), self.folder.name)
        answer = self.put("storm.nc", body, "?keep=600", Content_Digest=digest_of(body))
        self.assertEqual(answer.status, 201, answer.body)
        self.assertEqual(answer.headers["Location"], "/v1/uploads/storm.nc")
        told = answer.json()
        self.assertEqual((told["id"], told["bytes"], told["digest"]),
                         ("storm.nc", len(body), digest_of(body)))
        self.assertEqual(self.daemon.get("/v1/uploads/storm.nc").json(), told)
        dataset = self.opened("storm.nc")
        self.assertEqual(dataset, "storm")
        self.assertTrue(np.array_equal(self.values(dataset), cube()))
        self.assertEqual(self.daemon.get(f"/v1/datasets/{dataset}/frame.png?width=64&height=48")
                         .status, 200)

    def test_uploads_are_not_kept_below_the_data_root(self):
        root = pathlib.Path(self.folder.name)
        for state in (root / "a" / "state", root, root / "a" / ".." / "state"):
            refused = subprocess.run(
                [PROGRAM, "serve", "tornado", "--data-root", root, "--state-dir", state,
                 "--upload-limit", "4M"], capture_output=True, text=True, check=False)
            self.assertEqual(refused.returncode, 2, refused.stderr)
            self.assertIn("lies below --data-root", refused.stderr)

    def test_a_description_and_its_data_are_two_uploads(self):
        file = io.BytesIO()
        np.save(file, cube(2))
        offset = len(file.getvalue()) - cube(2).nbytes
        description = {"windsplat": "raw", "file": "blob.npy", "dims": {"x": 6, "y": 5, "z": 4},
                       "type": "float32", "endian": "little", "offset": offset,
                       "fields": [{"name": "q"}]}
        self.assertEqual(self.put("blob.npy", file.getvalue()).status, 201)
        self.assertEqual(self.put("blob.json", json.dumps(description)).status, 201)
        self.assertTrue(np.array_equal(self.values(self.opened("blob.json")), cube(2)))
        # Other uploads are not companions.
        description["file"] = "../blob/blob.npy"
        for name in ("../blob/blob.npy", "blob.npy"):
            description["file"] = name
            self.put("thief.json", json.dumps(description))
            answer = self.daemon.post("/v1/datasets", {"upload": "thief.json"})
            self.assertEqual(self.daemon.finished(answer.headers["Location"])["state"], "failed")
            self.daemon.ask("DELETE", "/v1/uploads/thief.json")

    def test_a_wrong_digest_leaves_nothing(self):
        body = os.urandom(300_000)
        for field in ("Content_Digest", "Repr_Digest"):
            answer = self.put("storm.nc", body, **{field: digest_of(body[1:])})
            self.assert_refused(answer, 422, digest_of(body), digest_of(body[1:]))
            self.assertEqual(self.daemon.get("/v1/uploads/storm.nc").status, 404)
            self.assertEqual(self.files(), [])
        for text in ("sha-512=:AAAA:", "sha-256=AAAA", "sha-256=:AAAA:", "md5=:AAAA:"):
            self.assert_refused(self.put("a.nc", body, Content_Digest=text), 422, "sha-256")
        self.assertEqual(self.put("a.nc", body, Content_Digest="md5=:AAAA:, " + digest_of(body))
                         .status, 201)

    def test_quota_counts_what_is_kept_and_what_is_being_received(self):
        half = LIMIT // 2
        self.assert_refused(self.put("a.raw", bytes(half + 1)), 507, str(half + 1), str(half))
        self.assertEqual(self.put("a.raw", bytes(half)).status, 201)
        self.assert_refused(self.put("b.raw", b"x"), 507, "0 are left")
        self.assertEqual(self.daemon.ask("DELETE", "/v1/uploads/a.raw").status, 204)
        with self.begun("c.raw", half):
            self.wait_until(lambda: len(self.files()) == 1)
            self.assert_refused(self.put("b.raw", b"x"), 507, "0 are left")
            self.assert_refused(self.put("c.raw", b"x"), 409, "exists")
        self.wait_until(lambda: self.put("b.raw", bytes(half)).status == 201)

    def test_a_length_above_all_limits_is_refused_before_the_body(self):
        for method, target, length, status, text in (
                ("PUT", "/v1/uploads/a.nc", 10**15, 507, f"{10**15} bytes"),
                ("PUT", "/v1/uploads/a.nc", 2**64 - 1, 507, f"--upload-limit {LIMIT}"),
                ("POST", "/v1/uploads/a.nc", 10**6, 405, ""),
                ("POST", "/v1/frames", LIMIT // 2, 413, "at most 65536 bytes")):
            with socket.create_connection(self.daemon.host.split(":")) as client:
                client.sendall(f"{method} {target} HTTP/1.1\r\nHost: {self.daemon.host}\r\n"
                               "Content-Type: application/json\r\n"
                               f"Content-Length: {length}\r\n\r\n".encode())
                answer = http.client.HTTPResponse(client)
                answer.begin()
                self.assertEqual(answer.status, status, (method, target, length))
                self.assertIn(text.encode(), answer.read())

    def begun(self, name, length, sent=1000):
        """A connection whose upload is not complete."""
        client = socket.create_connection(self.daemon.host.split(":"))
        client.sendall(f"PUT /v1/uploads/{name} HTTP/1.1\r\nHost: {self.daemon.host}\r\n"
                       f"Content-Length: {length}\r\n\r\n".encode() + bytes(sent))
        return client

    def test_what_is_aborted_leaves_nothing(self):
        for sent in (0, 1000, 700_000):
            client = self.begun("storm.nc", LIMIT // 2, sent)
            self.wait_until(lambda: len(self.files()) == 1)
            client.close()
            self.wait_until(lambda: self.files() == [])
        self.assertEqual(self.daemon.get("/v1/uploads/storm.nc").status, 404)
        self.assertEqual(self.put("storm.nc", bytes(LIMIT // 2)).status, 201)

    def test_an_address_has_few_at_a_time(self):
        clients = [self.begun(f"a{n}.nc", 5000) for n in range(4)]
        self.wait_until(lambda: len(self.files()) == 4)
        answer = self.put("more.nc", b"x")
        self.assert_refused(answer, 429, "too many")
        self.assertIn("Retry-After", answer.headers)
        for client in clients:
            client.sendall(bytes(4000))
            self.assertIn(b" 201 ", client.recv(400))
            client.close()

    def test_a_connection_is_used_again_and_100_continue_is_sent(self):
        body = os.urandom(600_000)
        with socket.create_connection(self.daemon.host.split(":")) as client:
            head = f"Host: {self.daemon.host}\r\nContent-Length: {len(body)}\r\n"
            client.sendall(f"PUT /v1/uploads/a.nc HTTP/1.1\r\n{head}Expect: 100-continue\r\n\r\n"
                           .encode())
            self.assertTrue(client.recv(100).startswith(b"HTTP/1.1 100 "))
            client.sendall(body)
            self.assertIn(b" 201 ", client.recv(2000).split(b"\r\n")[0])
            # The next request follows the body in one packet.
            client.sendall(f"PUT /v1/uploads/b.nc HTTP/1.1\r\n{head}\r\n".encode() + body +
                           f"GET /v1/uploads/b.nc HTTP/1.1\r\nHost: {self.daemon.host}\r\n"
                           "Connection: close\r\n\r\n".encode())
            rest = b""
            while part := client.recv(65536):
                rest += part
        self.assertEqual(rest.count(digest_of(body).encode()), 2, rest)

    def test_memory_does_not_grow_with_the_body(self):
        self.daemon.end()
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state, "--upload-limit", "1G")
        status = pathlib.Path(f"/proc/{self.daemon.process.pid}/status")

        def peak():
            lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
            return int(lines["VmHWM"].split()[0]) << 10

        before = peak()
        self.assertEqual(self.put("large.raw", bytes(200 << 20)).status, 201)
        self.assertLess(peak() - before, 32 << 20)

    def test_uploads_and_their_datasets_end(self):
        body = netcdf(cube(), self.folder.name)
        self.put("a.nc", body, "?keep=1")
        self.put("b.nc", body)
        first, second = self.opened("a.nc"), self.opened("b.nc")
        self.wait_until(lambda: self.daemon.get(f"/v1/datasets/{first}").status == 404)
        self.assertEqual(self.daemon.get("/v1/uploads/a.nc").status, 404)
        self.assertEqual(self.files(), ["b/b.nc"])
        self.assertEqual(self.daemon.get(f"/v1/datasets/{second}").status, 200)
        self.assertEqual(self.daemon.ask("DELETE", "/v1/uploads/b.nc").status, 204)
        self.assertEqual(self.daemon.get(f"/v1/datasets/{second}").status, 404)
        self.assertEqual(self.files(), [])
        self.assertEqual(self.daemon.ask("DELETE", "/v1/uploads/b.nc").status, 404)

    def test_files_are_private_and_end_with_the_daemon(self):
        self.put("a.nc", b"abc")
        folder = self.state / "uploads"
        modes = {stat.S_IMODE(path.stat().st_mode) for path in (folder, folder / "a")}
        self.assertEqual(modes, {0o700})
        self.assertEqual(stat.S_IMODE((folder / "a" / "a.nc").stat().st_mode), 0o600)
        self.daemon.end()
        self.assertFalse(folder.exists())

    def test_what_a_killed_daemon_left_is_removed(self):
        self.put("a.nc", b"abc")
        self.daemon.kill()
        self.assertEqual(self.files(), ["a/a.nc"])
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state, "--upload-limit", "4M")
        self.assertEqual(self.files(), [])
        self.assertEqual(self.daemon.get("/v1/uploads/a.nc").status, 404)

    def test_a_folder_with_other_files_is_not_emptied(self):
        self.daemon.end()
        (self.state / "uploads").mkdir()
        (self.state / "uploads" / "mine.nc").write_text("mine")
        done = subprocess.run([PROGRAM, "serve", "tornado", "--listen", "127.0.0.1:0",
                               "--state-dir", self.state, "--upload-limit", "4M"],
                              capture_output=True, text=True, check=False, timeout=30)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("has other files", done.stderr)
        self.assertEqual(self.files(), ["mine.nc"])

    def test_names_and_parameters_are_checked(self):
        for name in ("..", "a%2Fb", ".hidden", "a..b", "a.", "-a", "a%20b", "a*", "a%00", "x" * 81):
            answer = self.put(name, b"x")
            self.assertIn(answer.status, (404, 422), name)
        self.assert_refused(self.put("a.nc", b""), 422, "body")
        self.assert_refused(self.put("a.nc", b"x", "?keep=0"), 422, "'keep'")
        self.assert_refused(self.put("a.nc", b"x", "?keep=9999999"), 422, "604800")
        self.assert_refused(self.put("a.nc", b"x", "?size=1"), 400, "'size'")
        self.assert_refused(self.put("a.nc", b"x", Content_Encoding="gzip"), 415, "Encoding")
        self.assertEqual(self.put("a.nc", b"x").status, 201)
        self.assert_refused(self.put("a.nc", b"x"), 409, "exists")
        self.assert_refused(self.daemon.post("/v1/datasets", {"upload": "none.nc"}), 404,
                            "none.nc")
        self.assert_refused(self.daemon.post("/v1/datasets", {"upload": "a.nc", "path": "b"}), 422,
                            "/path")

    def test_what_is_no_data_fails_in_its_job(self):
        self.put("noise.nc", os.urandom(5000))
        answer = self.daemon.post("/v1/datasets", {"upload": "noise.nc"})
        state = self.daemon.finished(answer.headers["Location"])
        self.assertEqual(state["state"], "failed")
        self.assertNotIn(str(self.state), json.dumps(state))

    def test_uploads_are_off_unless_asked_for(self):
        self.daemon.end()
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state)
        for answer in (self.put("a.nc", b"x"), self.put("a.nc", bytes(100_000)),
                       self.daemon.get("/v1/uploads/a.nc"),
                       self.daemon.ask("DELETE", "/v1/uploads/a.nc"),
                       self.daemon.post("/v1/datasets", {"upload": "a.nc"})):
            self.assert_refused(answer, 403, "--upload-limit")
        self.assertFalse((self.state / "uploads").exists())
        for given, text in ((["--upload-limit", "4M"], "--state-dir"),
                            (["--upload-limit", "much", "--state-dir", self.state], "much")):
            done = subprocess.run([PROGRAM, "serve", "tornado", "--listen", "127.0.0.1:0", *given],
                                  capture_output=True, text=True, check=False, timeout=30)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(text, done.stderr)


def zarr_files(values):
    """The files of a Zarr store of version 2, one chunk a level."""
    array = {"zarr_format": 2, "shape": values.shape, "chunks": (1, *values.shape[1:]),
             "dtype": "<f4", "compressor": None, "fill_value": None, "order": "C",
             "filters": None}
    files = {".zgroup": b'{"zarr_format": 2}', "q/.zarray": json.dumps(array).encode(),
             "q/.zattrs": b'{"_ARRAY_DIMENSIONS": ["z", "y", "x"]}'}
    return files | {f"q/{k}.0.0": level.tobytes() for k, level in enumerate(values)}


def zipped(files, method=zipfile.ZIP_STORED, prefix=""):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, body in files.items():
            archive.writestr(prefix + name if isinstance(name, str) else name, body)
    return out.getvalue()


def special(name, mode):
    entry = zipfile.ZipInfo(name)
    entry.create_system, entry.external_attr = 3, mode << 16
    return entry


class Archives(WithUploads):
    """Zarr stores as ZIP archives."""

    def test_a_store_is_unpacked_and_opened(self):
        for n, (method, prefix) in enumerate(((zipfile.ZIP_STORED, ""), (zipfile.ZIP_DEFLATED, ""),
                                              (zipfile.ZIP_DEFLATED, "storm.zarr/"))):
            name = f"store{n}.zarr.zip"
            files = zarr_files(cube(n))
            answer = self.put(name, zipped(files, method, prefix))
            self.assertEqual(answer.status, 201, answer.body)
            self.assertEqual(len(self.files()), len(files))
            self.assertTrue(np.array_equal(self.values(self.opened(name)), cube(n)))
            self.assertEqual(self.daemon.ask("DELETE", f"/v1/uploads/{name}").status, 204)
            self.assertEqual(self.files(), [])

    def test_hostile_archives_are_refused_and_leave_nothing(self):
        good = zipped({"a": b"x" * 100, "b": b"y"})
        end, entry = good.rindex(b"PK\5\6"), good.index(b"PK\1\2")

        packed = zipped({"a": bytes(range(200)) * 2}, zipfile.ZIP_DEFLATED)

        def patched(at, value, width=4):
            return good[:at] + value.to_bytes(width, "little") + good[at + width:]

        cases = {
            "whose name is not a path": [zipped({name: b"x"}) for name in (
                "../x", "/x", "a/../../x", "a//x", "./x", "a\\x", "a\nx", "x" * 600,
                "/".join("a" * 20))],
            "a link or a special file": [zipped({special("a", 0o120777): b"/etc/passwd"}),
                                         zipped({special("a", 0o10644): b""})],
            "more than 200 times": [zipped({"a": bytes(2 << 20)}, zipfile.ZIP_DEFLATED)],
            "more than 20000 entries": [zipped({f"{n}": b"" for n in range(20001)})],
            "twice": [zipped({"a": b"1", special("a", 0o100644): b"2"}),
                      zipped({"a": b"1", "a/b": b"2"})],
            "checksum": [good.replace(b"x" * 100, b"x" * 99 + b"z")],
            "encrypted": [patched(entry + 8, 1, 2)],
            "neither stored nor deflated": [patched(entry + 10, 12, 2)],
            "overlap": [good[:entry + 20] + 2 * len(good).to_bytes(4, "little") +
                        good[entry + 28:]],
            "ZIP64": [patched(end + 16, 0xffffffff)],
            "several parts": [patched(end + 4, 1, 2)],
            "directory": [patched(end + 12, 10), patched(entry, 0),
                          patched(entry + 28, 9999, 2)],
            "header": [patched(0, 0)],
            "end record": [good[:-5], b"PK" * 20, b"noise" * 100],
            "not deflated": [packed[:31] + b"\xff" * 20 + packed[51:]],
        }
        for text, bodies in cases.items():
            for body in bodies:
                answer = self.put("a.zip", body)
                self.assert_refused(answer, 422, text)
                self.assertEqual(self.files(), [], text)
        self.assertFalse((self.state.parent / "x").exists())
        self.assertEqual(self.put("a.zip", good).status, 201)

    def test_a_bomb_writes_no_more_than_it_declares(self):
        body = zipped({"a": bytes(1 << 20)}, zipfile.ZIP_DEFLATED)
        entry = body.index(b"PK\1\2")
        body = body[:entry + 24] + (1000).to_bytes(4, "little") + body[entry + 28:]
        self.assert_refused(self.put("a.zip", body), 422, "longer than it declares")
        self.assertEqual(self.files(), [])

    def test_quota_counts_what_is_unpacked(self):
        noise = os.urandom(1 << 19)
        for n in range(2):
            body = zipped({f"{name}": b"" for name in range(100)} | {"noise": noise})
            answer = self.put(f"{n}.zip", body)
            if n == 0:
                self.assertEqual(answer.status, 201, answer.body)
        self.assert_refused(answer, 507, "--upload-limit")
        self.assertEqual(len(self.files()), 101)
        self.daemon.ask("DELETE", "/v1/uploads/0.zip")
        self.assertEqual(self.put("all.raw", bytes(LIMIT // 2)).status, 201)


if __name__ == "__main__":
    unittest.main()
