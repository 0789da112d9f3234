"""Pictures, movies and streams of views, against the real daemon."""
import asyncio
import io
import math
import multiprocessing
import os
import pathlib
import stat
import struct
import tempfile
import time
import unittest
import unittest.mock
import zipfile

import numpy as np
import PIL.Image
from support import shared_server, windsplat

# Instead of ffmpeg: writes its arguments and the number of PNG files of its input to the output.
ENCODER = """#!/usr/bin/python3
import sys
data = sys.stdin.buffer.read()
if "-fail" in sys.argv[0]:
    sys.exit("no such codec")
with open(sys.argv[-1].removeprefix("file:"), "w") as file:
    file.write(f"{data.count(b'IHDR')} " + " ".join(sys.argv[1:-1]))
"""


class Frames(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server, _ = shared_server()
        cls.view = cls.server["tornado:24"].view(size=(96, 64))

    def test_pixels_are_those_of_the_picture(self):
        frame = self.view.frame()
        self.assertEqual((frame.width, frame.height, frame.format), (96, 64, "png"))
        self.assertEqual(frame.image.size, (96, 64))
        pixels = frame.array
        self.assertEqual((pixels.shape, pixels.dtype), ((64, 96, 3), np.uint8))
        self.assertGreater(pixels.max(), 100)
        np.testing.assert_array_equal(pixels, np.asarray(PIL.Image.open(io.BytesIO(frame.bytes))))
        self.assertEqual(frame.bytes, self.view.frame().bytes)

    def test_linear_pixels_over_black_are_the_encoded_ones(self):
        view = self.view.image(background="#000000").ground(show="off")
        linear = view.frame("npy").array
        self.assertEqual((linear.shape, linear.dtype), ((64, 96, 4), np.float32))
        # The transfer function of sRGB (IEC 61966-2-1).
        light = np.clip(linear[..., :3], 0, 1)
        coded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
        difference = np.abs(255 * coded - view.frame().array.astype(float))
        self.assertLessEqual(difference.max(), 1.01)

    def test_the_report_tells_method_error_and_times(self):
        report = self.view.method(name="kernel").frame("jpeg").report
        self.assertEqual(report.method, "kernel")
        self.assertIn(report.error.kind, ("estimated", "measured", "unknown"))
        self.assertGreater(report.work["samples"], 0)
        self.assertEqual(set(report.timing), {"queue", "render", "encode"})
        empty = self.view.vector(field=None).scalars().frame().report.empty
        self.assertIsInstance(empty, str)
        limited = self.view.quality(maxError=0.05).frame().report.error
        self.assertEqual((limited.asked, limited.kept), (0.05, True))

    def test_pixels_are_picked_and_views_are_shared(self):
        view = self.server["climate:48x24x8"].view(size=(96, 64))
        picked = [view.pick(x, y) for x in range(8, 96, 16) for y in range(8, 64, 8)]
        feature = next(one for one in picked if one is not None)
        self.assertIn(feature["field"], self.server["climate:48x24x8"].fields)
        self.assertIsNone(view.pick(0, 0))
        address, _, id = view.share().partition("#!view=")
        self.assertEqual(address, self.server.url)
        self.assertEqual(self.server.http.get(f"v1/views/{id}")["view"]["image"],
                         {"width": 96, "height": 64})

    def test_a_reference_tells_the_error_of_the_picture(self):
        frame, error = self.view.size(48, 32).reference(timeout=120)
        self.assertEqual(frame.image.size, (48, 32))
        self.assertGreater(error, 0)
        self.assertLess(error, 0.02)

    def test_files_are_named_by_format(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, start in (("a.png", b"\x89PNG"), ("a.jpg", b"\xff\xd8"), ("a.pdf", b"%PDF"),
                                ("a.svg", b"<svg"), ("a.npy", b"\x93NUMPY")):
                path = self.view.save(pathlib.Path(folder) / name)
                self.assertEqual(path.read_bytes()[: len(start)], start)
            with self.assertRaisesRegex(ValueError, "a.bmp"):
                self.view.save("a.bmp")
            with self.assertRaisesRegex(ValueError, "format png"):
                self.view.frame().save("a.jpg")

    def test_the_server_refuses_what_the_schema_cannot(self):
        with self.assertRaises(windsplat.InvalidView) as caught:
            self.view.volume("velocty").frame()
        self.assertEqual(caught.exception.errors[0].pointer[:10], "/scalars/0")

    def test_jupyter_gets_a_picture_with_its_size_and_a_text(self):
        data, metadata = self.view._repr_mimebundle_()
        self.assertEqual(set(data), {"text/plain", "image/jpeg"})
        self.assertEqual(metadata["image/jpeg"], {"width": 96, "height": 64})
        self.assertTrue(data["image/jpeg"].startswith("/9j/"))  # base64 of a JPEG
        table = self.view.dataset._repr_html_()
        self.assertIn("24 x 24 x 24 samples", table)
        self.assertIn("<td>wind</td><td>vector</td>", table)
        html = self.view.widget(height=300)._repr_html_()
        self.assertIn(f'<iframe src="{self.server.url}?embed#!%7B%22dataset%22%3A', html)
        self.assertIn("height: 300px", html)


def ends_of_box(view):
    """Lowest and highest place of the corners of the box of a view in its picture, of which -1 and
    1 are the edges: shape (2, 2)."""
    description, camera = view.dataset.description, view.get("/camera")
    eye, target = np.array(camera["eye"]), np.array(camera["target"])
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, camera["up"])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    aspect = view.get("/image/width") / view.get("/image/height")
    low, high = np.array(description["world"]["min"]), np.array(description["world"]["max"])
    for k, name in enumerate("xyz"):
        ends = view.get(f"/region/{name}")
        if ends is not None:
            axis = description["axes"][name]
            inside = [world for place, world in zip(axis["coordinates"], axis["world"])
                      if ends[0] <= place <= ends[1]]
            low[k], high[k] = min(inside), max(inside)
    places = []
    for corner in range(8):
        point = np.where([corner >> k & 1 for k in range(3)], high, low) - eye
        half = math.tan(math.radians(35 / 2)) * (point @ forward)
        if camera.get("projection") == "orthographic":
            half = camera["height"] / 2
        places.append((point @ right / half / aspect, point @ up / half))
    return np.min(places, axis=0), np.max(places, axis=0)


class Looking(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server, _ = shared_server()
        cls.dataset = cls.server["tornado:24"]

    def test_the_box_fits_the_picture_from_every_side(self):
        for azimuth, elevation in ((0, 90), (30, 40), (90, 0), (200, -35), (-45, 10)):
            with self.subTest(azimuth=azimuth, elevation=elevation):
                view = self.dataset.view(size=(96, 64)).look(azimuth, elevation)
                low, high = ends_of_box(view)
                np.testing.assert_allclose(low, -high, atol=1e-6)  # in the middle
                self.assertLess(high.max(), 1)
                self.assertGreater(high.max(), 0.9)

    def test_the_box_fits_a_parallel_projection(self):
        for side in ((30, 40), (0, 10), (200, -35)):
            view = self.dataset.view(size=(96, 64)).look(*side, projection="orthographic")
            self.assertLess(np.abs(ends_of_box(view)).max(), 1)

    def test_sides_are_those_of_the_rest_interface(self):
        # Azimuth 90 looks west, so that the eye is in the east.
        eye = self.dataset.view().look(90, 0).get("/camera/eye")
        self.assertGreater(eye[0], 1)
        self.assertAlmostEqual(eye[1], self.dataset.view().look(90, 0).get("/camera/target")[1])
        query = f"v1/datasets/tornado%3A24/frame.npy?width=96&height=64&azimuth={210}&elevation=25"
        theirs = np.load(io.BytesIO(self.server.http.request("GET", query).content))[..., 3]
        ours = self.dataset.view(size=(96, 64)).look(210, 25).frame("npy").array[..., 3]
        self.assertGreater(np.corrcoef(theirs.ravel(), ours.ravel())[0, 1], 0.6)

    def test_a_turn_is_about_the_middle_of_the_box(self):
        view = self.dataset.view().look(20, 30)
        world = self.dataset.description["world"]
        middle = (np.array(world["min"]) + np.array(world["max"])) / 2
        turn = [one.get("/camera") for one in view.turn(8)]
        for key in ("eye", "target"):
            places = [np.array(one[key]) - middle for one in turn]
            np.testing.assert_allclose([np.hypot(*one[:2]) for one in places],
                                       np.hypot(*places[0][:2]))
            np.testing.assert_allclose(places[4][:2], -places[0][:2], atol=1e-12)
            half = np.array(view.turn(3, degrees=180)[2].get(f"/camera/{key}")) - middle
            np.testing.assert_allclose(half, places[4], atol=1e-12)

    def test_a_turn_keeps_the_whole_box_at_every_angle_from_one_distance(self):
        wide = self.server["climate:48x24x8"].view(size=(400, 225))
        for name, view in (("default", wide), ("side", wide.look(0, 30)),
                           ("narrow", wide.size(200, 300).look(70, 10)),
                           ("from above", wide.look(0, 90)),
                           ("region", wide.region(x=(0, 40), y=(-80, 80))),
                           ("parallel", wide.look(0, 30, projection="orthographic")),
                           ("part of a turn", wide.look(0, 30))):
            with self.subTest(name):
                turn = view.turn(24, degrees=100 if name == "part of a turn" else 360)
                ends = [np.abs(ends_of_box(one)).max() for one in turn]
                self.assertLess(max(ends), 1)
                self.assertGreater(max(ends), 0.93)  # no farther away than that takes
                far = [math.dist(one.get("/camera/eye"), one.get("/camera/target"))
                       for one in turn]
                np.testing.assert_allclose(far, far[0])
        turn = wide.look(0, 90).turn(4)
        np.testing.assert_allclose(turn[1].get("/camera/up"), [-1, 0, 0], atol=1e-12)

    def test_a_view_of_a_part_or_from_afar_is_turned_at_its_own_distance(self):
        wide = self.server["climate:48x24x8"].view(size=(400, 225))
        for zoom in (3, 0.3):
            view = wide.look(0, 30, zoom=zoom)
            for one in view.turn(3):
                self.assertAlmostEqual(
                    math.dist(one.get("/camera/eye"), one.get("/camera/target")),
                    math.dist(view.get("/camera/eye"), view.get("/camera/target")))


class Movies(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server, _ = shared_server()
        cls.view = cls.server["climate:48x24x8"].view(size=(63, 40))

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def encoder(self, name="ffmpeg"):
        program = self.folder / "bin" / name
        program.parent.mkdir(exist_ok=True)
        program.write_text(ENCODER)
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        return str(program)

    def test_an_animated_png_has_the_frames_of_the_steps(self):
        seen = []
        path = self.folder / "a.apng"
        movie = self.view.movie(path, steps=[0, 3, 6], fps=8,
                                progress=lambda done, count: seen.append((done, count)))
        self.assertEqual((movie.frames, movie.width, movie.height), (3, 63, 40))
        self.assertEqual(seen, [(1, 3), (2, 3), (3, 3)])
        with PIL.Image.open(path) as image:
            self.assertEqual((image.n_frames, image.info["duration"]), (3, 125))
            for index, step in enumerate((0, 3, 6)):
                image.seek(index)
                np.testing.assert_array_equal(np.asarray(image.convert("RGB")),
                                              self.view.at(step).frame().array)
        data, metadata = movie._repr_mimebundle_()
        self.assertEqual(metadata["image/png"], {"width": 63, "height": 40})
        self.assertEqual(list(self.folder.iterdir()), [path])

    def test_a_zip_has_all_steps_in_order_whoever_makes_it(self):
        for workers in (None, 3):
            movie = self.view.movie(self.folder / "a.zip", workers=workers)
            self.assertEqual((movie.frames, movie.fps, movie.width, movie.height), (8, 24, 63, 40))
            with zipfile.ZipFile(self.folder / "a.zip") as file:
                names = file.namelist()
                self.assertEqual(names, [f"frame_{k:06d}.png" for k in range(8)])
                self.assertEqual(file.read(names[5]), self.view.at(5).frame().bytes)

    def test_the_server_draws_steps_and_turns(self):
        path = self.folder / "a.zip"
        seen = []
        movie = self.view.movie(path, steps=range(1, 8, 3),
                                progress=lambda done, count: seen.append((done, count)))
        self.assertEqual(movie.frames, 3)
        self.assertEqual(seen, sorted(seen))
        self.assertEqual({count for _, count in seen}, {100})
        with zipfile.ZipFile(path) as file:
            self.assertEqual(file.read("frame_000002.png"), self.view.at(7).frame().bytes)
        view = self.view.patch({"camera": {"eye": [2, -2, 1], "target": [0, 0, 0]}})
        self.assertEqual(view.movie(path, steps=[0], turn=360, frames=4).frames, 4)
        with zipfile.ZipFile(path) as file:
            self.assertEqual(file.read("frame_000000.png"), view.frame().bytes)
            self.assertNotEqual(file.read("frame_000001.png"), view.frame().bytes)
        key = {"projection": "perspective", "target": [0, 0, 0]}
        keys = [{"time": at, "camera": {**key, "eye": [2, -2, 1 + at]}} for at in (0, 1)]
        self.assertEqual(view.movie(path, steps=[0], camera_path={"keyframes": keys}).frames, 25)

    def test_steps_are_given_as_the_command_line_and_the_rest_interface_take_them(self):
        path = self.folder / "a.zip"
        for steps, shown in (("1:7:3", (1, 4, 7)), ("2:3", (2, 3)), ({"first": 6}, (6, 7)),
                             ({"last": 5, "stride": 4}, (0, 4)), ([5, 3], (5, 3))):
            for workers in (None, 2):
                with self.subTest(steps=steps, workers=workers):
                    made = self.view.movie(path, steps=steps, workers=workers)
                    self.assertEqual(made.frames, len(shown))
                    with zipfile.ZipFile(path) as file:
                        for name, step in zip(file.namelist(), shown):
                            self.assertEqual(file.read(name), self.view.at(step).frame().bytes)

    def test_steps_that_are_none_of_the_dataset_are_refused_with_those_that_are(self):
        for steps in ("", "3", "0-3", "0:3:", "-1:3", "3:0", "0:8", "0:3:0", {"first": 8},
                      {"last": 8}, {"from": 1}, {"stride": -1}):
            with self.subTest(steps), self.assertRaisesRegex(ValueError, "none of 0 to 7: give"):
                self.view.movie(self.folder / "a.zip", steps=steps)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_job_that_takes_too_long_is_ended(self):
        view = self.view.size(800, 600)
        with self.assertRaises(windsplat.JobTimeout):
            view.movie(self.folder / "a.zip", steps=[0], turn=360, frames=500, timeout=0.3)
        job = self.server.http.get("v1/jobs")["jobs"][-1]
        self.assertEqual(job["kind"], "animation")
        end = time.monotonic() + 20
        while job["state"] in ("queued", "running") and time.monotonic() < end:
            time.sleep(0.05)
            job = self.server.http.get(f"v1/jobs/{job['id']}")
        if job["state"] != "cancelled":  # not to slow down the tests that follow
            self.server.http.request("DELETE", f"v1/jobs/{job['id']}")
        self.assertEqual(job["state"], "cancelled")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_place_that_cannot_be_written_is_found_before_anything_is_drawn(self):
        jobs = self.server.http.get("v1/jobs")["jobs"]
        for more in ({}, {"workers": 1}):
            with self.subTest(more), self.assertRaisesRegex(FileNotFoundError, r"nowhere/\.a\.zip"):
                self.view.movie(self.folder / "nowhere" / "a.zip", steps=[0], **more)
        self.assertEqual(self.server.http.get("v1/jobs")["jobs"], jobs)

    def test_motions_of_the_server_are_refused_where_it_does_not_draw(self):
        for given in ({"turn": 90, "workers": 2}, {"frames": 4, "steps": [0, 1, 5]}):
            with self.assertRaisesRegex(ValueError, "at equal distances"):
                self.view.movie(self.folder / "a.zip", **given)
        with self.assertRaises(ValueError):
            self.view.movie(self.folder / "a.apng", turn=90)
        with self.assertRaisesRegex(windsplat.InvalidView, "/frames"):
            self.view.movie(self.folder / "a.zip", frames=99)

    def test_videos_are_encoded_by_ffmpeg(self):
        folder = str(pathlib.Path(self.encoder()).parent)
        with unittest.mock.patch.dict(os.environ, {"PATH": folder}):
            windsplat.movie(self.folder / "a.mp4", self.view.turn(3), fps=24)
        text = (self.folder / "a.mp4").read_text()
        self.assertTrue(text.startswith("3 "))
        for words in ("-f image2pipe", "-framerate 24", "-c:v libx264", "-f mp4"):
            self.assertIn(words, text)

    def test_without_ffmpeg_other_kinds_are_named_and_nothing_is_written(self):
        with unittest.mock.patch.dict(os.environ, {"PATH": "/nowhere"}):
            with self.assertRaisesRegex(windsplat.MovieFailed, "ffmpeg.*not found.*apng"):
                self.view.movie(self.folder / "a.webm", workers=2)
        with unittest.mock.patch("shutil.which", lambda _: self.encoder("ffmpeg-fail")):
            with self.assertRaisesRegex(windsplat.MovieFailed, "no such codec"):
                self.view.movie(self.folder / "a.mp4", steps=[0], workers=2)
        with self.assertRaisesRegex(windsplat.MovieFailed, "frame 1 has 64 x 40"):
            windsplat.movie(self.folder / "a.zip", [self.view, self.view.size(64, 40)])
        with self.assertRaises(windsplat.InvalidView):
            windsplat.movie(self.folder / "a.zip", [self.view, self.view.at(99)])
        self.assertEqual([path.name for path in self.folder.iterdir()], ["bin"])


class Streams(unittest.IsolatedAsyncioTestCase):
    def setUp(self):
        self.server, _ = shared_server()
        self.view = self.server["climate:48x24x8"].view(size=(96, 64))

    async def test_a_view_at_rest_gets_a_final_frame(self):
        async with self.server.stream(self.view) as stream:
            self.assertEqual(stream.hello["protocol"], "windsplat.v1")
            async for frame in stream:
                self.assertEqual(frame.rev, 1)
                if frame.final:
                    break
            self.assertEqual(frame.image.size, (96, 64))
            self.assertIn(frame.report.method, ("slab", "kernel"))
            self.assertEqual(frame.report.document["view"]["dataset"], "climate:48x24x8")

    async def test_patches_change_the_view_and_equal_ones_do_not(self):
        async with self.server.stream(self.view) as stream:
            first = await stream.final()
            self.assertEqual(await stream.patch({"step": 4}), 2)
            second = await stream.final()
            self.assertEqual((second.step, second.rev), (4, 2))
            self.assertNotEqual(first.bytes, second.bytes)
            await stream.patch({"step": 4})
            self.assertEqual((await stream.final(timeout=20)).seq, second.seq)
            await stream.show(self.view.at(1))
            self.assertEqual((await stream.final()).step, 1)

    async def test_a_refused_patch_is_a_problem_and_the_stream_goes_on(self):
        async with self.server.stream(self.view) as stream:
            await stream.final()
            with self.assertRaisesRegex(windsplat.InvalidView, "did you mean 'step'"):
                await stream.patch({"stpe": 1})
            await stream.patch({"vector": {"field": "nothing"}})
            with self.assertRaises(windsplat.InvalidView) as caught:
                await stream.final()
            self.assertEqual(caught.exception.errors[0].pointer, "/vector/field")
            self.assertEqual(stream.document, self.view.to_dict())
            await stream.patch({"step": 2})
            self.assertEqual((await stream.final()).step, 2)

    async def test_all_steps_are_played_if_frames_are_acknowledged(self):
        async with self.server.stream(self.view) as stream:
            steps = [(await stream.final()).step]
            await stream.play(0, 7, fps=60, loop=False, drop=False)
            async for frame in stream:
                steps.append(frame.step)
                if frame.step == 7:
                    break
            self.assertEqual(sorted(set(steps)), list(range(8)))

    async def test_a_frame_is_acknowledged_when_the_next_is_asked_for(self):
        sent = []
        async with self.server.stream(self.view) as stream:
            send = stream._send

            async def recorded(message):
                sent.append(message)
                await send(message)

            stream._send = recorded
            first = await stream.__anext__()
            self.assertEqual(sent, [])
            await stream.patch({"step": 5})
            second = await stream.__anext__()
            self.assertEqual([one["seq"] for one in sent if one["type"] == "ack"], [first.seq])
            self.assertGreater(second.seq, first.seq)

    async def test_a_fork_neither_uses_nor_closes_the_stream_of_another_process(self):
        async with self.server.stream(self.view) as stream:
            await stream.final()

            def child():
                for call in (lambda: stream.patch({"step": 2}), stream.__anext__):
                    with self.assertRaisesRegex(windsplat.WindsplatError, "another process"):
                        asyncio.run(call())
                asyncio.run(stream.close())

            fork = multiprocessing.get_context("fork").Process(target=child)
            fork.start()
            fork.join(60)
            self.addCleanup(fork.kill)
            self.assertEqual(fork.exitcode, 0)
            await stream.patch({"step": 3})
            self.assertEqual((await stream.final()).step, 3)

    async def test_a_stream_that_was_not_entered_says_so(self):
        with self.assertRaisesRegex(windsplat.WindsplatError, "enter the stream first"):
            await self.server.stream(self.view).__anext__()

    async def test_a_lost_server_is_told(self):
        with self.assertRaises(windsplat.ConnectionFailed):
            async with windsplat.Server("http://127.0.0.1:9/").stream(self.view):
                pass


if __name__ == "__main__":
    unittest.main()
