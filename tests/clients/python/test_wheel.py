"""Builds wheel and sources of the Python client without a network, and installs the wheel into an
environment."""
import ast
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile

from support import CLIENT, PROGRAM, ROOT

USE = """
import windsplat, windsplat._documents, sys
assert not windsplat.__file__.startswith(sys.argv[1]), windsplat.__file__
windsplat._documents.own_schema()
with windsplat.Server.start("tornado:8", program=sys.argv[2], threads=1) as server:
    print(server["tornado:8"].view(size=(32, 24)).frame("jpeg").image.size)
"""
# As pip calls it (PEP 517), without the environment that it would make for it.
BUILD = """
import sys, setuptools.build_meta as backend
print(getattr(backend, sys.argv[1])(sys.argv[2]))
"""


def run(*command, **more):
    done = subprocess.run([str(one) for one in command], text=True, capture_output=True,
                          check=False, **more)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.stdout}{done.stderr}")
    return done.stdout


def ours():
    return {path.relative_to(CLIENT).as_posix() for path in (CLIENT / "windsplat").rglob("*")
            if path.is_file() and "__pycache__" not in path.parts}


class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.here = pathlib.Path(folder.name)
        cls.source = cls.here / "source"
        shutil.copytree(CLIENT, cls.source, ignore=shutil.ignore_patterns(
            "build", "*.egg-info", "__pycache__"))
        cls.wheel = cls.build("build_wheel")

    @classmethod
    def build(cls, what):
        name = run(sys.executable, "-c", BUILD, what, cls.here, cwd=cls.source).split()[-1]
        return cls.here / name

    def test_the_wheel_has_all_files_and_says_what_it_needs(self):
        self.assertRegex(self.wheel.name, r"^windsplat-\d+\.\d+\.\d+-py3-none-any\.whl$")
        with zipfile.ZipFile(self.wheel) as file:
            inside = set(file.namelist())
            (metadata,) = [one for one in inside if one.endswith("/METADATA")]
            (licence,) = [one for one in inside if one.endswith("/LICENSE")]
            text = file.read(metadata).decode()
            self.assertEqual(file.read(licence).decode(), (ROOT / "LICENSE").read_text())
        self.assertLessEqual({"windsplat/py.typed", "windsplat/generated/view.schema.json"}, ours())
        self.assertEqual({one for one in inside if ".dist-info/" not in one}, ours())
        for line in ("Requires-Python: >=3.10", "Requires-Dist: httpx", "License: MIT",
                     "Requires-Dist: websockets", "Provides-Extra: xarray"):
            self.assertIn(line, text)

    def test_the_sources_build_the_same_wheel(self):
        with tarfile.open(self.build("build_sdist")) as file:
            names = {one.name.partition("/")[2] for one in file.getmembers() if one.isfile()}
        self.assertLessEqual(ours() | {"LICENSE", "README.md", "pyproject.toml"}, names)

    def test_the_wheel_installs_without_a_network(self):
        environment = self.here / "env"
        # Without a pip of its own, which takes longest.
        run(sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", environment)
        python = environment / "bin" / "python"
        run(sys.executable, "-m", "pip", "--python", python, "--disable-pip-version-check",
            "install", "--no-index", self.wheel)
        size = run(python, "-W", "error::DeprecationWarning:windsplat", "-c", USE, CLIENT, PROGRAM,
                   cwd=self.here)
        self.assertEqual(size.strip(), "(32, 24)")

    def test_the_syntax_is_that_of_the_oldest_python(self):
        for name in ours():
            if name.endswith(".py"):
                text = (CLIENT / name).read_text()
                ast.parse(text, name, feature_version=(3, 10))

    def test_versions_agree(self):
        version = run(PROGRAM, "--version").split()[-1]
        self.assertIn(f'\nversion = "{version}"\n', (CLIENT / "pyproject.toml").read_text())
        self.assertIn(f'__version__ = "{version}"',
                      (CLIENT / "windsplat" / "__init__.py").read_text())
        self.assertTrue((ROOT / "LICENSE").read_text().startswith("MIT"))


if __name__ == "__main__":
    unittest.main()
