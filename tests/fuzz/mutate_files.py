#!/usr/bin/env python3
"""Thousands of spoiled files of every format against one daemon, which must outlive them all.

    tests/fuzz/mutate_files.py --count 10000              # 7 to 10 minutes on two cores
    tests/fuzz/mutate_files.py --count 300                # a quick round
    tests/fuzz/mutate_files.py --count 1500 --strace      # and what its processes really opened
    tests/fuzz/mutate_files.py --seed 7 --only 1234 --keep found   # one file again, with answers

Every file is posted to a daemon with --data-root; what loads is described, drawn, probed and
forgotten. First the seeds as they are: those must load. Then mutated ones. A failure is
 - a daemon that died, does not answer, or outgrows its memory limit by more than 10 %;
 - an answer that is neither what was asked for nor a problem with a reason, or a 5xx other than 503
   and 507; numbers that are none; a call that takes longer than --patience;
 - a file outside the data root that was opened by anybody (watched by inotify), or came back;
 - with --strace: any file a loader opened by name once it was confined, any socket it made, any
   file that the daemon opened beyond its own, any connection it made, and libraries looked for in
   the current folder.
A loader that died is no failure (that is what it is for), but it is counted and the file kept.
Files, seeds and order depend on --seed alone, given the same tools (nccopy and grib_filter make
some seeds if they are there; build/test-data gives real ones). Exit code 0: no failure.
"""

import argparse
import collections
import concurrent.futures
import ctypes
import http.client
import json
import math
import os
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import mutations  # noqa: E402
import seeds  # noqa: E402
import strace_log  # noqa: E402

MEMORY_LIMIT = 1 << 30
IN_FLIGHT = 8
EVERY = 500
CALM = (503, 507)  # the 5xx that are answers
LIBRARIES = ["/usr/share/eccodes/definitions"]
ESCAPES_SHARE = 0.1


class Failure(Exception):
    """What must not be."""


class Refused(Exception):
    """An error with a reason."""


class Watch:
    """Counts opens of the files in a folder, by whatever process, through inotify."""

    def __init__(self, folder):
        libc = ctypes.CDLL(None, use_errno=True)
        self.descriptor = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        self.names = collections.Counter()
        opened = 0x20
        if self.descriptor < 0 or libc.inotify_add_watch(
                self.descriptor, os.fsencode(folder), ctypes.c_uint32(opened)) < 0:
            sys.exit("mutate_files: inotify does not work here")

    def seen(self):
        try:
            while data := os.read(self.descriptor, 65536):
                at = 0
                while at < len(data):
                    size = struct.unpack_from("<I", data, at + 12)[0]
                    self.names[data[at + 16:at + 16 + size].rstrip(b"\0").decode()] += 1
                    at += 16 + size
        except BlockingIOError:
            pass
        return self.names


class Daemon:
    def __init__(self, options, root, folder, memory_limit=MEMORY_LIMIT, more=()):
        self.memory_limit = memory_limit
        self.log = folder / "strace.log" if options.strace else None
        command = [options.program, "serve", "tornado", "--data-root", root,
                   "--listen", "127.0.0.1:0", "--memory-limit", str(memory_limit), *more]
        if self.log:
            # -D: strace is not the parent, so that the child is the daemon itself.
            command = ["strace", "-D", "-f", "-y", "-o", self.log, "-e",
                       "trace=" + strace_log.CALLS, *command]
        self.errors = open(folder / "daemon.log", "wb")
        self.child = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE,
                                      stderr=self.errors, text=True)
        url = self.child.stdout.readline()
        if not url:
            sys.exit("mutate_files: the daemon did not start: "
                     + (folder / "daemon.log").read_text())
        self.port = int(url.strip().rstrip("/").rpartition(":")[2])
        self.patience = options.patience
        self.own = threading.local()

    def ask(self, method, path, body=None, more=None):
        """Status, headers and bytes of the answer."""
        for attempt in range(2):
            if not hasattr(self.own, "connection"):
                self.own.connection = http.client.HTTPConnection("127.0.0.1", self.port,
                                                                 timeout=self.patience)
            try:
                headers = ({"Content-Type": "application/json"} if body else {}) | (more or {})
                self.own.connection.request(method, path, body, headers)
                answer = self.own.connection.getresponse()
                return answer.status, answer.headers, answer.read()
            except TimeoutError as late:
                del self.own.connection
                raise Failure(f"no answer within {self.patience:g} s to {method} {path}") from late
            except (http.client.HTTPException, OSError) as fault:
                self.own.connection.close()
                del self.own.connection
                if attempt:  # a kept connection may have been closed meanwhile, a new one not
                    raise Failure(f"the connection broke at {method} {path}: {fault!r}") from fault

    def json(self, method, path, body=None):
        status, headers, data = self.ask(method, path, body)
        check_for_marks(data)
        return judged(status, headers, data)

    def vitals(self):
        """Resident MB and open files; fails if it is not there."""
        if self.child.poll() is not None:
            raise Failure(f"the daemon died: {self.child.returncode}")
        if self.ask("GET", "/livez")[0] != 200:
            raise Failure("/livez does not answer 200")
        status = pathlib.Path(f"/proc/{self.child.pid}/status").read_text()
        resident = int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024
        if resident * 2**20 > 1.1 * self.memory_limit:
            raise Failure(f"the daemon has {resident:.0f} MB resident")
        return resident, len(os.listdir(f"/proc/{self.child.pid}/fd"))

    def stop(self):
        """Its exit code, once what watched it has written everything."""
        self.child.terminate()
        code = self.child.wait(60)
        end = f"{self.child.pid} +++ exited"
        for _ in range(300 if self.log else 0):
            if end in self.log.read_text("latin-1")[-20000:]:
                break
            time.sleep(0.1)
        return code


