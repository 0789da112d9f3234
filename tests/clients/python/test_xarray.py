"""The accessor of xarray: what the server reads is what the arrays hold."""
import tempfile
import unittest
import unittest.mock

import netCDF4
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


def cube(dtype="f4", name="a", **attributes):
    """A Dataset of one field over two times, with plain coordinates."""
    values = (np.arange(2 * 3 * 4 * 5) % 100).reshape(2, 3, 4, 5).astype(dtype)
    return xarray.Dataset(
        {name: (("time", "z", "y", "x"), values, attributes)},
        {"time": np.array(["2020-01-01", "2020-01-02"], dtype="datetime64[ns]"),
         "z": np.arange(3.0), "y": np.arange(4.0), "x": np.arange(5.0)})


class Lazy:
    """An array that is computed where it is read, and notes how much of it at once."""

    def __init__(self, array):
        self.array, self.shape, self.dtype, self.most = array, array.shape, array.dtype, 0
        self.ndim, self.size = array.ndim, array.size

    def __getitem__(self, key):
        part = self.array[key]
        self.most = max(self.most, part.size)
        return part


def lazy(arrays, name):
    """The Dataset with a lazy variable, as xarray.open_dataset gives it."""
    source = Lazy(arrays[name].values)

    class Backend(xarray.backends.BackendArray):
        shape, dtype = source.shape, source.dtype

        def __getitem__(self, key):
            return xarray.core.indexing.explicit_indexing_adapter(
                key, self.shape, xarray.core.indexing.IndexingSupport.BASIC, source.__getitem__)

    variable = xarray.Variable(arrays[name].dims,
                               xarray.core.indexing.LazilyIndexedArray(Backend()))
    return arrays.assign({name: variable}), source


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

    def values(self, arrays, name="a", step=1, **more):
        dataset = arrays.windsplat.open(server=self.server, **more)
        return dataset.values(name, step=step).array

    def test_numbers_of_every_kind_arrive(self):
        kinds = {f"k{number}": cube(dtype).a for number, dtype in enumerate(
            ("f2", "f4", "f8", "g", ">f4", "i1", "i2", "u2", "i8", "u8", "?"))}
        dataset = xarray.Dataset(kinds).windsplat.open(server=self.server)
        for name, array in kinds.items():
            with self.subTest(array.dtype):
                np.testing.assert_array_equal(dataset.values(name, step=1).array,
                                              array[1].values.astype("f4"))

    def test_packed_and_missing_values_are_those_of_the_attributes(self):
        packed = cube("i2", scale_factor=0.5, add_offset=10.0, _FillValue=np.int16(3))
        wanted = np.where(packed.a[1] == 3, np.nan, packed.a[1] * 0.5 + 10).astype("f4")
        np.testing.assert_array_equal(self.values(packed), wanted)
        marked = cube("f8", _FillValue=1e300, missing_value=7.0)  # as read without decoding
        marked.a[:] = marked.a.where(marked.a != 8, 1e300)
        wanted = marked.a[1].where((marked.a[1] != 7) & (marked.a[1] != 1e300)).values.astype("f4")
        np.testing.assert_array_equal(self.values(marked), wanted)
        unpacked = cube("f4", valid_range=np.array([0, 20], "i2"))  # of the packed values
        unpacked.a.encoding.update(dtype="int16", scale_factor=0.01, _FillValue=-1,
                                   missing_value=-2)
        unpacked.a.values[1, 0, 0, :2] = -1.0, -2.0  # the marks are of packed numbers
        np.testing.assert_array_equal(self.values(unpacked), unpacked.a[1].values)

    def test_several_marks_of_missing_values_are_all_masked(self):
        several = {"missing_value": [7, 8]}, {"missing_value": np.array([8, 7]), "_FillValue": 9}
        for dtype in ("f4", "f8", "i2", "u1", "i8"):
            for marks in several:
                arrays = cube(dtype, **marks)  # as read without decoding
                arrays.a.values[1, 0, 0, :3] = 7, 8, 9
                gone = np.isin(arrays.a[1], [7, 8, marks.get("_FillValue", 7)])
                with self.subTest(dtype=dtype, **marks):
                    np.testing.assert_array_equal(
                        self.values(arrays), np.where(gone, np.nan, arrays.a[1]).astype("f4"))

    def test_marks_that_the_type_lacks_mark_nothing(self):
        for dtype, mark in (("i2", 65536.0), ("u1", -1), ("i2", 7.5), ("i2", "none"),
                            ("f4", "none"), ("f4", 1e300)):
            arrays = cube(dtype, missing_value=mark)
            arrays.a.values[1, 0, 0, :2] = 0, 255
            with self.subTest(dtype=dtype, mark=mark):
                np.testing.assert_array_equal(self.values(arrays), arrays.a[1].values)
        rounded = cube("f4", missing_value=np.float64(0.1))  # of float32 in the array
        rounded.a[1, 0, 0, 0] = 0.1
        self.assertTrue(np.isnan(self.values(rounded)[0, 0, 0]))

    def test_fields_without_any_value_have_no_range(self):
        dataset = (cube() * np.nan).windsplat.open(server=self.server)
        self.assertTrue(np.isnan(dataset.range("a")).all())

    def test_names_and_attributes_that_netcdf_lacks_are_replaced_and_left_out(self):
        arrays = cube(name="temp (K)/x", units="K", source=None, parts={"a": 1}, checked=True)
        arrays.attrs["history"] = None
        view = arrays.windsplat.view(scalar="temp (K)/x", server=self.server)
        self.assertEqual(view.get("/scalars"), [{"field": "temp_K_x"}])
        self.assertEqual(view.dataset.fields["temp_K_x"].units, "K")
        view = xarray.Dataset({3: cube().a}).windsplat.view(scalar=3, server=self.server)
        self.assertEqual(view.get("/scalars"), [{"field": "v3"}])
        same = xarray.DataArray(np.zeros((3, 3, 3)), dims=("x", "y", "z"), name="x")
        self.assertEqual(list(same.windsplat.view(server=self.server).dataset.fields), ["x"])

    def test_places_of_columns_come_along(self):
        arrays = cube(standard_name="air_temperature").drop_vars(("x", "y"))
        lat, lon = np.meshgrid(np.linspace(40, 43, 4), np.linspace(5, 9, 5), indexing="ij")
        arrays = arrays.assign_coords(
            lat=(("y", "x"), lat + 0.01 * lon, {"units": "degrees_north"}),
            lon=(("y", "x"), lon - 0.01 * lat, {"units": "degrees_east"}))
        dataset = arrays.windsplat.open(server=self.server)
        self.assertEqual(dataset.probe(lon=8, lat=42, level=1).position.index[:2], (3, 2))
        with netCDF4.Dataset(self.server._root / f"{dataset.id}.nc") as file:
            self.assertEqual(set(file["a"].coordinates.split()), {"lat", "lon"})

    def test_lazy_arrays_are_read_an_entry_at_a_time_and_not_kept(self):
        arrays, source = lazy(cube("f8"), "a")
        np.testing.assert_array_equal(self.values(arrays), cube().a[1].values)
        self.assertEqual(source.most, 3 * 4 * 5)
        source.array = source.array + 1
        self.assertEqual(float(arrays.a[0, 0, 0, 1]), 2)

    def test_arrays_of_dask_are_computed(self):
        try:
            import dask.array  # noqa: F401
        except ImportError:
            self.skipTest("dask is not installed")
        arrays = cube().chunk({"time": 1, "x": 2})
        np.testing.assert_array_equal(self.values(arrays), cube().a[1].values)

    def test_a_chunk_of_dask_is_computed_once_if_it_is_not_large(self):
        try:
            import dask.array
        except ImportError:
            self.skipTest("dask is not installed")
        entry = 3 * 4 * 5 * 4  # bytes
        for most, wanted in ((2 * entry, 3), (entry, 5), (0, 5)):
            computed = []

            def noted(block):
                computed.append(block.shape[0])
                return block

            one = cube().a
            values = np.concatenate([one.values, one.values + 1, one.values[:1]])
            source = dask.array.from_array(values, chunks=(2, -1, -1, -1))
            arrays = cube().isel(time=[0, 0, 0, 0, 0]).assign_coords(time=np.arange(5.0))
            arrays["a"] = one.dims, source.map_blocks(noted, meta=np.empty((0,) * 4, "f4"))
            with self.subTest(most), unittest.mock.patch("windsplat._netcdf.READ_BYTES", most):
                np.testing.assert_array_equal(self.values(arrays, step=3), values[3])
                self.assertEqual(len(computed), wanted)

    def test_what_cannot_be_held_is_named(self):
        refused = (
            (cube("f8") * 1e300, "'a' has values up to 5.9e.301; the server keeps float32, at"),
            (cube().isel(x=slice(0)), "'a' has no values: its shape is .*'x': 0"),
            (xarray.Dataset({"a": (("when", "z", "y", "x"), np.zeros((0, 3, 4, 5)))},
                            {"when": np.array([], dtype=object)}), "'a' has no values"),
            (cube("c8"), "no variable of numbers.*complex64"))
        for arrays, text in refused:
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                arrays.windsplat.open(server=self.server)
        with self.assertRaisesRegex(ValueError, "'a' has values of type complex64"):
            cube("c8").windsplat.open(["a"], server=self.server)
        room = unittest.mock.Mock(free=100)
        with unittest.mock.patch("shutil.disk_usage", return_value=room):
            with self.assertRaisesRegex(ValueError, "of which 'a' .* MB; the folder .* 0 MB left"):
                cube().windsplat.open(server=self.server)

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
                sent = []
                dataset = arrays.open(["cc"], server=remote,
                                      progress=lambda *counts: sent.append(counts))
                self.assertEqual(sent[-1][0], sent[-1][1])
                self.assertGreater(sent[-1][1], 1000)
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
