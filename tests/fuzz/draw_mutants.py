#!/usr/bin/env python3
"""Mutates small datasets whose values are all known, and compares the reports and pictures of two
daemons with them.

    tests/fuzz/draw_mutants.py --first 34 --count 170     # the short form, in ctest
    tests/fuzz/draw_mutants.py --count 10000 --reasons 20
    tests/fuzz/draw_mutants.py --only 1234 --keep found   # one file again, kept in a folder

mutate_files.py changes bytes, and nearly all of its files are refused when they are opened. Here
the mutation changes the dataset (model.py): values, attributes, axes, times, packing, chunk tables
(model_mutations.py). The result is then written as a file of each format (model_writers.py,
model_grib.py), so most files open, and their contents are known without reading them.

Two daemons open every file, with one render thread and with three. The following are compared with
the known values: the range and the count of masked samples of each field, over all steps and at the
last one, the values at some samples, the coordinates of the axes and the dates. Both rendering
methods render the last step; each picture must be finite, within [0, 1], premultiplied, and empty
if all samples are masked. Both daemons must give the same bytes. CPU time per file and peak memory
are bounded.

Needs python3-netcdf4. The files depend on --seed only. Exit code 0: no assertion failed, and at
least half of the files of each format were opened and rendered with both methods.
"""

import argparse
import collections
import concurrent.futures
import io
import json
import os
import pathlib
import re
import sys
import tempfile
import urllib.parse

import cftime
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import model as models  # noqa: E402
import model_mutations  # noqa: E402
import model_writers  # noqa: E402
import mutations_values as formats  # noqa: E402
from checked_daemon import (Daemon, Failure, Refused, check_description, judged,  # noqa: E402
                            open_dataset, plain, write_case)

MEMORY_LIMIT = 512 << 20
CPU_SECONDS_MAX = 20
METHODS = ("kernel", "slab")


class Process:
    """A daemon and its resource usage."""

    def __init__(self, options, root, folder, threads):
        folder.mkdir()
        self.daemon = Daemon(options, root, folder, MEMORY_LIMIT, ["--threads", str(threads)])
        self.cpu = self.cpu_seconds()

    def cpu_seconds(self):
        """CPU time of the daemon and of its ended loaders, in seconds."""
        stat = pathlib.Path(f"/proc/{self.daemon.child.pid}/stat").read_text()
        return sum(map(int, stat.rpartition(")")[2].split()[11:15])) / os.sysconf("SC_CLK_TCK")

    def check_cpu(self):
        before, self.cpu = self.cpu, self.cpu_seconds()
        if self.cpu - before > CPU_SECONDS_MAX:
            raise Failure(f"{self.cpu - before:.1f} s of CPU time")

    def peak_mib(self):
        status = pathlib.Path(f"/proc/{self.daemon.child.pid}/status").read_text()
        return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) / 1024


def expect_near(reported, truth, what):
    """To single precision."""
    if abs(reported - truth) > 4e-7 * abs(truth) + 1e-44:
        raise Failure(f"{what} is {reported!r}, not {truth!r}")


def check_range(reported, masked, values, model, what):
    """values: (component, ...) of the truth. Exact datasets are compared, resampled ones
    bounded."""
    truth, absent = models.range_and_masked(values)
    if model.resampled:
        slack = 1e-5 * max(map(abs, truth or [0])) + 1e-30
        if reported is not None and (truth is None or reported[1] > truth[1] + slack):
            raise Failure(f"{what} reaches {reported}, the file {truth}")
        return
    if masked != absent:
        raise Failure(f"{what}: {masked} masked, not {absent} of {values[0].size}")
    if (reported is None) != (truth is None):
        raise Failure(f"the range of {what} is {reported}, not {truth}")
    if truth is not None:
        for one, other in zip(reported, truth):
            expect_near(one, other, f"the range of {what}, {reported},")


