#!/usr/bin/env python3
"""Opens thousands of mutated files of every format with one daemon, which must survive all of them.

    tests/fuzz/mutate_files.py --count 10000              # 7 to 10 minutes on two cores
    tests/fuzz/mutate_files.py --count 300                # a quick round
    tests/fuzz/mutate_files.py --count 1500 --strace      # also checks every file opened
    tests/fuzz/mutate_files.py --seed 7 --only 1234 --keep found   # one file again, with answers

Every file is posted to a daemon with --data-root; loaded datasets are described, rendered, probed
and forgotten. First the unmodified seeds, which must load, then mutated files. A failure is
 - a daemon that exits, does not answer, or exceeds its memory limit by more than 10 %;
 - an answer that is neither a result nor a problem with a reason, or a 5xx other than 503 and 507;
   invalid numbers; a call that takes longer than --patience;
 - a file outside the data root that any process opened (watched by inotify), or whose content was
   returned;
 - with --strace: any file that a confined loader opened by name, any socket it created, any
   unexpected file that the daemon opened, any connection it made, and a search for libraries in the
   current folder.
A crashed loader is not a failure (it is confined for that purpose), but it is counted and the file
kept. Files, seeds and order depend on --seed only, given the same tools (nccopy and grib_filter
create some seeds if installed; build/test-data supplies real files). Exit code 0: no failure.
"""

import argparse
import collections
import concurrent.futures
import pathlib
import random
import re
import shutil
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import mutations  # noqa: E402
import seeds  # noqa: E402
import seeds_escaping  # noqa: E402
import strace_log  # noqa: E402
from checked_daemon import (LIBRARIES, Daemon, Failure, Refused, Watch,  # noqa: E402
                            check_controls, plain, try_file, write_case)

IN_FLIGHT = 8
EVERY = 500
ESCAPES_SHARE = 0.1


def case_of(number, options, kinds):
    """The seed and the mutated files of a case, reproducibly."""
    dice = random.Random(f"{options.seed}/{number}")
    kind = sorted(kinds)[number % len(kinds)]
    escaping = [seed for seed in kinds[kind] if seed.escapes]
    plain = [seed for seed in kinds[kind] if not seed.escapes]
    group = escaping if escaping and dice.random() < ESCAPES_SHARE else plain
    seed = dice.choice(group)
    if not seed.sure and not seed.escapes and dice.random() < 0.7:
        seed = dice.choice([one for one in plain if one.sure] or plain)
    files = dict(seed.files)
    names = list(files)
    name = names[0] if dice.random() < 0.5 else dice.choice(names)
    donor = dice.choice(dice.choice(list(kinds.values()))).files
    other = dice.choice(list(donor.values()))
    if len(names) > 1 and dice.random() < 0.03:
        del files[name]
    else:
        files[name] = mutations.mutated(files[name], dice, other)
    return seed, files


class Run:
    """Counts outcomes by format, and records failures."""

    def __init__(self, options, daemon, root, watch):
        self.options = options
        self.daemon = daemon
        self.root = root
        self.watch = watch
        self.lock = threading.Lock()
        self.counts = collections.defaultdict(collections.Counter)
        self.reasons = collections.Counter()
        self.failures = []
        self.slow = []

    def one(self, name, seed, files, sure):
        folder = self.root / name
        path = write_case(folder, seed.path, files, seed.links)
        begin = time.monotonic()
        outcome, text = "loaded", ""
        try:
            try_file(self.daemon, path)
        except Refused as reason:
            outcome, text = "refused", str(reason)
            if sure:
                outcome, text = "failed", f"a valid file was refused: {text}"
        except (Failure, KeyError, TypeError, IndexError, AttributeError) as fault:
            outcome, text = "failed", repr(fault) if not isinstance(fault, Failure) else str(fault)
        taken = time.monotonic() - begin
        died = outcome == "refused" and re.search(
            r"the loader of .* (was terminated|ended with|said)", text)
        self.note(name, seed, outcome, "died" if died else "", text, taken)
        if self.options.keep and (died or outcome == "failed" or self.options.only is not None):
            shutil.copytree(folder, pathlib.Path(self.options.keep) / name, symlinks=True,
                            dirs_exist_ok=True)
        shutil.rmtree(folder)

    def note(self, name, seed, outcome, died, text, taken):
        with self.lock:
            row = self.counts[seed.kind]
            row["files"] += 1
            row[outcome] += 1
            row["died"] += bool(died)
            self.slow = sorted([*self.slow, (taken, name, seed.kind, text)], reverse=True)[:5]
            if outcome == "refused":
                self.reasons[f"{seed.kind}: {plain(text)}"] += 1
            if outcome == "failed":
                self.failures.append(f"{name} ({seed.kind}, {seed.name}): {text}")
            if outcome == "failed" or died or self.options.only is not None:
                print(f"{outcome} {name} ({seed.kind}, {seed.name}) {taken:.2f} s: {text[:400]}",
                      flush=True)

    def fail(self, text):
        self.failures.append(text)
        print(f"failed: {text}", flush=True)

    def all(self, cases):
        """Cases are (name, seed, files, sure), eight at a time; the daemon is checked every 500."""
        with concurrent.futures.ThreadPoolExecutor(IN_FLIGHT) as pool:
            done = 0
            while chunk := [case for _, case in zip(range(EVERY), cases)]:
                list(pool.map(lambda case: self.one(*case), chunk))
                done += len(chunk)
                for name, count in self.watch.seen().items():
                    self.fail(f"outside/{name} was opened {count} times")
                self.watch.names.clear()
                resident, files = self.daemon.vitals()
                print(f"{done} files: pid {self.daemon.child.pid} answers, {resident:.0f} MB "
                      f"resident, {files} open files, {len(self.failures)} failures", flush=True)

    def table(self):
        names = ("files", "loaded", "refused", "died", "failed")
        total = collections.Counter()
        print(f"\n{'format':16}" + "".join(f"{n:>14}" for n in
                                           ("files", "loaded", "refused", "loader died",
                                            "failed")))
        for kind, row in sorted(self.counts.items()):
            total.update(row)
            print(f"{kind:16}" + "".join(f"{row[n]:14}" for n in names))
        print(f"{'all':16}" + "".join(f"{total[n]:14}" for n in names))
        print("slowest: " + ", ".join(f"{name} {kind} {taken:.1f} s"
                                      for taken, name, kind, _ in self.slow))
        if self.options.reasons:
            for text, count in self.reasons.most_common(self.options.reasons):
                print(f"{count:6} {text}")


