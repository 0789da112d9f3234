"""Failures of the system: memory, sockets, files, disk, descriptors; and a clock that jumps."""
import json
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import sys
import threading
import time

from shim import Shim
from support import (PATIENCE_S, SAMPLE, Stream, Untried, ask, case, check_good,
                     check_good_stream, cpu_s, is_sanitized, metric, need, small_view, wait_for)

HERE = pathlib.Path(__file__).parent
FAKETIME = "/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1"


def shim_of(world):
    return pathlib.Path(world.program).resolve().parent / "tests/libfaults_shim.so"


def inject(world, count, *kinds, phases=("serve", "guarded")):
    """That many rounds of each kind; inject.py runs the complete sweep."""
    if not shim_of(world).exists():
        raise Untried(f"{shim_of(world)} is not built (sanitizers have their own allocator): no "
                      f"{', '.join(kinds)} was made to fail")
    if world.quick:
        raise Untried("not in a quick round: inject.py --quick is a test of its own")
    words = [word for kind in kinds for word in ("--kind", kind)]
    words += [word for phase in phases for word in ("--phase", phase)]
    done = subprocess.run([sys.executable, str(HERE / "inject.py"), "--program", world.program,
                           "--count", str(count), "--seconds", "600", "--slack",
                           str(world.slack), *words],
                          capture_output=True, text=True, check=False)
    need(done.returncode == 0, done.stdout[-400:] + done.stderr[-200:])
    rows = re.findall(r"^\| \w+ \| \w+ \| [\d-]+ \| (\d+) \(.*?\) \| (\d+) ", done.stdout,
                      re.MULTILINE)
    need(rows, f"no result of inject.py: {done.stdout[-200:]}")
    places, calls = (sum(int(row[n]) for row in rows) for n in (0, 1))
    return f"{calls} calls failed at {places} call sites; others were not affected"


@case("malloc that fails", 200, 3)
def no_malloc(world, count):
    return inject(world, count, "malloc", "mmap")


@case("send, recv and accept that fail", 100, 3)
def no_sockets(world, count):
    return inject(world, count, "send", "recv", "accept", "socket")


@case("read, write, fsync and open that fail", 100, 3)
def no_files(world, count):
    return inject(world, count, "read", "write", "fsync", "open")


@case("threads that cannot be created at startup", 10, 3)
def no_threads(world, count):
    return inject(world, count, "thread", phases=["start"])


@case("random numbers that are unavailable", 50, 3)
def no_random(world, count):
    return inject(world, count, "random")


@case("a disk that is full", 60, 12)
def full_disk(world, count):
    if os.geteuid() != 0:
        raise Untried("a small tmpfs needs root: a full disk was not tried "
                      "(inject.py's ENOSPC was)")
    folder = world.new_folder()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=128k", "none", folder],
                      capture_output=True, check=False).returncode != 0:
        raise Untried("no tmpfs can be mounted here: a full disk was not tried")
    try:
        daemon = world.start("--state-dir", str(folder), SAMPLE)
        saved = []
        view = {"dataset": SAMPLE, "scalars": [{"field": "cloud"}] * 4}
        while len(saved) < 1000:
            got = ask(daemon.port, "POST", "/v1/views", view)
            if got.status != 201:
                break
            saved.append(json.loads(got.body)["id"])
        need(got.status == 507, f"a full disk is answered by {got.status}")
        for n in range(count):
            got = ask(daemon.port, "POST", "/v1/views", view)
            need(got.status == 507, f"a full disk is answered by {got.status}")
            need(ask(daemon.port, "GET", f"/v1/views/{saved[n % len(saved)]}").status == 200,
                 "a saved view is lost")
            check_good(daemon.port)
        need(ask(daemon.port, "DELETE", f"/v1/views/{saved.pop()}").status == 204, "cannot delete")
        need(ask(daemon.port, "POST", "/v1/views", view).status == 201, "no room after a deletion")
        need(not list(folder.rglob("*.part")), "an incomplete file was left")
        need(daemon.stop() == 0, "it did not end with 0")
        again = world.start("--state-dir", str(folder), SAMPLE)
        for name in saved:
            need(ask(again.port, "GET", f"/v1/views/{name}").status == 200, "a saved view is lost")
        again.stop()
    finally:
        world.end_case()
        subprocess.run(["umount", folder], check=True)
    return f"507 each time, {len(saved)} views before stay, saved again once there is room"


