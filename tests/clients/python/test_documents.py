"""Views as documents: the schema, its vectors, suggestions, merge patches."""
import inspect
import json
import subprocess
import sys
import unittest

from support import CLIENT, ROOT, windsplat

from windsplat import stream
from windsplat._documents import errors_of, merged, own_schema

VECTORS = ROOT / "protocol" / "vectors"
# The key of cases with rules between two keys, which only the server checks.
BY_THE_SERVER = "schema"


def cases(folder, name):
    return json.loads((VECTORS / folder / name).read_text())


class Generated(unittest.TestCase):
    def test_types_are_those_of_the_schema(self):
        done = subprocess.run([sys.executable, str(CLIENT / "generate_view_types.py"), "--check"],
                              text=True, capture_output=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)


class Vectors(unittest.TestCase):
    def test_valid_views_are_accepted(self):
        for case in cases("valid", "view.json"):
            if "document" in case:
                with self.subTest(case["description"]):
                    windsplat.View(case["document"])

    def test_invalid_views_are_refused_at_the_pointer(self):
        refused = 0
        for case in cases("invalid", "view.json"):
            if "document" in case and case.get(BY_THE_SERVER, True):
                with self.subTest(case["description"]):
                    schema = own_schema()
                    found = [one.pointer for one in errors_of(case["document"], schema, schema)]
                    self.assertIn(case["pointer"], found)
                    refused += 1
        self.assertGreater(refused, 50)

    def test_headers_of_frames_are_read(self):
        for case in cases("valid", "frame_headers.json"):
            with self.subTest(case["description"]):
                header = stream.header_of(bytes.fromhex(case["hex"]))
                for name in ("seq", "rev", "flags", "width", "height", "codec"):
                    self.assertEqual(getattr(header, name), case["fields"][name], name)

    def test_damaged_headers_are_refused(self):
        for case in cases("invalid", "frame_headers.json"):
            with self.subTest(case["description"]), self.assertRaises(windsplat.WindsplatError):
                stream.header_of(bytes.fromhex(case["hex"]))


class Keys(unittest.TestCase):
    def refused(self, call):
        with self.assertRaises(windsplat.InvalidView) as caught:
            call()
        return caught.exception

    def test_an_unknown_key_is_refused_with_a_suggestion(self):
        view = windsplat.View()
        self.assertEqual(str(self.refused(lambda: view.set("/camera/fov_y", 30))),
                         "/camera/fov_y: unknown key: did you mean 'fovY'?")
        self.assertIn("did you mean 'image'?", str(self.refused(lambda: view.patch({"imag": {}}))))
        self.assertIn("did you mean 'sphere'?",
                      str(self.refused(lambda: view.geometry(mapping="spher"))))

    def test_an_unknown_keyword_of_a_part_is_refused_as_a_key(self):
        view = windsplat.View()
        self.assertEqual(str(self.refused(lambda: view.vector(colour={"by": "magnitude"}))),
                         "/vector/colour: unknown key: did you mean 'color'?")
        self.assertIn("/camera/fov: unknown key", str(self.refused(
            lambda: view.camera(eye=[0, -3, 1], fov=30))))
        self.assertIn("opacity", str(inspect.signature(windsplat.View.vector)))

    def test_each_invalid_value_is_named_by_its_pointer(self):
        error = self.refused(lambda: windsplat.View(
            {"camera": {"eye": [1, 2]}, "scalars": [{"color": {"range": [0, "a"]}}]}))
        self.assertEqual([one.pointer for one in error.errors],
                         ["/camera/eye", "/scalars/0/color/range/1", "/scalars/0/field"])

    def test_a_view_is_never_changed(self):
        first = windsplat.View({"vector": {"stride": 3}})
        second = first.vector(opacity=0.5, color={"by": "magnitude"})
        self.assertEqual(first.to_dict(), {"vector": {"stride": 3}})
        self.assertEqual(second.to_dict(), {"vector": {
            "stride": 3, "opacity": 0.5, "color": {"by": "magnitude"}}})
        second.to_dict()["vector"]["stride"] = 9
        self.assertEqual(second.get("/vector/stride"), 3)
        self.assertEqual(first, windsplat.View({"vector": {"stride": 3}}))
        self.assertEqual(len({first, second, windsplat.View({"vector": {"stride": 3}})}), 2)

    def test_none_returns_to_the_default_but_draws_no_lines_as_the_field_of_vectors(self):
        view = windsplat.View({"vector": {"stride": 3, "field": "wind"}, "light": {}})
        self.assertEqual(view.vector(stride=None, field=None).set(light=None).to_dict(),
                         {"vector": {"field": None}})

    def test_media_and_surfaces_are_added_and_replaced(self):
        view = windsplat.View().volume("cloud", shading="none").volume("rain")
        self.assertEqual(view.get("/scalars"),
                         [{"field": "cloud", "shading": "none"}, {"field": "rain"}])
        self.assertEqual(view.scalars("snow").get("/scalars"), [{"field": "snow"}])
        self.assertEqual(view.scalars().get("/scalars"), [])
        surfaces = windsplat.View().isosurface("t", 273.15, opacity=0.4).section("t", "z", 2)
        self.assertEqual(surfaces.get("/surfaces"), [
            {"field": "t", "isovalue": 273.15, "opacity": 0.4},
            {"field": "t", "slice": {"axis": "z", "index": 2}}])

    def test_numbers_of_numpy_are_numbers(self):
        import numpy as np

        view = windsplat.View().camera(eye=np.array([1, 2, 3.5]), fovY=np.float32(30))
        self.assertEqual(json.loads(view.to_json()),
                         {"camera": {"eye": [1.0, 2.0, 3.5], "fovY": 30.0}})


class Patches(unittest.TestCase):
    def test_merge_patches_are_those_of_rfc_7396(self):
        # Appendix A of the RFC.
        for target, patch, result in (
            ({"a": "b"}, {"a": "c"}, {"a": "c"}),
            ({"a": "b"}, {"b": "c"}, {"a": "b", "b": "c"}),
            ({"a": "b"}, {"a": None}, {}),
            ({"a": "b", "b": "c"}, {"a": None}, {"b": "c"}),
            ({"a": ["b"]}, {"a": "c"}, {"a": "c"}),
            ({"a": "c"}, {"a": ["b"]}, {"a": ["b"]}),
            ({"a": {"b": "c"}}, {"a": {"b": "d", "c": None}}, {"a": {"b": "d"}}),
            ({"a": [{"b": "c"}]}, {"a": [1]}, {"a": [1]}),
            ({"a": "foo"}, {"a": {"b": {"c": None}}}, {"a": {"b": {}}}),
        ):
            self.assertEqual(merged(target, patch), result)

    def test_the_difference_of_two_views_leads_from_one_to_the_other(self):
        old = {"step": 1, "vector": {"stride": 2, "opacity": 1}, "scalars": [{"field": "a"}]}
        new = {"vector": {"stride": 3}, "scalars": [{"field": "b"}], "light": {}}
        patch = stream.difference_of(old, new)
        self.assertEqual(patch, {"step": None, "vector": {"opacity": None, "stride": 3},
                                 "scalars": [{"field": "b"}], "light": {}})
        self.assertEqual(merged(old, patch), new)


if __name__ == "__main__":
    unittest.main()