def check_for_marks(data):
    if str(seeds.MARK_NUMBER).encode() in data or seeds.MARK_TEXT.encode() in data:
        raise Failure(f"what lies outside came back: {data[:300]!r}")


def no_constant(name):
    raise Failure(f"JSON holds {name}")


def judged(status, headers, data):
    """The JSON of a good answer. Raises Refused or Failure."""
    kind = headers.get("Content-Type", "")
    try:
        parsed = json.loads(data, parse_constant=no_constant) if data else None
    except ValueError as fault:
        raise Failure(f"{status}: not JSON: {data[:200]!r}") from fault
    if status < 300:
        if data and not kind.startswith("application/json"):
            raise Failure(f"{status} with the type {kind}")
        return parsed
    if not kind.startswith("application/problem+json"):
        raise Failure(f"{status} with the type {kind}: {data[:200]!r}")
    raise refusal(parsed, status)


def refusal(problem, status=None):
    if not isinstance(problem, dict) or not problem.get("detail", "").strip():
        return Failure(f"a problem without a reason: {problem}")
    status = status or problem["status"]
    if status >= 500 and status not in CALM:
        return Failure(f"{status}: {problem['detail']}")
    return Refused(f"{status}: {problem['detail']}")


def check_numbers(value, where):
    """Every number is finite; null marks missing values."""
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return
    if isinstance(value, (int, float)):
        if not math.isfinite(value):
            raise Failure(f"{where} is {value}")
    elif isinstance(value, list):
        for i, item in enumerate(value):
            check_numbers(item, f"{where}/{i}")
    else:
        for key, item in value.items():
            check_numbers(item, f"{where}/{key}")


def check_description(about):
    check_numbers(about, "")
    dims = [about["dims"][axis] for axis in "xyz"]
    if not all(isinstance(n, int) and n >= 1 for n in dims) or math.prod(dims) > 2**31:
        raise Failure(f"dims are {dims}")
    if not about["fields"] or about["steps"]["count"] < 1:
        raise Failure("a dataset without fields or steps")
    for field in about["fields"]:
        low_high = field["range"]
        if low_high is not None and not low_high[0] <= low_high[1]:
            raise Failure(f"the range of {field['name']} is {low_high}")


def check_picture(daemon, dataset):
    status, headers, data = daemon.ask("GET", f"/v1/datasets/{dataset}/frame.jpg"
                                              "?width=64&height=48")
    if status != 200:
        judged(status, headers, data)
    if headers["Content-Type"] != "image/jpeg" or data[:2] != b"\xff\xd8" \
            or data[-2:] != b"\xff\xd9":
        raise Failure(f"a picture of type {headers['Content-Type']} that begins {data[:8]!r}")


