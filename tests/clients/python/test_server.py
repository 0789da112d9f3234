"""Servers, datasets and values, against the real daemon; refusals against prepared answers."""
import asyncio
import concurrent.futures
import datetime
import email.utils
import multiprocessing
import os
import subprocess
import tempfile
import threading
import time
import unittest
import unittest.mock

import numpy as np
from support import Prepared, problem, shared_server, start, windsplat

from windsplat._times import SAME, step_of


class Refusals(unittest.TestCase):
    def test_a_refused_request_is_repeated_when_the_server_says(self):
        waits = []
        with Prepared((503, {"Retry-After": "7"}, problem(503)), (429, {}, problem(429)),
                      (200, {}, {"version": "1.2.3"})) as there:
            with unittest.mock.patch("time.sleep", waits.append):
                self.assertEqual(windsplat.Server(there.url).version, "1.2.3")
            self.assertEqual(there.requests, ["GET /v1"] * 3)
        # Up to a fifth longer, so that clients refused together come apart; without a word 1 s.
        self.assertTrue(7 <= waits[0] <= 8.4 and 1 <= waits[1] <= 1.2, waits)

    def test_a_date_says_when_to_ask_again_too(self):
        waits = []
        date = email.utils.formatdate(time.time() + 30, usegmt=True)
        with Prepared((503, {"Retry-After": date}, problem(503)),
                      (200, {}, {"version": "1.2.3"})) as there:
            with unittest.mock.patch("time.sleep", waits.append):
                windsplat.connect(there.url)
        self.assertTrue(20 < waits[0] <= 36, waits)

    def test_what_is_no_windsplat_server_is_refused_as_that(self):
        for answer, text in (((200, {}, ["a"]), "no windsplat server"),
                             ((200, {}, {"a": 1}), "no windsplat server"),
                             ((200, {}, "<html>"), "no windsplat server"),
                             ((302, {"Location": "/login"}, {}), "sends requests on to /login")):
            with self.subTest(answer), Prepared(answer) as there:
                with self.assertRaisesRegex(windsplat.ConnectionFailed, text):
                    windsplat.connect(there.url)
        with Prepared((200, {}, b"<html>")) as there:
            with self.assertRaisesRegex(windsplat.ConnectionFailed, "/v1 is no address of"):
                windsplat.connect(there.url)

    def test_a_wait_beyond_the_patience_is_not_begun(self):
        with Prepared((429, {"Retry-After": "30"}, problem(429))) as there:
            with self.assertRaises(windsplat.Busy) as caught:
                windsplat.connect(there.url, patience=5)
            self.assertEqual(caught.exception.retry_after, 30)
            self.assertEqual(there.requests, ["GET /v1"])

    def test_errors_name_each_value_by_its_pointer(self):
        errors = [{"pointer": "/a/0", "detail": "x"}, {"pointer": "", "detail": "y"}]
        with Prepared((422, {}, problem(422, errors=errors, requestId="r1"))) as there:
            with self.assertRaises(windsplat.InvalidView) as caught:
                windsplat.connect(there.url)
            error = caught.exception
            self.assertEqual([(one.pointer, one.detail) for one in error.errors],
                             [("/a/0", "x"), ("", "y")])
            self.assertEqual((error.status, error.title, error.detail, error.request_id),
                             (422, "Refused", "no", "r1"))

    def test_a_job_that_takes_too_long_is_a_timeout(self):
        job = {"id": "1", "kind": "dataset", "state": "running", "result": None, "problem": None}
        with Prepared((202, {}, job), (200, {}, job)) as there:
            with self.assertRaises(windsplat.JobTimeout) as caught:
                windsplat.Server(there.url).open("a.nc", timeout=0.2)
            self.assertIsInstance(caught.exception, TimeoutError)

    def test_addresses(self):
        self.assertEqual(windsplat.Server("localhost:8080").url, "http://localhost:8080/")
        self.assertEqual(windsplat.Server("https://a.example/b/?c#d").url, "https://a.example/b/")
        for address in ("ftp://a.example", "http://a b", "", "unix:relative", "unix:"):
            with self.assertRaisesRegex(ValueError, f"'.*{address}' is no"):
                windsplat.Server(address)


