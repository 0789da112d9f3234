#!/usr/bin/env python3
"""Values as arrays: boxes, levels and strides against the file, read by netCDF4.

Usage: values.py --program=PATH [unittest arguments]
"""
import io
import json
import pathlib
import tempfile
import unittest

import netCDF4
import numpy as np

from served import Daemon, taken_program, write_columns

PROGRAM = taken_program()
LIMIT = 64 << 20
LONGITUDES = np.arange(0, 360, 10.0)
LATITUDES = np.arange(80, -81, -20.0)  # north first in the file
LEVELS = np.array([300.0, 500.0, 850.0, 1000.0])  # top first in the file
HOURS = (0, 6, 12)


def write_globe(path, seed=3):
    with netCDF4.Dataset(path, "w") as file:
        axes = {"time": (HOURS, "hours since 2001-01-01"), "level": (LEVELS, "hPa"),
                "lat": (LATITUDES, "degrees_north"), "lon": (LONGITUDES, "degrees_east")}
        names = {"level": "air_pressure", "lat": "latitude", "lon": "longitude"}
        for name, (values, units) in axes.items():
            file.createDimension(name, len(values))
            axis = file.createVariable(name, "f8", (name,))
            axis.units = units
            if name in names:
                axis.standard_name = names[name]
            axis[:] = values
        rng = np.random.default_rng(seed)
        for name, standard in (("u", "eastward_wind"), ("v", "northward_wind"),
                               ("t", "air_temperature")):
            variable = file.createVariable(name, "f4", tuple(axes), fill_value=-999)
            variable.standard_name, variable.units = standard, "K" if name == "t" else "m s-1"
            data = rng.normal(size=(len(HOURS), len(LEVELS), len(LATITUDES), len(LONGITUDES)))
            if name == "t":
                data[rng.random(data.shape) < 0.1] = -999
            variable[:] = data.astype("f4")


def write_large(path):
    """Above the limit as a whole: 300 x 300 x 200 values."""
    with netCDF4.Dataset(path, "w") as file:
        for name, count in (("z", 200), ("y", 300), ("x", 300)):
            file.createDimension(name, count)
            axis = file.createVariable(name, "f8", (name,))
            axis.units = "m"
            axis[:] = np.arange(count) * 0.1
        variable = file.createVariable("q", "f4", ("z", "y", "x"))
        variable.units = "1"
        for k in range(200):
            variable[k] = np.arange(90000, dtype="f4").reshape(300, 300) + k


