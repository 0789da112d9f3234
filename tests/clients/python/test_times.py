"""Times in the calendars of CF: files of each, read by the daemon, whose choice of steps the client
has to share; distances against cftime."""
import datetime
import pathlib
import random
import unittest
import unittest.mock

import cftime
import netCDF4
import numpy as np
import xarray
from support import shared_server, windsplat

import windsplat.xarray  # noqa: F401
from windsplat._times import CALENDARS, day_number, moment_of

# Units, times: around a day that some calendars lack.
FILES = {
    "noleap": ("hours since 2000-02-28 12:00", (0, 12, 36)),
    "365_day": ("days since 1999-12-31", (0, 58, 59)),
    "all_leap": ("days since 2001-02-28", (0, 1, 2)),
    "360_day": ("days since 2000-02-28", (0, 2, 3)),
    "julian": ("days since 1900-02-28", (0, 1, 2)),
    "proleptic_gregorian": ("days since 1500-02-28", (0, 1, 2)),
    "standard": ("days since 1582-10-03", (0, 1, 2)),
    "gregorian": ("minutes since 2000-01-01", (0, 0.5, 1)),
}
WITHOUT_DATES = {"none": ("seconds since 2000-01-01", (0, 1, 2))}


def write(path, calendar, units, times):
    with netCDF4.Dataset(path, "w") as file:
        for name, places in (("time", times), ("z", range(3)), ("y", range(3)), ("x", range(4))):
            file.createDimension(name, len(places))
            file.createVariable(name, "f8", (name,))[:] = list(places)
        file["time"].units, file["time"].calendar = units, calendar
        values = np.zeros((len(times), 3, 3, 4)) + np.arange(len(times))[:, None, None, None]
        file.createVariable("t", "f4", ("time", "z", "y", "x"))[:] = values


class Calendars(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server, cls.folder = shared_server()
        cls.datasets = {}
        for calendar, (units, times) in {**FILES, **WITHOUT_DATES}.items():
            path = pathlib.Path(cls.folder) / f"calendar_{calendar}.nc"
            write(path, calendar, units, times)
            cls.datasets[calendar] = cls.server.open(path.name)

    def theirs(self, dataset, text):
        answer = self.server.http.get(f"v1/datasets/{dataset.id}/fields/t/values.json",
                                      datetime=text, nearest="true")
        return answer["step"]

    def test_steps_are_those_of_the_file_in_every_calendar(self):
        for calendar, (units, times) in FILES.items():
            dates = cftime.num2date(times, units, calendar)
            view = self.datasets[calendar].view()
            with self.subTest(calendar):
                for step, date in enumerate(dates):
                    for time in (date, date.isoformat(), date.isoformat() + "Z"):
                        self.assertEqual(view.at(time=time).get("/step"), step)
                arrays = xarray.DataArray(dates, dims="time")
                self.assertEqual(view.at(time=arrays[1]).get("/step"), 1)

    def test_the_nearest_step_is_that_of_the_server_in_every_calendar(self):
        chance = random.Random(7)
        for calendar, (units, times) in FILES.items():
            dataset = self.datasets[calendar]
            span = times[-1] - times[0]
            for _ in range(8):
                date = cftime.num2date(times[0] + chance.uniform(-0.2, 1.2) * span, units, calendar)
                text = date.isoformat(timespec="seconds")
                with self.subTest(calendar, text=text):
                    step = dataset.step_at(text, nearest=True)
                    self.assertEqual(step, self.theirs(dataset, text))
                    self.assertEqual(step, dataset.step_at(date, nearest=True))

    def test_a_date_that_the_calendar_lacks_is_refused(self):
        for calendar, text in (("noleap", "2000-02-29"), ("360_day", "2000-01-31"),
                               ("julian", "1901-02-29"), ("standard", "1582-10-10"),
                               ("gregorian", "2000-01-01T24:00"), ("all_leap", "2001-04-31")):
            for nearest in (False, True):
                with self.subTest(text), self.assertRaisesRegex(
                        ValueError, f"'{text}' is no time of the calendar '{CALENDARS[calendar]}'"):
                    self.datasets[calendar].step_at(text, nearest=nearest)
        with self.assertRaisesRegex(ValueError, "calendar 'standard', the steps are of 'noleap'"):
            self.datasets["noleap"].step_at(cftime.datetime(2000, 2, 28, 12), nearest=True)
        # After the reform two calendars have the same days.
        self.assertEqual(self.datasets["gregorian"].step_at(
            cftime.datetime(2000, 1, 1, calendar="proleptic_gregorian")), 0)

    def test_times_without_dates_are_numbers(self):
        dataset = self.datasets["none"]
        self.assertIsNone(dataset.calendar)
        self.assertEqual(list(dataset.times), [0, 1, 2])
        self.assertEqual(dataset.step_at(2), 2)
        with self.assertRaisesRegex(ValueError, "no dates, give a number from 0 to 2"):
            dataset.step_at("0001-01-01")

    def test_arrays_of_times_have_a_type_that_has_their_dates(self):
        for calendar, (units, times) in FILES.items():
            given = self.datasets[calendar].times
            dates = cftime.num2date(times, units, calendar)
            with self.subTest(calendar):
                if calendar in ("gregorian", "proleptic_gregorian"):
                    self.assertEqual(given.dtype, np.dtype("datetime64[ms]"))
                    self.assertEqual([str(one) for one in given],
                                     [one.isoformat(timespec="milliseconds") for one in dates])
                else:
                    self.assertTrue(all(given == dates))
                    self.assertEqual(given[2] - given[0], dates[2] - dates[0])
        with unittest.mock.patch.dict("sys.modules", {"cftime": None}):
            self.assertEqual(list(self.datasets["360_day"].times)[1], "2000-02-30T00:00:00Z")
        with self.assertRaisesRegex(ValueError, "no time: give a text"):
            self.datasets["gregorian"].step_at(np.datetime64("NaT"))

    def test_days_are_counted_as_by_cftime(self):
        chance = random.Random(11)
        for calendar in set(CALENDARS.values()):
            zero = cftime.datetime(1, 1, 1, calendar=calendar)
            for _ in range(100):
                days = chance.randrange(0, 1_100_000)
                date = zero + datetime.timedelta(days=days)
                number = day_number(date.year, date.month, date.day, calendar)
                self.assertEqual(number - day_number(1, 1, 1, calendar), days, (calendar, date))
        self.assertEqual(moment_of("2000-03-01T01:00+02:00", "noleap"),
                         moment_of("2000-02-28T23:00", "noleap"))

    def test_arrays_of_xarray_keep_their_calendar(self):
        times = xarray.cftime_range("2000-02-29", periods=3, freq="D", calendar="360_day")
        arrays = xarray.Dataset(
            {"q": (("time", "z", "y", "x"), np.zeros((3, 3, 3, 4), "f4"))}, {"time": times})
        view = arrays.windsplat.view(scalar="q", server=self.server)
        self.assertEqual(view.dataset.calendar, "360_day")
        self.assertTrue(all(view.dataset.times == times))
        self.assertEqual(view.at(time=arrays.time[2]).get("/step"), 2)
        self.assertEqual(view.at(time="2000-02-30").get("/step"), 1)


if __name__ == "__main__":
    unittest.main()