def truths(about, model):
    """(field, truth) of those that the file contains."""
    out = []
    for field in about["fields"]:
        values = model.truth(model.vectors.get(field["name"], field["components"]))
        if values is not None:
            out.append((field, values))
    names = {name for field, _ in out
             for name in model.vectors.get(field["name"], field["components"])}
    if lost := {field.name for field in model.fields} - names:
        raise Failure(f"{sorted(lost)} are not among {[f['name'] for f in about['fields']]}")
    return out


def field_path(dataset, field):
    return f"/v1/datasets/{dataset}/fields/{urllib.parse.quote(field['name'], safe='')}"


def check_values(daemon, dataset, about, model, dice):
    fields = truths(about, model)
    last = model.shape[0] - 1
    for field, values in fields:
        answer = daemon.json("GET", field_path(dataset, field) + "/range?of=all")
        check_range(answer["range"], answer["masked"], values, model, field["name"])
        answer = daemon.json("GET", field_path(dataset, field) + f"/range?of=step&step={last}")
        check_range(answer["range"], answer["masked"], values[:, last], model,
                    f"{field['name']} at the last step")
    if model.placed:
        for _ in range(3):
            check_sample(daemon, dataset, fields, model, dice)


def check_sample(daemon, dataset, fields, model, dice):
    t, z, y, x = (int(dice.integers(n)) for n in model.shape)
    at = urllib.parse.urlencode({a: repr(model.axes[a].values[i].item())
                                 for a, i in zip("xyz", (x, y, z))})
    values = daemon.json("GET", f"/v1/datasets/{dataset}/probe?{at}&step={t}")["values"]
    for field, truth in fields:
        wanted = truth[:, t, z, y, x].astype(float)
        reported = values[field["name"]]["value"]
        if (reported is None) != bool(np.isnan(wanted).any()):
            raise Failure(f"{field['name']} at {at} is {reported}, not {wanted}")
        for one, other in zip(np.atleast_1d(reported) if reported is not None else [], wanted):
            expect_near(one, other, f"{field['name']} at {at}, step {t},")


def check_axes(about, model):
    for a in "xyz":
        reported = (about["axes"].get(a) or {}).get("coordinates")
        truth = np.sort(model.axes[a].values)
        if reported is None or len(reported) != len(truth) or not np.allclose(
                np.sort(reported), truth, rtol=1e-6, atol=1e-6 * (truth[-1] - truth[0])):
            raise Failure(f"axis {a} has coordinates {reported}, not {truth.tolist()}")


def check_times(about, model):
    axis = model.axes["t"]
    times = about["steps"]["times"]
    if len(times) != len(axis.values):
        raise Failure(f"{len(times)} steps, not {len(axis.values)}")
    if model.kind in (*formats.STILL, *formats.GRIB, "grads"):
        return
    calendar = axis.attributes.get("calendar", "standard")
    for reported, value in zip(times, axis.values):
        date = cftime.num2date(value, axis.attributes["units"], calendar).isoformat()
        if reported["value"] != value or reported["text"] != date + "Z":
            raise Failure(f"the time {value} is reported as {reported}, not {date}")


def picture(daemon, view):
    status, headers, data = daemon.ask("POST", "/v1/frames", json.dumps(view),
                                       {"Accept": "application/x-npy"})
    if status != 200:
        judged(status, headers, data)
    return data


def view_of(about, step, method, dice):
    """A view from any direction, including from within: every line, however weak, and the last
    scalar as a medium over its whole range."""
    view = {"dataset": about["id"], "step": step, "image": {"width": 64, "height": 48},
            "method": {"name": method, "detail": str(dice.choice(["auto", "full"]))},
            "camera": {"projection": str(dice.choice(["perspective", "orthographic"])),
                       "eye": (dice.choice([0.3, 1, 3]) * dice.uniform(0.3, 1, 3)
                               * dice.choice([-1, 1], 3)).tolist()},
            "geometry": {"mapping": str(dice.choice(about["mappings"]))}}
    if about["defaultView"].get("vector"):
        view["vector"] = {"minMagnitude": 0, "stride": int(dice.integers(1, 3))}
    for field in about["fields"]:
        if field["kind"] == "scalar" and field["range"]:
            low, high = np.clip(field["range"], -9e37, 9e37).tolist()  # limits of the view
            if low == high:
                low, high = low - abs(low) / 2 - 1, high + abs(high) / 2 + 1
            view["scalars"] = [{"field": field["name"], "extinction": [[low, 1], [high, 5]],
                                "color": {"range": [low, high]}}]
    return view


