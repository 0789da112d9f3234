#!/usr/bin/env python3
"""Fields whose steps are larger than the memory limit: probes, series and arrays of values read
the boxes that they need, against the files as read by netCDF4.

Usage: boxes.py --program=PATH [unittest arguments]
"""
import io
import json
import pathlib
import re
import struct
import tempfile
import unittest

import netCDF4
import numpy as np

from served import Daemon, taken_program

PROGRAM = taken_program()
LIMIT = 192  # MiB, of which 68 are for data
SIDES = (512, 1024, 1024)  # x, y, z of the raw file: 2 GiB, and a vector of 6 GiB
SHAPE = (200, 300, 320)  # z, y, x of the netCDF files: 73 MiB
HOURS = (0, 6, 12)
SPACINGS = {"chunked": 0.2, "times": 360 / SHAPE[2], "classic": 0.2,
            "one_chunk": 0.2}  # degrees of longitude


def write_raw(folder):
    """A sparse file of zeros with a few numbers, by their indices."""
    document = {"windsplat": "raw", "file": "large.raw", "dims": dict(zip("xyz", SIDES)),
                "type": "float32", "endian": "little",
                "fields": [{"name": "q"}, {"name": "wind", "components": ["u", "v", "w"]}]}
    (folder / "large.json").write_text(json.dumps(document))
    samples = SIDES[0] * SIDES[1] * SIDES[2]
    rng = np.random.default_rng(5)
    known = {}
    with open(folder / "large.raw", "wb") as file:
        file.truncate(16 * samples)
        for index in [(0, 0, 0), tuple(n - 1 for n in SIDES),
                      *(tuple(map(int, rng.integers(0, SIDES))) for _ in range(12)),
                      *(tuple(64 * int(rng.integers(0, n // 64)) for n in SIDES)
                        for _ in range(12))]:
            at = index[0] + SIDES[0] * (index[1] + SIDES[1] * index[2])
            known[index] = [float(np.float32(value)) for value in rng.normal(size=4)]
            file.seek(4 * at)
            file.write(struct.pack("<f", known[index][0]))
            file.seek(4 * samples + 12 * at)
            file.write(struct.pack("<3f", *known[index][1:]))
    return known


def write_grid(path, chunk, hours=HOURS):
    """Packed, masked, with the top and the north first."""
    form = "NETCDF4" if chunk else "NETCDF3_64BIT_OFFSET"
    with netCDF4.Dataset(path, "w", format=form) as file:
        axes = {"time": (hours, "hours since 2001-01-01", None),
                "level": (np.arange(1, SHAPE[0] + 1) * 5.0, "hPa", "air_pressure"),
                "lat": (np.arange(SHAPE[1])[::-1] * 0.2, "degrees_north", "latitude"),
                "lon": (np.arange(SHAPE[2]) * SPACINGS[path.stem], "degrees_east", "longitude")}
        for name, (values, units, standard) in axes.items():
            file.createDimension(name, len(values))
            axis = file.createVariable(name, "f8", (name,))
            axis.units = units
            if standard:
                axis.standard_name = standard
            axis[:] = values
        storage = {"chunksizes": chunk, "zlib": True, "complevel": 1} if chunk else {}
        t = file.createVariable("t", "i2", tuple(axes), fill_value=-32768, **storage)
        t.units, t.scale_factor, t.add_offset = "K", 0.01, 250.0
        t.set_auto_maskandscale(False)
        z, y, x = np.ogrid[:SHAPE[0], :SHAPE[1], :SHAPE[2]]
        for step in range(len(hours)):
            data = ((z * 31 + y * 7 + x * 3 + step * 1000) % 20000 - 10000).astype("i2")
            data[(z + y * x) % 11 == step] = -32768
            t[step] = data


class Boxes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="windsplat-boxes-")
        folder = pathlib.Path(cls.folder.name)
        cls.known = write_raw(folder)
        write_grid(folder / "chunked.nc", (1, 33, 64, 50))
        write_grid(folder / "times.nc", (3, 20, 40, 320))
        write_grid(folder / "classic.nc", None)
        write_grid(folder / "one_chunk.nc", (1, *SHAPE), HOURS[:1])
        with netCDF4.Dataset(folder / "chunked.nc") as file:
            # South first, and the greatest pressure first.
            cls.t = np.ma.filled(file["t"][:].astype("f4"), np.nan)[:, ::-1, ::-1]
        cls.daemon = Daemon(PROGRAM, folder / "large.json", folder / "chunked.nc",
                            folder / "times.nc", folder / "classic.nc", folder / "one_chunk.nc",
                            "tornado:2048x2048x1536", f"--memory-limit={LIMIT}M")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.end()
        cls.folder.cleanup()

    def tearDown(self):
        with open(f"/proc/{self.daemon.process.pid}/status", encoding="ascii") as status:
            peak = int(re.search(r"VmHWM:\s+(\d+) kB", status.read())[1])
        self.assertLess(peak, LIMIT << 10, "KiB of the daemon")

    def get(self, path):
        answer = self.daemon.get(f"/v1/datasets/{path}")
        self.assertEqual(answer.status, 200, answer.body)
        return answer

    def array(self, query, dataset, field="t"):
        answer = self.get(f"{dataset}/fields/{field}/values.npy?{query}")
        return np.load(io.BytesIO(answer.body), allow_pickle=False)

    def assert_same(self, found, wanted, message=""):
        self.assertEqual(found.shape, wanted.shape, message)
        self.assertTrue(np.array_equal(np.isnan(found), np.isnan(wanted)), message)
        self.assertTrue(np.allclose(found, wanted, rtol=1e-6, atol=0, equal_nan=True), message)

    def test_the_whole_step_does_not_fit(self):
        for path in ("large/fields/q/histogram", "chunked/fields/t/range"):
            answer = self.daemon.get(f"/v1/datasets/{path}")
            status, detail = answer.detail()
            self.assertEqual(status, 507, detail)
            self.assertIn("would suffice", detail)

    def test_descriptions_say_what_pictures_need(self):
        for dataset in ("large", "chunked"):
            notes = " ".join(self.get(dataset).json()["notes"])
            self.assertRegex(notes, "is not shown, but its fields can be probed: .* would suffice")
            self.assertIn("a store that 'windsplat convert' makes of the dataset", notes)
            answer = self.daemon.get(f"/v1/datasets/{dataset}/frame.png?width=32&height=32")
            status, detail = answer.detail()
            self.assertEqual(status, 507, detail)
            self.assertIn("would suffice", detail)

    def test_fields_whose_chunks_do_not_fit_are_refused_with_the_limit_that_would_suffice(self):
        listed = {one["id"]: one for one in self.daemon.get("/v1/datasets").json()["datasets"]}
        failed = [name for name, one in listed.items() if one["state"] == "failed"]
        self.assertEqual(failed, ["one_chunk"])
        self.assertRegex(" ".join(listed["one_chunk"]["notes"]),
                         "'t' needs 73.2 MiB at a step; .* would suffice")

    def test_arrays_that_read_far_more_than_they_have_are_refused(self):
        path = "/v1/datasets/tornado:2048x2048x1536/fields/wind/values.npy?stride=256,256"
        status, detail = self.daemon.get(f"{path},1").detail()
        self.assertEqual(status, 422, detail)
        self.assertIn("would read 73728.0 MiB of 'wind', and a request reads at most 16384.0 MiB",
                      detail)
        self.assertEqual(self.daemon.get(f"{path},512").status, 200)

    def loads(self):
        text = self.daemon.get("/metrics").body.decode()
        return int(re.search(r'^windsplat_volume_loads_total{result="ok"} (\d+)', text, re.M)[1])

    def test_strided_layers_of_a_column_are_read_together(self):
        i, j, k = next(index for index in self.known if index[2] % 2 == 1)
        before = self.loads()
        column = self.array(f"bbox={i},{j},{i},{j}&stride=1,1,2&level=1,{SIDES[2] - 1}",
                            "large", "q").ravel()
        self.assertEqual(column.size, SIDES[2] // 2)
        self.assertEqual(column[k // 2], np.float32(self.known[i, j, k][0]))
        self.assertLess(self.loads() - before, 4)

    def test_probes_of_a_sparse_file_of_gigabytes_are_its_numbers(self):
        for index, values in self.known.items():
            asked = ",".join(map(str, index))
            told = self.get(f"large/probe?index={asked}").json()["values"]
            found = [told["q"]["value"], *told["wind"]["value"]]
            self.assertTrue(np.allclose(found, values, rtol=1e-6, atol=0), (index, found))

    def test_values_of_a_sparse_file_of_gigabytes_are_its_numbers(self):
        for (i, j, k), values in self.known.items():
            box = f"bbox={i},{j},{i},{j}&level={k}"
            self.assertEqual(self.array(box, "large", "q").ravel().tolist(), values[:1])
            self.assertEqual(self.array(box, "large", "wind").ravel().tolist(), values[1:])
        thin = self.array("stride=64,64,64", "large", "q")
        self.assertEqual(thin.shape, (16, 16, 8))
        wanted = np.zeros(thin.shape, "f4")
        for (i, j, k), values in self.known.items():
            if i % 64 == j % 64 == k % 64 == 0:
                wanted[k // 64, j // 64, i // 64] = values[0]
        self.assertTrue(np.array_equal(thin, wanted))

    def test_probes_of_turned_packed_and_masked_fields_are_those_of_the_file(self):
        rng = np.random.default_rng(6)
        masked = 0
        for dataset in ("chunked", "times", "classic"):
            for _ in range(60):
                step, k, j, i = (int(rng.integers(n)) for n in (len(HOURS), *SHAPE))
                told = self.get(f"{dataset}/probe?index={i},{j},{k}&step={step}").json()
                wanted = float(self.t[step, k, j, i])
                found = told["values"]["t"]["value"]
                masked += np.isnan(wanted)
                if np.isnan(wanted):
                    self.assertIsNone(found)
                else:
                    self.assertAlmostEqual(found, wanted, 4)
        self.assertGreater(masked, 3)

    def test_series_are_those_of_the_file(self):
        for dataset in ("chunked", "times", "classic"):
            for i, j, k in ((0, 0, 0), (319, 299, 199), (160, 33, 77)):
                told = self.get(f"{dataset}/fields/t/series?index={i},{j},{k}").json()
                found = np.array([np.nan if one is None else one for one in told["values"]], "f4")
                self.assert_same(found, self.t[:, k, j, i])

    def test_values_of_boxes_and_strides_are_those_of_the_file(self):
        rng = np.random.default_rng(7)
        for round_ in range(36):
            dataset = ("chunked", "times", "classic")[round_ % 3]
            low = [int(rng.integers(n)) for n in SHAPE]
            high = [int(rng.integers(first, n)) for first, n in zip(low, SHAPE)]
            stride = [int(rng.integers(1, most)) for most in ((2, 5, 60)[round_ % 3], 6, 6)]
            step = int(rng.integers(len(HOURS)))
            (z0, y0, x0), (z1, y1, x1) = low, high
            west, east = (x * SPACINGS[dataset] for x in (x0, x1))
            query = (f"bbox={west:.4f},{y0 * 0.2:.1f},{east:.4f},{y1 * 0.2:.1f}"
                     f"&level={1000 - 5 * z0},{1000 - 5 * z1}"
                     f"&stride={stride[2]},{stride[1]},{stride[0]}&step={step}")
            wanted = self.t[step, z0:z1 + 1:stride[0], y0:y1 + 1:stride[1], x0:x1 + 1:stride[2]]
            if z0 == z1:
                wanted = wanted.reshape(1, *wanted.shape[-2:])
            if 4 * wanted.size > 40 << 20:
                continue  # does not fit beside the boxes
            self.assert_same(self.array(query, dataset), wanted, f"{dataset} {query}")

    def test_values_beyond_the_seam_of_longitudes_are_those_of_the_file(self):
        across = [*range(302, 320), *range(18)]
        for stride in (1, 5):
            found = self.array(f"bbox=-20.25,2,19.125,8&level=200,600&stride={stride},1", "times")
            self.assert_same(found, self.t[0, 80:161, 10:41, across[::stride]].transpose(1, 2, 0))

    def test_differences_of_steps_are_those_of_the_file(self):
        query = "bbox=2,3,9,8&level=200,600&step=2&minusStep=0"
        for dataset in ("chunked", "classic"):
            wanted = (self.t[2] - self.t[0])[80:161, 15:41, 10:46]
            found = self.array(query, dataset)
            self.assertEqual(found.shape, wanted.shape)
            self.assertTrue(np.allclose(found, wanted, rtol=0, atol=1e-4, equal_nan=True))

if __name__ == "__main__":
    unittest.main()
