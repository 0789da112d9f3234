#!/usr/bin/env python3
"""Three attacks that once succeeded through libraries of windsplat, against a real daemon: a long
chunked trailer, HDF5 files that refer to other files, and paths that are URLs.

    tests/edge/attacks.py                          # all three
    tests/edge/attacks.py --attack=url_paths       # or chunked_trailer, external_files
    tests/edge/attacks.py --strace=no              # canaries alone (a socket that listens, files)

No other file may be opened and no connection made: a socket listens at the addresses, inotify
watches the files, and strace, if it works, records every call of the daemon and its loaders.
Exit code 0: every attack failed."""
import argparse
import json
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "fuzz"))
import checked_daemon  # noqa: E402
import hdf5_bytes  # noqa: E402
import seeds_escaping  # noqa: E402
import strace_log  # noqa: E402
from checked_daemon import Failure, Refused  # noqa: E402
from seed_numbers import DIMS, floats, numbers  # noqa: E402
from suite import KIB, Watched, parser_of, require  # noqa: E402
from wire_client import Closed, Connection, Target, WebSocket, request  # noqa: E402

TRAILER_BYTES = 66 * 1024
ROUNDS = 50


class Canary(threading.Thread):
    """Listens on loopback and counts connections."""

    def __init__(self):
        super().__init__(daemon=True)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.visitors = 0
        self.came = threading.Event()
        self.start()

    def run(self):
        while True:
            visitor, _ = self.listener.accept()
            self.visitors += 1
            self.came.set()
            visitor.close()

    def check_itself(self):
        socket.create_connection(("127.0.0.1", self.port)).close()
        require(self.came.wait(5), "the canary does not accept connections")
        self.visitors = 0


def strace_works():
    try:
        done = subprocess.run(["strace", "-o", "/dev/null", "true"], stderr=subprocess.DEVNULL)
    except FileNotFoundError:
        return False
    return done.returncode == 0


class Scene:
    """A daemon with a data root, files outside of it that must not be opened, and canaries."""

    def __init__(self, options, folder):
        self.folder, self.root, self.outside = folder, folder / "root", folder / "outside"
        self.root.mkdir()
        seeds_escaping.write_outside(self.outside)
        self.watch = checked_daemon.Watch(self.outside)
        (self.outside / "mark.txt").read_bytes()
        require(self.watch.seen(), "inotify sees nothing here")
        self.canary = Canary()
        self.canary.check_itself()
        self.program = options.program
        self.straced = options.strace == "yes" or (options.strace == "auto" and strace_works())
        started = argparse.Namespace(program=options.program, strace=self.straced, patience=60)
        self.daemon = checked_daemon.Daemon(started, self.root, folder)
        # Verifies that a disclosure of the outside files would be detected.
        checked_daemon.check_controls(self.daemon, self.root, self.outside)
        self.watch.seen()
        self.watch.names.clear()

    def refuse(self, path):
        """Posts a path that must not load; returns the reason."""
        try:
            checked_daemon.try_file(self.daemon, path)
        except Refused as reason:
            return str(reason)
        raise Failure(f"{path} was loaded")

    def end(self):
        """Raises Failure if anything outside was accessed; returns how access was watched."""
        self.daemon.vitals()
        code = self.daemon.stop()
        require(code == 0, f"the daemon exited with {code}")
        require(not self.watch.seen(), f"outside files opened: {dict(self.watch.names)}")
        require(self.canary.visitors == 0, f"{self.canary.visitors} connections were made")
        if not self.straced:
            return "canaries only, without strace"
        judge = strace_log.Judge([self.root, self.folder / "tmp"], self.outside,
                                 checked_daemon.LIBRARIES, pathlib.Path(self.program).resolve())
        judge.read(self.daemon.log)
        judge.report()
        require(not judge.faults, f"strace: {judge.faults[:5]}")
        return (f"strace saw {judge.counts['loaders confined']} confined loaders open no file and "
                "make no connection")


