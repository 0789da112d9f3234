#!/usr/bin/env python3
"""Compares the bill of materials with the libraries and modules that are really loaded and bundled.

Usage: sbom.py --program=PATH
"""
import argparse
import json
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PROGRAM = None


def output_of(*command):
    return subprocess.run(command, text=True, capture_output=True, check=True).stdout


class Bill(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.text = output_of(str(ROOT / "scripts/sbom"), PROGRAM)
        cls.bill = json.loads(cls.text)
        cls.required = {one["name"]: one for one in cls.bill["components"]
                        if one["scope"] == "required"}

    def test_names_itself(self):
        self.assertEqual(self.bill["bomFormat"], "CycloneDX")
        version = output_of(PROGRAM, "--version").split()[-1]
        self.assertEqual(self.bill["metadata"]["component"]["version"], version)

    def test_loaded_libraries_are_listed_with_versions(self):
        loaded = set(re.findall(r"(/\S+) \(0x", output_of("ldd", PROGRAM)))
        self.assertGreater(len(loaded), 10)
        case_reader = pathlib.Path(PROGRAM).with_name("windsplat-vtk")
        if case_reader.is_file():
            loaded |= set(re.findall(r"(/\S+) \(0x", output_of("ldd", str(case_reader))))
            self.assertTrue(any("vtkIOGeometry" in path for path in loaded))
        paths = {str(pathlib.Path(path).resolve()) for path in loaded}
        # dpkg knows a library by its path in / or in /usr.
        names = sorted(paths | {path.removeprefix("/usr") for path in paths})
        lines = subprocess.run(["dpkg", "-S", *names], text=True, capture_output=True,
                               check=False).stdout.splitlines()
        owners = {line.split(": ")[1].removeprefix("/usr"): line.split(":")[0] for line in lines}
        for path in paths:
            package = owners[path.removeprefix("/usr")]
            version = output_of("dpkg-query", "-W", "-f", "${Version}\n", package).split()[0]
            self.assertEqual(self.required[package]["version"], version, path)

    def test_every_component_has_a_version(self):
        for one in self.bill["components"]:
            self.assertTrue(one["version"], one["name"])

    def test_the_coastlines_are_listed_with_their_licence(self):
        folder = ROOT / "server/ground/natural_earth"
        package = self.required["world-atlas"]
        self.assertIn(f"`world-atlas` {package['version']}", (folder / "README.md").read_text())
        self.assertEqual(package["licenses"], [{"expression": "ISC"}])
        self.assertTrue((folder / "LICENSE").is_file())

    def test_compiled_in_headers_are_listed(self):
        for name in ("libboost1.81-dev", "nlohmann-json3-dev", "libglm-dev", "libcli11-dev"):
            self.assertIn(name, self.required)
        self.assertNotIn("libgtest-dev", self.required)

    def test_only_bundled_modules_are_required(self):
        lock = json.loads((ROOT / "web/package-lock.json").read_text())["packages"]
        for name in ("lil-gui", "@observablehq/plot", "d3-scale"):
            self.assertEqual(self.required[name]["version"],
                             lock[f"node_modules/{name}"]["version"])
        for name in ("esbuild", "typescript", "ajv", "json-schema-to-typescript", "lodash"):
            self.assertNotIn(name, self.required)
        modules = [one for one in self.bill["components"] if one["purl"].startswith("pkg:npm/")
                   and one["name"] != "world-atlas"]  # the source of data that are in the tree
        self.assertEqual(len(modules), len(lock) - 1)

    def test_references_are_unique_and_output_is_reproducible(self):
        names = [one["bom-ref"] for one in self.bill["components"]]
        self.assertEqual(len(names), len(set(names)))
        self.assertEqual(self.text, output_of(str(ROOT / "scripts/sbom"), PROGRAM))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True)
    known, rest = parser.parse_known_args()
    PROGRAM = known.program
    unittest.main(argv=[__file__, *rest])
