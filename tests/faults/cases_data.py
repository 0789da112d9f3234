"""Hostile files, names that lead outside the data root, files that change while being read, and
insufficient memory."""
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

from support import (MIB, PATIENCE_S, ROOT, SAMPLE, Untried, ask, case, check_good, need, picture,
                     wait_for)

MUTATE = ROOT / "tests/fuzz/mutate_files.py"
CGROUPS = pathlib.Path("/sys/fs/cgroup")


def mutate(world, count, *more):
    done = subprocess.run([sys.executable, str(MUTATE), "--program", world.program, "--count",
                           str(count), *more], capture_output=True, text=True, check=False,
                          cwd=ROOT, env=dict(os.environ, PYTHONDONTWRITEBYTECODE="1"))
    last = re.findall(r"^.*: (\d+) failures.*$", done.stdout, re.MULTILINE)
    need(done.returncode == 0 and last == ["0"], f"{done.stdout[-300:]} {done.stderr[-200:]}")
    return re.findall(r"^\d+ seeds of \d+ formats", done.stdout, re.MULTILINE)[0]


@case("hostile data files", 2000, 60)
def hostile(world, count):
    if world.quick:
        raise Untried("the test files.spoiled does it in quick rounds")
    return mutate(world, count) + "; the daemon lived, no file outside was opened"


@case("hostile data files, every call watched by strace", 600, 20)
def hostile_watched(world, count):
    if not shutil.which("strace"):
        raise Untried("strace is not installed: opens and sockets of loaders were not watched")
    if world.quick:
        raise Untried("the seeds take too long under strace for a quick round")
    return mutate(world, count, "--strace") + "; no loader opened a file by name or made a socket"


def synth(world, path, dims="16x16x16", steps=3):
    subprocess.run([world.program, "synth", "tornado", "--dims", dims, "--steps", str(steps), "-o",
                    path], check=True, capture_output=True)


@case("names of datasets that refer to other locations", 200, 40)
def names(world, count):
    folder = world.new_folder()
    root, outside = folder / "root", folder / "outside"
    root.mkdir()
    outside.mkdir()
    synth(world, outside / "canary.nc")
    synth(world, root / "good.nc")
    (root / "link.nc").symlink_to(outside / "canary.nc")
    (root / "folder").symlink_to(outside)
    (root / "fifo.nc").unlink(missing_ok=True)
    os.mkfifo(root / "fifo.nc")
    canary = (outside / "canary.nc").stat()
    wrong = ["../outside/canary.nc", "good.nc/../../outside/canary.nc", str(outside / "canary.nc"),
             "link.nc", "folder/canary.nc", "http://127.0.0.1/canary.nc", "file:///etc/passwd",
             "good.nc#mode=bytes", "http://127.0.0.1:1/x#mode=dap2", "s3://bucket/x", "/dev/zero",
             "fifo.nc", "", ".", "..", "a" * 5000, "good.nc\0.png", "~/x.nc", "//etc/passwd",
             "dods://127.0.0.1/x", "*.nc/../../outside/*", "/proc/self/mem", "-o"]
    daemon = world.start("--data-root", str(root), SAMPLE)
    at_once = by_job = 0
    for n in range(count):
        name = wrong[n % len(wrong)]
        got = ask(daemon.port, "POST", "/v1/datasets", {"path": name})
        if got.status == 202:
            job = wait_for(lambda: finished(daemon.port, got.headers["location"]), PATIENCE_S,
                           f"the job for {name[:60]} does not end")
            need(job["state"] == "failed", f"{name[:60]} was opened: {job}")
            by_job += 1
        else:
            need(400 <= got.status < 500, f"{name[:60]} is answered by {got.status}")
            at_once += 1
    now = (outside / "canary.nc").stat()
    need(now.st_atime_ns == canary.st_atime_ns, "the file outside was read")
    got = ask(daemon.port, "POST", "/v1/datasets", {"path": "good.nc"})
    job = wait_for(lambda: finished(daemon.port, got.headers["location"]), PATIENCE_S, "no job")
    need(job["state"] == "done", f"a valid file is refused: {job}")
    for target in ("/v1/datasets/../../etc/passwd", "/v1/datasets/%2e%2e%2f%2e%2e",
                   "/../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/..%5c..%5cetc"):
        got = ask(daemon.port, "GET", target)
        need(got.status in (400, 404), f"{target} is answered by {got.status}")
    return f"{at_once} refused at once, {by_job} by a failed job; the file outside was not read"


def finished(port, location):
    job = json.loads(ask(port, "GET", location).body)
    return job if job["state"] in ("done", "failed", "cancelled") else None


