"""The outcome of a test suite, and its text in the summary."""
import dataclasses


@dataclasses.dataclass
class Outcome:
    """Counts are of test cases. A test that failed and then passed by itself is unstable: it is
    listed with its first output, and counts as passed."""
    passed: int = 0
    skipped: int = 0
    failed: dict = dataclasses.field(default_factory=dict)    # name -> output
    unstable: dict = dataclasses.field(default_factory=dict)  # name -> first output
    durations: dict = dataclasses.field(default_factory=dict)  # name -> seconds
    seconds: float = 0

    def counts(self):
        numbers = (("passed", self.passed), ("failed", len(self.failed)),
                   ("skipped", self.skipped), ("unstable", len(self.unstable)))
        return ", ".join(f"{number} {word}" for word, number in numbers if number) or "-"


def excerpt(name, said, lines_max=30):
    """The first lines of a failing test's output, marked off from the suite's own lines."""
    lines = [line for line in said.splitlines() if line.strip()][:lines_max]
    return "\n".join([f"{name}:", *(f"  | {line}" for line in lines)])


def summary(outcomes, seconds, slowest=0):
    """The end of a run's output, sufficient to know what failed and how."""
    lines = []
    for suite, outcome in outcomes.items():
        for word, tests in (("unstable", outcome.unstable), ("failed", outcome.failed)):
            lines += [excerpt(f"{suite}: {word}: {name}", said)
                      for name, said in list(tests.items())[:10]]
    lines.append(f"\n{'suite':<22} {'result':<7} {'time':>6}  tests")
    for suite, outcome in outcomes.items():
        result = "FAILED" if outcome.failed else "ok"
        lines.append(f"{suite:<22} {result:<7} {outcome.seconds:5.0f}s  {outcome.counts()}")
    for suite, outcome in outcomes.items():
        longest = sorted(outcome.durations.items(), key=lambda item: -item[1])[:slowest]
        lines += [f"slow: {suite}: {name} {duration:.1f} s" for name, duration in longest]
    for word, of in (("unstable", lambda outcome: outcome.unstable),
                     ("failed", lambda outcome: outcome.failed)):
        lines += [f"{word}: {suite}: {name}" for suite, outcome in outcomes.items()
                  for name in of(outcome)]
    bad = sum(bool(outcome.failed) for outcome in outcomes.values())
    lines.append(f"total: {len(outcomes)} suites, {bad} failed, {seconds:.0f} s")
    return "\n".join(lines)
