#!/usr/bin/env python3
"""Stores with levels against the same data as netCDF: equal pictures where both fit into memory,
and pictures where only levels do. Levels are computed here (stores.py), not by the program.

Usage: levels.py --program=PATH [unittest arguments]
"""
import io
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))

from served import Daemon, taken_program
from stores import CHUNK, write_netcdf, write_store

PROGRAM = taken_program()
LIMIT = 192  # MiB, of which 68 are for data
SMALL = (37, 42, 51)  # z, y, x
LARGE = (200, 240, 300)  # 55 MiB a scalar, 165 MiB a vector
CHAIN = [(0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 3, 3)]


def made(shape, steps, masked):
    """A cloud and a whirling wind with noise."""
    rng = np.random.default_rng(3)
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij", sparse=True)
    out = {name: np.empty((steps, *shape), "f4") for name in ("cloud", "u", "v", "w")}
    for step in range(steps):
        noise = rng.normal(size=shape).astype("f4")
        out["cloud"][step] = 1e-3 * np.exp(-6 * ((x - 0.2 * step)**2 + y**2 + z**2)) * (
            1 + 0.3 * noise)
        out["u"][step] = -9 * y + noise
        out["v"][step] = 9 * x - noise
        out["w"][step] = 3 * (1 - z * z) + noise * x
        if masked:
            hole = (np.abs(x - 0.5) < 0.2) & (np.abs(y) < 0.3) & (z > 0)
            for values in out.values():
                values[step][np.broadcast_to(hole, shape)] = np.nan
    return out


