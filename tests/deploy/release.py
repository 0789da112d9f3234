#!/usr/bin/env python3
"""Checks the files that scripts/release made: all are there, of the version of the sources, whole,
and have the listed checksums. scripts/release runs it last.

Usage: release.py [--dist=FOLDER] [--image] [--public-key=FILE] [unittest arguments]
--image: there is a container image, too. --public-key: verifies the signature (minisign).
"""
import argparse
import hashlib
import io
import json
import pathlib
import re
import subprocess
import sys
import tarfile
import unittest
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
GIVEN = None


def version():
    return re.search(r"project\(windsplat VERSION ([\d.]+)",
                     (ROOT / "CMakeLists.txt").read_text()).group(1)


class Release(unittest.TestCase):
    def file(self, pattern):
        """The one file of this name."""
        found = sorted(GIVEN.dist.glob(pattern))
        self.assertEqual(len(found), 1, f"{pattern}: {found}")
        return found[0]

    def test_every_file_is_listed_with_its_checksum(self):
        lines = (GIVEN.dist / "SHA256SUMS").read_text().splitlines()
        listed = {name: digest for digest, name in (line.split("  ") for line in lines)}
        present = {path.name for path in GIVEN.dist.iterdir()
                   if not path.name.startswith("SHA256SUMS")}
        self.assertEqual(set(listed), present)
        for name, digest in listed.items():
            self.assertEqual(hashlib.sha256((GIVEN.dist / name).read_bytes()).hexdigest(), digest,
                             name)

    def test_the_signature_is_of_the_key(self):
        if GIVEN.public_key is None:
            self.skipTest("no --public-key")
        run = subprocess.run(["minisign", "-V", "-p", GIVEN.public_key, "-m",
                              GIVEN.dist / "SHA256SUMS"], capture_output=True, text=True,
                             check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn(f"Trusted comment: windsplat {version()}", run.stdout)

    def test_debian_packages_are_of_this_version(self):
        for name in ("windsplat", "libwindsplat[0-9]*", "windsplat-dev"):
            package = self.file(f"{name}_{version()}-*_*.deb")
            field = subprocess.run(["dpkg-deb", "--field", package, "Version"], text=True,
                                   capture_output=True, check=True).stdout
            self.assertEqual(field.strip().rpartition("-")[0], version())

    def test_the_sources_are_those_of_the_last_commit(self):
        head = subprocess.run(["git", "-C", ROOT, "ls-tree", "-r", "--name-only", "-z", "HEAD"],
                              capture_output=True, text=True, check=True).stdout
        name = f"windsplat-{version()}"
        with tarfile.open(self.file(f"{name}.tar.gz")) as archive:
            files = {one.name.removeprefix(name + "/") for one in archive if not one.isdir()}
        self.assertEqual(files, {path for path in head.split("\0") if path})

    def test_client_packages_are_of_this_version(self):
        with tarfile.open(self.file("*.tgz")) as archive:
            facts = json.load(archive.extractfile("package/package.json"))
            names = set(archive.getnames())
        self.assertEqual(facts["version"], version())
        entries = [entry for value in facts["exports"].values()
                   for entry in (value.values() if isinstance(value, dict) else [value])]
        self.assertLessEqual({"package/" + entry.removeprefix("./") for entry in entries}, names)
        with zipfile.ZipFile(self.file("*.whl")) as wheel:
            self.assertIsNone(wheel.testzip())
            metadata, = (name for name in wheel.namelist() if name.endswith("/METADATA"))
            self.assertIn(f"\nVersion: {version()}\n", wheel.read(metadata).decode())

    def test_the_bill_of_materials_names_what_the_packages_hold(self):
        text = self.file(f"windsplat-{version()}.cdx.json").read_text()
        bill = json.loads(text)
        self.assertEqual((bill["bomFormat"], bill["metadata"]["component"]["version"]),
                         ("CycloneDX", version()))
        unpacked = subprocess.run(["dpkg-deb", "--fsys-tarfile", self.file("windsplat_*.deb")],
                                  capture_output=True, check=True).stdout
        with tarfile.open(fileobj=io.BytesIO(unpacked)) as archive:
            inside = archive.extractfile("./usr/share/doc/windsplat/windsplat.cdx.json").read()
        self.assertEqual(inside.decode(), text)

    def test_the_image_is_whole(self):
        if not GIVEN.image:
            self.skipTest("no --image")
        with tarfile.open(self.file(f"windsplat-{version()}-image.tar")) as archive:
            def blob(facts):
                kind, digest = facts["digest"].split(":")
                data = archive.extractfile(f"./blobs/{kind}/{digest}").read()
                self.assertEqual(hashlib.new(kind, data).hexdigest(), digest)
                return data
            manifest = json.loads(archive.extractfile("./index.json").read())["manifests"][0]
            manifest = json.loads(blob(manifest))
            settings = json.loads(blob(manifest["config"]))["config"]
            for layer in manifest["layers"]:
                blob(layer)
        self.assertEqual((settings["User"], settings["Entrypoint"]), ("10001:10001", ["windsplat"]))


def main():
    global GIVEN
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dist", type=pathlib.Path, default=ROOT / "build/dist")
    parser.add_argument("--image", action="store_true")
    parser.add_argument("--public-key", type=pathlib.Path)
    GIVEN, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    main()
