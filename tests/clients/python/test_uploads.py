"""Uploads: what is sent, against prepared answers; files and stores of Zarr, against the real
daemon."""
import base64
import hashlib
import json
import os
import pathlib
import tempfile
import unittest
import unittest.mock

import numpy as np
from support import Prepared, problem, shared_server, start, windsplat


def write_store(folder, values, version):
    """A store of one array (z, y, x), a chunk a level."""
    name = "b/{}.0.0" if version == 2 else "b/c/{}/0/0"
    chunks = [1, *values.shape[1:]]
    if version == 2:
        documents = {".zgroup": {"zarr_format": 2}, "b/.zattrs": {"_ARRAY_DIMENSIONS": [*"zyx"]},
                     "b/.zarray": {"zarr_format": 2, "shape": values.shape, "chunks": chunks,
                                   "dtype": "<f4", "compressor": None, "fill_value": None,
                                   "order": "C", "filters": None}}
    else:
        key = {"name": "default"}
        grid = {"name": "regular", "configuration": {"chunk_shape": chunks}}
        codecs = [{"name": "bytes", "configuration": {"endian": "little"}}]
        documents = {"zarr.json": {"zarr_format": 3, "node_type": "group"},
                     "b/zarr.json": {"zarr_format": 3, "node_type": "array", "codecs": codecs,
                                     "shape": values.shape, "data_type": "float32",
                                     "chunk_grid": grid, "chunk_key_encoding": key,
                                     "fill_value": 0, "dimension_names": [*"zyx"]}}
    files = {where: json.dumps(one).encode() for where, one in documents.items()}
    files |= {name.format(k): level.tobytes() for k, level in enumerate(values)}
    for where, body in files.items():
        path = folder / where
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(body)


class Uploads(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name) / "my winds.nc"
        self.path.write_bytes(b"0123456789" * 1000)

    def test_a_file_is_sent_with_its_digest_and_opened(self):
        done = {"id": "1", "kind": "dataset", "state": "done", "result": "winds", "problem": None}
        refused = (429, {"Retry-After": "0"}, problem(429))
        with Prepared(refused, (201, {}, {}), (202, {}, done)) as there:
            sent = []
            dataset = windsplat.Server(there.url).upload(
                self.path, keep=60, progress=lambda *counts: sent.append(counts))
            self.assertEqual(dataset.id, "winds")
            again, put, post = there.requests
            self.assertEqual(again, put)
            self.assertRegex(put, r"^PUT /v1/uploads/my-winds-[0-9a-f]{16}\.nc\?keep=60$")
            self.assertEqual(post, "POST /v1/datasets")
            self.assertEqual(there.bodies[1], self.path.read_bytes())
            digest = base64.b64encode(hashlib.sha256(there.bodies[1]).digest()).decode()
            self.assertEqual(there.headers[1]["Content-Digest"], f"sha-256=:{digest}:")
            self.assertEqual((sent[0], sent[-1]), ((0, 10_000), (10_000, 10_000)))
            self.assertEqual(json.loads(there.bodies[2]),
                             {"upload": put.split("/")[3].split("?")[0]})
            dataset.close(forget=True)
            self.assertEqual(there.requests[-1], put.replace("PUT", "DELETE").split("?")[0])

    def test_a_server_that_takes_no_uploads_says_so_of_a_long_file_too(self):
        self.path.write_bytes(bytes(100_000))  # more than other bodies may have
        with self.assertRaisesRegex(windsplat.Unauthorized, "--upload-limit and --state-dir"):
            shared_server()[0].upload(self.path)

    def test_an_upload_that_cannot_be_opened_is_removed(self):
        with Prepared((201, {}, {}), (422, {}, problem(422)), (204, {}, {})) as there:
            with self.assertRaises(windsplat.InvalidView):
                windsplat.Server(there.url).upload(self.path)
            self.assertEqual([one.split()[0] for one in there.requests], ["PUT", "POST", "DELETE"])


class Stores(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.server = start("tornado:8", upload_limit="16M", state_dir=folder.name)
        cls.addClassCleanup(cls.server.close)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.temporary = self.folder / "temporary"
        self.temporary.mkdir()
        patch = unittest.mock.patch("tempfile.tempdir", str(self.temporary))
        patch.start()
        self.addCleanup(patch.stop)

    def test_the_folder_of_a_zarr_store_is_sent_as_a_file_and_opened(self):
        for version in (2, 3):
            with self.subTest(version):
                values = np.random.default_rng(version).random((3, 40, 50), "f4")
                store = self.folder / f"v{version}.zarr"
                write_store(store, values, version)
                os.utime(next(store.rglob("*2.0.0" if version == 2 else "c/2/0/0")), (0, 0))
                sent = []
                dataset = self.server.upload(store, progress=lambda *one: sent.append(one))
                self.assertRegex(dataset.upload_id, rf"^v{version}-[0-9a-f]{{16}}\.zip$")
                np.testing.assert_array_equal(dataset.values("b").array, values)
                self.assertEqual(sent[-1][0], sent[-1][1])
                self.assertGreater(sent[-1][1], values.nbytes)
                dataset.close(forget=True)
                self.assertEqual(list(self.temporary.iterdir()), [])

    def test_another_folder_is_refused_with_what_can_be_uploaded(self):
        (self.folder / "winds.nc").write_bytes(b"CDF")
        text = r"without a Zarr store \(no \.zgroup.*one file, or"
        with self.assertRaisesRegex(ValueError, text):
            self.server.upload(self.folder)

    def test_a_store_with_what_is_no_file_of_its_own_is_not_sent(self):
        store = self.folder / "a.zarr"
        for make in (lambda path: path.symlink_to(self.folder), lambda path: os.mkfifo(path),
                     lambda path: path.symlink_to("nowhere"),
                     lambda path: path.symlink_to("/etc/hostname")):
            write_store(store, np.zeros((2, 2, 2), "f4"), 2)
            make(store / "b" / "9")
            with self.assertRaisesRegex(ValueError, r"a\.zarr/b/9' is neither"):
                self.server.upload(store)
            (store / "b" / "9").unlink()
        self.assertEqual(list(self.temporary.iterdir()), [])


if __name__ == "__main__":
    unittest.main()