class Values(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server, cls.folder = shared_server()
        cls.dataset = cls.server["climate:48x24x8"]

    def test_fields_and_times(self):
        fields = self.dataset.fields
        self.assertEqual((fields["wind"].kind, fields["wind"].units), ("vector", "m s-1"))
        self.assertTrue(fields["wind_speed"].derived)
        times = self.dataset.times
        self.assertEqual(times.dtype, np.dtype("datetime64[ms]"))
        self.assertEqual(times[1] - times[0], np.timedelta64(6, "h"))
        self.assertEqual(self.dataset.step_at("2001-01-01T12:00"), 2)
        self.assertEqual(self.dataset.step_at(times[5]), 5)
        self.assertEqual(self.dataset.view().at(time=times[3]).get("/step"), 3)
        self.assertEqual(self.dataset.shape, (8, 24, 48))
        self.assertEqual(self.dataset.coordinates("z")[0], 1000)

    def test_a_time_without_a_step_is_refused_with_its_neighbours(self):
        at = self.dataset.view().at
        with self.assertRaises(windsplat.InvalidView) as caught:
            at(time="2001-01-01T11:00")
        self.assertIn("is 2001-01-01T12:00:00Z (step 2); nearest=True", str(caught.exception))
        # The same word as of REST, which names the same neighbours and takes the same step.
        path = "v1/datasets/climate%3A48x24x8/fields/cloud/values.json"
        with self.assertRaises(windsplat.InvalidView) as theirs:
            self.server.http.get(path, datetime="2001-01-01T11:00")
        said = "the one before is 2001-01-01T06:00:00Z (step 1), the one after is"
        self.assertIn(said, theirs.exception.detail)
        self.assertIn(said, caught.exception.detail)
        for time, step in (("2001-01-01T11:00", 2), ("2001-01-01T09:00", 1), ("1990-01-01", 0),
                           ("2001-01-01T11:00+02:00", 1)):
            self.assertEqual(at(time=time, nearest=True).get("/step"), step)
            there = self.server.http.get(path, datetime=time, nearest="true")
            self.assertEqual(there["step"], step)
        for time in ("2001-01-01T14:00+02:00", datetime.datetime(2001, 1, 1, 12),
                     np.datetime64("2001-01-01T12", "h"), "2001-01-01 12:00:00.000",
                     datetime.datetime(2001, 1, 1, 12, tzinfo=datetime.timezone.utc)):
            self.assertEqual(at(time=time).get("/step"), 2)
        with self.assertRaisesRegex(windsplat.InvalidView, r"the one before is [^,]*\(step 7\); n"):
            at(time="2099-01-01")
        for time in ("noon", 3):
            with self.assertRaisesRegex(ValueError, "is no time.*2001-01-01T06:00"):
                at(time=time)
        with self.assertRaisesRegex(ValueError, "nearest requires time"):
            at(2, nearest=True)

    def test_values_and_probes_take_times_and_the_names_of_places_of_rest(self):
        place = {"lon": 10, "lat": 40, "level": 500}
        probe = self.dataset.probe(**place, time="2001-01-01T12:00")
        self.assertEqual((probe.step, probe["wind"]),
                         (2, self.dataset.probe(10, 40, 500, step=2)["wind"]))
        self.assertEqual(self.dataset.probe(**place, time="2001-01-01T11:00", nearest=True).step, 2)
        np.testing.assert_array_equal(self.dataset.series("cloud", **place).values,
                                      self.dataset.series("cloud", 10, 40, 500).values)
        values = self.dataset.values("cloud", level=1000, time="2001-01-01T12:00")
        self.assertEqual(values.step, 2)
        for call in (lambda **more: self.dataset.probe(**place, **more),
                     lambda **more: self.dataset.values("cloud", **more)):
            with self.assertRaisesRegex(windsplat.InvalidView, "the one after is"):
                call(time="2001-01-01T11:00")
            with self.assertRaisesRegex(ValueError, "either step or time"):
                call(time="2001-01-01T12:00", step=1)
            with self.assertRaisesRegex(ValueError, "nearest requires time"):
                call(nearest=True)
        with self.assertRaisesRegex(windsplat.InvalidView, "lon"):
            self.server["tornado:24"].probe(lon=1, lat=1, level=1)

    def test_steps_without_dates_are_chosen_by_their_coordinates(self):
        times = [0.0, 0.1, 0.3]
        texts = ["0 s", "0.1 s", "0.3 s"]
        self.assertEqual(step_of(times, 0.1 + 1e-12, False, texts, 0.1, SAME), 1)
        self.assertEqual(step_of(times, 0.19, True, texts, 0.19, SAME), 1)
        with self.assertRaisesRegex(windsplat.InvalidView, r"0\.1 s \(step 1\).*0\.3 s \(step 2"):
            step_of(times, 0.2, False, texts, 0.2, SAME)

    def test_probes_series_histograms_and_ranges_agree(self):
        probe = self.dataset.probe(10, 40, 500, step=2, fields=["wind_speed"])
        series = self.dataset.series("wind", 10, 40, 500)
        np.testing.assert_allclose(series.values[2], probe["wind"])
        self.assertAlmostEqual(np.linalg.norm(probe["wind"]), probe["wind_speed"], places=4)
        self.assertEqual(len(series.times), len(self.dataset.steps))
        again = self.dataset.probe(index=probe.position.index, step=2)
        self.assertEqual(again["cloud"], probe["cloud"])
        low, high = self.dataset.range("cloud", step=1)
        histogram = self.dataset.histogram("cloud", bins=8, step=1)
        self.assertEqual(histogram.counts.sum() + histogram.masked, np.prod(self.dataset.shape))
        self.assertEqual((histogram.edges[0], histogram.edges[-1]), (low, high))
        moment = self.dataset.times[1]
        speeds = [self.dataset.range("wind_speed", step=step) for step in (0, 1)]
        self.assertNotEqual(*speeds)
        self.assertNotEqual(speeds[1], self.dataset.range("wind_speed"))
        self.assertEqual(self.dataset.range("wind_speed", time=moment), speeds[1])
        of_time = self.dataset.histogram("cloud", bins=8, time=moment)
        np.testing.assert_array_equal(of_time.counts, histogram.counts)
        first = self.dataset.histogram("cloud", bins=8, step=0)
        self.assertFalse(np.array_equal(of_time.counts, first.counts))
        every = self.dataset.range("cloud")
        self.assertTrue(every[0] <= low and every[1] >= high)

    def test_values_of_a_box_are_those_of_probes(self):
        try:
            box = self.dataset.values("wind", box=(-20, 30, 40, 70), level=(1000, 500), step=2,
                                      stride=2)
        except windsplat.NotFound:
            self.skipTest("the daemon has no resource of values")
        self.assertEqual(box.dims, ("component", "z", "y", "x"))
        self.assertEqual(box.array.dtype, np.float32)
        place = {axis: box.coordinates[axis][1] for axis in "xyz"}
        probe = self.dataset.probe(**place, step=2)
        self.assertEqual((probe.position.x, probe.position.y), (place["x"], place["y"]))
        np.testing.assert_array_equal(box.array[:, 1, 1, 1], np.float32(probe["wind"]))
        arrays = box.to_xarray()
        self.assertEqual((arrays.dims, arrays.attrs["units"]),
                         (("component", "level", "lat", "lon"), "m s-1"))
        level = self.dataset.values("cloud", level=float(box.coordinates["z"][2]))
        self.assertEqual(level.array.shape, (24, 48))
        self.assertEqual(float(level.to_xarray().level), box.coordinates["z"][2])
        whole = self.dataset.values("cloud")
        np.testing.assert_array_equal(whole.array[2], level.array)
        with self.assertRaises(windsplat.InvalidView):
            self.dataset.values("cloud", level=1e9)

    def test_a_size_that_is_no_pair_is_refused(self):
        for size in ("400x200", (400,), 400):
            with self.assertRaisesRegex(ValueError, r"size must be .*\(400, 200\), not .*400"):
                self.dataset.view(size=size)
        self.assertEqual(self.dataset.view(size=[40, 20]).get("/image/height"), 20)

    def test_names_are_suggested(self):
        with self.assertRaisesRegex(windsplat.NotFound, "did you mean 'tornado:24'"):
            self.server["tornado24"]
        with self.assertRaisesRegex(windsplat.NotFound, "did you mean 'cloud'"):
            self.dataset.range("clouds")


class Open(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        import netCDF4

        cls.server, cls.folder = shared_server()
        for number in range(2):
            with netCDF4.Dataset(cls.folder / f"part_{number}.nc", "w") as file:
                for name, size in (("time", 1), ("z", 3), ("y", 4), ("x", 5)):
                    file.createDimension(name, size)
                    file.createVariable(name, "f8", (name,))[:] = np.arange(size) + (
                        number if name == "time" else 0)
                file["time"].units = "days since 2020-02-28"
                file.createVariable("t", "f4", ("time", "z", "y", "x"))[:] = number + np.arange(
                    60, dtype="f4").reshape(1, 3, 4, 5)
        # Another field at the time of part_0, for lists of files.
        with netCDF4.Dataset(cls.folder / "part_0.nc") as file, netCDF4.Dataset(
                cls.folder / "other.nc", "w") as other:
            for name in ("time", "z", "y", "x"):
                other.createDimension(name, len(file.dimensions[name]))
                other.createVariable(name, "f8", (name,))[:] = file[name][:]
            other["time"].units = file["time"].units
            other.createVariable("q", "f4", ("time", "z", "y", "x"))[:] = 2 * file["t"][:]
        (cls.folder / "bad.nc").write_bytes(b"CDF\x01 and no more")

    def test_files_patterns_and_lists(self):
        one = self.server.open("part_0.nc")
        self.assertEqual((one.id, len(one.steps)), ("part_0", 1))
        series = self.server.open(self.folder / "part_?.nc")
        self.assertEqual(list(series.times), [np.datetime64("2020-02-28"),
                                              np.datetime64("2020-02-29")])
        self.assertEqual(series.range("t"), (0, 60))
        listed = self.server.open(["part_0.nc", "other.nc"], title="Two parts")
        self.assertEqual(listed.title, "Two parts")
        self.assertLessEqual({"t", "q"}, set(listed.fields))

    def test_what_cannot_be_opened_is_a_problem(self):
        with self.assertRaises(windsplat.Problem) as caught:
            self.server.open("bad.nc")
        self.assertIn("bad.nc", caught.exception.detail)
        with self.assertRaises(windsplat.NotFound):
            self.server.open("nowhere.nc")
        with self.assertRaisesRegex(ValueError, "is not below the folder"):
            self.server.open("/etc/passwd")

    def test_a_dataset_is_forgotten(self):
        dataset = self.server.open("part_1.nc")
        dataset.close(forget=True)
        self.assertNotIn("part_1", self.server.datasets)


class Secured(unittest.TestCase):
    def test_certificates_are_checked_by_a_file(self):
        with tempfile.TemporaryDirectory() as folder:
            key, certificate = f"{folder}/key.pem", f"{folder}/cert.pem"
            subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                            "ec_paramgen_curve:P-256", "-nodes", "-days", "2", "-subj", "/CN=w",
                            "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", key, "-out",
                            certificate], check=True, capture_output=True)
            own = start("tornado:8", tls_cert=certificate, tls_key=key)
            self.addCleanup(own.close)
            self.assertEqual(list(own.datasets), ["tornado:8"])
            with self.assertRaisesRegex(windsplat.ConnectionFailed, "CERTIFICATE_VERIFY_FAILED"):
                windsplat.connect(own.url)
            with windsplat.connect(own.url, verify=certificate) as server:
                view = server["tornado:8"].view(size=(32, 24))
                self.assertEqual(view.frame("jpeg").width, 32)

                async def final():
                    async with server.stream(view) as stream:
                        return await stream.final()

                self.assertTrue(asyncio.run(final()).final)

    def test_a_proxy_of_the_environment_does_not_stand_before_this_machine(self):
        server, _ = shared_server()
        variables = {name: "http://127.0.0.1:9" for name in ("http_proxy", "HTTP_PROXY",
                                                             "all_proxy", "ALL_PROXY")}
        with unittest.mock.patch.dict(os.environ, variables):
            with windsplat.connect(server.url) as again:
                self.assertIn("tornado:24", again.datasets)


