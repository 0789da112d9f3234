#!/usr/bin/env python3
"""Builds, and runs the test suites; called by scripts/test after the installation of dependencies.
Later builds and clang-tidy run at low priority during the tests, which often wait for clocks and
sockets. The output of a suite is stored in build/test-logs and shown as a whole when it ends; the
last output is a table.

tests/CMakeLists.txt defines the tests that are repeated under each sanitizer."""
import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import time
import traceback

import ctest_suite
import node_suite
from outcome import Outcome, summary

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build"
LOGS = BUILD / "test-logs"
# More than the number of cores, because tests spend much of their time waiting.
CORES = len(os.sched_getaffinity(0))
JOBS = min(2 * CORES, CORES + 4)
# A browser and its daemon occupy a core; by default node runs one file fewer than there are cores.
BROWSERS = min(CORES, 4)
SEARCH_SECONDS = 30  # for each fuzzer
GIVING_WAY = ("nice", "-n", "19")  # low priority, because tests have deadlines
SANITIZERS = {
    "ASAN_OPTIONS": "detect_leaks=1:strict_string_checks=1:check_initialization_order=1",
    "UBSAN_OPTIONS": "print_stacktrace=1",
    "TSAN_OPTIONS": "halt_on_error=1:second_deadlock_stack=1"}
# Patterns of the summary lines of commands: passed, and failed.
COUNTS = (re.compile(r"^tidy: (\d+) files clean.* (\d+) files$", re.M),
          re.compile(r"^total: (\d+) targets, .* (\d+) crashed$", re.M))


def fixed_addresses():
    """The thread sanitizer cannot start under the address randomisation of some kernels; it is
    disabled for the process if permitted."""
    words = ["setarch", os.uname().machine, "-R"]
    works = subprocess.run([*words, "true"], stderr=subprocess.DEVNULL, check=False)
    return words if works.returncode == 0 else []


def command(emit, *words):
    """A suite that is one command."""
    text = ""
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          errors="replace") as running:
        for line in running.stdout:
            emit(line)
            text += line
    outcome = Outcome()
    for pattern in COUNTS:
        if found := pattern.search(text):
            outcome.passed = int(found[1])
    if running.returncode != 0:
        outcome.failed[" ".join(map(str, words[-2:]))] = "\n".join(text.splitlines()[-30:])
    return outcome


class Run:
    def __init__(self, options):
        self.options = options
        self.outcomes = {}
        self.begin = time.monotonic()

    def suite(self, name, run, *words, **named):
        """Runs a suite and stores its outcome; returns whether no test failed permanently."""
        begin = time.monotonic()
        path = LOGS / (name.replace(" ", "-") + ".log")
        print(f"-- {name} begins: {os.path.relpath(path, ROOT)}", flush=True)
        with path.open("w") as log:

            def emit(text):
                log.write(text)
                log.flush()

            try:
                outcome = run(emit, *words, **named)
            except Exception:  # an error of the runner itself must not stop the other suites
                outcome = Outcome()
                outcome.failed[name] = traceback.format_exc()
                emit(outcome.failed[name])
        outcome.seconds = time.monotonic() - begin
        self.outcomes[name] = outcome
        print(f"\n== {name}, {outcome.seconds:.0f} s\n{path.read_text()}", flush=True)
        return not outcome.failed

    def ctest(self, name, preset, *selection, prefix=()):
        def run(emit):
            return ctest_suite.Suite(BUILD / preset, selection, JOBS, emit, prefix).run()
        return self.suite(name, run)

    def built(self, preset, *prefix):
        every = self.options.thorough or self.options.quick
        targets = ("all", "thorough_tests") if every else ()
        return self.suite(f"build {preset}", command, *prefix, "scripts/build", preset, *targets)

    def tidy(self):
        words = () if self.options.thorough else ("--changed",)
        self.suite("clang-tidy", command, *GIVING_WAY, "scripts/tidy", *words)

    def everything(self):
        thorough = self.options.thorough
        chosen = () if thorough else ("-LE", "thorough")
        plain = fixed_addresses()
        beside = concurrent.futures.ThreadPoolExecutor(1)  # one build at a time, in this order
        try:
            release = beside.submit(self.built, "release")
            dev = beside.submit(self.built, "dev", *GIVING_WAY)
            tsan = beside.submit(self.built, "tsan", *GIVING_WAY, *plain)
            tidy = beside.submit(lambda: dev.result() and self.tidy())
            unit = {"web": ["npm", "--prefix", "web", "test", "--silent", "--",
                            "--test-reporter=tap"]}
            self.suite("page unit", node_suite.run, unit, 1)
            if release.result():
                self.ctest("release", "release", *chosen)
                browser = {path.name: ["tests/browser/run", "--test-reporter=tap", path.name]
                           for path in sorted((ROOT / "tests/browser").rglob("*.test.mjs"))
                           if "node_modules" not in path.parts}
                self.suite("page browser", node_suite.run, browser, BROWSERS)
            if dev.result():
                self.ctest("asan ubsan", "dev", *chosen)
                self.suite("fuzz", command, "scripts/fuzz", "--no-build", "--seconds", "0")
            if tsan.result():
                self.ctest("tsan", "tsan", *chosen, prefix=plain)
            tidy.result()
        finally:
            beside.shutdown(cancel_futures=True)
        if thorough:
            self.suite("fuzz search", command, "scripts/fuzz", "--seconds", str(SEARCH_SECONDS))

    def quick(self):
        if self.built("release"):
            self.ctest("release", "release", "-L", "unit|protocol|tidy")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--thorough", action="store_true")
    options = parser.parse_args()
    os.chdir(ROOT)
    os.environ.update(SANITIZERS)
    LOGS.mkdir(parents=True, exist_ok=True)
    run = Run(options)
    run.quick() if options.quick else run.everything()
    print(summary(run.outcomes, time.monotonic() - run.begin, 10 if options.thorough else 0))
    return 1 if any(outcome.failed for outcome in run.outcomes.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