class Levels(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="windsplat-levels-")
        folder = pathlib.Path(cls.folder.name)
        paths = []
        for name, uneven in (("even", False), ("uneven", True)):
            axes = [100.0 * np.arange(n) for n in SMALL]
            if uneven:
                axes[0] = 40 * np.arange(SMALL[0]) + 2.5 * np.arange(SMALL[0])**1.9
            fields = made(SMALL, 2, masked=True)
            write_netcdf(folder / f"{name}.nc", fields, axes, 2)
            write_store(folder / f"{name}_store.zarr", fields, axes, 2, CHAIN, 3, uneven)
            paths += [folder / f"{name}.nc", folder / f"{name}_store.zarr"]
        axes = [100.0 * np.arange(n) for n in LARGE]
        fields = cls.large = made(LARGE, 1, masked=False)
        write_netcdf(folder / "large.nc", fields, axes, 1)
        write_store(folder / "large_store.zarr", fields, axes, 1, CHAIN, 3)
        large = [folder / "large.nc", folder / "large_store.zarr"]
        cls.roomy = Daemon(PROGRAM, *paths, *large, "--memory-limit=1500M")
        cls.tight = Daemon(PROGRAM, large[1], f"--memory-limit={LIMIT}M")
        cls.refusing = Daemon(PROGRAM, large[0], f"--memory-limit={LIMIT}M")

    @classmethod
    def tearDownClass(cls):
        cls.roomy.end()
        cls.tight.end()
        cls.refusing.end()
        cls.folder.cleanup()

    def picture(self, daemon, view, kind="image/png"):
        answer = daemon.ask("POST", "/v1/frames", json.dumps(view),
                            {"Content-Type": "application/json", "Accept": kind})
        self.assertEqual(answer.status, 200, answer.body[:2000])
        return answer

    def level(self, answer):
        found = re.search(r"level=(\d,\d,\d)", answer.headers["Windsplat-Frame"])
        return found and found[1]

    def assert_same_pictures(self, dataset, view):
        plain = self.picture(self.roomy, {**view, "dataset": dataset})
        store = self.picture(self.roomy, {**view, "dataset": f"{dataset}_store"})
        self.assertEqual(self.level(store), self.level(plain), view)
        self.assertEqual(store.body, plain.body, (dataset, view))
        return self.level(store)

    def test_pictures_are_those_of_the_plain_file(self):
        levels = set()
        for dataset in ("even", "uneven"):
            for method in ("kernel", "slab"):
                for height in (16, 240):
                    for vector in ({}, {"field": None}, {"stride": 1, "opacity": 0.1}):
                        image = {"width": height * 5 // 4, "height": height}
                        view = {"step": 1, "method": {"name": method}, "vector": vector,
                                "image": image}
                        levels.add(self.assert_same_pictures(dataset, view))
        self.assertIn(None, levels)
        self.assertIn("1,1,1", levels)

    def test_lines_of_every_stride_are_those_of_the_plain_file(self):
        for stride in (1, 2, 3, 4, 8):
            view = {"vector": {"stride": stride}, "image": {"width": 20, "height": 16}}
            self.assert_same_pictures("even", view)
            self.assert_same_pictures("uneven", view)

    def test_levels_of_other_widths_are_computed(self):
        for vertical in ("index", "linear"):
            view = {"geometry": {"vertical": vertical}, "vector": {"field": None},
                    "image": {"width": 10, "height": 8}}
            self.assertEqual(self.assert_same_pictures("uneven", view), "1,1,1")

    def test_regions_and_slices_are_those_of_the_plain_file(self):
        image = {"width": 20, "height": 16}
        for view in ({"region": {"x": [500, 4000]}},
                     {"geometry": {"slice": {"axis": "z", "index": 9}}},
                     {"region": {"where": [{"field": "cloud", "range": [1e-4, 1]}]}}):
            self.assert_same_pictures("even", {**view, "image": image})

    def test_default_views_and_ranges_are_those_of_the_plain_file(self):
        for dataset in ("even", "uneven"):
            plain, store = (self.roomy.get(f"/v1/datasets/{one}").json()
                            for one in (dataset, f"{dataset}_store"))
            for one in (plain, store):
                one["defaultView"].pop("dataset")
            self.assertEqual(store["defaultView"], plain["defaultView"])
            for field in ("cloud", "wind"):
                for query in ("?step=1", "?of=all", ""):
                    one, two = (self.roomy.get(f"/v1/datasets/{d}/fields/{field}/range{query}")
                                for d in (dataset, f"{dataset}_store"))
                    self.assertEqual(one.status, two.status)
                    self.assertEqual(one.body, two.body, (field, query))

    def test_a_store_that_exceeds_the_memory_is_drawn_from_its_levels(self):
        image = {"width": 320, "height": 240}
        refused = self.refusing.post("/v1/frames", {"image": image, "dataset": "large"})
        self.assertEqual(refused.status, 507, refused.body[:500])
        drawn = self.picture(self.tight, {"image": image, "dataset": "large_store"})
        self.assertIn(self.level(drawn), ("1,1,1", "2,2,2"))
        scalars = self.roomy.get("/v1/datasets/large").json()["defaultView"]["scalars"]
        for method in ("kernel", "slab"):
            here = {"image": image, "method": {"name": method}, "vector": {"field": None},
                    "scalars": scalars}
            coarse = self.picture(self.tight, {**here, "dataset": "large_store"},
                                  "application/x-npy")
            self.assertIn(self.level(coarse), ("1,1,1", "2,2,2"))
            fine = self.picture(self.roomy, {**here, "dataset": "large"}, "application/x-npy")
            found, wanted = (np.load(io.BytesIO(one.body)).astype("f8") for one in (coarse, fine))
            self.assertEqual(found.shape, wanted.shape)
            self.assertLess(np.sqrt(np.mean((found - wanted)**2)), 0.01)
            self.assertGreater(np.std(found), 0.02)

    def detail(self, answer):
        return json.loads(answer.headers["Windsplat-Frame"])["detail"]

    def parts_of_views(self):
        """Views of few samples of the large store, from outside and from within."""
        look = {"projection": "perspective", "fovY": 8}
        cloud = [{"field": "cloud", "color": {"range": [0, 2e-3]},
                  "extinction": [[0, 0], [2e-3, 40]]}]
        lines = {"field": "wind", "length": 0.02, "magnitudeRange": [0, 20], "stride": 1,
                 "minMagnitude": 0}
        for camera in ({"projection": "orthographic", "eye": [0.1, -2, 0.05],
                        "target": [0.1, 0, 0.05], "height": 0.06},
                       {**look, "eye": [0.3, -0.4, 0.2], "target": [0.9, 0.1, 0.5]},
                       {**look, "eye": [0.1, 0.2, 1.5], "target": [0.1, 0.1, 0], "fovY": 3}):
            for scalars, vector in ((cloud, {"field": None}), ([], lines), (cloud, lines)):
                yield {"camera": camera, "scalars": scalars, "vector": vector,
                       "image": {"width": 160, "height": 120}}

    def test_a_store_that_exceeds_the_memory_is_drawn_from_the_part_in_sight(self):
        """Level 0: equal to the same store in memory."""
        parts = 0
        for view in self.parts_of_views():
            for method in ("kernel", "slab"):
                here = {**view, "dataset": "large_store", "method": {"name": method}}
                found = self.picture(self.tight, here, "application/x-npy")
                detail = self.detail(found)
                self.assertEqual(detail["wanted"], {"halvings": [0, 0, 0]}, view)
                if detail["drawn"]["halvings"] != [0, 0, 0]:
                    continue
                drawn = detail["drawn"]
                bytes_ = 4 * np.prod(drawn["count"]) * (
                    len(view["scalars"]) + (3 if view["vector"]["field"] else 0))
                self.assertLess(bytes_, 0.45 * 68 * 2**20)
                wanted = self.picture(self.roomy, here, "application/x-npy")
                self.assertEqual(self.detail(wanted)["drawn"], {"halvings": [0, 0, 0]})
                self.assertEqual(found.body, wanted.body, view)
                parts += 1
        self.assertGreaterEqual(parts, 10)

    WHOLE_CLOUD = {"vector": {"field": None}, "method": {"name": "kernel"},
                   "scalars": [{"field": "cloud", "color": {"range": [0, 1e-3]},
                                "extinction": [[0, 0.1], [1e-3, 40]]}],
                   "image": {"width": 640, "height": 480},
                   "camera": {"projection": "orthographic", "eye": [0, -2, 0],
                              "target": [0, 0, 0], "height": 1}}

    def test_the_error_of_a_coarser_level_contains_what_finer_ones_would_change(self):
        whirl = {"field": "wind", "length": 0.03, "magnitudeRange": [0, 20], "stride": 1,
                 "minMagnitude": 0, "color": {"by": "worldZ", "range": [-1, 1]}}
        # Coarser levels do not tell of the cloud's noise, which is another at each sample.
        for more, least in (({}, 0.2), ({"vector": whirl, "scalars": []}, 0.5)):
            view = {**self.WHOLE_CLOUD, **more}
            coarse, fine = (self.picture(where, {**view, "dataset": name}, "application/x-npy")
                            for where, name in ((self.tight, "large_store"),
                                                (self.roomy, "large")))
            found, wanted = (np.load(io.BytesIO(one.body)).astype("f8") for one in (coarse, fine))
            error = np.sqrt(np.mean((found - wanted)**2))
            told = json.loads(coarse.headers["Windsplat-Frame"])
            self.assertNotEqual(told["detail"]["drawn"], told["detail"]["wanted"])
            self.assertEqual(told["error"]["kind"], "estimated")
            self.assertGreater(told["error"]["value"], least * error)
            self.assertLess(told["error"]["value"], 2 * error)
            self.assertLessEqual(told["detail"]["error"], told["error"]["value"])
            self.assertNotIn("error", json.loads(fine.headers["Windsplat-Frame"]).get("detail", {}))

    def test_render_says_that_a_coarser_level_is_drawn_than_would_suffice(self):
        view = self.WHOLE_CLOUD
        folder = pathlib.Path(self.folder.name)
        (folder / "view.json").write_text(json.dumps(view))
        said = {}
        for limit in (f"{LIMIT}M", "1500M"):
            done = subprocess.run(
                [PROGRAM, "render", folder / "large_store.zarr", "--view", folder / "view.json",
                 "--memory-limit", limit, "-o", folder / "render.png"],
                capture_output=True, text=True, check=True)
            said[limit] = done.stderr
            done = subprocess.run(
                [PROGRAM, "animate", folder / "large_store.zarr", "--view", folder / "view.json",
                 "--memory-limit", limit, "--turn", "10", "--frames", "2",
                 "-o", folder / "turn_%d.png"],
                capture_output=True, text=True, check=True)
            self.assertEqual("2 pictures lack detail; of the first" in done.stderr,
                             limit == f"{LIMIT}M", done.stderr)
        self.assertIn("where 0,0,0 would suffice", said[f"{LIMIT}M"])
        self.assertNotIn("would suffice", said["1500M"])

    def test_the_legend_of_a_part_marks_values_that_only_the_whole_has(self):
        view = {"dataset": "large_store", "vector": {"field": None},
                "scalars": [{"field": "cloud", "color": {"range": [0, 1e-3]},
                             "extinction": [[0, 0.1], [1e-3, 40]]}],
                "annotations": {"legend": True}, "image": {"width": 320, "height": 240},
                "camera": {"projection": "orthographic", "eye": [0.8, -2, 0.4],
                           "target": [0.8, 0, 0.4], "height": 0.05}}
        self.assertGreater(self.large["cloud"].max(), 1e-3)
        part = self.picture(self.tight, view)
        drawn = self.detail(part)["drawn"]
        self.assertEqual(drawn["halvings"], [0, 0, 0])
        x, y, z = (slice(a, a + n) for a, n in zip(drawn["first"], drawn["count"]))
        self.assertLess(self.large["cloud"][0][z, y, x].max(), 1e-3)
        self.assertEqual(part.body, self.picture(self.roomy, view).body)

    def test_what_is_chosen_fits_beside_the_loader_and_the_part_before(self):
        lines = {"field": "wind", "length": 0.02, "magnitudeRange": [0, 20], "stride": 1,
                 "minMagnitude": 0}
        cloud = [{"field": "cloud", "color": {"range": [0, 2e-3]},
                  "extinction": [[0, 0], [2e-3, 40]]}]
        for angle in range(9, 25, 3):
            view = {"dataset": "large_store", "vector": lines, "scalars": cloud,
                    "image": {"width": 48, "height": 36},
                    "camera": {"projection": "perspective", "fovY": angle,
                               "eye": [-0.4 + 0.01 * angle, -0.6, 0.2], "target": [0.1, 0.6, 0.1]}}
            self.assertTrue(self.detail(self.picture(self.tight, view)))

    def test_resident_bytes_and_bricks_are_those_of_the_parts_drawn(self):
        view = {**self.WHOLE_CLOUD, "dataset": "large_store",
                "image": {"width": 160, "height": 120}}
        store = pathlib.Path(self.folder.name) / "large_store.zarr"
        with Daemon(PROGRAM, store, f"--memory-limit={LIMIT}M") as daemon:
            def told():
                dataset = daemon.get("/v1/datasets/large_store").json()
                levels = [one["residentBytes"] for one in dataset["levels"]]
                self.assertLessEqual(sum(levels), dataset["residentBytes"])
                return np.array([*levels, *(daemon.metric(f"windsplat_{one}") for one in (
                    'bricks_total{from="store"}', "brick_bytes_read_total", "bricks_waiting",
                    "parts_resident_bytes", 'bricks_total{from="resident"}'))])
            for x in (-0.5, 0, 0.5):
                before = told()
                view["camera"] = {"projection": "orthographic", "eye": [x, -2, 0],
                                  "target": [x, 0, 0], "height": 0.05}
                drawn = self.detail(self.picture(daemon, view))["drawn"]
                self.assertEqual(drawn["halvings"], [0, 0, 0])
                bricks = np.prod([(first + count - 1) // CHUNK - first // CHUNK + 1
                                  for first, count in zip(drawn["first"], drawn["count"])])
                samples = 4 * np.prod(drawn["count"])
                first = told()
                self.assertEqual(list((first - before)[:-1]),
                                 [samples, 0, 0, 0, bricks, samples, 0, samples])
                self.picture(daemon, view)
                again = told() - first
                self.assertEqual(list(again[:-1]), [0] * (len(again) - 1))
                self.assertGreaterEqual(again[-1], bricks)

    def test_a_zoom_ends_with_every_sample(self):
        """From the whole to single voxels: levels never get coarser, and a pick is exact."""
        finest = [9, 9, 9]
        for height in (1.2, 0.6, 0.3, 0.1, 0.03, 0.01, 0.003):
            view = {"dataset": "large_store", "vector": {"field": None},
                    "scalars": [{"field": "cloud", "color": {"range": [0, 2e-3]},
                                 "extinction": [[0, 1], [2e-3, 40]]}],
                    "image": {"width": 160, "height": 120},
                    "camera": {"projection": "orthographic", "eye": [0.1, -2, 0.05],
                               "target": [0.1, 0, 0.05], "height": height}}
            drawn = self.detail(self.picture(self.tight, view))["drawn"]
            self.assertTrue(all(a <= b for a, b in zip(drawn["halvings"], finest)), height)
            finest = drawn["halvings"]
        self.assertEqual(finest, [0, 0, 0])
        self.assertLess(np.prod(drawn["count"]), 0.2 * np.prod(LARGE))
        picks = [daemon.post("/v1/picks?x=80&y=60", view)
                 for daemon in (self.tight, self.roomy)]
        self.assertEqual([one.status for one in picks], [200, 200], picks[0].body[:500])
        self.assertEqual(picks[0].body, picks[1].body)
        found = picks[0].json()["feature"]
        x, y, z = (found["position"]["index"][axis] for axis in "xyz")
        self.assertEqual(np.float32(found["value"]), self.large["cloud"][0][z, y, x])

    def oblique(self, height, x=0.1):
        """A view of the cloud along a diagonal of the large store."""
        return {"dataset": "large_store", "vector": {"field": None},
                "scalars": [{"field": "cloud", "color": {"range": [0, 2e-3]},
                             "extinction": [[0, 1], [2e-3, 40]]}],
                "image": {"width": 160, "height": 120},
                "camera": {"projection": "orthographic", "eye": [x + 1.2, -1.6, 0.95],
                           "target": [x, 0, 0.05], "height": height}}

    def test_a_zoom_along_a_diagonal_ends_with_every_sample(self):
        """The box around what is in sight does not fit: only bricks in sight are read."""
        finest = [9, 9, 9]
        for height in (1.2, 0.6, 0.3, 0.1, 0.03, 0.01, 0.003):
            view = self.oblique(height)
            found = self.picture(self.tight, view, "application/x-npy")
            drawn = self.detail(found)["drawn"]
            self.assertTrue(all(a <= b for a, b in zip(drawn["halvings"], finest)), height)
            finest = drawn["halvings"]
        self.assertEqual(finest, [0, 0, 0])
        bounds, boxes = np.prod(drawn["count"]), drawn["boxes"]
        self.assertGreater(4 * bounds, 0.45 * 68 * 2**20)
        self.assertLess(boxes["count"] * np.prod(boxes["size"]), 0.5 * bounds)
        wanted = self.picture(self.roomy, view, "application/x-npy")
        self.assertNotIn("boxes", self.detail(wanted)["drawn"])
        self.assertEqual(found.body, wanted.body)
        picks = [daemon.post("/v1/picks?x=80&y=60", view)
                 for daemon in (self.tight, self.roomy)]
        self.assertEqual([one.status for one in picks], [200, 200], picks[0].body[:500])
        self.assertEqual(picks[0].body, picks[1].body)

    def test_of_a_view_that_moves_only_the_bricks_that_are_new_are_read(self):
        read = 'bricks_total{from="store"}'
        store = pathlib.Path(self.folder.name) / "large_store.zarr"
        boxes, reads = [], []
        for daemons in ("one", "each"):
            with Daemon(PROGRAM, store, f"--memory-limit={LIMIT}M") as daemon:
                for x in ((0.1, 0.17) if daemons == "one" else (0.17,)):
                    before = daemon.metric(f"windsplat_{read}")
                    drawn = self.detail(self.picture(daemon, self.oblique(0.003, x)))["drawn"]
                    boxes.append(drawn["boxes"]["count"])
                    reads.append(daemon.metric(f"windsplat_{read}") - before)
        first, moved, alone = reads
        self.assertEqual(boxes[1], boxes[2])
        self.assertGreaterEqual(first, boxes[0])
        self.assertLess(moved, alone)
        self.assertGreater(moved, 0)

    def test_a_picture_of_a_part_does_not_depend_on_what_was_drawn_before(self):
        views = [{**view, "dataset": "large_store"} for view in self.parts_of_views()]
        first = [self.picture(self.tight, view).body for view in views]
        again = [self.picture(self.tight, view).body for view in reversed(views)]
        self.assertEqual(first, again[::-1])

    def test_light_and_surfaces_are_those_of_whole_levels(self):
        view = next(self.parts_of_views())
        lit = {**view, "dataset": "large_store", "light": {}}
        self.assertNotIn("count", self.detail(self.picture(self.tight, lit))["drawn"])

    def test_what_shows_every_sample_is_refused_with_the_limit_that_would_suffice(self):
        image = {"width": 64, "height": 48}
        for view in ({"method": {"detail": "full"}},
                     {"geometry": {"slice": {"axis": "z", "index": 9}}}):
            answer = self.tight.post("/v1/frames",
                                     {**view, "dataset": "large_store", "image": image})
            status, detail = answer.detail()
            self.assertEqual(status, 507, (view, detail))
            self.assertIn("would suffice", detail)

    def test_strided_lines_of_a_store_that_exceeds_the_memory_come_from_middles_of_kernels(self):
        image = {"width": 320, "height": 240}
        for stride in (1, 2, 4, 8):
            view = {"dataset": "large_store", "vector": {"stride": stride}, "scalars": [],
                    "image": image}
            found = self.picture(self.tight, view, "application/x-npy")
            wanted = self.picture(self.roomy, {**view, "dataset": "large"}, "application/x-npy")
            found, wanted = (np.load(io.BytesIO(one.body)).astype("f8") for one in (found, wanted))
            self.assertLess(np.sqrt(np.mean((found - wanted)**2)), 0.1, stride)

    def test_ranges_of_a_store_that_exceeds_the_memory_are_exact(self):
        for field in ("cloud", "wind"):
            query = f"fields/{field}/range?of=all"
            found = self.tight.get(f"/v1/datasets/large_store/{query}")
            wanted = self.roomy.get(f"/v1/datasets/large/{query}")
            self.assertEqual((found.status, found.body), (wanted.status, wanted.body))
            query = f"fields/{field}/range?step=0"
            found = self.tight.get(f"/v1/datasets/large_store/{query}")
            wanted = self.roomy.get(f"/v1/datasets/large/{query}").json()
            wanted.pop("places")  # are not stored
            self.assertEqual((found.status, found.json()), (200, wanted))

    def test_default_views_of_a_store_that_exceeds_the_memory_are_near_those_of_all_samples(self):
        found = self.tight.get("/v1/datasets/large_store").json()
        wanted = self.roomy.get("/v1/datasets/large").json()
        self.assertNotIn("can be probed, but not shown", " ".join(found.get("notes", [])))
        for one, two in zip(found["defaultView"]["scalars"], wanted["defaultView"]["scalars"]):
            self.assertEqual(one["field"], two["field"])
            np.testing.assert_allclose(one["color"]["range"], two["color"]["range"], rtol=0.35)
        one, two = (of["defaultView"]["vector"] for of in (found, wanted))
        np.testing.assert_allclose(one["magnitudeRange"], two["magnitudeRange"], rtol=0.2)


if __name__ == "__main__":
    unittest.main()