class Values(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="windsplat-values-")
        folder = pathlib.Path(cls.folder.name)
        write_globe(folder / "globe.nc")
        write_globe(folder / "other.nc", 4)
        write_columns(folder / "columns.nc")
        write_large(folder / "large.nc")
        cls.file = {}
        for name in ("globe", "other"):
            with netCDF4.Dataset(folder / f"{name}.nc") as file:
                # The order of arrays: south first, and the greatest pressure first.
                cls.file[name] = {field: np.ma.filled(file[field][:], np.nan)[:, ::-1, ::-1]
                                  for field in ("u", "v", "t")}
        cls.daemon = Daemon(PROGRAM, *(folder / f"{name}.nc" for name in
                                       ("globe", "other", "columns", "large")), "tornado")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.end()
        cls.folder.cleanup()

    def ask(self, query="", field="t", dataset="globe", kind="npy", **headers):
        return self.daemon.get(f"/v1/datasets/{dataset}/fields/{field}/values.{kind}?{query}",
                               **headers)

    def array(self, query="", field="t", dataset="globe"):
        """The array and what it has."""
        answer = self.ask(query, field, dataset)
        self.assertEqual(answer.status, 200, answer.body)
        self.assertEqual(answer.headers["Content-Type"], "application/x-npy")
        array = np.load(io.BytesIO(answer.body), allow_pickle=False)
        self.assertEqual(array.dtype, np.dtype("<f4"))
        told = json.loads(answer.headers["Windsplat-Values"])
        self.assertEqual(tuple(told["shape"]), array.shape)
        self.assertEqual(len(told["dims"]), array.ndim)
        return array, told

    def assert_same(self, found, wanted):
        self.assertTrue(np.array_equal(found, wanted, equal_nan=True))

    def assert_refused(self, answer, *texts, status=422):
        found, detail = answer.detail()
        self.assertEqual(found, status, detail)
        for text in texts:
            self.assertIn(text, detail)

    def test_a_step_is_that_of_the_file_with_masked_samples_as_nan(self):
        array, told = self.array("step=2")
        self.assert_same(array, self.file["globe"]["t"][2])
        self.assertTrue(np.isnan(array).any())
        self.assertEqual((told["dims"], told["units"], told["step"]), (["z", "y", "x"], "K", 2))
        self.assertEqual(told["time"], {"value": 12, "text": "2001-01-01T12:00:00Z"})
        ends = {axis: (one["first"], one["last"], one["count"]) for axis, one in
                told["axes"].items()}
        self.assertEqual(ends, {"x": (0, 350, 36), "y": (-80, 80, 9), "z": (1000, 300, 4)})

    def test_a_vector_has_its_components_first(self):
        array, told = self.array("step=1", "wind")
        self.assertEqual(told["dims"], ["component", "z", "y", "x"])
        self.assert_same(array, np.stack([self.file["globe"][name][1] for name in ("u", "v")]))

    def test_one_level_is_a_map_and_a_range_keeps_its_axis(self):
        whole = self.file["globe"]["t"][0]
        array, told = self.array("level=850")
        self.assert_same(array, whole[1])
        self.assertEqual((told["dims"], told["axes"]["z"]["first"]), (["y", "x"], 850))
        for query in ("level=400,900", "level=900,400", "level=500,850"):
            array, told = self.array(query)
            self.assert_same(array, whole[1:3])
            self.assertEqual(told["axes"]["z"]["index"], 1)
        self.assert_refused(self.ask("level=700"), "'level'", "500 and 850")
        self.assert_refused(self.ask("level=1013"), "1000")

    def test_boxes_hold_the_samples_within(self):
        array, told = self.array("bbox=35,-45,120,20&level=500")
        self.assert_same(array, self.file["globe"]["t"][0][2, 2:6, 4:13])
        self.assertEqual((told["axes"]["x"]["first"], told["axes"]["x"]["last"]), (40, 120))
        self.assertNotIn("turn", told["axes"]["x"])

    def test_boxes_pass_the_seam_of_longitudes(self):
        whole = self.file["globe"]["t"][0][0]
        for query, first in (("-25,-80,15,80", -20), ("335,-80,15,80", 340),
                             ("335,-80,375,80", 340)):
            array, told = self.array(f"bbox={query}&level=1000")
            self.assert_same(array, whole[:, [34, 35, 0, 1]])
            x = told["axes"]["x"]
            self.assertEqual((x["first"], x["last"], x["index"], x["turn"]),
                             (first, first + 30, 34, 36))
        array, told = self.array("bbox=-180,-80,180,80&level=1000")
        self.assertEqual(array.shape, (9, 36))
        here = (np.array(self.ask("bbox=-180,-80,180,80&level=1000", kind="json").json()
                         ["axes"]["x"]["coordinates"]) % 360 / 10).astype(int)
        self.assert_same(array, whole[:, here])

    def test_strides_count_from_the_first_sample(self):
        whole = self.file["globe"]["t"][0]
        for stride, part in (("3", whole[:, ::3, ::3]), ("5,2", whole[:, ::2, ::5]),
                             ("1,4,3", whole[::3, ::4, :]), ("100", whole[:, :1, :1])):
            self.assert_same(self.array(f"stride={stride}")[0], part)
        array, told = self.array("bbox=-25,-80,65,80&level=1000&stride=3,1")
        self.assert_same(array, whole[0][:, [34, 1, 4]])
        self.assertEqual((told["axes"]["x"]["stride"], told["axes"]["x"]["last"]), (3, 40))

    def test_differences_are_those_of_the_file(self):
        wanted = self.file["globe"]["t"][2] - self.file["other"]["t"][2]
        self.assert_same(self.array("step=2&minus=other")[0], wanted)
        wanted = self.file["globe"]["u"][2, 1] - self.file["globe"]["u"][0, 1]
        self.assert_same(self.array("step=2&minusStep=0&level=850", "u")[0], wanted)

    def test_columns_beyond_the_box_are_masked(self):
        rows, columns = np.meshgrid(np.arange(9), np.arange(12), indexing="ij")
        longitude, latitude = 10 + 0.5 * columns - 0.1 * rows, 48 + 0.5 * rows + 0.1 * columns
        inside = (longitude >= 11) & (longitude <= 13.2) & (latitude >= 49) & (latitude <= 51.2)
        wanted = np.where(inside, rows * 100.0 + columns, np.nan)
        kept = np.ix_(inside.any(1), inside.any(0))
        query = "bbox=11,49,13.2,51.2"
        array, _ = self.array(query, dataset="columns")
        self.assert_same(array, wanted[kept])
        told = self.ask(query, dataset="columns", kind="json").json()
        self.assertTrue(np.allclose(np.reshape(told["longitudes"], array.shape), longitude[kept]))
        self.assertTrue(np.allclose(np.reshape(told["latitudes"], array.shape), latitude[kept]))

    def test_data_without_longitudes_have_boxes_in_their_axes(self):
        array, told = self.array("bbox=1,2,1.45,2.2&level=0.3,0.5", "q", "large")
        self.assertEqual(array.shape, (3, 3, 5))
        self.assertEqual(array[0, 0, 0], 20 * 300 + 10 + 3)
        self.assertEqual(told["axes"]["y"]["units"], "m")
        self.assert_refused(self.ask("bbox=2,0,1,3", "q", "large"), "only longitudes")

    def test_arrays_are_bounded(self):
        answer = self.ask("", "q", "large")
        self.assert_refused(answer, "200 x 300 x 300", "72000000", str(LIMIT), "stride")
        array, _ = self.array("stride=2,2,2", "q", "large")
        self.assertEqual(array.shape, (100, 150, 150))
        self.assertEqual(array[1, 1, 1], 602 + 2)

    def test_json_has_every_coordinate_and_no_values(self):
        told = self.ask("bbox=-25,-80,15,80&stride=1,3", kind="json").json()
        self.assertEqual(told["axes"]["x"]["coordinates"], [-20, -10, 0, 10])
        self.assertEqual(told["axes"]["y"]["coordinates"], [-80, -20, 40])
        self.assertEqual(told["axes"]["z"]["coordinates"], [1000, 850, 500, 300])
        self.assertEqual(told["shape"], [4, 3, 4])

    def test_arrays_are_revalidated(self):
        first = self.ask("step=1")
        again = self.ask("step=1", If_None_Match=first.headers["ETag"])
        self.assertEqual((again.status, again.body), (304, b""))
        for query, field in (("step=2", "t"), ("step=1&stride=2", "t"), ("step=1", "u"),
                             ("step=1&minusStep=0", "t")):
            other = self.ask(query, field, If_None_Match=first.headers["ETag"])
            self.assertEqual(other.status, 200, query)
        at_time = self.ask("datetime=2001-01-01T06:00Z", If_None_Match=first.headers["ETag"])
        self.assertEqual(at_time.status, 304)

    def test_json_is_revalidated_in_either_form(self):
        for coding in ("identity", "gzip"):
            sent = {"query": "stride=2,2,2", "field": "q", "dataset": "large", "kind": "json",
                    "Accept_Encoding": coding}
            first = self.ask(**sent)
            self.assertEqual(first.headers.get("Content-Encoding", "identity"), coding)
            again = self.ask(**sent, If_None_Match=first.headers["ETag"])
            self.assertEqual((again.status, again.body), (304, b""), coding)
            for name in ("ETag", "Vary"):
                self.assertEqual(again.headers[name], first.headers[name], coding)

    def test_what_is_not_understood_is_refused(self):
        for query, status, text in (("bbox=1,2,3", 400, "four numbers"),
                                    ("bbox=1,2,3,x", 400, "four numbers"),
                                    ("bbox=0,20,10,-20", 422, "south beyond its north"),
                                    ("bbox=1,-80,2,80", 422, "'bbox'"),
                                    ("level=1,2,3", 400, "'level'"),
                                    ("level=nan", 400, "'level'"),
                                    ("stride=0", 422, "'stride'"), ("stride=1.5", 422, "'stride'"),
                                    ("stride=1,1,1,1", 400, "'stride'"),
                                    ("step=3", 422, "'step'"), ("size=3", 400, "'size'"),
                                    ("step=0&datetime=2001-01-01", 422, "mutually exclusive"),
                                    ("datetime=2001-01-01T01:00", 422, "nearest=true")):
            self.assert_refused(self.ask(query), text, status=status)
        self.assert_refused(self.ask("", "nothing"), "nothing", status=404)


if __name__ == "__main__":
    unittest.main()
