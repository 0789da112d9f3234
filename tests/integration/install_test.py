#!/usr/bin/env python3
"""Installs a build into a temporary folder by `cmake --install` and checks what a user finds there.

Usage: install_test.py --build=FOLDER
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
PLAIN = {"PATH": "/usr/bin:/bin"}


def output_of(*command, env=None):
    done = subprocess.run(command, text=True, capture_output=True, check=False, env=env)
    if done.returncode != 0:
        raise AssertionError(f"{command} ended with {done.returncode}: {done.stderr}")
    return done.stdout


def install(prefix, component, destination=""):
    output_of("cmake", "--install", BUILD, "--prefix", prefix, "--component", component,
              env={**os.environ, "DESTDIR": destination})


def files_below(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


class Staged(unittest.TestCase):
    """A package's installation: prefix /usr, and DESTDIR."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.folder.name)
        install("/usr", "runtime", cls.folder.name)
        cls.program = cls.root / "usr/bin/windsplat"

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def text(self, name):
        return (self.root / name).read_text()

    def test_program_unit_settings_and_documents_are_there(self):
        found = files_below(self.root)
        documents = "usr/share/doc/windsplat"
        for name in ("usr/bin/windsplat", "usr/lib/systemd/system/windsplat.service",
                     "usr/lib/systemd/system/windsplat.socket", "etc/default/windsplat",
                     f"{documents}/README.md", f"{documents}/CHANGELOG.md",
                     f"{documents}/LICENSE", f"{documents}/docs/user/deployment.md",
                     f"{documents}/examples/windsplat.json"):
            self.assertIn(name, found)

    def test_only_the_folders_of_packages_are_written(self):
        self.assertEqual({path.name for path in self.root.iterdir()}, {"usr", "etc"})

    def test_the_program_runs_and_searches_no_folder_of_its_own(self):
        self.assertRegex(output_of(str(self.program), "--version", env=PLAIN), r"^windsplat [\d.]+")
        self.assertNotRegex(output_of("readelf", "-d", str(self.program)), r"RPATH|RUNPATH")

    def test_the_unit_starts_the_installed_program(self):
        started = re.search(r"^ExecStart=(\S+)",
                            self.text("usr/lib/systemd/system/windsplat.service"), re.M)
        self.assertEqual(started.group(1), "/usr/bin/windsplat")

    def test_the_unit_and_its_settings_name_the_same_file(self):
        unit = self.text("usr/lib/systemd/system/windsplat.service")
        self.assertIn("EnvironmentFile=-/etc/default/windsplat\n", unit)
        options = re.findall(r"^#?(WINDSPLAT_\w+)=", self.text("etc/default/windsplat"), re.M)
        help_text = output_of(str(self.program), "serve", "--help", env=PLAIN)
        for name in set(options) - {"WINDSPLAT_ARGS"}:  # which the unit itself passes on
            self.assertIn(f"Env:{name})", help_text)

    def test_the_example_is_a_configuration_that_serve_accepts(self):
        example = self.root / "usr/share/doc/windsplat/examples/windsplat.json"
        # A file that is not there comes after the configuration, which is read first.
        done = subprocess.run([self.program, "serve", "--listen", "127.0.0.1:0", "--config",
                               example, "--strict", "absent.nc"],
                              text=True, capture_output=True, check=False)
        self.assertIn("absent.nc", done.stderr)
        self.assertNotIn("windsplat.json", done.stderr)

    def test_the_package_has_the_version_of_the_program(self):
        version = output_of(str(self.program), "--version", env=PLAIN).split()[-1]
        packaged = re.match(r"windsplat \((\S+)-\d+\)", (ROOT / "debian/changelog").read_text())
        self.assertEqual(packaged.group(1), version)

    def test_manual_pages_are_there_for_every_command_if_the_program_prints_them(self):
        listed = output_of(str(self.program), "--help", env=PLAIN).partition("Subcommands:\n")[2]
        commands = re.findall(r"^  ([a-z]+)", listed, re.M)
        self.assertIn("serve", commands)
        if "man" in commands:
            pages = self.root / "usr/share/man/man1"
            wanted = {"windsplat.1.gz"} | {f"windsplat-{name}.1.gz" for name in commands}
            self.assertEqual({path.name for path in pages.iterdir()}, wanted)
        if "completions" in commands:
            for name in ("bash-completion/completions/windsplat", "zsh/site-functions/_windsplat",
                         "fish/vendor_completions.d/windsplat.fish"):
                self.assertTrue((self.root / "usr/share" / name).stat().st_size > 0)


class Prefixed(unittest.TestCase):
    """A user's own installation in a folder."""

    def test_everything_is_below_the_prefix_and_own_settings_stay(self):
        with tempfile.TemporaryDirectory() as folder:
            install(folder, "runtime")
            settings = pathlib.Path(folder) / "etc/default/windsplat"
            settings.write_text("WINDSPLAT_ARGS=winds.nc\n")
            install(folder, "runtime")
            self.assertEqual(settings.read_text(), "WINDSPLAT_ARGS=winds.nc\n")
            unit = (pathlib.Path(folder) / "lib/systemd/system/windsplat.service").read_text()
            self.assertIn(f"ExecStart={folder}/bin/windsplat serve", unit)
            self.assertIn(f"EnvironmentFile=-{settings}\n", unit)
            # Without the other component the program says which files it cannot read.
            self.assertFalse((pathlib.Path(folder) / "bin/windsplat-vtk").exists())


def main():
    global BUILD
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, metavar="FOLDER")
    given, rest = parser.parse_known_args()
    BUILD = given.build
    unittest.main(argv=["install_test", *rest])


if __name__ == "__main__":
    main()
