#!/usr/bin/env python3
"""Checks the files of docs/user/deploy whose programs the tests do not run, as far as that is
possible without them: options exist, documents are well-formed, and the daemon starts with what
they give it and answers as the program around it would ask. Usage: files.py [--program=FILE]"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests" / "edge"))
from wire_client import Connection, Daemon, Target, WebSocket, request  # noqa: E402

RECIPES = ROOT / "docs/user/deploy"
PROGRAM = str(ROOT / "build/release/windsplat")
FOREIGN = {"WINDSPLAT_UPSTREAM", "WINDSPLAT_ARGS"}  # of the Caddyfile and the unit


class Named(Target):
    """A daemon that is asked by another name."""
    name = "winds.example"

    def authority(self):
        return self.name


def environment_of(lines):
    """What `Environment=NAME=VALUE` lines of a unit set, without those that refer to systemd."""
    pairs = re.findall(r"^Environment=(\w+)=(.*)$", lines, re.M)
    return {name: value for name, value in pairs if "%" not in value}


class Files(unittest.TestCase):
    def test_every_variable_and_option_exists(self):
        described = subprocess.run([PROGRAM, "serve", "--help"], capture_output=True, text=True,
                                   check=True).stdout
        known = set(re.findall(r"WINDSPLAT_[A-Z0-9_]+", described)) | FOREIGN
        options = set(re.findall(r"--[a-z0-9-]+", described))
        for path in RECIPES.iterdir():
            text = path.read_text()
            self.assertEqual(set(re.findall(r"WINDSPLAT_[A-Z0-9_]+", text)) - known - {
                "WINDSPLAT_TESTS", "WINDSPLAT_WERROR"}, set(), path.name)
            for line in re.findall(r"windsplat serve (.*(?:\\\n.*)*)", text):
                self.assertEqual(set(re.findall(r"--[a-z0-9-]+", line)) - options, set(), path.name)

    def test_units_are_valid(self):
        if not shutil.which("systemd-analyze"):
            self.skipTest("systemd-analyze is not installed")
        with tempfile.TemporaryDirectory() as folder:
            unit = (ROOT / "deploy/windsplat.service").read_text()
            path = pathlib.Path(folder) / "windsplat.service"
            path.write_text(re.sub(r"^ExecStart=\S+", f"ExecStart={PROGRAM}", unit, flags=re.M))
            drop_ins = pathlib.Path(folder) / "windsplat.service.d"
            drop_ins.mkdir()
            for name in ("tls", "proxy", "unix"):
                shutil.copy(RECIPES / f"systemd-{name}.conf", drop_ins / f"{name}.conf")
            activator = path.with_suffix(".socket")
            shutil.copy(ROOT / "deploy/windsplat.socket", activator)
            activated = path.with_suffix(".socket.d")
            activated.mkdir()
            shutil.copy(RECIPES / "systemd-unix-socket.conf", activated / "unix.conf")
            run = subprocess.run(["systemd-analyze", "verify", "--man=no", path, activator],
                                 capture_output=True, text=True, check=False)
        ours = [line for line in run.stderr.splitlines() if folder in line or "windsplat" in line]
        self.assertEqual((run.returncode, ours), (0, []), run.stderr)

    def served(self, environment):
        """The statuses of the page by the public name and by another one."""
        kept = dict(os.environ)
        os.environ.update(environment)
        try:
            daemon = Daemon(PROGRAM, "tornado:16")
        finally:
            os.environ.clear()
            os.environ.update(kept)
        try:
            daemon.child.stdout.close()
            here = Named("127.0.0.1", daemon.port, base="/winds/")
            other = Named("127.0.0.1", daemon.port, base="/winds/")
            other.name = "other.example"
            return request(here, "GET", "").status, request(other, "GET", "").status
        finally:
            daemon.stop()

    def test_the_drop_in_for_proxies_serves_the_public_name_below_the_path(self):
        environment = environment_of((RECIPES / "systemd-proxy.conf").read_text())
        self.assertEqual(self.served(environment), (200, 421))

    def test_the_composed_daemon_serves_the_public_name_below_the_path(self):
        try:
            import yaml  # pylint: disable=import-outside-toplevel
        except ImportError:
            self.skipTest("python3-yaml is not installed")
        document = yaml.safe_load((RECIPES / "compose.yaml").read_text())
        services, networks = document["services"], document["networks"]
        daemon, caddy = services["windsplat"], services["caddy"]
        self.assertNotIn("ports", daemon)
        self.assertTrue(networks["inner"]["internal"])
        self.assertEqual(networks["inner"]["ipam"]["config"][0]["subnet"],
                         daemon["environment"]["WINDSPLAT_TRUSTED_PROXY"])
        name, port = caddy["environment"]["WINDSPLAT_UPSTREAM"].split(":")
        self.assertEqual((services[name], f"0.0.0.0:{port}"), (daemon, daemon["command"][2]))
        for service in services.values():
            for volume in service["volumes"]:
                source = volume.split(":")[0]
                self.assertTrue(source.startswith("./") or source in document["volumes"], volume)
            self.assertLessEqual(set(service["networks"]), set(networks))
        with tempfile.TemporaryDirectory() as folder:
            environment = {**daemon["environment"], "WINDSPLAT_STATE_DIR": folder,
                           "WINDSPLAT_DATA_ROOT": folder}
            self.assertEqual(self.served(environment), (200, 421))

    def test_both_images_have_the_same_packages_and_build(self):
        def of(path):
            text = path.read_text().replace("&&", " ")
            lists = re.findall(r"--no-install-recommends((?:\s*\\\n|\s*[a-z0-9.+-]+)*)", text)
            packages = set(re.findall(r"[a-z][a-z0-9.+-]+", lists[-1])) - {"rm", "rf"}
            built = re.findall(
                r"scripts/setup build web|(?:cmake|install -D) [^\\\n]*[^\\\s]", text)
            return packages, [line.strip() for line in built]
        self.assertEqual(of(RECIPES / "windsplat.def"), of(ROOT / "Dockerfile"))

    def test_the_launcher_entry_starts_a_daemon_that_answers_the_hub(self):
        with tempfile.TemporaryDirectory() as folder:
            entry = self.entry_of(folder)
            # As jupyter-server-proxy: it fills in port and base_url, and passes the headers of
            # the browser on, with those of the entry in place of equal ones.
            token_file = entry["command"][entry["command"].index("--token-file") + 1]
            self.assertEqual(os.stat(token_file).st_mode & 0o777, 0o600)
            words = [word.format(port=0, base_url="/user/ada/") for word in entry["command"]]
            self.assertEqual(words[:4], ["windsplat", "serve", "--listen", "127.0.0.1:0"])
            daemon = Daemon(PROGRAM, "tornado:16", *words[4:])
            try:
                daemon.child.stdout.close()
                hub = Named("127.0.0.1", daemon.port, base="/user/ada/windsplat/")
                hub.name = "hub.example"
                self.assertEqual(request(hub, "GET", "v1/datasets").status, 401)
                scheme, hub.token = entry["request_headers_override"]["Authorization"].split()
                self.assertEqual((scheme, entry["absolute_url"]), ("Bearer", True))
                for path in ("", "v1/datasets"):
                    answer = request(hub, "GET", path, {"Origin": "https://hub.example"})
                    self.assertEqual(answer.status, 200, path)
                WebSocket(hub).close()
                with Connection(Target("localhost", daemon.port)) as probe:  # "is it ready?"
                    probe.raw(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    self.assertGreater(probe.answer().status, 0)
            finally:
                daemon.stop()

    @staticmethod
    def entry_of(folder):
        """The entry that the file defines, with a runtime folder and a home of its own."""
        def module(name, **members):
            made = type(sys)(name)
            vars(made).update(members)
            return made
        fake = {"jupyter_core": module("jupyter_core"),
                "jupyter_core.paths": module("jupyter_core.paths",
                                             jupyter_runtime_dir=lambda: folder + "/runtime")}
        c = type("Configuration", (), {"ServerProxy": type("ServerProxy", (), {})})
        text = (RECIPES / "jupyter_server_config.py").read_text()
        kept = {name: sys.modules.get(name) for name in fake}
        home = os.environ.get("HOME", "")
        sys.modules.update(fake)
        os.environ["HOME"] = folder
        try:
            exec(compile(text, "jupyter_server_config.py", "exec"), {"c": c})
        finally:
            os.environ["HOME"] = home
            for name, before in kept.items():
                sys.modules.pop(name) if before is None else sys.modules.update({name: before})
        return c.ServerProxy.servers["windsplat"]


if __name__ == "__main__":
    options = [one for one in sys.argv[1:] if one.startswith("--program=")]
    if options:
        PROGRAM = str(pathlib.Path(options[0].partition("=")[2]).resolve())
    unittest.main(argv=[sys.argv[0], *(one for one in sys.argv[1:] if one not in options)])
