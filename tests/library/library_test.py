#!/usr/bin/env python3
"""Builds programs against the installed library, by find_package and by pkg-config: the example of
docs/user/library.md, and use.cpp, whose pictures must be those of the installed program.

Usage: library_test.py --build=FOLDER
"""
import argparse
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BUILD = None


def output_of(*command, **given):
    done = subprocess.run(command, text=True, capture_output=True, check=False, **given)
    if done.returncode != 0:
        raise AssertionError(f"{command} ended with {done.returncode}: {done.stdout}{done.stderr}")
    return done.stdout


def block(language):
    text = (ROOT / "docs/user/library.md").read_text()
    return re.search(rf"```{language}\n(.*?)```", text, re.S).group(1)


class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.held = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.held.name)
        cls.prefix = cls.folder / "installed"
        for component in ("runtime", "library", "development"):
            output_of("cmake", "--install", BUILD, "--prefix", str(cls.prefix), "--component",
                      component)
        cls.libraries = next(cls.prefix.glob("lib/**/libwindsplat.so")).parent
        cls.program = cls.prefix / "bin/windsplat"

    @classmethod
    def tearDownClass(cls):
        cls.held.cleanup()

    def compiled(self, source, *options):
        """By pkg-config, with the run path of an unusual prefix."""
        env = {**os.environ, "PKG_CONFIG_PATH": str(self.libraries / "pkgconfig")}
        flags = output_of("pkg-config", "--cflags", "--libs", "windsplat", env=env).split()
        made = self.folder / pathlib.Path(source).stem
        output_of("c++", "-std=c++17", "-Wall", "-Wextra", "-Werror", str(source), *flags, *options,
                  f"-Wl,-rpath,{self.libraries}", "-o", str(made))
        return made

    def test_the_example_is_built_by_find_package_and_draws(self):
        sources = self.folder / "swirl"
        sources.mkdir()
        (sources / "swirl.cpp").write_text(block("cpp"))
        (sources / "CMakeLists.txt").write_text(block("cmake"))
        output_of("cmake", "-S", str(sources), "-B", str(sources / "build"),
                  f"-DCMAKE_PREFIX_PATH={self.prefix}")
        output_of("cmake", "--build", str(sources / "build"))
        said = output_of(str(sources / "build/swirl"), cwd=sources)
        self.assertEqual(said, "640 x 360\n")
        picture = (sources / "swirl.ppm").read_bytes()
        header = b"P6 640 360 255\n"
        self.assertTrue(picture.startswith(header))
        self.assertEqual(len(picture), len(header) + 640 * 360 * 3)
        self.assertGreater(len(set(picture[len(header):])), 50)  # more than text on a plain ground

    def test_pictures_are_those_of_the_program_and_faults_are_refused(self):
        made = self.compiled(ROOT / "tests/library/use.cpp")
        file = self.folder / "tornado.nc"
        output_of(str(self.program), "synth", "tornado", "--dims", "20x20x20", "-o", str(file))
        self.assertEqual(output_of(str(made), str(file), cwd=self.folder), "")
        for name, given in (("sample", "tornado:24"), ("file", str(file))):
            drawn = self.folder / f"{name}.npy"
            output_of(str(self.program), "render", given, "--step", "2", "--size", "96x64", "-o",
                      str(drawn))
            numbers = drawn.read_bytes()[-96 * 64 * 16:]
            self.assertEqual((self.folder / f"{name}.bin").read_bytes(), numbers)
            self.assertTrue(any(numbers))

        refused = output_of(str(made), str(file), "/nonexistent/windsplat", cwd=self.folder)
        self.assertIn("cannot be executed: '/nonexistent/windsplat'", refused)

    def test_only_the_declared_names_are_visible(self):
        path = self.libraries / "libwindsplat.so"
        listed = output_of("nm", "--dynamic", "--defined-only", "--demangle", str(path))
        names = {line.split(" ", 2)[2] for line in listed.splitlines()}
        own = re.compile(r"(vtable for |typeinfo for |typeinfo name for )?windsplat::"
                         r"(Problem|Volume|View|Renderer|set_program)\b")
        self.assertTrue(any("Renderer::render(" in name for name in names))
        self.assertEqual([name for name in sorted(names) if not own.match(name)], [])
        dynamic = output_of("readelf", "-d", str(path))
        self.assertIn("[libwindsplat.so.0.1]", dynamic)
        self.assertNotRegex(dynamic, r"RPATH|RUNPATH")


def main():
    global BUILD
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, metavar="FOLDER")
    given, rest = parser.parse_known_args()
    BUILD = given.build
    unittest.main(argv=["library_test", *rest])


if __name__ == "__main__":
    main()
