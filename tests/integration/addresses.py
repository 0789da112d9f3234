#!/usr/bin/env python3
"""Addresses of pictures: those of datasets and of saved views, and what their parameters change.

Usage: addresses.py --program=PATH [unittest arguments]
"""
import json
import pathlib
import tempfile
import unittest
import urllib.parse

import netCDF4
import numpy as np

from served import Daemon, taken_program, write_columns

PROGRAM = taken_program()
HOURS = (0, 6, 12, 24)
LONGITUDES, LATITUDES = np.arange(0, 360, 15.0), np.arange(-75, 76, 15.0)
LEVELS = (1000.0, 700.0, 400.0)
SIZE = "width=96&height=72"


def write_globe(path, calendar="standard", since="2001-02-28"):
    """Winds, a cloud and a temperature that differ at each step."""
    with netCDF4.Dataset(path, "w") as file:
        axes = {"time": (HOURS, f"hours since {since}"), "level": (LEVELS, "hPa"),
                "lat": (LATITUDES, "degrees_north"), "lon": (LONGITUDES, "degrees_east")}
        names = {"level": "air_pressure", "lat": "latitude", "lon": "longitude"}
        for name, (values, units) in axes.items():
            file.createDimension(name, len(values))
            axis = file.createVariable(name, "f8", (name,))
            axis.units = units
            if name == "time":
                axis.calendar = calendar
            else:
                axis.standard_name = names[name]
            axis[:] = values
        rng = np.random.default_rng(7)
        shape = (len(HOURS), len(LEVELS), len(LATITUDES), len(LONGITUDES))
        for name, standard, units in (("u", "eastward_wind", "m s-1"),
                                      ("v", "northward_wind", "m s-1"),
                                      ("uo", "eastward_sea_water_velocity", "m s-1"),
                                      ("vo", "northward_sea_water_velocity", "m s-1"),
                                      ("cloud", "cloud_area_fraction", "1"),
                                      ("t", "air_temperature", "K")):
            variable = file.createVariable(name, "f4", tuple(axes))
            variable.standard_name, variable.units = standard, units
            variable[:] = rng.random(shape) * (1 if name == "cloud" else 20)


