"""Runs the entries of a ctest suite, counts their test cases, and repeats failed ones by
themselves at the end."""
import dataclasses
import json
import re
import subprocess
import xml.etree.ElementTree as xml

import googletest
from outcome import Outcome

OUTPUT_BYTES_MAX = 100_000_000
# A race or memory error rarely occurs twice, so its first report counts as a failure.
REPORTED = re.compile(r"(WARNING|ERROR): \w+Sanitizer|runtime error:")


@dataclasses.dataclass
class Entry:
    command: list
    environment: dict
    folder: str


def entries(build, selection):
    listing = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1", *selection],
                             stdout=subprocess.PIPE, check=True, text=True).stdout
    found = {}
    for test in json.loads(listing)["tests"]:
        properties = {item["name"]: item["value"] for item in test.get("properties", [])}
        pairs = [pair.split("=", 1) for pair in properties.get("ENVIRONMENT", [])]
        found[test["name"]] = Entry(test.get("command", []), dict(pairs),
                                    properties.get("WORKING_DIRECTORY", str(build)))
    return found


def run_ctest(prefix, build, selection, jobs, emit):
    """name -> (status, seconds, output)."""
    report = build / "Testing/report.xml"
    report.unlink(missing_ok=True)
    limits = [word for kind in ("passed", "failed")
              for word in (f"--test-output-size-{kind}", str(OUTPUT_BYTES_MAX))]
    command = [*prefix, "ctest", "--test-dir", build, "-j", str(jobs), "--no-tests=error",
               "--output-junit", report, *limits, *selection]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          errors="replace") as running:
        for line in running.stdout:
            emit(line)
    if not report.exists():
        return {}
    return {case.get("name"): (status(case), float(case.get("time") or 0),
                               case.findtext("system-out") or "")
            for case in xml.parse(report).getroot().iter("testcase")}


def status(case):
    """run (it passed), fail, or skip; a missing program counts as failed."""
    reason = case.find("skipped")
    if reason is None:
        return "fail" if case.get("status") == "fail" else "run"
    skipped = reason.get("message", "").startswith(("SKIP_", "Disabled"))
    return "skip" if skipped else "fail"


class Suite:
    def __init__(self, build, selection, jobs, emit, prefix=()):
        self.build, self.selection, self.jobs = build, selection, jobs
        self.emit, self.prefix = emit, list(prefix)
        self.outcome = Outcome()
        self.again = []  # (name, output, function that returns whether it passes now)

    def run(self):
        known = entries(self.build, self.selection)
        results = run_ctest(self.prefix, self.build, self.selection, self.jobs, self.emit)
        if not results:
            self.outcome.failed["ctest"] = "no test was run"
        for name, (status, seconds, said) in results.items():
            self.note(name, known[name], status, seconds, said)
        for name, said, passes in self.again:
            self.emit(f"\n{name} failed:\n{said}\n")
            if REPORTED.search(said):
                self.outcome.failed[name] = said
                continue
            passed = passes()
            (self.outcome.unstable if passed else self.outcome.failed)[name] = said
            self.outcome.passed += passed
            self.emit(f"{name}, once more by itself: {'passed' if passed else 'failed'}\n")
        return self.outcome

    def note(self, name, entry, status, seconds, said):
        found = googletest.cases(said)
        if not found or entry.environment.get("GTEST_SHARD_INDEX") is None:
            self.outcome.durations[name] = seconds
            if status == "fail":
                self.again.append((name, said, lambda: self.entry_passes(name)))
            elif status == "run":
                self.outcome.passed += "GTEST_SHARD_INDEX" not in entry.environment
            else:
                self.outcome.skipped += 1
            return
        where = ([*self.prefix, *entry.command], entry.environment, entry.folder)
        if status == "fail":
            lost = [case for case in googletest.shard(*where) if case not in found]
            found |= googletest.run_cases(*where, lost)
        for case, (result, duration, words) in found.items():
            self.outcome.durations[case] = duration
            if result in ("failed", "crashed"):
                self.again.append((case, words, lambda case=case: googletest.run_cases(
                    *where, [case])[case][0] == "ok"))
            else:
                self.outcome.passed += result == "ok"
                self.outcome.skipped += result == "skipped"
        everywhere = "\n".join(words for _, _, words in found.values())
        reported = REPORTED.search(said) and not REPORTED.search(everywhere)
        if status == "fail" and (reported or all(result in ("ok", "skipped")
                                                 for result, _, _ in found.values())):
            tail = "\n".join(said.splitlines()[-60:])  # after the tests: a leak, for example
            self.again.append((name, tail, lambda: self.entry_passes(name)))

    def entry_passes(self, name):
        only = ["-R", f"^{re.escape(name)}$"]
        results = run_ctest(self.prefix, self.build, only, 1, self.emit)
        return bool(results) and all(status == "run" for status, _, _ in results.values())