def through_jumps(daemon, jump, count):
    with Stream(daemon.port) as one:
        for n in range(count):
            jump((-1) ** n * (10 ** (n % 9)))
            since = time.monotonic()
            one.final_frame(small_view(turn=0.01 * n))
            check_good(daemon.port)
            need(time.monotonic() - since < PATIENCE_S / 2, "a jump of the clock delays it")
        jump(0)
    need(metric(daemon.port, "windsplat_sessions") <= 1, "the number of sessions is wrong")
    check_good_stream(daemon.port)


@case("a state folder that becomes read-only", 10, 2)
def read_only_state(world, count):
    if os.geteuid() != 0:
        raise Untried("mounting a disk read-only needs root")
    folder = world.new_folder()
    if subprocess.run(["mount", "-t", "tmpfs", "none", folder], capture_output=True,
                      check=False).returncode != 0:
        raise Untried("no tmpfs can be mounted here")

    def remount(how):
        subprocess.run(["mount", "-o", f"remount,{how}", folder], check=True)

    def refused(daemon, name):
        view = {"dataset": SAMPLE}
        for method, path, body in (("POST", "", view), ("PUT", f"/{name}", view),
                                   ("DELETE", f"/{name}", None)):
            got = ask(daemon.port, method, f"/v1/views{path}", body)
            need(got.status == 507 and b"Read-only" in got.body, f"{method}: {got.status}")
        need(ask(daemon.port, "GET", f"/v1/views/{name}").status == 200, "the view is lost")

    try:
        for _ in range(count):
            daemon = world.start("--state-dir", str(folder), SAMPLE)
            name = json.loads(ask(daemon.port, "POST", "/v1/views", {}).body)["id"]
            remount("ro")
            refused(daemon, name)
            need(daemon.stop() == 0, "it did not end with 0")
            again = world.start("--state-dir", str(folder), SAMPLE)
            refused(again, name)
            remount("rw")
            need(ask(again.port, "DELETE", f"/v1/views/{name}").status == 204, "cannot delete")
            need(again.stop() == 0, "it did not end with 0")
    finally:
        subprocess.run(["umount", "-l", folder], check=False)
    return "507 with the reason; it starts on such a folder and serves its views"


@case("a clock that jumps", 40, 8)
def clock(world, count):
    shim = Shim(shim_of(world), world.new_folder())
    daemon = shim.start(world.program, SAMPLE)
    world.started.append(daemon)
    through_jumps(daemon, shim.jump, count)
    days = {line[:10] for line in daemon.lines}
    need(len(days) > 1, "nothing was tested: the log shows no jump")
    need(daemon.stop() == 0, "it did not end with 0")
    return f"by up to {10 ** min(count - 1, 8)} s both ways; streams and requests continue"


@case("a clock that jumps, by faketime", 20, 4)
def faked_clock(world, count):
    if not pathlib.Path(FAKETIME).exists():
        raise Untried("faketime is not installed: a clock jump with it was not tried")
    if is_sanitized(world.program):
        raise Untried("a build with sanitizers: faketime cannot be preloaded into it")
    file = world.new_folder() / "time"
    file.write_text("+0\n")
    daemon = world.start(SAMPLE, env=dict(
        os.environ, LD_PRELOAD=FAKETIME, FAKETIME_TIMESTAMP_FILE=str(file), FAKETIME_NO_CACHE="1",
        FAKETIME_DONT_FAKE_MONOTONIC="1", DONT_FAKE_MONOTONIC="1"))

    def jump(seconds):
        (file.parent / "next").write_text(f"{seconds:+d}\n")
        os.replace(file.parent / "next", file)
    through_jumps(daemon, jump, count)
    need(daemon.stop() == 0, "it did not end with 0")
    return "streams and requests continue"


