#!/usr/bin/env python3
"""Compares the program's reports on real files with independent readers.

    scripts/fetch-test-data
    python3 tests/integration/real_files.py --program=build/release/windsplat

Needs python3-netcdf4 and python3-numpy (netCDF, with the library's own masks), and for other
formats only the parsers below: GrADS, OpenDX, legacy VTK, VTK image data as text. For each file
these are compared: the coordinates and units of the axes, and for each field its units, its range
and count of masked samples over the steps that the program read, and single values by the daemon's
probe, at the corners and inside, of the first and the last step. Exits 1 if anything differs.
"""

import argparse
import itertools
import json
import re
import subprocess
import sys
import tempfile
import urllib.parse
import urllib.request
from pathlib import Path

import netCDF4
import numpy as np

TOLERANCE = 1e-6  # precision of float32 and of the shortest decimal text


class Independent:
    """The values of another reader. axes: x, y, z -> coordinates as in the file, or None where
    a grid has no such axis. scalars: name -> masked array (step, z, y, x). vectors: name -> names
    of its components. units: name of a scalar or an axis -> text, if the file contains it. columns:
    arrays (y, x) of longitudes and of latitudes, by which the program finds a column, or None.
    falls: axes of levels that are counted from the top. ground: the name of the variable with the
    height of the ground, "land" or "seaFloor" and its heights in metres; None: not compared."""

    def __init__(self, axes, scalars, vectors, units=None, columns=None, falls=(), ground=None):
        self.axes, self.scalars, self.vectors = axes, scalars, vectors
        self.units = units or {}
        self.columns = columns
        self.falls = falls
        self.ground = ground


def read_netcdf(path, inspected):
    """The axis order of each array follows the names reported by the program; values and masks
    come from the netCDF library."""
    file = netCDF4.Dataset(path)
    names = {a: inspected["axes"][a]["name"] for a in "xyz"}
    hybrid = "hyam" in file.variables
    axes = {}
    for a, name in names.items():
        if name in file.variables and not (hybrid and a == "z"):
            axes[a] = np.asarray(file.variables[name][:], float)
        elif hybrid and a == "z":
            a_p0 = 1e5 * np.asarray(file.variables["hyam"][:], float)
            mean = float(np.mean(np.asarray(file.variables["PS"][0], float)))
            axes[a] = a_p0 + np.asarray(file.variables["hybm"][:], float) * mean
        else:
            axes[a] = np.arange(len(file.dimensions[name])) if name in file.dimensions else None
    scalars = {}
    for field in inspected["fields"]:
        for name in field["components"]:
            if name not in file.variables:
                continue
            variable = file.variables[name]
            order = [variable.dimensions.index(names[a]) for a in "zyx" if axes[a] is not None]
            rest = [d for d in range(variable.ndim) if d not in order]
            shape = [1 if axes[a] is None else len(axes[a]) for a in "zyx"]
            values = np.ma.asarray(variable[:]).transpose(rest + order)
            scalars[name] = np.ma.masked_invalid(values.astype(float)).reshape([-1] + shape)
    vectors = {f["name"]: f["components"] for f in inspected["fields"] if f["kind"] == "vector"}
    units = {name: getattr(file.variables[name], "units", "") for name in scalars}
    units |= {a: getattr(file.variables[names[a]], "units", "") for a in "xyz"
              if names[a] in file.variables and not (hybrid and a == "z")}
    if hybrid:
        units["z"] = file.variables["PS"].units
    return Independent(axes, scalars, vectors, units)