def check_picture(data, method, empty):
    image = np.load(io.BytesIO(data))
    if image.shape != (48, 64, 4) or image.dtype != np.float32:
        raise Failure(f"a picture of {image.shape} {image.dtype}")
    if not np.isfinite(image).all():
        raise Failure(f"{method}: {(~np.isfinite(image)).sum()} channels are not finite")
    if image.min() < 0 or image.max() > 1 + 1e-5:
        raise Failure(f"{method}: a picture from {image.min()} to {image.max()}")
    over = (image[..., :3] - image[..., 3:]).max()
    if over > 1e-5:
        raise Failure(f"{method}: a colour is {over} above its opacity")
    if empty and image.any():
        raise Failure(f"{method}: everything is masked, but something is drawn")
    return image[..., 3].max() > 0


def examine(process, path, model, seed):
    """The reports and pictures of one daemon for a file, to be compared with those of the other,
    and whether any pixel is covered. Raises Refused or Failure."""
    daemon = process.daemon
    dataset = urllib.parse.quote(open_dataset(daemon, path), safe="")
    answers, drawn = [], []
    try:
        about = daemon.json("GET", f"/v1/datasets/{dataset}")
        check_description(about)
        if model.exact or model.resampled:
            check_values(daemon, dataset, about, model, np.random.default_rng(seed))
        if model.placed:
            check_axes(about, model)
        if model.timed:
            check_times(about, model)
        step = about["steps"]["count"] - 1
        empty = model.exact and all(np.isnan(values[:, -1]).all()
                                    for _, values in truths(about, model)) and not any(
            field["dtype"] == "derived" for field in about["fields"])
        for method in METHODS:
            view = view_of(about, step, method, np.random.default_rng(seed))
            if empty:
                view["ground"] = {"show": "off"}
            data = picture(daemon, view)
            drawn.append(check_picture(data, method, empty))
            answers.append(data)
        process.check_cpu()
        # Repeated, because it now includes the ranges of all steps.
        answers.append(daemon.json("GET", f"/v1/datasets/{dataset}"))
    finally:
        daemon.json("DELETE", f"/v1/datasets/{dataset}?forget=true")
    return answers, any(drawn)


