#!/usr/bin/env python3
"""windsplat convert: stores of each kind of grid against the inputs as read by numpy and netCDF4,
whose levels numpy computes.

Usage: convert.py --program=PATH [unittest arguments]
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))
from inputs import pressures, read_netcdf, write_columns, write_pressures, write_raw
from served import taken_program
from stores import Store, groups, strided, two_values

PROGRAM = taken_program()


def run(*arguments, check=True):
    done = subprocess.run([PROGRAM, "convert", *map(str, arguments)], capture_output=True,
                          text=True, check=False)
    if check and done.returncode != 0:
        raise AssertionError(done.stderr)
    return done


class Convert(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="windsplat-convert-")
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)
        self.rng = np.random.default_rng(11)

    def converted(self, source, *options):
        out = self.folder / f"{source.stem}.zarr"
        run(source, "-o", out, *options)
        self.assertFalse(out.with_name(out.name + ".part").exists())
        return Store(out)

    def assert_close(self, found, wanted, message):
        self.assertEqual(found.shape, wanted.shape, message)
        self.assertTrue(np.array_equal(np.isnan(found), np.isnan(wanted)), message)
        self.assertTrue(np.allclose(found, wanted, rtol=2e-5, atol=2e-5, equal_nan=True), message)

    def check_scalar(self, store, name, values):
        """values: (time, z, y, x)"""
        self.assertTrue(np.array_equal(store.read(f"0/{name}"), values, equal_nan=True), name)
        widths = store.widths()
        for number, halvings in enumerate(store.levels[1:], 1):
            stored = [store.read(f"{number}/{name}{end}")
                      for end in ("", "_low", "_high", "_low_share", "_high_share")]
            for step, one in enumerate(values):
                wanted = two_values(one, halvings, widths)
                # Samples at the mean are on either side, by rounding: both ways are right. The more
                # samples a group has, the more often one of them is.
                several = 1e-3 + 1e-6 * 2**sum(halvings)
                for found, true, what in zip(stored, wanted, ("mean", "low", "high", "", "")):
                    if what == "mean":
                        self.assert_close(found[step], true, f"{name} {what} of level {number}")
                low, high, below, above = (one[step].astype("f8") for one in stored[1:])
                self.assert_close(low * below + high * above, wanted[0] * (wanted[3] + wanted[4]),
                                  f"{name} two values of level {number}")
                off = np.abs(below - wanted[3])[~np.isnan(below)]
                self.assertLess((off > 1e-4).mean(), several, f"shares of level {number}")
        self.check_statistics(store, name, values)

    def check_vector(self, store, name, components, strides):
        for component, values in components.items():
            self.assertTrue(np.array_equal(store.read(f"0/{component}"), values, equal_nan=True))
        magnitudes = np.sqrt(sum(one.astype("f8") ** 2 for one in components.values()))
        widths = store.widths()
        for number, halvings in enumerate(store.levels[1:], 1):
            drawn = [store.read(f"{number}/{one}") for one in components]
            found = store.read(f"{number}/{name}_magnitude")
            for step in range(len(magnitudes)):
                samples = [groups(one[step], halvings) for one in components.values()]
                same = np.ones(samples[0].shape, bool)
                for one, values in zip(drawn, samples):
                    value = one[step][..., None]
                    same &= (values == value) | (np.isnan(values) & np.isnan(value))
                # At the ends the place that is drawn may lie beyond the data.
                ok = same.any(-1) | np.isnan(drawn[0][step])
                self.assertTrue(ok.all(), f"{name} of level {number} has other samples")
                self.assertLess(np.isnan(drawn[0][step]).mean(),
                                np.isnan(samples[0]).mean() + 0.05)
                self.assert_close(found[step], two_values(magnitudes[step], halvings, widths)[0],
                                  f"magnitudes of level {number}")
            for component, values in components.items():
                path = f"{number}/{component}_strided"
                self.assertEqual(store.has(path), number <= strides, path)
                if number > strides:
                    continue
                wanted = np.stack([strided(one, 1 << number) for one in values])
                self.assertTrue(np.array_equal(store.read(path), wanted, equal_nan=True), path)
        self.check_statistics(store, name, magnitudes.astype("f4"))

    def check_statistics(self, store, name, values):
        low, high, masked, histogram = (
            store.read(f"statistics/0/{name}_{end}")
            for end in ("low", "high", "masked", "histogram"))
        meta = store.nodes[f"0/{store.own['fields'][0]['components'][0]}"]
        brick = meta["codecs"][0]["configuration"]["chunk_shape"][1:]
        for step, one in enumerate(values):
            for place in np.ndindex(low.shape[1:]):
                part = one[tuple(slice(p * b, (p + 1) * b) for p, b in zip(place, brick))]
                at = (step, *place)
                known = part[~np.isnan(part)]
                self.assertEqual(masked[at], part.size - known.size)
                self.assertEqual(histogram[at].sum(), known.size)
                if known.size == 0:
                    self.assertTrue(np.isnan(low[at]) and np.isnan(high[at]))
                    continue
                self.assertEqual((low[at], high[at]), (known.min(), known.max()))
                wanted = np.histogram(known.astype("f8"), 32, (known.min(), known.max()))[0]
                self.assertLess(np.abs(wanted.cumsum() - histogram[at].cumsum()).max(), 9)
        ranges = store.read(f"statistics/{name}_range")
        for step, one in enumerate(values):
            self.assertEqual(tuple(ranges[step]), (np.nanmin(one), np.nanmax(one)))
            self.assertEqual(store.read(f"statistics/{name}_masked")[step], np.isnan(one).sum())

    def test_an_even_grid_of_two_units(self):
        source, known = write_raw(self.folder, "even", (520, 140, 133), self.rng)
        store = self.converted(source, "--threads", 2)
        # The coarsest has 2^18 samples at most, and the middles of kernels of stride 16 are stored.
        self.assertEqual(store.levels, [(n, n, n) for n in range(5)])
        self.check_scalar(store, "q", known["q"])
        self.check_vector(store, "wind", {c: known[c] for c in "uvw"}, 4)

    def test_levels_that_are_made_of_several_units(self):
        source, known = write_raw(self.folder, "long", (40000, 131, 1), self.rng, 400)
        store = self.converted(source, "--threads", 2)
        self.assertGreater(max(store.levels[-1]), 4)
        self.check_scalar(store, "q", known["q"])
        self.check_vector(store, "wind", {c: known[c] for c in "uvw"}, 4)

    def test_uneven_axes_masks_and_two_steps(self):
        source = write_pressures(self.folder / "gcm.nc", (60, 150, 170), self.rng)
        store = self.converted(source)
        self.assertIsNone(store.own["widths"]["x"])
        self.assertEqual(store.own["widths"]["z"], "0/level_widths")
        turned = (1, 2)
        self.check_scalar(store, "t", read_netcdf(source, "t", turned))
        u, v = (read_netcdf(source, one, turned) for one in "uv")
        hidden = np.isnan(u) | np.isnan(v)
        wind = {"u": np.where(hidden, np.nan, u), "v": np.where(hidden, np.nan, v)}
        name = next(one["name"] for one in store.own["fields"] if len(one["components"]) == 2)
        self.assertNotEqual(store.levels[1], (1, 1, 1))
        self.check_vector(store, name, wind, 4)
        self.assertTrue(np.array_equal(store.read("0/time"), [0, 6]))
        self.assertTrue(np.array_equal(store.read("0/level"), pressures(60)[::-1]))

    def test_columns_of_one_layer(self):
        source = write_columns(self.folder / "map.nc", (700, 410), self.rng)
        store = self.converted(source)
        self.assertEqual(store.levels[1:], [(n, n, 0) for n in range(1, 5)])
        self.check_scalar(store, "t", read_netcdf(source, "t", ()))
        longitude = store.read("0/longitude")
        self.assertAlmostEqual(longitude[3, 5], 5 + 0.02 * 5 - 0.004 * 3)
        self.assert_close(store.read("1/longitude"),
                          groups(longitude[None], (1, 1, 0)).mean(-1)[0], "longitudes")

    def test_chosen_fields_and_steps(self):
        source = write_pressures(self.folder / "gcm.nc", (5, 140, 150), self.rng, steps=5)
        store = self.converted(source, "--field", "t", "--steps", "1:4:2", "--compression", "none")
        self.assertFalse(store.has("0/u"))
        self.assertTrue(np.array_equal(store.read("0/time"), [6, 18]))
        self.check_scalar(store, "t", read_netcdf(source, "t", (1, 2))[1:4:2])

    def test_a_sample_is_converted(self):
        out = self.folder / "tornado.zarr"
        run("tornado:140x130x20", "-o", out, "--compression", "zstd:2")
        store = Store(out)
        self.assertEqual(store.nodes["0/u"]["shape"][1:], [20, 130, 140])
        blosc = store.nodes["0/u"]["codecs"][0]["configuration"]["codecs"][1]["configuration"]
        self.assertEqual((blosc["cname"], blosc["clevel"]), ("zstd", 2))

    def test_the_program_reads_its_store_as_the_input(self):
        source = write_pressures(self.folder / "gcm.nc", (20, 140, 150), self.rng)
        self.converted(source)
        told = [json.loads(subprocess.run([PROGRAM, "inspect", "--json", "--ranges", "all", one],
                                          capture_output=True, text=True, check=True).stdout)
                for one in (source, source.with_suffix(".zarr"), source.with_suffix(".zarr") / "0")]
        self.assertEqual(told[0]["title"], "A storm")
        for store in told[1:]:
            for what in ("title", "axes", "dims", "steps", "timeUnits"):
                self.assertEqual(told[0][what], store[what])
        fields = [{one["name"]: [one[what] for what in ("components", "range", "masked", "units")]
                   for one in text["fields"]} for text in told]
        self.assertEqual(fields[0], fields[1])
        self.assertEqual(fields[0], fields[2])

    def test_inspect_tells_levels_with_their_bricks_and_bytes(self):
        source, _ = write_raw(self.folder, "even", (520, 140, 133), self.rng)
        store = self.converted(source, "--threads", 2)
        told = json.loads(subprocess.run([PROGRAM, "inspect", "--json", store.folder], check=True,
                                         capture_output=True, text=True).stdout)["levels"]
        self.assertEqual([tuple(level["halvings"]) for level in told], store.levels)
        for number, level in enumerate(told):
            shape = store.nodes[f"{number}/u"]["shape"][1:]
            self.assertEqual([level["dims"][axis] for axis in "zyx"], shape)
            bricks = [-(-n // 64) for n in shape]
            self.assertEqual(level["bricks"], np.prod(bricks))
            # q and three components; at coarser levels q is two values with their shares.
            self.assertEqual(level["bytes"], 4 * np.prod(shape) * (4 if number == 0 else 7))
            files = [one.stat().st_size for one in (store.folder / str(number)).rglob("*")
                     if one.is_file() and one.name != "zarr.json"]
            self.assertEqual(level["storedBytes"], sum(files))
        text = subprocess.run([PROGRAM, "inspect", store.folder], check=True,
                              capture_output=True, text=True).stdout
        self.assertRegex(text, r"\nlevels\n  0  520 x 140 x 133 samples  81 bricks")
        self.assertRegex(text, r" 1 brick +\d")

    def test_what_is_refused(self):
        source = write_pressures(self.folder / "gcm.nc", (3, 30, 40), self.rng)
        out = self.folder / "gcm.zarr"
        for options, text in ((["--field", "x"], "no field"),
                              (["--steps", "0:7"], "last step of the dataset is 1"),
                              (["--compression", "gzip"], "is not lz4"),
                              (["--memory-limit", "100M"], "below the minimum")):
            refused = run(source, "-o", out, *options, check=False)
            self.assertEqual(refused.returncode, 2, refused.stderr)
            self.assertIn(text, refused.stderr)
            self.assertFalse(out.exists())
        refused = run(source, "-o", "-", check=False)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("a store is a folder", refused.stderr)
        self.converted(source)
        refused = run(source, "-o", out, check=False)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("--force replaces it", refused.stderr)
        run(source, "-o", out, "--force", "--field", "t")
        self.assertFalse(Store(out).has("0/u"))
        other = self.folder / "mine"
        other.mkdir()
        (other / "letter.txt").write_text("dear")
        refused = run(source, "-o", other, "--force", check=False)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("not a Zarr store", refused.stderr)
        self.assertTrue((other / "letter.txt").exists())


if __name__ == "__main__":
    unittest.main()
