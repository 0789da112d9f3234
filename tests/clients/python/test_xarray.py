"""The accessor of xarray: what the server reads is what the arrays hold."""
import tempfile
import unittest

import numpy as np
import support
import xarray
from support import start, windsplat

import windsplat.xarray as accessors

LEVELS = np.array([1000, 850, 700, 500, 300], dtype="f8")
LATITUDES = np.linspace(70, 20, 6)  # descending, as in many files
LONGITUDES = np.linspace(-30, 40, 8)
DIMENSIONS = ("time", "level", "latitude", "longitude")


def example():
    shape = (2, 5, 6, 8)
    values = np.arange(np.prod(shape), dtype="f8").reshape(shape)

    def variable(offset, **attributes):
        return DIMENSIONS, values + offset, attributes

    return xarray.Dataset(
        {
            "u": variable(1, units="m s-1", standard_name="eastward_wind"),
            "v": variable(2, units="m s-1", standard_name="northward_wind"),
            "a1": variable(3, units="V m-1"),
            "a2": variable(4, units="V m-1"),
            "a3": variable(5, units="V m-1"),
            "cc": variable(0, units="1", long_name="fraction of cloud cover"),
            "t2m": (("time", "latitude", "longitude"), values[:, 0], {"units": "K"}),
        },
        coords={
            "time": np.array(["2020-01-01T00", "2020-01-01T06"], dtype="datetime64[ns]"),
            "level": ("level", LEVELS, {"units": "hPa", "standard_name": "air_pressure"}),
            "latitude": ("latitude", LATITUDES, {"units": "degrees_north"}),
            "longitude": ("longitude", LONGITUDES, {"units": "degrees_east"}),
        },
    )