class Addresses(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="windsplat-addresses-")
        folder = pathlib.Path(cls.folder.name)
        write_globe(folder / "globe.nc")
        write_globe(folder / "noleap.nc", "noleap", "2004-02-28")
        cls.daemon = Daemon(PROGRAM, folder / "globe.nc", folder / "noleap.nc", "tornado")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.end()
        cls.folder.cleanup()

    def saved(self, view):
        answer = self.daemon.post("/v1/views", view)
        self.assertEqual(answer.status, 201, answer.body)
        return answer.headers["Location"]

    def frame(self, query="", dataset="globe", form="png"):
        return self.daemon.get(f"/v1/datasets/{dataset}/frame.{form}?{SIZE}&{query}")

    def posted(self, view, form="png"):
        """The same picture as the answer to a view, which the parameters stand for."""
        whole = {"dataset": "globe", "image": {"width": 96, "height": 72}, **view}
        answer = self.daemon.ask("POST", "/v1/frames", json.dumps(whole), {
            "Content-Type": "application/json",
            "Accept": {"png": "image/png", "svg": "image/svg+xml"}[form]})
        self.assertEqual(answer.status, 200, answer.body)
        return answer

    def assert_refused(self, answer, *texts, status=422):
        found, detail = answer.detail()
        self.assertEqual(found, status, detail)
        for text in texts:
            self.assertIn(text, detail)

    # --- saved views ---

    def test_a_saved_view_has_the_picture_that_its_document_has(self):
        view = {"dataset": "globe", "step": 2, "scalars": [],
                "image": {"width": 96, "height": 72, "background": "#203040"}}
        place = self.saved(view)
        picture = self.daemon.get(f"{place}/frame.png")
        self.assertEqual((picture.status, picture.headers["Content-Type"]), (200, "image/png"))
        self.assertEqual(picture.body, self.posted(view).body)
        types = {"jpg": "image/jpeg", "npy": "application/x-npy", "pdf": "application/pdf",
                 "svg": "image/svg+xml"}
        for name, kind in types.items():
            answer = self.daemon.get(f"{place}/frame.{name}")
            self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, kind))

    def test_parameters_override_the_saved_view(self):
        view = {"dataset": "globe", "step": 2, "image": {"width": 640, "height": 480}}
        place = self.saved(view)
        picture = self.daemon.get(f"{place}/frame.png?{SIZE}&step=1")
        self.assertEqual(picture.body, self.posted({"step": 1}).body)
        self.assertNotEqual(picture.body, self.posted({"step": 2}).body)
        orbit = self.daemon.get(f"{place}/frame.png?{SIZE}&step=1&azimuth=70&zoom=1.5")
        self.assertEqual(orbit.body, self.frame("step=1&azimuth=70&zoom=1.5").body)
        self.assert_refused(self.daemon.get(f"{place}/frame.png?width=0"), "/image/width")
        self.assert_refused(self.daemon.get(f"{place}/frame.png?step=99"), "/step", "0 to 3")
        self.assert_refused(self.daemon.get(f"{place}/frame.png?dpi=300&quality=3"), "'quality'",
                            status=400)

    def test_a_picture_of_a_saved_view_is_revalidated(self):
        place = self.saved({"dataset": "globe", "image": {"width": 96, "height": 72}})
        first = self.daemon.get(f"{place}/frame.png")
        self.assertEqual(first.headers["Cache-Control"], "no-cache")
        tag = first.headers["ETag"]
        again = self.daemon.get(f"{place}/frame.png", If_None_Match=tag)
        self.assertEqual((again.status, again.body, again.headers["ETag"]), (304, b"", tag))
        changed = self.daemon.ask("PATCH", place, '{"step": 3}',
                                  {"Content-Type": "application/merge-patch+json"})
        self.assertEqual(changed.status, 200)
        later = self.daemon.get(f"{place}/frame.png", If_None_Match=tag)
        self.assertEqual(later.status, 200)
        self.assertNotEqual(later.headers["ETag"], tag)
        self.assertEqual(later.body, self.posted({"step": 3}).body)

    def test_a_saved_view_without_data_has_no_picture(self):
        self.assert_refused(self.daemon.get(f'{self.saved({"step": 1})}/frame.png'),
                            "names no dataset")
        self.assert_refused(self.daemon.get(f'{self.saved({"dataset": "gone"})}/frame.png'),
                            "gone", status=404)
        self.assert_refused(self.daemon.get("/v1/views/0000000000/frame.png"), "0000000000",
                            status=404)

    def test_differences_of_a_saved_view_are_drawn(self):
        view = {"dataset": "globe", "step": 3, "difference": {"step": 0}}
        picture = self.daemon.get(f"{self.saved(view)}/frame.png?{SIZE}&step=2")
        self.assertEqual(picture.body, self.posted({**view, "step": 2}).body)

    # --- times ---

    def test_datetime_is_the_step_at_that_time(self):
        wanted = self.posted({"step": 1}).body
        for time in ("T06:00:00Z", "T06:00Z", "T06:00", "T06:00:00.000Z", "T08:30+02:30",
                     "T00:00-06:00"):
            answer = self.frame(f"datetime=2001-02-28{urllib.parse.quote(time)}")
            self.assertEqual((answer.status, answer.body), (200, wanted), time)
        # A day without a time of day begins it; the last one is in the next month.
        self.assertEqual(self.frame("datetime=2001-03-01").body, self.posted({"step": 3}).body)

    def test_a_time_without_a_step_is_refused_with_its_neighbours(self):
        self.assert_refused(self.frame("datetime=2001-02-28T07:00Z"),
                            "2001-02-28T06:00:00Z (step 1)", "2001-02-28T12:00:00Z (step 2)",
                            "nearest=true")
        self.assert_refused(self.frame("datetime=2001-02-27"), "the one after is "
                            "2001-02-28T00:00:00Z (step 0)")
        self.assert_refused(self.frame("datetime=2001-03-02"), "the one before is "
                            "2001-03-01T00:00:00Z (step 3)")

    def test_the_nearest_step_is_drawn_if_asked_for(self):
        for time, step in (("2001-02-28T02:59:59Z", 0), ("2001-02-28T03:00:01Z", 1),
                           ("2001-02-28T09:00:00Z", 1), ("2001-02-28T18:00:00.001Z", 3),
                           ("1999-01-01", 0), ("2031-01-01", 3)):
            answer = self.frame(f"datetime={time}&nearest=true")
            self.assertEqual(answer.body, self.posted({"step": step}).body, time)

    def test_times_are_those_of_the_calendar(self):
        # The day after 2004-02-28 is 2004-03-01 without leap days.
        self.assertEqual(self.frame("datetime=2004-03-01", "noleap").status, 200)
        self.assert_refused(self.frame("datetime=2004-02-29", "noleap"), "'datetime'", status=400)
        answer = self.frame("datetime=2004-02-28T18:00:00.001Z&nearest=true", "noleap")
        self.assertEqual(answer.body, self.frame("step=3", "noleap").body)

    def test_what_is_no_time_is_refused(self):
        for text in ("yesterday", "2001-02-30", "2001-02-28T24:00Z", "2001-02", "2001-02-28T06",
                     "2001-02-28T06:00Zz", "2001-02-28T06:00:00.12345Z", ""):
            self.assert_refused(self.frame(f"datetime={text}"), "'datetime'", status=400)
        self.assert_refused(self.frame("datetime=2001-02-28&step=0"), "'step' and 'datetime'")
        self.assert_refused(self.frame("nearest=true"), "requires 'datetime'")
        self.assert_refused(self.frame("datetime=2001-02-28", "tornado"), "no dates")

    # --- fields, colours, annotations ---

    def test_field_is_all_that_is_drawn(self):
        none = {"field": None}
        for names, view in (("wind", {"vector": {"field": "wind"}, "scalars": []}),
                            ("t", {"vector": none, "scalars": [{"field": "t"}]}),
                            ("cloud,wind", {"vector": {"field": "wind"},
                                            "scalars": [{"field": "cloud"}]}),
                            ("t,cloud", {"vector": none,
                                         "scalars": [{"field": "t"}, {"field": "cloud"}]})):
            self.assertEqual(self.frame(f"field={names}").body, self.posted(view).body, names)

    def test_field_keeps_what_a_saved_view_says_of_it(self):
        medium = {"field": "t", "color": {"map": "magma", "range": [0, 10]}}
        surfaces = [{"field": "t", "isovalue": 12}, {"field": "cloud", "isovalue": 0.5}]
        place = self.saved({"dataset": "globe", "scalars": [{"field": "cloud"}, medium],
                            "surfaces": surfaces})
        picture = self.daemon.get(f"{place}/frame.png?{SIZE}&field=t")
        self.assertEqual(picture.body, self.posted({
            "vector": {"field": None}, "scalars": [medium], "surfaces": surfaces[:1]}).body)

    def test_fields_that_do_not_exist_are_refused_with_those_that_do(self):
        self.assert_refused(self.frame("field=zzzz"), "'zzzz'; fields: ", "wind", "cloud", "t")
        self.assert_refused(self.frame("field=winds"), "did you mean 'wind'?")
        self.assert_refused(self.frame("field="), "''")
        self.assert_refused(self.frame("field=t,t"), "named twice")
        self.assert_refused(self.frame("field=wind,current"), "more than one vector")

    def test_colormap_colours_lines_media_and_surfaces(self):
        self.assertEqual(self.frame("colormap=magma&field=wind,t").body, self.posted({
            "vector": {"field": "wind", "color": {"map": "magma"}},
            "scalars": [{"field": "t", "color": {"map": "magma"}}]}).body)
        shown = self.daemon.get("/v1/datasets/globe").json()["defaultView"]["scalars"]
        self.assertEqual(self.frame("colormap=cividis").body, self.posted({
            "vector": {"color": {"map": "cividis"}},
            "scalars": [{"field": one["field"], "color": {"map": "cividis"}}
                        for one in shown]}).body)
        self.assert_refused(self.frame("colormap=jet-like"), "'jet-like'", "viridis")

    def test_annotate_names_parts(self):
        parts = ("box", "axes", "north", "scaleBar", "legend", "title", "stepTime", "contourLabels")
        every = dict.fromkeys(parts, True)
        self.assertEqual(self.frame("annotate=true").body, self.posted({"annotations": every}).body)
        self.assertEqual(self.frame("annotate=legend,stepTime").body,
                         self.posted({"annotations": {"legend": True, "stepTime": True}}).body)
        place = self.saved({"dataset": "globe", "annotations": {**every, "titleText": "Mine"}})
        self.assertEqual(self.daemon.get(f"{place}/frame.png?{SIZE}&annotate=false").body,
                         self.posted({}).body)
        self.assertEqual(self.daemon.get(f"{place}/frame.svg?{SIZE}&annotate=title").body,
                         self.posted({"annotations": {"title": True, "titleText": "Mine"}},
                                     "svg").body)
        self.assert_refused(self.frame("annotate=titles"), "'titles'", "stepTime")

    def test_parameters_are_part_of_the_tag(self):
        tags = {self.frame(query).headers["ETag"]
                for query in ("", "field=t", "colormap=magma", "annotate=box",
                              "datetime=2001-03-01")}
        self.assertEqual(len(tags), 5)
        tag = self.frame("step=3").headers["ETag"]
        same = self.daemon.get(f"/v1/datasets/globe/frame.png?{SIZE}&datetime=2001-03-01",
                               If_None_Match=tag)
        self.assertEqual(same.status, 304)


