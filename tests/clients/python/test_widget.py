"""The widget of notebooks without a browser: gestures, frames, and the class for anywidget, which
is replaced by one with its interface. (tests/browser/client has the page's side.)"""
import math
import queue
import subprocess
import sys
import types
import unittest
import unittest.mock

import numpy as np
import traitlets
from support import CLIENT, shared_server, windsplat

from windsplat import relay

CAMERA = {"eye": [0.0, -3.0, 1.0], "target": [0.0, 0.0, 0.0], "up": [0.0, 0.0, 1.0], "fovY": 35.0,
          "height": 2.0, "projection": "perspective"}


class AnyWidget(traitlets.HasTraits):
    """What LiveView uses of anywidget.AnyWidget (anywidget 0.9)."""

    def __init__(self, **values):
        super().__init__(**values)
        self.sent = queue.Queue()
        self.closed = False

    def send(self, content, buffers=None):
        self.sent.put((content, buffers))

    def on_msg(self, callback):
        self.callback = callback

    def close(self):
        self.closed = True


class Gestures(unittest.TestCase):
    def test_a_drag_keeps_distance_and_target(self):
        turned = {**CAMERA, **relay.orbited(CAMERA, 60, 0)}
        self.assertAlmostEqual(math.dist(turned["eye"], (0, 0, 0)), math.sqrt(10))
        self.assertAlmostEqual(turned["eye"][2], 1)
        self.assertLess(turned["eye"][0], 0)  # the scene follows the pointer to the right
        back = relay.orbited(turned, -60, 0)
        np.testing.assert_allclose(back["eye"], CAMERA["eye"], atol=1e-12)
        steep = {**CAMERA, **relay.orbited(CAMERA, 0, 9999)}
        self.assertAlmostEqual(math.degrees(math.asin(steep["eye"][2] / math.sqrt(10))),
                               relay.STEEPEST)

    def test_a_drag_from_straight_above_keeps_what_is_up(self):
        above = {**CAMERA, "eye": [0.0, 0.0, 3.0], "up": [0.0, 1.0, 0.0]}
        eye = relay.orbited(above, 0, -100)["eye"]
        self.assertAlmostEqual(eye[0], 0)
        self.assertLess(eye[1], 0)  # north stays up: the eye comes down in the south

    def test_a_shift_by_the_height_of_the_picture_shifts_by_what_it_shows(self):
        camera = {**CAMERA, "eye": [0.0, -3.0, 0.0]}
        right = relay.panned(camera, 1, 0)
        height = 6 * math.tan(math.radians(17.5))
        np.testing.assert_allclose(right["target"], [-height, 0, 0], atol=1e-12)
        down = relay.panned({**camera, "projection": "orthographic"}, 0, 0.5)
        np.testing.assert_allclose(down["target"], [0, 0, 1], atol=1e-12)
        np.testing.assert_allclose(down["eye"], [0, -3, 1], atol=1e-12)

    def test_zooming_in_and_out_returns(self):
        closer = {**CAMERA, **relay.zoomed(CAMERA, 2)}
        self.assertEqual((closer["eye"], closer["height"]), ([0.0, -1.5, 0.5], 1.0))
        np.testing.assert_allclose(relay.zoomed(closer, 0.5)["eye"], CAMERA["eye"])


class Widgets(unittest.TestCase):
    def test_pictures_need_no_optional_package(self):
        server, _ = shared_server()
        code = ("import sys\n"
                "for name in ('anywidget', 'numpy', 'PIL', 'xarray', 'typing_extensions'):\n"
                "    sys.modules[name] = None\n"
                "import windsplat, windsplat.relay\n"
                "view = windsplat.connect(sys.argv[1])['tornado:24'].view(size=(32, 24))\n"
                "print(len(view.look(20, 30).frame().bytes) > 100, view.dataset.steps[1].text)\n")
        done = subprocess.run([sys.executable, "-W", "ignore", "-c", code, server.url], cwd=CLIENT,
                              text=True, capture_output=True, check=False)
        self.assertEqual(done.stdout.split()[:1], ["True"], done.stderr)

    def test_a_live_view_without_its_package_says_what_to_install(self):
        view = shared_server()[0]["tornado:24"].view()
        with unittest.mock.patch.dict(sys.modules, {"anywidget": None}):
            sys.modules.pop("windsplat.widget", None)
            with self.assertRaises(windsplat.WindsplatError) as caught:
                view.live()
        self.assertIsInstance(caught.exception, ImportError)
        self.assertRegex(str(caught.exception), r"pip install anywidget.*view\.widget\(\)")

    def test_a_live_view_passes_on_frames_and_takes_gestures(self):
        server, _ = shared_server()
        module = types.SimpleNamespace(AnyWidget=AnyWidget)
        with unittest.mock.patch.dict(sys.modules, {"anywidget": module}):
            view = server["climate:48x24x8"].view(size=(96, 64))
            live = view.live(height=200)
        self.addCleanup(live.close)
        self.assertEqual((live.height, len(live.steps)), (200, 8))
        self.assertTrue(live.trait_metadata("steps", "sync"))
        self.assertIn("export default", live._esm.read_text())
        self.assertEqual(live.view, view)

        def until_final():
            while True:
                content, buffers = live.sent.get(timeout=30)
                self.assertEqual(content["type"], "frame", content)
                live.callback(live, {"type": "shown", "seq": content["seq"]}, [])
                if content["final"]:
                    return content, buffers

        live.callback(live, {"type": "ready"}, [])
        content, buffers = until_final()
        self.assertEqual((content["width"], content["mime"]), (96, "image/jpeg"))
        self.assertEqual(buffers[0][:2], b"\xff\xd8")
        live.callback(live, {"type": "orbit", "dx": 10, "dy": 0}, [])
        until_final()
        self.assertLess(live.view.get("/camera/eye")[0], 0)
        live.view = view.at(3)
        self.assertEqual(until_final()[0]["step"], 3)
        live.view = view.vector(field="nothing")
        self.assertEqual(live.sent.get(timeout=30)[0]["type"], "problem")
        live.close()
        self.assertTrue(live.closed)


if __name__ == "__main__":
    unittest.main()