def read_model_ctl(path, _):
    """The example of grads: 5 days, little-endian float32, variables one after another."""
    levels = [("PS", 0), ("U", 7), ("V", 7), ("Z", 7), ("T", 7), ("Q", 5), ("TS", 0), ("P", 0)]
    raw = np.fromfile(path.with_suffix(".dat"), "<f4").astype(float)
    raw = raw.reshape(5, sum(max(1, n) for _, n in levels), 46, 72)
    scalars, at = {}, 0
    for name, count in levels:
        values = np.full((5, 7, 46, 72), np.nan)
        values[:, : max(1, count)] = raw[:, at : at + max(1, count)]
        at += max(1, count)
        if count:
            near = np.abs(values + 2.56e33) < 1e28
            scalars[name] = np.ma.masked_array(values, near | np.isnan(values))
    axes = {"x": np.arange(72) * 5.0, "y": -90 + np.arange(46) * 4.0,
            "z": np.array([1000, 850, 700, 500, 300, 200, 100.0])}
    units = {"x": "degrees_east", "y": "degrees_north", "z": "hPa"}
    return Independent(axes, scalars, {"wind": ["U", "V"]}, units)


def read_storm(path, _):
    """The storm of dxsamples: indices x, z, y; y up; drawn with file z, x, y as x, y, z."""
    head, _, payload = path.read_bytes().partition(b"\nend\n")
    text = head.decode()
    rank = int(re.search(r"rank (\d)", text)[1])
    counts = [int(n) for n in re.search(r"counts (\d+) (\d+) (\d+)", text).groups()]
    deltas = [[float(n) for n in line] for line in re.findall(r"delta +(\S+) +(\S+) +(\S+)", text)]
    assert np.flatnonzero(np.array(deltas)).tolist() == [0, 5, 7], "x, z, y"
    values = np.frombuffer(payload, ">f4", count=np.prod(counts) * 3**rank).astype(float)
    values = values.reshape(counts + [3] * rank)
    turned = np.moveaxis(values, [2, 0, 1], [0, 1, 2])[None]  # (step, up: y, x, z)
    axes = {"x": deltas[1][2] * np.arange(counts[1]), "y": deltas[0][0] * np.arange(counts[0]),
            "z": deltas[2][1] * np.arange(counts[2])}
    name = path.stem
    if not rank:
        return Independent(axes, {name: np.ma.asarray(turned)}, {})
    parts = {f"{name}_{c}": np.ma.asarray(turned[..., i]) for i, c in enumerate("xyz")}
    return Independent(axes, parts, {name: [f"{name}_{c}" for c in "zxy"]})


def read_legacy_rectilinear(path, _):
    words = path.read_text().split()
    numbers = lambda start, count: np.array(words[start : start + count], float)
    at = words.index("DIMENSIONS")
    counts = [int(n) for n in words[at + 1 : at + 4]]
    axes = {a: numbers(words.index(f"{a.upper()}_COORDINATES") + 3, n)
            for a, n in zip("xyz", counts)}
    shape = [1] + counts[::-1]
    scalars = {"scalars": numbers(words.index("LOOKUP_TABLE") + 2, np.prod(counts)).reshape(shape)}
    vectors = numbers(words.index("VECTORS") + 3, 3 * np.prod(counts)).reshape(shape + [3])
    for i, c in enumerate("xyz"):
        scalars[f"vectors_{c}"] = vectors[..., i]
    return Independent(axes, {n: np.ma.asarray(v) for n, v in scalars.items()},
                       {"vectors": ["vectors_x", "vectors_y", "vectors_z"]})


def read_image_text(path, _):
    text = path.read_text()
    low_high = [int(n) for n in re.search(r'WholeExtent="([^"]*)"', text)[1].split()]
    counts = [h - l + 1 for l, h in zip(low_high[::2], low_high[1::2])]
    origin, spacing = ([float(n) for n in re.search(rf'{key}="([^"]*)"', text)[1].split()]
                       for key in ("Origin", "Spacing"))
    axes = {a: origin[i] + spacing[i] * np.arange(counts[i]) for i, a in enumerate("xyz")}
    array = re.search(r'<DataArray[^>]*Name="scalars"[^>]*>(.*?)</DataArray>', text, re.S)[1]
    values = np.array(array.split(), float).reshape([1] + counts[::-1])
    return Independent(axes, {"scalars": np.ma.asarray(values)}, {})


