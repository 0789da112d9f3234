"""A daemon that opens hostile files, and the checks of its answers."""

import collections
import ctypes
import http.client
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import threading
import time
import urllib.parse

import seeds_escaping
import strace_log

MEMORY_LIMIT = 1 << 30
CALM = (503, 507)  # 5xx statuses that are valid answers
LIBRARIES = ["/usr/share/eccodes/definitions"]


class Failure(Exception):
    """A violated requirement."""


class Refused(Exception):
    """An error with a reason."""


class Watch:
    """Counts, through inotify, opens of the files in a folder by any process."""

    def __init__(self, folder):
        libc = ctypes.CDLL(None, use_errno=True)
        self.descriptor = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        self.names = collections.Counter()
        opened = 0x20
        if self.descriptor < 0 or libc.inotify_add_watch(
                self.descriptor, os.fsencode(folder), ctypes.c_uint32(opened)) < 0:
            sys.exit("checked_daemon: inotify does not work here")

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
            sys.exit("checked_daemon: the daemon did not start: "
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
                if attempt:  # only a kept connection may have been closed by the daemon
                    raise Failure(f"connection failed during {method} {path}: {fault!r}") from fault

    def json(self, method, path, body=None):
        status, headers, data = self.ask(method, path, body)
        check_for_marks(data)
        return judged(status, headers, data)

    def vitals(self):
        """Resident MB and number of open files; fails if the daemon has ended."""
        if self.child.poll() is not None:
            raise Failure(f"the daemon exited: {self.child.returncode}")
        if self.ask("GET", "/livez")[0] != 200:
            raise Failure("/livez does not answer 200")
        status = pathlib.Path(f"/proc/{self.child.pid}/status").read_text()
        resident = int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024
        if resident * 2**20 > 1.1 * self.memory_limit:
            raise Failure(f"the daemon has {resident:.0f} MB resident")
        return resident, len(os.listdir(f"/proc/{self.child.pid}/fd"))

    def stop(self):
        """Stops the daemon; returns its exit code once its log and trace are complete."""
        self.child.terminate()
        code = self.child.wait(60)
        end = f"{self.child.pid} +++ exited"
        for _ in range(300 if self.log else 0):
            if end in self.log.read_text("latin-1")[-20000:]:
                break
            time.sleep(0.1)
        return code


def check_for_marks(data):
    marks = (str(seeds_escaping.MARK_NUMBER), seeds_escaping.MARK_TEXT)
    if any(mark.encode() in data for mark in marks):
        raise Failure(f"content from outside the data root was returned: {data[:300]!r}")


def no_constant(name):
    raise Failure(f"JSON holds {name}")


def judged(status, headers, data):
    """The JSON of a successful answer. Raises Refused or Failure."""
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
    """Checks that every number is finite; null may represent a missing value."""
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
        raise Failure(f"a picture of type {headers['Content-Type']} that starts with {data[:8]!r}")


def check_probe(daemon, dataset, about):
    def middle(axis):
        places = (about["axes"].get(axis) or {}).get("coordinates") or [0]
        return places[len(places) // 2] or 0
    at = "&".join(f"{axis}={min(max(middle(axis), -1e30), 1e30)!r}" for axis in "xyz")
    try:
        probe = daemon.json("GET", f"/v1/datasets/{dataset}/probe?{at}")
    except Refused as reason:
        # some columns have positions that no axis contains
        if "outside the box of the data" in str(reason):
            return
        raise
    check_numbers(probe, "probe")
    # Derived fields, and converted vectors with a component "w(omega)", only if they were drawn.
    stored = {field["name"] for field in about["fields"] if field["dtype"] != "derived"
              and not any("(" in component for component in field["components"])}
    listed = {field["name"] for field in about["fields"]}
    if not stored <= set(probe["values"]) <= listed:
        raise Failure(f"a probe of {sorted(probe['values'])}, not {sorted(stored)}")


def check_histogram(daemon, dataset, about):
    name = about["fields"][-1]["name"]
    quoted = urllib.parse.quote(name, safe="")
    made = daemon.json("GET", f"/v1/datasets/{dataset}/fields/{quoted}/histogram?bins=8")
    check_numbers(made, "histogram")
    counted = sum(made["counts"]) + made["below"] + made["above"]
    if counted + made["masked"] != math.prod(about["dims"].values()):
        raise Failure(f"a histogram of {counted} and {made['masked']} masked")


def open_dataset(daemon, path):
    """Opens a file; returns the dataset's id. Raises Refused or Failure."""
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
    """Loads all steps. Raises Refused if any of them does not load, or Failure."""
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


def plain(reason):
    """A reason without the parts that depend on the file."""
    return re.sub(r"-?\d+(\.\d+)?(e[+-]?\d+)?", "N", re.sub(r"'[^']*'", "'...'", reason))[:150]


def check_controls(daemon, root, outside):
    """Verifies with copies inside the data root that the content of outside files would be
    recognised."""
    for name in ("mark.vti", "mark.dx", "mark.h5"):
        shutil.copy(outside / name, root / name)
        try:
            try_file(daemon, name)
        except (Failure, Refused) as outcome:
            if "was returned" not in str(outcome):
                sys.exit(f"checked_daemon: {name} is not recognised: {outcome}")
        else:
            sys.exit(f"checked_daemon: {name} is not recognised")
        (root / name).unlink()
