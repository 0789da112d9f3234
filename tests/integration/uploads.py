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
import resource
import shutil
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
PART = 256 << 10  # bytes that are received before they are written


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

    def bytes_on_disk(self):
        return sum((self.state / "uploads" / name).stat().st_size for name in self.files())

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
        for state in (root / "a" / "state", root, root / "a" / ".." / "state", "not-there-yet"):
            refused = subprocess.run(
                [pathlib.Path(PROGRAM).resolve(), "serve", "tornado", "--data-root", root,
                 "--state-dir", state, "--upload-limit", "4M"], capture_output=True, text=True,
                check=False, cwd=root, timeout=30)
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
        self.assert_refused(self.put("a.raw", bytes(half + 1)), 413, str(half + 1), str(half))
        self.assertEqual(self.put("a.raw", bytes(half)).status, 201)
        self.assert_refused(self.put("b.raw", b"x"), 507, "0 are left")
        self.assertEqual(self.daemon.ask("DELETE", "/v1/uploads/a.raw").status, 204)
        with self.begun("c.raw", half, half - 100):
            self.wait_until(lambda: self.bytes_on_disk() == half - PART)
            self.assert_refused(self.put("b.raw", bytes(PART + 1)), 507, "are left")
            self.assert_refused(self.put("c.raw", b"x"), 409, "is being received")
        self.wait_until(lambda: self.put("b.raw", bytes(half)).status == 201)

    def test_an_address_keeps_half_of_all_uploads(self):
        for n in range(128):
            self.assertEqual(self.put(f"{n}.raw", b"x", "?keep=604800").status, 201)
        answer = self.put("more.raw", b"x")
        self.assert_refused(answer, 507, "128 uploads are kept, as many as an address may have")
        self.assertNotIn("Retry-After", answer.headers)
        other = http.client.HTTPConnection(self.daemon.host, source_address=("127.0.0.2", 0))
        self.addCleanup(other.close)
        other.request("PUT", "/v1/uploads/other.raw", b"x")
        self.assertEqual(other.getresponse().status, 201)
        self.daemon.ask("DELETE", "/v1/uploads/0.raw")
        self.assertEqual(self.put("more.raw", b"x").status, 201)

    def test_an_upload_takes_a_block_at_least(self):
        self.assertEqual(self.put("a.raw", bytes(LIMIT // 2 - 8192)).status, 201)
        self.assertEqual(self.put("b.raw", b"x").status, 201)
        self.assertEqual(self.put("c.raw", b"x").status, 201)
        self.assert_refused(self.put("d.raw", b"x"), 507, "takes 4096 bytes", "0 are left")
        self.daemon.ask("DELETE", "/v1/uploads/b.raw")
        self.assertEqual(self.put("d.raw", bytes(4096)).status, 201)

    def test_a_slow_client_holds_no_room_that_it_has_not_filled(self):
        half = LIMIT // 2
        with self.begun("slow.raw", half, 300_000) as slow:
            self.wait_until(lambda: self.bytes_on_disk() == PART)
            self.assertEqual(self.put("quick.raw", bytes(half - PART)).status, 201)
            slow.sendall(bytes(PART))
            self.assertIn(b" 507 ", slow.recv(4000).split(b"\r\n")[0])
            # Nothing waits for the end of its connection.
            self.assertEqual(self.files(), ["quick/quick.raw"])
            self.assertEqual(self.put("slow.raw", bytes(4096)).status, 201)
            self.daemon.ask("DELETE", "/v1/uploads/slow.raw")
        self.assertEqual(self.put("more.raw", bytes(PART)).status, 201)

    def test_a_client_that_trickles_is_cut_off(self):
        with self.begun("slow.raw", LIMIT // 2, 1000) as slow:
            begun = time.monotonic()
            slow.settimeout(1)
            while time.monotonic() - begun < 90:
                try:
                    slow.sendall(b"x")
                    if slow.recv(1) == b"":
                        break
                except TimeoutError:
                    continue
                except OSError:
                    break
            self.assertLess(time.monotonic() - begun, 90, "the connection stayed open")
        self.wait_until(lambda: self.put("slow.raw", bytes(LIMIT // 2)).status == 201)

    def test_limits_are_listed(self):
        limits = self.daemon.get("/v1").json()["limits"]
        self.assertEqual((limits["uploadBytesMax"], limits["uploadsBytesMax"]), (LIMIT // 2, LIMIT))
        self.assertEqual(limits["valuesBytesMax"], 64 << 20)
        self.daemon.end()
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state)
        limits = self.daemon.get("/v1").json()["limits"]
        self.assertEqual((limits["uploadBytesMax"], limits["uploadsBytesMax"]), (0, 0))

    def test_a_length_above_all_limits_is_refused_before_the_body(self):
        for method, target, length, status, text in (
                ("PUT", "/v1/uploads/a.nc", 10**15, 413, f"{10**15} bytes"),
                ("PUT", "/v1/uploads/a.nc", 2**64 - 1, 413, f"{LIMIT // 2}, half of "),
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
        for sent in (0, 1000, PART, 700_000):
            client = self.begun("storm.nc", LIMIT // 2, sent)
            self.wait_until(lambda: len(self.files()) == (sent >= PART))
            client.close()
            self.wait_until(lambda: self.files() == [])
            self.assertEqual(self.daemon.get("/v1/uploads/storm.nc").status, 404)
            self.wait_until(lambda: self.put("storm.nc", bytes(LIMIT // 2)).status == 201)
            self.assertEqual(self.daemon.ask("DELETE", "/v1/uploads/storm.nc").status, 204)

    def test_an_address_has_few_at_a_time(self):
        clients = [self.begun(f"a{n}.nc", PART + 4000, PART) for n in range(4)]
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

    def test_leftovers_are_removed_also_without_uploads_but_nothing_else(self):
        self.put("a.nc", b"abc")
        body = io.BytesIO()
        with zipfile.ZipFile(body, "w") as archive:
            for n in range(8):
                archive.writestr(f"q/{n}", b"x")
        self.assertEqual(self.put("a.zip", body.getvalue()).status, 201)
        self.daemon.kill()
        folder = self.state / "uploads"
        (folder / "b").mkdir()
        for name in ("mine.nc", "a/mine.nc", "b/mine.nc"):
            (folder / name).write_text("mine")
        self.assertGreater(len(self.files()), 6)
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state)
        self.assertEqual(self.files(), ["a/mine.nc", "b/mine.nc", "mine.nc"])
        self.daemon.kill()
        shutil.rmtree(folder)
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state, "--upload-limit", "4M")
        self.put("a.nc", b"abc")
        self.daemon.kill()
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state)
        self.assertFalse(folder.exists())
        # A folder of others, or a link to one, is not looked into.
        self.daemon.kill()
        elsewhere = pathlib.Path(self.folder.name) / "elsewhere"
        for place in (elsewhere / ".incomplete", elsewhere / "a"):
            place.mkdir(parents=True)
        (elsewhere / "a" / "a.nc").write_text("mine")
        folder.symlink_to(elsewhere)
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state)
        self.assertTrue((elsewhere / "a" / "a.nc").exists())

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

    def test_a_limit_on_the_size_of_files_is_a_full_disk(self):
        self.daemon.end()
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, before[1]))
        try:
            self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state,
                                 "--upload-limit", "8M")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        self.assert_refused(self.put("large.raw", bytes(3 << 20)), 507, "too large")
        self.assertEqual(self.files(), [])
        self.assertEqual(self.put("small.raw", bytes(1 << 19)).status, 201)

    def test_names_and_parameters_are_checked(self):
        for name in ("..", "a%2Fb", ".hidden", "a..b", "a.", "-a", "a%20b", "a*", "a%00", "x" * 81):
            answer = self.put(name, b"x")
            self.assertIn(answer.status, (404, 422), name)
        self.assert_refused(self.put("a.nc", b""), 422, "body")
        self.assert_refused(self.put("a.nc", b"x", "?keep=0"), 422, "'keep'")
        self.assert_refused(self.put("a.nc", b"x", "?keep=9999999"), 422, "604800")
        self.assert_refused(self.put("a.nc", b"x", "?size=1"), 400, "'size'")
        self.assert_refused(self.put("a.nc", b"x", Content_Encoding="gzip"), 415, "Encoding")
        self.assert_refused(self.put("a.nc", b"x", Content_Range="bytes 0-0/9"), 400, "whole")
        self.assertEqual(self.put("a.nc", b"x").status, 201)
        answer = self.put("a.nc", b"x")
        self.assert_refused(answer, 409, "exists")
        self.assertEqual(answer.json()["type"], "/problems/conflict")
        self.assertNotIn("Retry-After", answer.headers)
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
                            (["--upload-limit", "much", "--state-dir", self.state], "much"),
                            (["--upload-limit", "8191", "--state-dir", self.state], "8K")):
            done = subprocess.run([PROGRAM, "serve", "tornado", "--listen", "127.0.0.1:0", *given],
                                  capture_output=True, text=True, check=False, timeout=30)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(text, done.stderr)


if __name__ == "__main__":
    unittest.main()
