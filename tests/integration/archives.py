#!/usr/bin/env python3
"""Uploaded archives: unpacked within limits by a confined process, and opened.

Usage: archives.py --program=PATH [unittest arguments]
"""
import contextlib
import io
import json
import os
import pathlib
import signal
import socket
import struct
import time
import unittest
import zipfile

import numpy as np

from served import Daemon
from uploads import LIMIT, PROGRAM, WithUploads, cube


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


def zip64(plain, entries=2, packed=100, header_at=0, disks=1, fields=None, record_at=None,
          directory_at=None):
    """A plain archive of two entries whose numbers, and those of its first entry, are in the
    records of ZIP64."""
    end, directory = plain.rindex(b"PK\5\6"), plain.index(b"PK\1\2")
    if fields is None:
        fields = struct.pack("<HHHHQQQ", 0x5455, 0, 1, 24, 100, packed, header_at)
    name = int.from_bytes(plain[directory + 28:directory + 30], "little")
    rest = directory + 46 + name
    entry = (plain[directory:directory + 20] + b"\xff" * 8 + plain[directory + 28:directory + 30] +
             struct.pack("<H", len(fields)) + plain[directory + 32:directory + 42] + b"\xff" * 4 +
             plain[directory + 46:rest])
    body = plain[:directory] + entry + fields + plain[rest:end]
    at = directory if directory_at is None else directory_at
    record = struct.pack("<IQHHIIQQQQ", 0x06064b50, 44, 45, 45, 0, 0, entries, entries,
                         len(body) - directory, at)
    locator = struct.pack("<IIQI", 0x07064b50, 0, len(body) if record_at is None else record_at,
                          disks)
    return body + record + locator + plain[end:end + 8] + b"\xff" * 12 + plain[end + 20:]


def special(name, mode):
    entry = zipfile.ZipInfo(name)
    entry.create_system, entry.external_attr = 3, mode << 16
    return entry