@case("no file descriptors left", 200, 60)
def no_descriptors(world, count):
    """More connections than descriptors; the listening socket must not be polled in a loop."""
    limit = 40
    if is_sanitized(world.program):
        raise Untried("a build with sanitizers: UBSan tests through a pipe whether memory is "
                      "readable, and reports it as invalid if no descriptor is available")

    def prepare():
        resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit))
    daemon = world.start(SAMPLE, prepare=prepare)
    check_good(daemon.port)
    held = [socket.create_connection(("127.0.0.1", daemon.port)) for _ in range(max(count, limit))]
    time.sleep(0.5)
    used, since = cpu_s(daemon.pid), time.monotonic()
    time.sleep(1.5)
    share = (cpu_s(daemon.pid) - used) / (time.monotonic() - since)
    need(share < 0.2, f"it takes {100 * share:.0f} % of a processor while it cannot accept")
    for one in held:
        one.close()
    wait_for(lambda: answers(daemon.port), PATIENCE_S, "no answer once descriptors are free")
    failures = metric(daemon.port, "windsplat_accept_failures_total")
    need(failures > 0 and "cannot accept" in daemon.log(), "the lack of descriptors did not occur")
    need(failures < 200, f"{failures:.0f} attempts: it does not back off")
    check_good_stream(daemon.port)
    need(daemon.stop() == 0, "it did not end with 0")
    return f"{failures:.0f} attempts, {100 * share:.1f} % of a processor; then it continues"


def answers(port):
    try:
        return ask(port, "GET", "/livez", timeout=2).status == 200
    except OSError:
        return False


@case("a loader that is killed", 30, 6)
def killed_loader(world, count):
    folder = world.new_folder()
    subprocess.run([world.program, "synth", "tornado", "--dims", "48x48x48", "--steps", "40", "-o",
                    folder / "wind.nc"], check=True, capture_output=True)
    daemon = world.start(str(folder / "wind.nc"), "--memory-limit", "300M")
    target = "/v1/datasets/wind/frame.jpg?width=32&height=24&step="
    killed = failed = 0
    for n in range(count):
        for child in children(daemon.pid):
            try:
                os.kill(child, signal.SIGKILL)
                killed += 1
            except ProcessLookupError:
                continue
        got = ask(daemon.port, "GET", f"{target}{n % 40}")
        need(got.status in (200, 409, 422, 500, 503), f"answered by {got.status}")
        failed += got.status != 200
    need(killed > 0, "no loader was running when it was to be killed")
    wait_for(lambda: ask(daemon.port, "GET", f"{target}39").status == 200, PATIENCE_S,
             "the file is no longer rendered")
    zombies = [c for c in children(daemon.pid) if state_of(c) == "Z"]
    need(len(zombies) <= 1, f"{len(zombies)} zombies")
    return f"{killed} killed, {failed} requests failed; the file is read again"


@case("a loader that is stopped", 3, 1)
def stopped_loader(world, count):
    """The loader is stopped by SIGSTOP, as during playback; other datasets are served meanwhile."""
    folder = world.new_folder()
    for name in ("wind", "other"):
        subprocess.run([world.program, "synth", "tornado", "--dims", "32x32x32", "--steps", "12",
                        "-o", folder / f"{name}.nc"], check=True, capture_output=True)
    daemon = world.start(str(folder / "wind.nc"), str(folder / "other.nc"))

    def step(dataset, n):
        return ask(daemon.port, "GET",
                   f"/v1/datasets/{dataset}/frame.jpg?width=32&height=24&step={n}")
    longest = 0.0
    for n in range(0, 3 * count, 3):
        wait_for(lambda: not children(daemon.pid), PATIENCE_S, "idle loaders do not end")
        need(step("wind", n).status == 200, "the file is not drawn")
        stopped = children(daemon.pid)[0]
        os.kill(stopped, signal.SIGSTOP)
        answers = []
        began = time.monotonic()
        asking = threading.Thread(target=lambda: answers.append(step("wind", n + 1)))
        asking.start()
        for other in range(3):
            need(step("other", n + other).status == 200, "another dataset is blocked")
        need(asking.is_alive(), "the stopped loader answered")
        asking.join()
        longest = max(longest, time.monotonic() - began)
        need(answers[0].status == 422, f"answered by {answers[0].status}")
        need(b"made no progress for 15.0 s" in answers[0].body, f"{answers[0].body[:200]!r}")
        need(state_of(stopped) in ("", "Z"), "the stopped loader still exists")
        need(step("wind", n + 1).status == 200, "no new loader replaces it")
    need(longest < 25, f"it took {longest:.1f} s")
    return f"refused after {longest:.1f} s with the reason, read again by another loader"


def children(pid):
    out = []
    for task in os.listdir(f"/proc/{pid}/task"):
        try:
            text = pathlib.Path(f"/proc/{pid}/task/{task}/children").read_text()
        except (FileNotFoundError, ProcessLookupError):
            continue
        out += [int(word) for word in text.split()]
    return out


def state_of(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return ""