class Run:
    def __init__(self, options, processes, root):
        self.options = options
        self.processes = processes
        self.root = root
        self.counts = collections.defaultdict(collections.Counter)
        self.mutations = collections.defaultdict(collections.Counter)
        self.reasons = collections.Counter()
        self.failures = []
        self.pool = concurrent.futures.ThreadPoolExecutor(len(processes))

    def outcome_of(self, path, model, number):
        """Returns refused, drawn or failed, and the reason."""
        asked = [self.pool.submit(examine, process, path, model, number)
                 for process in self.processes]
        results = []
        for future in asked:
            try:
                results.append(future.result())
            except Refused as reason:
                results.append(reason)
            except Failure as fault:
                results.append(fault)
        for result in results:
            if isinstance(result, Failure):
                return "failed", str(result)
        for result in results:
            if isinstance(result, Refused):
                kind = "failed" if model.must_open else "refused"
                return kind, ("a valid file was refused: " if model.must_open else "") + str(result)
        (first, visible), (second, _) = results
        for one, other, what in zip(first, second, (*METHODS, "the description")):
            if one != other:
                return "failed", f"{what} differs between one thread and three"
        return "seen" if visible else "drawn", ""

    def one(self, number):
        model = model_mutations.mutant(self.options.seed, number, self.options.format)
        files, path = model_writers.written(model)
        folder = self.root / f"m{number}"
        for process in self.processes:
            if process.daemon.child.poll() is not None:
                sys.exit(f"draw_mutants: a daemon exited before m{number}: "
                         + "; ".join(self.failures[-3:]))
        outcome, text = self.outcome_of(write_case(folder, path, files, {}), model, number)
        if self.options.keep and (outcome == "failed" or self.options.only is not None):
            write_case(pathlib.Path(self.options.keep) / f"m{number}", path, files, {})
        row = self.counts[model.kind]
        for counts in (row, *(self.mutations[name] for name in model.applied)):
            counts["files"] += 1
            counts[outcome] += 1
        if outcome == "refused":
            self.reasons[f"{model.kind}: {plain(text)}"] += 1
        line = f"m{number} ({model.kind}, {' + '.join(model.applied)}): {text}"
        if outcome == "failed":
            self.failures.append(line)
        if outcome == "failed" or self.options.only is not None:
            print(f"{outcome} {line[:500]}", flush=True)

    def finish(self, process):
        peak = process.peak_mib()
        print(f"a daemon's peak: {peak:.0f} MiB, {process.cpu_seconds():.0f} s of CPU time")
        if peak > self.options.peak_mib:
            self.failures.append(f"a daemon had {peak:.0f} MiB resident")
        if (code := process.daemon.stop()) != 0:
            self.failures.append(f"a daemon exited with {code}")

    def report(self):
        columns = ("files", "seen", "drawn", "refused", "failed")
        heads = ("files", "drawn", "empty", "refused", "failed")
        total = collections.Counter()
        too_few = []
        print(f"\n{'format':24}" + "".join(f"{head:>13}" for head in heads))

        def show(name, row):
            numbers = (row["files"], row["seen"] + row["drawn"], row["drawn"], row["refused"],
                       row["failed"])
            print(f"{name:24}" + "".join(f"{number:13}" for number in numbers))
        for kind, row in sorted(self.counts.items()):
            total.update({column: row[column] for column in columns})
            show(kind, row)
            if 2 * (row["seen"] + row["drawn"]) < row["files"]:
                too_few.append(kind)
        show("all", total)
        if self.options.reasons:
            print(f"\n{'mutation':24}")
            for name, row in sorted(self.mutations.items()):
                show(name, row)
            for text, count in self.reasons.most_common(self.options.reasons):
                print(f"{count:6} {text}")
        return too_few


def parsed_options():
    build = pathlib.Path(__file__).resolve().parents[2] / "build"
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(build / "release/windsplat"))
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="number of the first file")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="number of the only file to test")
    parser.add_argument("--format", help="the only format to test")
    parser.add_argument("--keep", help="folder for failing files")
    parser.add_argument("--patience", type=float, default=90, help="seconds for a call")
    parser.add_argument("--peak-mib", type=float, default=256,
                        help="permitted resident memory of a daemon")
    parser.add_argument("--reasons", type=int, default=0, help="number of reasons to print")
    options = parser.parse_args()
    options.strace = False
    return options


def main():
    options = parsed_options()
    with tempfile.TemporaryDirectory(prefix="windsplat-mutants-") as folder:
        folder = pathlib.Path(folder).resolve()
        (folder / "root").mkdir()
        processes = [Process(options, folder / "root", folder / f"threads-{n}", n) for n in (1, 3)]
        run = Run(options, processes, folder / "root")
        numbers = range(options.first, options.first + options.count)
        try:
            for number in numbers if options.only is None else [options.only]:
                run.one(number)
            for process in processes:
                run.finish(process)
        finally:
            for process in processes:
                process.daemon.child.kill()
    too_few = run.report() if options.only is None else []
    print(f"\nseed {options.seed}: {len(run.failures)} failures")
    for text in run.failures[:50]:
        print("  " + text[:300])
    if too_few:
        print(f"fewer than half of the files were rendered: {', '.join(too_few)}")
    return 1 if run.failures or too_few else 0


if __name__ == "__main__":
    sys.exit(main())