class Accessors(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.server = start("tornado:8", data_root=folder.name)
        cls.addClassCleanup(cls.server.close)

    def setUp(self):
        self.arrays = example()

    def view(self, *names, **more):
        return self.arrays.windsplat.view(*names, server=self.server, **more)

    def test_values_places_and_times_are_those_of_the_arrays(self):
        view = self.view("u", "v", scalar="cc", step=1)
        dataset = view.dataset
        self.assertEqual(view.get("/vector/field"), "wind")
        self.assertEqual(view.get("/scalars"), [{"field": "cc"}])
        np.testing.assert_array_equal(dataset.times,
                                      self.arrays.time.values.astype("datetime64[ms]"))
        there = self.arrays.sel(level=700, latitude=30, longitude=20, method="nearest")
        place = float(there.longitude), float(there.latitude), 700
        probe = dataset.probe(*place, step=1)
        self.assertEqual(probe["cc"], float(there.cc[1]))
        self.assertEqual(probe["wind"][:2], [float(there.u[1]), float(there.v[1])])
        np.testing.assert_array_equal(dataset.series("cc", *place).values, there.cc.values)

    def test_attributes_are_kept(self):
        dataset = self.view(scalar="cc").dataset
        field = dataset.fields["cc"]
        self.assertEqual((field.units, field.long_name), ("1", "fraction of cloud cover"))
        self.assertEqual(dataset.description["axes"]["z"]["kind"], "pressure")
        self.assertEqual(self.view("u", "v").dataset.fields["wind"].units, "m s-1")

    def test_the_title_is_that_of_the_arrays_or_the_one_given(self):
        self.assertEqual(self.view(scalar="cc").dataset.title, "fraction of cloud cover")
        self.assertEqual(self.view("u", "v", scalar="cc").dataset.title, "xarray")
        self.assertEqual(self.view("u", "v", scalar="cc", title="My run").dataset.title, "My run")
        one = self.arrays["a1"].windsplat
        self.assertEqual(one.view(server=self.server).dataset.title, "a1")
        self.assertEqual(one.view(server=self.server, title="First").dataset.title, "First")
        self.arrays.attrs["title"] = "Reanalysis"
        self.assertEqual(self.view("a1", "a2", "a3").dataset.title, "Reanalysis")

    def test_components_of_any_name_form_a_vector(self):
        view = self.view("a1", "a2", "a3")
        field = view.dataset.fields[view.get("/vector/field")]
        self.assertEqual((field.kind, field.units), ("vector", "V m-1"))
        self.assertEqual(view.get("/scalars"), [])
        values = view.dataset.probe(index=(0, 0, 0))[field.name]
        self.assertEqual(len(values), 3)
        self.assertEqual(values[1] - values[0], 1)

    def test_without_names_all_fields_of_three_dimensions_are_handed_over(self):
        view = self.view()
        self.assertLessEqual({"wind", "cc", "a1"}, set(view.dataset.fields))
        self.assertNotIn("t2m", view.dataset.fields)
        self.assertEqual(set(view.to_dict()), {"dataset"})

    def test_arrays_are_handed_over_once_until_they_are_refreshed(self):
        first = self.view(scalar="cc").dataset
        self.assertIs(self.view(scalar="cc").dataset, first)
        self.arrays.cc[:] = -7
        self.arrays.windsplat.refresh()
        second = self.view(scalar="cc").dataset
        self.assertEqual(second.probe(index=(0, 0, 0))["cc"], -7)
        self.assertNotIn(first.id, self.server.datasets)

    def test_terms_of_vertical_coordinates_come_along(self):
        arrays = example().drop_vars("level").rename(level="lev")
        arrays = arrays.assign_coords(lev=("lev", np.arange(5.0), {
            "standard_name": "atmosphere_hybrid_sigma_pressure_coordinate", "units": "1",
            "formula_terms": "a: hyam b: hybm ps: ps p0: p0"}))
        arrays["hyam"] = "lev", np.linspace(0, 0.3, 5)
        arrays["hybm"] = "lev", np.linspace(1, 0, 5)
        arrays["p0"] = (), 1e5, {"units": "Pa"}
        arrays["ps"] = ("time", "latitude", "longitude"), np.full((2, 6, 8), 1e5), {"units": "Pa"}
        self.arrays = arrays
        self.assertIn("pressure", self.view(scalar="cc").dataset.fields)

    def test_one_array_is_a_medium(self):
        view = self.arrays["cc"].windsplat.view(server=self.server, size=(64, 48))
        self.assertEqual(view.get("/scalars"), [{"field": "cc"}])
        self.assertEqual(view.frame().array.shape, (48, 64, 3))

    def test_what_is_no_field_of_three_dimensions_is_refused(self):
        for names, more, text in (
            ((), {"scalar": "t2m"}, "'t2m' has the dimensions .latitude, longitude. in space"),
            ((), {"scalar": "clouds"}, "no variable 'clouds'"),
            (("u",), {}, "need the components u and v"),
        ):
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                self.view(*names, **more)
        self.arrays = self.arrays[["t2m"]]
        with self.assertRaisesRegex(ValueError, r"no variable.*t2m \(time, latitude, longitude\)"):
            self.view()

    def test_another_server_gets_an_upload(self):
        if not support.takes_uploads():
            self.skipTest("the daemon has no option --upload-limit")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        with start("tornado:8", upload_limit="64M", state_dir=folder.name) as there:
            with windsplat.connect(there.url) as remote:
                view = example().windsplat.view("u", "v", scalar="cc", server=remote)
                self.assertEqual(view.get("/vector/field"), "wind")
                self.assertEqual(view.frame("jpeg").width, 1280)
                self.assertRegex(view.dataset.upload_id, r"^xarray-\d+-[0-9a-f]{16}\.nc$")
                self.arrays = example()
                arrays = self.arrays.windsplat
                dataset = arrays.open(["cc"], server=remote)
                arrays.refresh()
                self.assertNotIn(dataset.id, remote.datasets)

    def test_a_server_is_started_for_arrays(self):
        with self.assertRaisesRegex(ValueError, "first call"):
            accessors.local_server()
            accessors.local_server(threads=1)
        view = example().windsplat.view(scalar="cc", size=(32, 24))
        self.assertEqual(view.dataset.server, accessors.local_server())
        self.assertEqual(view.frame("jpeg").image.size, (32, 24))


if __name__ == "__main__":
    unittest.main()