class Archives(WithUploads):
    """Zarr stores as ZIP archives."""

    def restart(self, limit):
        self.daemon.end()
        self.daemon = Daemon(PROGRAM, "tornado", "--state-dir", self.state, "--upload-limit", limit)

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

    def test_what_macos_adds_is_left_out(self):
        files = {f"storm/{name}": body for name, body in zarr_files(cube()).items()}
        added = {"__MACOSX/storm/._q": b"x", "storm/.DS_Store": b"x", ".DS_Store": b"x"}
        self.assertEqual(self.put("storm.zip", zipped(added | files)).status, 201)
        self.assertNotIn("DS_Store", " ".join(self.files()))
        self.assertTrue(np.array_equal(self.values(self.opened("storm.zip")), cube()))

    def test_zip64_is_read(self):
        plain = zipped({"a": b"x" * 100, "b": b"y"})
        self.assertEqual(self.put("a.zip", zip64(plain)).status, 201)
        self.assertEqual(self.files(), ["a/a.zip/a", "a/a.zip/b"])
        self.assertEqual((self.state / "uploads/a/a.zip/a").read_bytes(), b"x" * 100)

    def test_an_archive_of_more_entries_than_the_plain_form_has(self):
        self.restart("2G")
        body = zipped({f"{n}": b"%d" % n for n in range(70_000)})
        self.assertEqual(self.put("a.zip", body).status, 201)
        self.assertEqual(len(self.files()), 70_000)
        self.assertEqual((self.state / "uploads/a/a.zip/69999").read_bytes(), b"69999")

    def test_as_many_entries_as_the_mark_of_zip64(self):
        self.restart("2G")
        body = zipped({f"{n}": b"" for n in range(65_535)})
        self.assertEqual(self.put("a.zip", body).status, 201)
        self.assertEqual(len(self.files()), 65_535)
        # With the longest comment the locator is before the end that is searched for the record.
        plain = zipped({"a": b"x" * 100, "b": b"y"})
        commented = zip64(plain)[:-2] + b"\xff\xff" + b"c" * 65_535
        self.assertEqual(self.put("b.zip", commented).status, 201)

    def test_the_last_entry_of_a_name_counts(self):
        body = zipped({"a": b"first", "b": b"other", special("a", 0o100644): b"last"})
        self.assertEqual(self.put("a.zip", body).status, 201)
        self.assertEqual((self.state / "uploads/a/a.zip/a").read_bytes(), b"last")
        self.assertEqual((self.state / "uploads/a/a.zip/b").read_bytes(), b"other")

    def test_the_daemon_itself_parses_no_archive(self):
        body = zipped({f"{n}": os.urandom(64) for n in range(300)})
        pid = self.daemon.process.pid
        seen = set()
        with socket.create_connection(self.daemon.host.split(":")) as client:
            client.sendall(f"PUT /v1/uploads/a.zip HTTP/1.1\r\nHost: {self.daemon.host}\r\n"
                           f"Content-Length: {len(body)}\r\n\r\n".encode() + body)
            client.setblocking(False)
            answer = b""
            end = time.monotonic() + 60
            while time.monotonic() < end:
                try:
                    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
                        for child in (task / "children").read_text().split():
                            seen.add(pathlib.Path(f"/proc/{child}/status").read_text()
                                     .partition("Seccomp:\t")[2][:1])
                except OSError:  # a thread or loader has ended
                    pass
                try:
                    answer = client.recv(400)
                    break
                except BlockingIOError:
                    pass
        self.assertIn(b" 201 ", answer)
        self.assertIn("2", seen)

    def begun(self, name, body, client="127.0.0.1"):
        """A connection over which an upload was sent whole, from an address of this machine."""
        client = socket.create_connection(self.daemon.host.split(":"), source_address=(client, 0))
        client.sendall(f"PUT /v1/uploads/{name} HTTP/1.1\r\nHost: {self.daemon.host}\r\n"
                       f"Content-Length: {len(body)}\r\n\r\n".encode() + body)
        return client

    def loaders(self):
        """Processes that unpack."""
        found = []
        for task in pathlib.Path(f"/proc/{self.daemon.process.pid}/task").iterdir():
            try:
                found += map(int, (task / "children").read_text().split())
            except OSError:  # a thread has ended
                pass
        return found

    @staticmethod
    def cpu_limit(process):
        """Seconds, or "unlimited"."""
        limits = pathlib.Path(f"/proc/{process}/limits").read_text()
        return limits.partition("Max cpu time")[2].split()[0]

    def stop_loaders(self, count):
        """Waits until so many unpack, and stops them."""
        stopped = set()

        def are_stopped():
            for one in set(self.loaders()) - stopped:
                os.kill(one, signal.SIGSTOP)
                stopped.add(one)
            return len(stopped) >= count

        self.wait_until(are_stopped)

    def test_the_end_of_the_daemon_does_not_wait_for_an_archive(self):
        self.restart("1G")
        with self.begun("a.zip", zipped({f"{n}": b"x" for n in range(20_000)})):
            self.stop_loaders(1)
            begun = time.monotonic()
            self.daemon.end()
            self.assertLess(time.monotonic() - begun, 11)
        self.assertFalse((self.state / "uploads").exists())

    def test_archives_delay_no_other_uploads_and_those_of_an_address_take_turns(self):
        self.restart("1G")
        body = zipped({f"{n}": b"x" for n in range(5_000)})
        with contextlib.ExitStack() as clients:
            sent = [clients.enter_context(self.begun(f"a{n}.zip", body)) for n in range(4)]
            self.stop_loaders(1)
            self.wait_until(lambda: self.cpu_limit(self.loaders()[0]) != "unlimited")
            self.assertLess(int(self.cpu_limit(self.loaders()[0])), 80)
            self.wait_until(lambda: self.bytes_on_disk() >= 4 * len(body))
            time.sleep(1)
            self.assertEqual(len(self.loaders()), 1)
            sent.append(clients.enter_context(self.begun("b.zip", body, "127.0.0.2")))
            self.stop_loaders(2)
            with self.begun("plain.nc", b"x" * 100_000, "127.0.0.2") as other:
                other.settimeout(60)
                self.assertIn(b" 201 ", other.recv(400))
            self.assertEqual(len(self.loaders()), 2)
            for client in sent:
                client.setblocking(False)
                with self.assertRaises(BlockingIOError):
                    client.recv(1)
            for one in self.loaders():
                os.kill(one, signal.SIGCONT)
            for client in sent:
                client.settimeout(60)
                self.assertIn(b" 201 ", client.recv(400))

    def test_an_archive_whose_client_has_left_is_discarded(self):
        self.restart("1G")
        body = zipped({f"{n}": b"x" for n in range(20_000)})
        client = self.begun("a.zip", body)
        self.wait_until(lambda: len(self.files()) > 1)
        client.close()
        self.wait_until(lambda: self.files() == [])
        self.assertEqual(self.put("a.zip", zipped({"a": b"x"})).status, 201)

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
            "more than 100000 entries": [zip64(good, entries=n) for n in (100_001, 2**64 - 1)],
            "twice": [zipped({"a": b"1", "a/b": b"2"}), zipped({"a": b"1", "a/": b""}),
                      zipped({"a/b": b"1", "a": b"2"})],
            "checksum": [good.replace(b"x" * 100, b"x" * 99 + b"z")],
            "encrypted": [patched(entry + 8, 1, 2)],
            "neither stored nor deflated": [patched(entry + 10, 12, 2)],
            "overlap": [good[:entry + 20] + 2 * len(good).to_bytes(4, "little") +
                        good[entry + 28:]],
            "of two sizes": [zip64(good, packed=2**63)],
            "no record of ZIP64": [patched(end + 16, 0xffffffff), zip64(good, record_at=2**64 - 1),
                                   zip64(good, record_at=1)],
            "whose sizes are missing": [patched(entry + 24, 0xffffffff), zip64(good, fields=b""),
                                        zip64(good, fields=struct.pack("<HHQ", 1, 8, 100)),
                                        zip64(good, fields=struct.pack("<HHQ", 1, 99, 100))],
            "beyond its end": [zip64(good, header_at=2**64 - 1), zip64(good, header_at=2**63)],
            "several parts": [patched(end + 4, 1, 2), zip64(good, disks=2)],
            "directory": [patched(end + 12, 10), patched(entry, 0),
                          patched(entry + 28, 9999, 2), zip64(good, directory_at=2**64 - 9)],
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

    def test_what_can_never_fit_is_too_large(self):
        body = zipped({f"{name}": b"" for name in range(LIMIT // 2 // 4096 + 1)})
        self.assert_refused(self.put("a.zip", body), 413, "half of --upload-limit")
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