def cases_of(options, everything, kinds):
    if options.only is not None:
        yield f"m{options.only}", *case_of(options.only, options, kinds), False
        return
    for i, seed in enumerate(everything):
        yield f"s{i}", seed, seed.files, seed.sure
    for number in range(options.count):
        yield f"m{number}", *case_of(number, options, kinds), False


def judge_log(run, options, root, outside):
    judge = strace_log.Judge([root, root.parent / "tmp"], outside, LIBRARIES,
                             pathlib.Path(options.program).resolve())
    judge.read(run.daemon.log)
    print("\nstrace:\n" + "\n".join(judge.report()))
    for fault in judge.faults[:20]:
        run.fail(fault[:400])
    if options.keep:
        shutil.copy(run.daemon.log, options.keep)


def parsed_options():
    default = pathlib.Path(__file__).resolve().parents[2] / "build"
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(default / "release/windsplat"))
    parser.add_argument("--test-data", type=pathlib.Path, default=default / "test-data")
    parser.add_argument("--count", type=int, default=10000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="number of the only mutated file to test")
    parser.add_argument("--format", help="the only format to test")
    parser.add_argument("--strace", action="store_true")
    parser.add_argument("--keep", help="folder for failing files")
    parser.add_argument("--patience", type=float, default=90, help="seconds for a call")
    parser.add_argument("--reasons", type=int, default=0, help="number of reasons to print")
    options = parser.parse_args()
    if options.strace and not shutil.which("strace"):
        sys.exit("mutate_files: strace is not installed")
    if options.keep:
        pathlib.Path(options.keep).mkdir(parents=True, exist_ok=True)
    return options


def run_in(folder, options):
    root, made, outside = folder / "root", folder / "made", folder / "outside"
    root.mkdir()
    made.mkdir()
    seeds_escaping.write_outside(outside)
    everything = [*seeds.plain_seeds(options.program, made, options.test_data),
                  *seeds_escaping.escape_seeds(outside)]
    kinds = collections.defaultdict(list)
    for seed in everything:
        if options.format in (None, seed.kind):
            kinds[seed.kind].append(seed)
    everything = [seed for seed in everything if seed.kind in kinds]
    watch = Watch(outside)
    (outside / "mark.txt").read_bytes()
    if not watch.seen():
        sys.exit("mutate_files: inotify does not work here")
    daemon = Daemon(options, root, folder)
    check_controls(daemon, root, outside)
    watch.seen()
    watch.names.clear()
    run = Run(options, daemon, root, watch)
    try:
        run.all(cases_of(options, everything, kinds))
    except Failure as fault:
        run.fail(str(fault))
    code = daemon.stop()
    if code != 0:
        run.fail(f"the daemon exited with {code}")
    if options.strace:
        judge_log(run, options, root, outside)
    run.table()
    print(f"\n{len(everything)} seeds of {len(kinds)} formats, seed {options.seed}: "
          f"{len(run.failures)} failures")
    for text in run.failures[:50]:
        print("  " + text[:300])
    return 1 if run.failures else 0


def main():
    options = parsed_options()
    with tempfile.TemporaryDirectory(prefix="windsplat-fuzz-") as folder:
        sys.exit(run_in(pathlib.Path(folder).resolve(), options))


if __name__ == "__main__":
    main()