def drawn(size):
    """A picture of the shared server, as a worker asks for it."""
    return shared_server()[0]["tornado:24"].view(size=size).frame().bytes


def said_of_the_end():
    return shared_server()[0]._process.ended()


class Forks(unittest.TestCase):
    def test_workers_get_their_own_pictures_and_so_does_the_process_that_they_are_forks_of(self):
        sizes = [(32 + 4 * k, 24) for k in range(12)]
        with concurrent.futures.ThreadPoolExecutor(4) as threads:  # leave connections at rest
            wanted = list(threads.map(drawn, sizes))
        self.assertEqual(len(set(wanted)), len(sizes))
        own, ended = [], threading.Event()

        def draw():
            while not ended.is_set():
                own.append(drawn(sizes[0]))

        thread = threading.Thread(target=draw)  # requests are under way at the fork
        thread.start()
        try:
            with multiprocessing.get_context("fork").Pool(4) as pool:
                got = pool.map_async(drawn, 4 * sizes, chunksize=1).get(timeout=120)
        finally:
            ended.set()
            thread.join()
        self.assertEqual(got, 4 * wanted)
        self.assertEqual(set(own), {wanted[0]})

    def test_a_fork_of_a_closed_server_is_closed_and_closing_in_a_fork_is_of_the_fork(self):
        url = shared_server()[0].url

        def child(server, closes):
            if closes:
                server.close()
            with self.assertRaisesRegex(windsplat.ConnectionFailed, "closed by close"):
                server.version

        for closes in (True, False):
            server = windsplat.connect(url)
            if not closes:
                server.close()
            fork = multiprocessing.get_context("fork").Process(target=child,
                                                               args=(server, closes))
            fork.start()
            fork.join(60)
            self.assertEqual(fork.exitcode, 0)
            if closes:
                self.assertTrue(server.version)
                server.close()

    def test_a_fork_does_not_report_a_running_server_as_ended(self):
        with multiprocessing.get_context("fork").Pool(1) as pool:
            self.assertEqual(pool.apply_async(said_of_the_end).get(timeout=60), "")


class Threads(unittest.TestCase):
    def test_a_server_may_be_used_from_several_threads(self):
        server, _ = shared_server()
        view = server["tornado:24"].view(size=(64, 48))
        pictures = []
        threads = [threading.Thread(target=lambda: pictures.append(view.frame().bytes))
                   for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(pictures), 8)
        self.assertEqual(len(set(pictures)), 1)


if __name__ == "__main__":
    unittest.main()