def check_probe(daemon, dataset, about):
    def middle(axis):
        places = (about["axes"].get(axis) or {}).get("coordinates") or [0]
        return places[len(places) // 2] or 0
    at = "&".join(f"{axis}={min(max(middle(axis), -1e30), 1e30)!r}" for axis in "xyz")
    try:
        probe = daemon.json("GET", f"/v1/datasets/{dataset}/probe?{at}")
    except Refused as reason:
        if "outside the data's box" in str(reason):  # columns stand where no axis tells
            return
        raise
    check_numbers(probe, "probe")
    if len(probe["values"]) != len(about["fields"]):
        raise Failure(f"a probe of {len(probe['values'])} values")


def check_histogram(daemon, dataset, about):
    name = about["fields"][-1]["name"]
    quoted = urllib.parse.quote(name, safe="")
    made = daemon.json("GET", f"/v1/datasets/{dataset}/fields/{quoted}/histogram?bins=8")
    check_numbers(made, "histogram")
    counted = sum(made["counts"]) + made["below"] + made["above"]
    if counted + made["masked"] != math.prod(about["dims"].values()):
        raise Failure(f"a histogram of {counted} and {made['masked']} masked")


def open_dataset(daemon, path):
    """Its id. Raises Refused or Failure."""
    until = time.monotonic() + daemon.patience
    job = daemon.json("POST", "/v1/datasets", json.dumps({"path": path}))
    pause = 0.01
    while job["state"] in ("queued", "running"):
        if time.monotonic() > until:
            raise Failure(f"the job is not done after {daemon.patience:g} s")
        time.sleep(pause)
        pause = min(0.2, pause * 1.3)
        job = daemon.json("GET", f"/v1/jobs/{job['id']}")
    if job["state"] != "done":
        raise refusal(job["problem"])
    return job["result"]


def try_file(daemon, path):
    """Raises Refused if it does not load, or not all of it; Failure."""
    dataset = urllib.parse.quote(open_dataset(daemon, path), safe="")
    try:
        about = daemon.json("GET", f"/v1/datasets/{dataset}")
        check_description(about)
        check_picture(daemon, dataset)
        check_probe(daemon, dataset, about)
        check_histogram(daemon, dataset, about)
    finally:
        daemon.json("DELETE", f"/v1/datasets/{dataset}?forget=true")


def write_case(folder, path, files, links):
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    for name, target in links.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).symlink_to(target)
    return f"{folder.name}/{path}"


def case_of(number, options, kinds):
    """The seed and the mutated files of a case: the same whenever it is asked for."""
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
    """Outcomes by format, and failures."""

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
                outcome, text = "failed", f"a sound file was refused: {text}"
        except (Failure, KeyError, TypeError, IndexError, AttributeError) as fault:
            outcome, text = "failed", repr(fault) if not isinstance(fault, Failure) else str(fault)
        taken = time.monotonic() - begin
        died = outcome == "refused" and re.search(r"the loader of .* (was ended|ended with|said)",
                                                  text)
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
        """Cases are (name, seed, files, sure), eight at a time, checked every 500."""
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


def plain(reason):
    """A reason without the parts that depend on the file."""
    return re.sub(r"-?\d+(\.\d+)?(e[+-]?\d+)?", "N", re.sub(r"'[^']*'", "'...'", reason))[:150]


def cases_of(options, everything, kinds):
    if options.only is not None:
        yield f"m{options.only}", *case_of(options.only, options, kinds), False
        return
    for i, seed in enumerate(everything):
        yield f"s{i}", seed, seed.files, seed.sure
    for number in range(options.count):
        yield f"m{number}", *case_of(number, options, kinds), False


def check_controls(daemon, root, outside):
    """What lies outside is recognised when it does come back: from copies that lie inside."""
    for name in ("mark.vti", "mark.dx", "mark.h5"):
        shutil.copy(outside / name, root / name)
        try:
            try_file(daemon, name)
        except (Failure, Refused) as told:
            if "came back" not in str(told):
                sys.exit(f"mutate_files: {name} is not recognised: {told}")
        else:
            sys.exit(f"mutate_files: {name} is not recognised")
        (root / name).unlink()


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
    parser.add_argument("--only", type=int, help="this mutated file alone")
    parser.add_argument("--format", help="this format alone")
    parser.add_argument("--strace", action="store_true")
    parser.add_argument("--keep", help="a folder for files that failed")
    parser.add_argument("--patience", type=float, default=90, help="seconds for a call")
    parser.add_argument("--reasons", type=int, default=0, help="show so many reasons")
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
    seeds.write_outside(outside)
    everything = seeds.all_seeds(options.program, made, options.test_data, outside)
    kinds = collections.defaultdict(list)
    for seed in everything:
        if options.format in (None, seed.kind):
            kinds[seed.kind].append(seed)
    everything = [seed for seed in everything if seed.kind in kinds]
    watch = Watch(outside)
    (outside / "mark.txt").read_bytes()
    if not watch.seen():
        sys.exit("mutate_files: inotify sees nothing here")
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
        run.fail(f"the daemon ended with {code}")
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
