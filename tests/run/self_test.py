#!/usr/bin/env python3
"""Test programs that pass, fail, crash or fail only once must be counted accordingly."""
import argparse
import contextlib
import io
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

import ctest_suite
import node_suite
import suites
from outcome import Outcome, summary

# Imitates GoogleTest; FLAKY fails if its file does not exist yet, and creates it.
PROGRAM = """
import os, pathlib, sys
cases = ["Case.good", "Case.bad", "Case.flaky", "Case.crash", "Case.after", "Case.skipped"]
chosen = os.environ.get("GTEST_FILTER", "*")
cases = [case for case in cases if chosen == "*" or case in chosen.split(":")]
if "--gtest_list_tests" in sys.argv:
    print("Case.", *(f"  {case[5:]}  # GetParam() = 1" for case in cases), sep="\\n")
    sys.exit(0)
index = int(os.environ.get("GTEST_SHARD_INDEX", 0))
code = 0
for case in cases[index::int(os.environ.get("GTEST_TOTAL_SHARDS", 1))]:
    print(f"[ RUN      ] {case}", flush=True)
    word = "      OK"
    once = pathlib.Path(__file__).with_suffix(".once")
    print("much said\\n" * 1000)
    if case == "Case.crash":
        os.abort()
    if case == "Case.bad" or case == "Case.flaky" and not once.exists():
        print(f"why {case} fails")
        word, code = "  FAILED ", 1
    if case == "Case.flaky":
        once.touch()
    if case == "Case.skipped":
        word = "  SKIPPED"
    print(f"[{word} ] {case} (12 ms)", flush=True)
sys.exit(code)
"""
ENTRIES = """
add_test(cases.0 "{python}" "{program}")
set_tests_properties(cases.0 PROPERTIES
  ENVIRONMENT "GTEST_TOTAL_SHARDS=1;GTEST_SHARD_INDEX=0;GTEST_FILTER=*")
add_test(passes "{python}" -c "print(1)")
add_test(fails "{python}" -c "raise SystemExit('a reason')")
add_test(skips "{python}" -c "raise SystemExit(77)")
set_tests_properties(skips PROPERTIES SKIP_RETURN_CODE 77)
add_test(absent "{program}-that-is-not-there")
add_test(races "{python}" -c "
import pathlib
once = pathlib.Path('races.once')
if not once.exists():
    once.touch()
    raise SystemExit('WARNING: ThreadSanitizer: data race')
")
"""


class Suites(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.said = []

    def test_ctest(self):
        program = self.folder / "cases.py"
        program.write_text(PROGRAM)
        (self.folder / "CTestTestfile.cmake").write_text(
            ENTRIES.format(python=sys.executable, program=program))
        outcome = ctest_suite.Suite(self.folder, [], 2, self.said.append).run()
        self.assertEqual(set(outcome.failed),
                         {"Case.bad", "Case.crash", "fails", "absent", "races"})
        self.assertEqual(set(outcome.unstable), {"Case.flaky"})
        self.assertEqual((outcome.passed, outcome.skipped), (4, 2))  # good, flaky, after, passes
        self.assertIn("why Case.bad fails", outcome.failed["Case.bad"])
        self.assertIn("why Case.flaky fails", outcome.unstable["Case.flaky"])
        self.assertIn("a reason", outcome.failed["fails"])
        self.assertEqual(outcome.durations["Case.after"], 0.012)

    def test_node(self):
        once = self.folder / "once"
        tests = {"good": "test('a', () => {});",
                 "bad": "test('b', () => {}); test('c', () => { throw new Error('why c'); });",
                 "flaky": "test('d', () => { if (!fs.existsSync(%r)) { fs.writeFileSync(%r, '');"
                          " throw new Error('why d'); } });" % (str(once), str(once))}
        commands = {}
        for name, text in tests.items():
            file = self.folder / f"{name}.mjs"
            file.write_text("import test from 'node:test'; import fs from 'node:fs';\n" + text)
            commands[name] = ["node", "--test", "--test-reporter=tap", file]
        outcome = node_suite.run(self.said.append, commands, 2)
        self.assertIn("bad: c", outcome.failed)
        self.assertTrue(all(name.startswith("bad: ") for name in outcome.failed))
        self.assertIn("why c", outcome.failed["bad: c"])
        self.assertIn("flaky: d", outcome.unstable)
        self.assertEqual(outcome.passed, 3)

    def test_what_a_failed_build_keeps_from_running(self):
        class Named(suites.Run):
            def suite(self, name, *_, **__):
                names.append(name)
                return name != "build release"

        names = []
        Named(argparse.Namespace(thorough=False, quick=False)).everything()
        self.assertEqual(sorted(names), ["asan ubsan", "build dev", "build release", "build tsan",
                                         "clang-tidy", "fuzz", "page unit", "tsan"])

    def test_a_suite_is_shown_as_a_whole(self):
        def other(emit):
            emit("other\n")
            return Outcome(passed=1)

        def one(emit):
            emit("begin of one\n")
            run.suite("other", other)
            emit("end of one\n")
            return Outcome(failed={"A.b": "why"})

        shown = io.StringIO()
        run = suites.Run(argparse.Namespace(thorough=False, quick=False))
        with mock.patch.object(suites, "LOGS", self.folder), contextlib.redirect_stdout(shown):
            self.assertFalse(run.suite("one", one))
        self.assertIn("begin of one\nend of one\n", shown.getvalue())
        self.assertEqual((self.folder / "other.log").read_text(), "other\n")
        self.assertEqual(set(run.outcomes), {"one", "other"})

    def test_an_exception_of_the_runner_fails_its_suite_alone(self):
        run = suites.Run(argparse.Namespace(thorough=False, quick=False))
        with mock.patch.object(suites, "LOGS", self.folder), \
                contextlib.redirect_stdout(io.StringIO()) as shown:
            self.assertFalse(run.suite("one", lambda emit: emit(1 / 0)))
        self.assertIn("ZeroDivisionError", shown.getvalue())
        self.assertIn("one", run.outcomes["one"].failed)

    def test_summary(self):
        outcomes = {"one": Outcome(passed=3, unstable={"A.b": "what b said"}, durations={"A.b": 2}),
                    "two": Outcome(passed=1, failed={"C.d": "what d said"})}
        lines = summary(outcomes, 7, 1).splitlines()
        self.assertIn("  | what b said", lines)
        self.assertIn("  | what d said", lines)
        self.assertIn("unstable: one: A.b", lines)
        self.assertIn("failed: two: C.d", lines)
        self.assertIn("slow: one: A.b 2.0 s", lines)
        self.assertIn("total: 2 suites, 1 failed, 7 s", lines)


if __name__ == "__main__":
    unittest.main()
