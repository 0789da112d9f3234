"""Builds the wheel of the Python client without a network, and installs it into an environment."""
import pathlib
import shutil
import subprocess
import sys
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


def run(*command, **more):
    done = subprocess.run([str(one) for one in command], text=True, capture_output=True,
                          check=False, **more)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.stdout}{done.stderr}")
    return done.stdout


class Wheel(unittest.TestCase):
    def test_the_wheel_has_all_files_and_installs_without_a_network(self):
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            source = here / "source"
            shutil.copytree(CLIENT, source, ignore=shutil.ignore_patterns("build", "*.egg-info",
                                                                          "__pycache__"))
            run(sys.executable, "-m", "venv", "--system-site-packages", here / "env")
            python = here / "env" / "bin" / "python"
            quiet = ("--disable-pip-version-check", "--no-index")
            run(python, "-m", "pip", "wheel", *quiet, "--no-build-isolation", "--no-deps",
                "--wheel-dir", here, source)
            (wheel,) = here.glob("*.whl")
            self.assertRegex(wheel.name, r"^windsplat-\d+\.\d+\.\d+-py3-none-any\.whl$")
            with zipfile.ZipFile(wheel) as file:
                inside = set(file.namelist())
                (metadata,) = [one for one in inside if one.endswith("/METADATA")]
                text = file.read(metadata).decode()
            ours = {path.relative_to(CLIENT).as_posix()
                    for path in (CLIENT / "windsplat").rglob("*")
                    if path.is_file() and "__pycache__" not in path.parts}
            self.assertLessEqual({"windsplat/py.typed", "windsplat/generated/view.schema.json"},
                                 ours)
            self.assertEqual({one for one in inside if ".dist-info/" not in one}, ours)
            for line in ("Requires-Python: >=3.10", "Requires-Dist: httpx", "License: MIT",
                         "Requires-Dist: websockets", "Provides-Extra: xarray"):
                self.assertIn(line, text)
            run(python, "-m", "pip", "install", *quiet, wheel)
            size = run(python, "-W", "ignore", "-c", USE, CLIENT, PROGRAM, cwd=here)
            self.assertEqual(size.strip(), "(32, 24)")

    def test_versions_agree(self):
        version = run(PROGRAM, "--version").split()[-1]
        self.assertIn(f'\nversion = "{version}"\n', (CLIENT / "pyproject.toml").read_text())
        self.assertIn(f'__version__ = "{version}"',
                      (CLIENT / "windsplat" / "__init__.py").read_text())
        self.assertTrue((ROOT / "LICENSE").read_text().startswith("MIT"))


if __name__ == "__main__":
    unittest.main()