@case("files truncated or replaced while loaded", 30, 6)
def changing(world, count):
    folder = world.new_folder()
    path, whole = folder / "wind.nc", folder / "whole.nc"
    synth(world, whole, steps=4)
    data = whole.read_bytes()
    path.write_bytes(data)
    daemon = world.start(str(path))
    need(picture(daemon.port, "wind").status == 200, "no picture of the file")
    old = 0
    for n in range(count):
        how = n % 5
        if how == 0:
            os.truncate(path, len(data) // 2)
        elif how == 1:
            os.truncate(path, 0)
        elif how == 2:
            (folder / "other").write_bytes(os.urandom(4000))
            os.replace(folder / "other", path)
        elif how == 3:
            path.unlink()
        else:
            with open(path, "r+b") as file:  # in place, while it is being read
                file.seek(len(data) // 3)
                file.write(os.urandom(len(data) // 3))
        # A step that is resident, and one that may have to be read.
        for step in (0, 1 + n % 3):
            got = ask(daemon.port, "GET", f"/v1/datasets/wind/frame.jpg?width=64&height=48"
                      f"&azimuth={n}&step={step}")
            need(got.status == 200 or 400 <= got.status < 500 or got.status in (500, 503),
                 f"answered by {got.status}")
            old += got.status == 200
        need(daemon.alive(), f"the daemon exited: {daemon.child.returncode}")
        path.unlink(missing_ok=True)
        path.write_bytes(data)
        wait_for(lambda: picture(daemon.port, "wind").status == 200, PATIENCE_S,
                 "the file is complete again but is not rendered")
    need(old > 0, "the old data were never rendered")
    return f"{old} of {2 * count} pictures from what was loaded, the others an error; no SIGBUS"


# --- memory --------------------------------------------------------------------------------------

@case("more data than --memory-limit", 40, 8)
def little_memory(world, count):
    # Boxes of a tornado can be read without the whole, which an electric field has to be.
    daemon = world.start("--memory-limit", "192M", "efield:200x200x200", "tornado:200x200x200",
                         "tornado:170x170x170", SAMPLE)
    listed = ask(daemon.port, "GET", "/v1/datasets").body
    need(b"'E' needs 91.6 MiB" in listed, "no reason for the refusal at startup")
    for n in range(count):
        got = picture(daemon.port, "tornado:200x200x200", azimuth=n)
        need(got.status == 507 and b"the field needs 91.6 MiB" in got.body,
             f"a field that can only be probed, answered by {got.status}: {got.body[:100]!r}")
        got = picture(daemon.port, "efield:200x200x200", azimuth=n)
        need(got.status == 404 and b"could not be opened" in got.body,
             f"refused at the start, answered by {got.status}: {got.body[:100]!r}")
        got = picture(daemon.port, "tornado:170x170x170", (512, 512), azimuth=n)
        need(got.status == 507, f"answered by {got.status}: {got.body[:100]!r}")
        need(b"need 75.0 MiB" in got.body, f"the required memory is missing: {got.body[:200]!r}")
        need(picture(daemon.port, SAMPLE, azimuth=n).status == 200, "a small one is refused too")
    return "refused at startup or 507; a small dataset is still rendered"


@case("limited address space (ulimit -v)", 10, 3)
def little_space(world, count):
    probe = world.start(SAMPLE)
    check_good(probe.port)
    with open(f"/proc/{probe.pid}/status", encoding="ascii") as status:
        needs = 1024 * int(re.search(r"VmPeak:\s+(\d+)", status.read())[1])
    probe.stop()
    if needs > 1 << 40:
        raise Untried("a build with sanitizers: it reserves terabytes of addresses, so no limit "
                      "was tried")
    limit = needs + 192 * MIB

    def prepare():
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    refused = 0
    daemon = world.start("tornado:400x400x400", SAMPLE, prepare=prepare)
    for n in range(count):
        got = picture(daemon.port, "tornado:400x400x400", azimuth=n)
        refused += got.status in (500, 503, 507)
        need(got.status in (200, 500, 503, 507), f"answered by {got.status}")
        check_good(daemon.port)
    need(refused > 0, "nothing was tested: there was memory for everything")
    need(daemon.stop() == 0, "it did not end with 0")
    return f"{refused} of {count} refused by 507 or 503, good ones between; ends with 0"


@case("limited memory (cgroup)", 10, 2)
def little_cgroup(world, count):
    """The kernel kills the loader or reclaims pages; if the daemon itself exceeds the group's
    limit it is killed, as intended, so the sizes used here leave room for it."""
    group = CGROUPS / f"windsplat-faults-{os.getpid()}"
    if "memory" not in read_or_nothing(CGROUPS / "cgroup.subtree_control"):
        raise Untried("no cgroup with a memory controller can be made here: none was tried")
    try:
        group.mkdir()
        (group / "memory.max").write_text(str(300 * MIB))
    except OSError as fault:
        raise Untried(f"no cgroup can be made here ({fault}): none was tried") from fault
    try:
        daemon = world.start("--memory-limit", "200M", "tornado:180x180x180", SAMPLE,
                             prepare=lambda: (group / "cgroup.procs").write_text(str(os.getpid())))
        for n in range(count):
            got = picture(daemon.port, "tornado:180x180x180", (512, 512), azimuth=n)
            need(got.status in (200, 503, 507), f"answered by {got.status}")
            check_good(daemon.port)
        need(daemon.stop(signal.SIGTERM) == 0, "it did not end with 0")
    finally:
        world.end_case()
        time.sleep(0.1)
        group.rmdir()
    return "507 or drawn; the kernel killed no process"


def read_or_nothing(path):
    try:
        return path.read_text()
    except OSError:
        return ""