FILES = {
    "nc4uvt.nc": read_netcdf,
    "rectilinear_grid_3D.nc": read_netcdf,
    "ced1.lf00.t00z.eta.nc": read_netcdf,
    "contour.cdf": read_netcdf,
    "vinth2p.nc": read_netcdf,
    "levitus_climatology.cdf": read_netcdf,
    "uv300.nc": read_netcdf,
    "hgt.nc": read_netcdf,
    "ocean.nc": read_netcdf,
    "HSURF_regional_model_0.44deg.nc": read_netcdf,
    "model.ctl": read_model_ctl,
    "wind.dx": read_storm,
    "cloudwater.dx": read_storm,
    "rainwater.dx": read_storm,
    "temperature.dx": read_storm,
    "RectGrid2.vtk": read_legacy_rectilinear,
    "heart.vti": read_image_text,
}


class Check:
    def __init__(self, name):
        self.name, self.compared, self.faults = name, 0, []

    def same(self, what, ours, theirs, scale=0.0):
        self.compared += 1
        ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
        allowed = TOLERANCE * np.maximum(np.abs(theirs), scale)
        if ours.shape != theirs.shape or not np.all(np.abs(ours - theirs) <= allowed):
            self.faults.append(f"{what}: {ours} here, {theirs} there")


    def same_text(self, what, ours, theirs):
        self.compared += 1
        if ours != theirs:
            self.faults.append(f"{what}: '{ours}' here, '{theirs}' there")


def order_of(ours, theirs):
    """For each coordinate of the program the index in the file; longitudes are modulo 360."""
    distance = np.abs(np.asarray(theirs)[None, :] - np.asarray(ours)[:, None])
    return np.argmin(np.minimum(distance, np.abs(distance - 360)), axis=1)


def compare_axes(check, inspected, other):
    """The file's arrays in the program's order of samples."""
    orders = {}
    for a in "xyz":
        axis = inspected["axes"][a]
        if other.axes[a] is None:
            orders[a] = np.zeros(1, int)
            continue
        orders[a] = order_of(axis["coordinates"], other.axes[a])
        there = other.axes[a][orders[a]]
        if axis["kind"] == "longitude":
            there = there + 360 * np.round((np.asarray(axis["coordinates"]) - there) / 360)
        check.same(f"axis {a}", axis["coordinates"], there, np.ptp(there))
        check.same(f"axis {a} uses each sample once", sorted(orders[a]), np.arange(len(there)))
        upward = -1 if axis["kind"] in ("pressure", "depth") or a in other.falls else 1
        check.same_text(f"axis {a} units", axis["units"], other.units.get(a, ""))
        check.same(f"axis {a} ascends", np.all(upward * np.diff(axis["coordinates"]) > 0), True)
    if other.ground is not None:
        name, kind, heights = other.ground
        found = inspected.get("ground", {"name": "", "kind": "", "range": [np.nan, np.nan]})
        check.same_text("ground", f"{found['name']} {found['kind']}", f"{name} {kind}")
        check.same("ground range", found["range"], [heights.min(), heights.max()], 1)
    other.scalars = {
        name: values[:, orders["z"]][:, :, orders["y"]][:, :, :, orders["x"]]
        for name, values in other.scalars.items()}


def values_of(field, other):
    """Masked array (component, step, z, y, x); None for a field the file does not have."""
    names = other.vectors.get(field["name"], [field["name"]])
    if not all(n in other.scalars for n in names):
        return None
    parts = np.ma.stack([other.scalars[n] for n in names])
    mask = np.ma.getmaskarray(parts).any(axis=0)
    return np.ma.masked_array(parts.data, np.broadcast_to(mask, parts.shape))