def chunked_trailer(options, _folder):
    """66 kB of trailer, of trailers and of chunk extensions, repeatedly: 501, closed, and at
    most a megabyte of memory growth at any time."""
    daemon = Watched(options)
    for _ in range(3):
        daemon.check_good_client()
    before = daemon.resident()
    daemon.forget_peak()
    letters = b"a" * TRAILER_BYTES
    bodies = {"trailer": b"0\r\nX: " + letters + b"\r\n\r\n",
              "trailers": b"0\r\n" + b"X: y\r\n" * (TRAILER_BYTES // 6) + b"\r\n",
              "extension": b"1;" + letters + b"\r\nx\r\n0\r\n\r\n"}
    head = (f"POST {daemon.target.base}v1/frames HTTP/1.1\r\nHost: {daemon.target.authority()}\r\n"
            f"{daemon.target.authorization()}Transfer-Encoding: chunked\r\n\r\n").encode()
    for _ in range(ROUNDS):
        for name, body in bodies.items():
            with Connection(daemon.target) as connection:
                connection.raw_or_lost(head + body)
                answer = connection.answer()
                require(answer.status == 501, f"{name}: {answer.status}")
                require(connection.ended(), f"{name}: stays open")
    peak = daemon.peak() - before
    require(not daemon.growth_max or peak <= daemon.growth_max, f"{peak / KIB:.0f} KiB more")
    daemon.check_good_client()
    require(daemon.stop() == 0, "the daemon did not exit with 0")
    return f"{ROUNDS * len(bodies)} attacks, each 501 and closed; at most {peak / KIB:.0f} KiB more"


def external_files(options, folder):
    """External links, external storage and virtual datasets, by relative, absolute and doubled
    paths and by links, under the names of both formats that use HDF5."""
    scene = Scene(options, folder)
    tried, refused = 0, 0
    for seed in seeds_escaping.escape_seeds(scene.outside):
        if seed.kind != "hdf5":
            continue
        for ending in ("h5", "nc"):
            tried += 1
            place = scene.root / f"case{tried}"
            renamed = {name.replace(".h5", "." + ending): data for name, data in
                       seed.files.items()}
            path = seed.path.replace(".h5", "." + ending)
            links = {(name if name.startswith("link_") else name.replace(".h5", "." + ending)): to
                     for name, to in seed.links.items()}
            try:  # data in the file itself may be shown
                checked_daemon.try_file(scene.daemon, checked_daemon.write_case(
                    place, path, renamed, links))
            except Refused:
                refused += 1
    require(tried >= 32 and refused >= 8, f"{tried} tried, {refused} refused")
    return f"{tried} files, {refused} refused, of the others nothing outside; {scene.end()}"


def addresses(port, outside):
    host = f"127.0.0.1:{port}"
    yield from (f"http://{host}/a.nc", f"https://{host}/a.nc", f"HTTP://{host}/a.nc",
                f"dods://{host}/a", f"dap4://{host}/a", f"s3://{host}/a.nc", f"ftp://{host}/a.nc",
                f"http://{host}/a.nc#mode=bytes", f"http://{host}/a.nc#mode=dap4",
                f"http://{host}/a.zarr#mode=zarr,s3", f"[dap4]http://{host}/a",
                f"[mode=bytes]http://{host}/a.nc", f"http://{host}/*.nc", f"x/http://{host}/a.nc",
                f"file://{outside}/mark.h5", f"file://{outside}/mark.h5#mode=bytes")


def near_addresses(port):
    """Strings that the netCDF library treats as URLs, or names of files."""
    host = f"127.0.0.1:{port}"
    yield from (f"http:{host}/a.nc", f"http:/{host}/a.nc", f"//{host}/a.nc", f"\\\\{host}\\a.nc",
                "good.h5#mode=bytes", "good.h5#mode=zarr,file", "good.h5#mode=dap4",
                "good.h5#mode=nczarr,s3", "[mode=bytes]good.h5", "good.h5#bytes", "good.h5?x")


def ways_out(outside):
    name = outside.name
    yield from (f"../{name}/mark.h5", f"./../{name}/mark.h5", f"deep/../../{name}/mark.h5",
                f"{outside}/mark.h5", f"//{outside}/mark.h5", f"%2e%2e/{name}/mark.h5",
                f"..%2f{name}/mark.h5", "link.h5", "absolute.h5", "folder/mark.h5", "l*.h5",
                f"../{name}/*.h5", "folder/*.h5", "link.h5#/u", "/proc/self/environ",
                "/proc/self/root/etc/passwd", "self/environ", f"good.h5/../../{name}/mark.h5")


def run_command(scene, command, path):
    """The command line must refuse a URL in place of a file, with a reason."""
    more = ["--listen", "127.0.0.1:0"] if command == "serve" else []
    more += ["-o", str(scene.folder / "out.png")] if command == "render" else []
    done = subprocess.run([scene.program, command, path, *more], capture_output=True, text=True,
                          timeout=60)
    require(done.returncode in (1, 2, 3), f"{command} {path}: exit code {done.returncode}")
    require(not done.stdout, f"{command} {path} said {done.stdout!r}")
    require("://" not in path or "URL" in done.stderr, f"{command} {path}: {done.stderr}")


def names_over_http(scene, path):
    """As the name of a dataset it is reported as unknown."""
    target = Target("127.0.0.1", scene.daemon.port)
    body = json.dumps({"dataset": path, "image": {"width": 16, "height": 12}}).encode()
    answer = request(target, "POST", "v1/frames", {"Content-Type": "application/json"}, body)
    require(answer.status in (404, 422), f"a frame of {path}: {answer.status}")
    with WebSocket(target) as viewer:
        viewer.say({"type": "open", "id": 3, "dataset": path})
        require(viewer.text("error")["id"] == 3, f"the stream opened {path}")


def url_paths(options, folder):
    """URLs, `#mode=` and paths out of the data root: by POST, as names, on the command line."""
    scene = Scene(options, folder)
    file = hdf5_bytes.File()
    file.add("u", DIMS[::-1], floats(numbers(0)))
    (scene.root / "good.h5").write_bytes(file.bytes())
    (scene.root / "deep").mkdir()
    (scene.root / "link.h5").symlink_to("../outside/mark.h5")
    (scene.root / "absolute.h5").symlink_to(scene.outside / "mark.h5")
    (scene.root / "folder").symlink_to("../outside")
    (scene.root / "self").symlink_to("/proc/self")
    checked_daemon.try_file(scene.daemon, "good.h5")
    urls = list(addresses(scene.canary.port, scene.outside))
    near, out = list(near_addresses(scene.canary.port)), list(ways_out(scene.outside))
    for path in urls:
        require("is a URL" in scene.refuse(path), f"{path}: {scene.refuse(path)}")
    for path in near + out:
        scene.refuse(path)
    for path in urls[:8]:
        names_over_http(scene, path)
    commands = 0
    for path in urls + near[:4]:
        for command in ("serve", "inspect", "render"):
            run_command(scene, command, path)
            commands += 1
    checked_daemon.try_file(scene.daemon, "good.h5")
    return (f"{len(urls)} addresses, {len(near)} that look like some and {len(out)} ways out, each "
            f"refused; {commands} commands that failed; {scene.end()}")


ATTACKS = {attack.__name__: attack for attack in (chunked_trailer, external_files, url_paths)}


def main():
    parser = parser_of(__doc__.splitlines()[0])
    parser.add_argument("--attack", choices=ATTACKS, action="append")
    parser.add_argument("--strace", choices=("auto", "yes", "no"), default="auto")
    options = parser.parse_args()
    failed = 0
    for name in options.attack or ATTACKS:
        with tempfile.TemporaryDirectory(prefix="windsplat-attack-") as folder:
            try:
                print(f"{name}: {ATTACKS[name](options, pathlib.Path(folder).resolve())}")
            except (AssertionError, Failure, Refused, Closed, OSError, RuntimeError) as fault:
                failed += 1
                print(f"FAILED {name}: {type(fault).__name__}: {fault}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