class Probes(unittest.TestCase):
    """Positions as longitude, latitude and level."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="windsplat-probes-")
        folder = pathlib.Path(cls.folder.name)
        write_globe(folder / "globe.nc")
        write_columns(folder / "rotated.nc")
        with netCDF4.Dataset(folder / "globe.nc") as file:
            cls.t = np.array(file["t"][:])
        cls.daemon = Daemon(PROGRAM, folder / "globe.nc", folder / "rotated.nc", "tornado")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.end()
        cls.folder.cleanup()

    def probe(self, dataset, query):
        return self.daemon.get(f"/v1/datasets/{dataset}/probe?{query}")

    def test_the_sample_is_the_nearest_one_of_the_file(self):
        for longitude, latitude, level in ((31, -14, 690), (-17, 44, 1000), (355, 71, 410)):
            answer = self.probe("globe", f"lon={longitude}&lat={latitude}&level={level}&step=2")
            self.assertEqual(answer.status, 200, answer.body)
            x = np.argmin(np.abs((LONGITUDES - longitude + 180) % 360 - 180))
            y = np.argmin(np.abs(LATITUDES - latitude))
            z = np.argmin(np.abs(np.array(LEVELS) - level))
            value = answer.json()["values"]["t"]["value"]
            self.assertEqual(np.float32(value), self.t[2, z, y, x])
            self.assertEqual(answer.body, self.probe(
                "globe", f"x={longitude}&y={latitude}&z={level}&step=2").body)

    def test_times_are_steps(self):
        for path in ("probe?lon=30&lat=0&level=700", "fields/t/histogram?bins=5",
                     "fields/t/range?of=step", "fields/t/values.npy?level=700"):
            def asked(query):
                return self.daemon.get(f"/v1/datasets/globe/{path}&{query}")
            at = asked("datetime=2001-02-28T12:00Z")
            self.assertEqual((at.status, at.body), (200, asked("step=2").body), path)
            self.assertNotEqual(at.body, asked("step=1").body, path)
            near = asked("datetime=2001-02-28T13:00Z&nearest=true")
            self.assertEqual((near.status, near.body), (200, at.body), path)
            for wrong, text in (("datetime=2001-02-28T13:00Z", "no step is at"),
                                ("datetime=2001-02-28T12:00Z&step=2", "mutually exclusive"),
                                ("nearest=true", "requires 'datetime'")):
                answer = asked(wrong)
                self.assertEqual(answer.status, 422, path)
                self.assertIn(text, answer.detail()[1])

    def test_a_series_takes_them_too(self):
        answer = self.daemon.get("/v1/datasets/globe/fields/t/series?lon=30&lat=-15&level=700")
        self.assertEqual(answer.status, 200, answer.body)
        self.assertTrue(np.array_equal(np.float32(answer.json()["values"]), self.t[:, 1, 4, 2]))

    def test_columns_of_a_curved_grid_have_longitudes(self):
        by_name = self.probe("rotated", "lon=12.1&lat=50.9")
        self.assertEqual(by_name.status, 200, by_name.body)
        self.assertEqual(by_name.body, self.probe("rotated", "x=12.1&y=50.9").body)

    def test_data_without_longitudes_refuse_them(self):
        for query in ("lon=0&lat=0&level=0", "lat=0&x=0&z=0"):
            status, detail = self.probe("tornado", query).detail()
            self.assertEqual(status, 422)
            self.assertIn("no longitudes and latitudes", detail)
            self.assertIn("'x' and 'y'", detail)
        self.assertEqual(self.probe("tornado", "x=0&y=0&level=0.1").body,
                         self.probe("tornado", "x=0&y=0&z=0.1").body)

    def test_positions_that_contradict_are_refused(self):
        for query, text in (("lon=0&x=0&lat=0&level=700", "'x' and 'lon'"),
                            ("index=0,0,0&lat=0", "mutually exclusive"),
                            ("lon=0&lat=91&level=700", "'lat' must be -90 to 90"),
                            ("lon=0&lat=0&level=700&heightField=t", "'level'"),
                            ("lon=0&level=700", "'lat' is required beside 'lon'"),
                            ("lat=0&level=700", "'lon' is required beside 'lat'"),
                            ("x=0&z=700", "y (or lat) is required")):
            status, detail = self.probe("globe", query).detail()
            self.assertEqual(status, 422, query)
            self.assertIn(text, detail)

    def test_misspelt_names_are_answered_with_the_nearest_or_all(self):
        view = {"dataset": "globe", "image": {"width": 64, "height": 48}}
        for path, texts in (
                ("datasets/glob/frame.png", ["no dataset 'glob'; did you mean 'globe'?"]),
                ("datasets/globe/frame.png?preset=figur", ["did you mean 'figure'?"]),
                ("datasets/globe/frame.png?preset=zzzz", ["presets: default, winds"]),
                ("datasets/globe/fields/winds/values.npy", ["did you mean 'wind'?"]),
                ("datasets/globe/fields/zzzz/values.npy", ["fields: ", "wind"]),
                ("datasets/globe/frame.png?field=winds", ["did you mean 'wind'?"]),
                ("datasets/globe/probe?lon=0&lat=0&level=700&fields=winds",
                 ["did you mean 'wind'?"])):
            status, detail = self.daemon.get(f"/v1/{path}").detail()
            self.assertIn(status, (404, 422), path)
            for text in texts:
                self.assertIn(text, detail, path)
        for part, text in (({"scalars": [{"field": "winds"}]}, "did you mean 'wind'?"),
                           ({"vector": {"field": "zzzz"}}, "fields: "),
                           ({"vector": {"strid": 2}}, "did you mean 'stride'?")):
            status, detail = self.daemon.post("/v1/frames", {**view, **part}).detail()
            self.assertEqual(status, 422)
            self.assertIn(text, detail)


if __name__ == "__main__":
    unittest.main()