def compare_fields(check, inspected, other):
    for field in inspected["fields"]:
        values = values_of(field, other)
        if values is None:
            continue
        seen = values if field["rangeOf"] == "all" else values[:, :1]
        units = {other.units.get(field["components"][0], "")}
        check.same_text(f"{field['name']} units", {field["units"]}, units)
        if field["range"] is None:  # derived fields are not decoded
            continue
        size = np.ma.sqrt((seen**2).sum(axis=0)) if len(seen) > 1 else seen[0]
        check.same(f"{field['name']} range", field["range"], [size.min(), size.max()], size.max())
        check.same(f"{field['name']} masked", field["masked"], np.ma.count_masked(size))
        if len(seen) > 1:
            check.same(f"{field['name']} components", len(field["components"]), len(seen))


def compare_values(check, inspected, other, url):
    axes = inspected["axes"]
    picks = {a: sorted({0, n // 3, n // 2, n - 1})
             for a, n in ((a, len(axes[a]["coordinates"])) for a in "xyz")}
    steps = sorted({0, inspected["steps"]["count"] - 1})
    # A probe gives the values of derived fields in memory; a histogram loads them.
    derived = [field["name"] for field in inspected["fields"]
               if field["dtype"] == "derived" and values_of(field, other) is not None]
    for name, step in itertools.product(derived, steps):
        with urllib.request.urlopen(f"{url}/fields/{name}/histogram?bins=2&step={step}"):
            pass
    for step, k, j, i in itertools.product(steps, picks["z"], picks["y"], picks["x"]):
        place = {a: axes[a]["coordinates"][n] for a, n in zip("xyz", (i, j, k))}
        if other.columns is not None:
            place |= {"x": other.columns[0][j, i], "y": other.columns[1][j, i]}
        query = urllib.parse.urlencode({**place, "step": step})
        with urllib.request.urlopen(f"{url}/probe?{query}") as reply:
            answer = json.load(reply)["values"]
        for field in inspected["fields"]:
            values = values_of(field, other)
            if values is None:
                continue
            there = values[:, step, k, j, i]
            here = answer[field["name"]]["value"]
            what = f"{field['name']} at {place}, step {step}"
            if here is None or there.mask.any():
                check.same(f"{what} masked", here is None, there.mask.any())
            else:
                check.same(what, np.atleast_1d(here), there.data, np.abs(values).max())


def check_file(program, path, read, only=False):
    """only: whether fields of the file that `read` does not know are a fault."""
    check = Check(path.name)
    inspected = json.loads(subprocess.run([program, "inspect", path, "--json"], check=True,
                                          capture_output=True).stdout)
    other = read(path, inspected)
    compare_axes(check, inspected, other)
    compare_fields(check, inspected, other)
    # "w(wap)" is converted from the variable wap.
    stored = {c for f in inspected["fields"] if f["dtype"] != "derived" for c in f["components"]
              if "(" not in c}
    if only and stored - set(other.scalars):
        check.faults.append(f"not expected: {sorted(stored - set(other.scalars))}")
    unseen = set(other.scalars) - {c for f in inspected["fields"] for c in f["components"]}
    if unseen:
        check.faults.append(f"not offered: {sorted(unseen)}")
    with tempfile.TemporaryFile("w+") as log:
        daemon = subprocess.Popen([program, "serve", path, "--listen", "127.0.0.1:0"],
                                  stdout=subprocess.PIPE, stderr=log, text=True)
        try:
            url = daemon.stdout.readline().strip().rstrip("/")
            compare_values(check, inspected, other, f"{url}/v1/datasets/{inspected['id']}")
        finally:
            daemon.terminate()
            daemon.wait()
    return check


def main():
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--program", default=root / "build/release/windsplat")
    parser.add_argument("--data", type=Path, default=root / "build/test-data")
    options = parser.parse_args()
    failed = 0
    for name, read in FILES.items():
        check = check_file(options.program, options.data / name, read)
        failed += bool(check.faults)
        print(f"{name}: {check.compared} comparisons, {len(check.faults)} differ")
        for fault in check.faults[:20]:
            print(f"  {fault}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
