#!/usr/bin/env python3
"""scripts/run --help changes nothing; scripts/setup names the package that prevents an
installation, and refuses an outdated node.

apt and its helpers are replaced by fakes on the PATH, so that nothing is downloaded or
installed."""
import os
import pathlib
import stat
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
MISSING = ("libboost1.81-dev", "prometheus-cpp-dev")
STANDS_IN = {
    "id": "echo 0",
    "dpkg-query": 'case "${*: -1}" in %s) echo not-installed ;; *) echo installed ;; esac'
                  % " | ".join(MISSING),
    "apt-mark": "echo libcurl4-gnutls-dev",
    "apt-cache": """
case "${*: -1}" in
  libcurl4-openssl-dev) echo 'Conflicts: libcurl4-gnutls-dev, libcurl4-nss-dev' ;;
  libboost1.81-dev) echo 'Conflicts: libboost1.55-dev (<< 2), libboost1.74-dev' ;;
  *) echo "Package: ${*: -1}" ;;
esac""",
    "apt-get": """
echo "$*" >>"$CALLS"
case " $* " in *' -s '*) ;; *) exit 0 ;; esac
case " $* " in *' prometheus-cpp-dev '*)
  echo 'Remv libcurl4-gnutls-dev [7.88]'
  echo 'Inst libcurl4-openssl-dev (7.88 Debian:12)'
  echo 'Inst prometheus-cpp-dev (1.0 Debian:12)' ;;
esac
case " $* " in *' libboost1.81-dev '*)
  echo 'Remv libboost-dev [1.74]'
  echo 'Remv libboost1.74-dev:amd64 [1.74]'
  echo 'Inst libboost1.81-dev (1.81 Debian:12)' ;;
esac""",
}


def run(script, *words, more=None):
    """Runs the script; returns its outcome and the calls of apt-get. more: further fakes."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for program, text in (STANDS_IN | (more or {})).items():
            file = folder / program
            file.write_text("#!/bin/bash\n" + text + "\n")
            file.chmod(file.stat().st_mode | stat.S_IXUSR)
        calls = folder / "calls"
        calls.touch()
        environment = dict(os.environ, PATH=f"{folder}:{os.environ['PATH']}", CALLS=str(calls))
        done = subprocess.run([str(ROOT / "scripts" / script), *words], env=environment,
                              capture_output=True, text=True, check=False, timeout=100)
        return done, calls.read_text().splitlines()


def need(holds, message):
    if not holds:
        sys.exit(f"scripts_test: {message}")


def help_changes_nothing():
    for words in (["--help"], ["-h"], ["winds.nc", "--help"]):
        done, calls = run("run", *words)
        need(done.returncode == 0, f"run {words} ends with {done.returncode}: {done.stderr}")
        need("Usage: scripts/run" in done.stdout and "windsplat serve" in done.stdout,
             f"run {words} prints no usage: {done.stdout}")
        need(not calls, f"run {words} calls apt-get: {calls}")


def conflicts_are_named():
    done, calls = run("setup", "build", "--help")
    need(done.returncode == 0 and not calls, f"setup --help: {done.returncode}, {calls}")
    need("Usage: scripts/setup" in done.stdout, f"setup --help says: {done.stdout}")
    done, calls = run("setup", "build")
    need(done.returncode == 1, f"setup ends with {done.returncode}: {done.stderr}")
    for line in ("libcurl4-gnutls-dev (held): conflicts with libcurl4-openssl-dev, which "
                 "prometheus-cpp-dev needs",
                 "libboost1.74-dev: conflicts with libboost1.81-dev\n",
                 "libboost-dev: needs a package that would be removed",
                 "apt-get remove libcurl4-gnutls-dev libboost-dev libboost1.74-dev\n",
                 "deploy/build-image.sh"):
        need(line in done.stderr, f"setup does not print '{line}':\n{done.stderr}")
    changes = [call for call in calls if " install " in f" {call} " and " -s " not in f" {call} "]
    need(not changes, f"setup installs: {changes}")


def an_old_node_is_refused():
    for version in ("v16.20.2", "v18.14.2"):
        done, calls = run("setup", "web", more={"node": f"echo {version}", "npm": "exit 1"})
        need(done.returncode == 1 and not calls, f"setup web: {done.returncode}, {calls}")
        need(f"node v18.15.0 or later and npm are needed; found: {version}\n" in done.stderr,
             f"setup says of node {version}:\n{done.stderr}")


if __name__ == "__main__":
    help_changes_nothing()
    conflicts_are_named()
    an_old_node_is_refused()
