"""Mutations of the axes, times and storage of a Model, and of its GRIB messages, in the form of
mutations_values.py."""

import numpy as np

import model as models
import model_grib
from mutations_values import CF, GRIB, NETCDF, is_text, of_type

# Grids with a greater ratio of the widest cell to the narrowest may be refused: the squares of
# their kernels must be representable as float (aspect_max of server/scene/lattice.cpp).
ASPECT_MAX = 1e7


# --- axes ----------------------------------------------------------------------------------------

def ascending(count, dice):
    return np.cumsum(dice.uniform(0.1, 2.0, count))


def descending_axis(model, dice):
    a = str(dice.choice(list("xyz" if model.kind not in GRIB else "xy")))
    model.axes[a].values = model.axes[a].values[::-1].copy()
    if model.kind == "grads" and a == "z":
        model.placed = False
    return len(model.axes[a].values) > 1


def uneven_axis(model, dice):
    if model.kind not in (*CF, "vtr", "vts", "vtu", "raw+json", "grads"):
        return False
    for a in "xyz":
        values = model.axes[a].values
        if dice.random() < 0.6:
            made = ascending(len(values), dice)
            model.axes[a].values = values[0] + made * dice.choice([1.0, 0.1])
    if model.kind == "vtu":
        model.exact = False
    return True


def scaled_axis(model, dice):
    """Very fine, very wide or far from zero: plain coordinates only."""
    if model.kind in (*GRIB, "grads"):
        return False
    axes = "z" if model.kind in (*CF, "raw+json") else "xyz"
    for a in axes:
        values = model.axes[a].values
        factor = float(dice.choice([1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e12]))
        model.axes[a].values = factor * (values + dice.choice([0.0, 0.0, 100.0, -1e5]))
    cells = np.concatenate([np.diff(model.axes[a].values) for a in "xyz"])
    cells = np.abs(cells[cells != 0])
    if cells.size and cells.max() > ASPECT_MAX * cells.min():
        model.must_open = False
    if model.kind in ("vtu", "vts"):
        model.must_open = model.exact = model.placed = False
    return True


def lone_sample(model, dice):
    """One sample along an axis."""
    axes = "xyz" if model.kind in (*CF, "raw+json") else "z"
    a = str(dice.choice(list(axes)))
    if model.kind in ("vts", "vtu"):
        return False
    model.axes[a].values = model.axes[a].values[:1]
    at = "tzyx".index(a)
    for field in model.fields:
        field.stored = field.stored.take([0], axis=at)
        field.absent = field.absent.take([0], axis=at)
        if field.packing is not None:
            field.packing = field.packing[:, :1]
            model.placed = False  # a single level has no axis
    return True


def many_samples(model, dice):
    if model.kind in GRIB:
        return False
    counts = {"x": int(dice.integers(12, 48)), "y": int(dice.integers(10, 32)),
              "z": int(dice.integers(2, 12))}
    for a, count in counts.items():
        begin, end = model.axes[a].values[[0, -1]]
        step = (end - begin) / max(1, len(model.axes[a].values) - 1) or 1.0
        model.axes[a].values = begin + step * np.arange(count)
    if model.kind in (*CF, "grads"):
        model.axes["x"].values = np.linspace(-170, 170, counts["x"])
        model.axes["y"].values = np.linspace(-85, 85, counts["y"])
    for field in model.fields:
        field.stored = np.resize(field.stored, model.shape)
        field.absent = np.zeros(model.shape, bool)
    return True


def warped(model, dice):
    """A curved grid, which is resampled."""
    if model.kind not in ("vts", "vtu"):
        return False
    model.options["warp"] = float(dice.choice([0.01, 0.1, 0.3]))
    model.exact = model.placed = False
    model.resampled = True
    return True


def malformed_axis(model, dice):
    """Coordinates that repeat, are not finite or are not ordered."""
    if model.kind not in (*CF, "vtr", "vts", "vtu"):
        return False
    values = model.axes[str(dice.choice(list("xyz")))].values
    at = int(dice.integers(len(values)))
    values[at] = dice.choice([values[at - 1], np.nan, np.inf, 1e308, values[0], 9.97e36])
    model.must_open = model.exact = model.placed = False
    return True


def renamed_axis(model, dice):
    """Attributes that identify an axis ambiguously, or as a different one."""
    if model.kind not in CF:
        return False
    for a in "xyz":
        about = model.axes[a].attributes
        if dice.random() < 0.5:
            about.pop("standard_name", None)
        if dice.random() < 0.3:
            about["units"] = str(dice.choice(["m", "km", "1", "hPa", "degrees", "level", "dbar",
                                              "degrees_north", "radians", ""]))
        if dice.random() < 0.3:
            about["positive"] = str(dice.choice(["up", "down", "sideways"]))
        if dice.random() < 0.3:
            about["axis"] = str(dice.choice(["X", "Y", "Z", "T", "Q"]))
    model.must_open = model.exact = model.placed = model.timed = False
    return True


def pressure_levels(model, _dice):
    if model.kind not in CF:
        return False
    z = model.axes["z"]
    z.name, z.attributes = "plev", {"units": "hPa", "standard_name": "air_pressure"}
    z.values = 1000.0 / np.arange(1, len(z.values) + 1)
    return True


# --- times ---------------------------------------------------------------------------------------

def other_times(model, dice):
    """Units, epochs and calendars."""
    if model.kind not in (*CF, "raw+json") or model.shape[0] < 1:
        return False
    axis = model.axes["t"]
    unit = str(dice.choice(["hours", "days", "minutes", "seconds"]))
    epoch = str(dice.choice(["1850-01-01 00:00:00", "2000-02-28 18:00:00", "1582-10-03 00:00:00",
                             "1999-12-30 23:00:00", "0001-01-01 00:00:00"]))
    axis.attributes["units"] = f"{unit} since {epoch}"
    axis.attributes["calendar"] = str(dice.choice(["standard", "proleptic_gregorian", "noleap",
                                                   "360_day", "all_leap", "julian"]))
    axis.values = np.cumsum(dice.integers(1, 1000, model.shape[0])).astype(np.float64)
    return True


def odd_times(model, dice):
    """Times that descend, repeat, are far away or not numbers."""
    if model.kind not in CF:
        return False
    axis = model.axes["t"]
    axis.values = axis.values[::-1].copy()
    if dice.random() < 0.5:
        axis.values[0] = dice.choice([np.nan, 1e300, -1e12, axis.values[-1], 1e18])
    if dice.random() < 0.3:
        axis.attributes["units"] = str(dice.choice(["hours", "fortnights since 2001-01-01", "",
                                                    "days since 2001-13-45", "months since 1-1-1"]))
    if dice.random() < 0.3:
        axis.attributes["calendar"] = "of the moon"
    model.must_open = model.timed = False
    return True


# --- storage -------------------------------------------------------------------------------------

def zarr_version(dice):
    """Version 2 or 3, with shards or without."""
    options = {"version": 2 + int(dice.integers(2))}
    if options["version"] == 3 and dice.random() < 0.6:
        options["shards"] = {"shards": [int(n) for n in dice.integers(1, 4, 4)],
                             "at_start": bool(dice.integers(2)), "summed": bool(dice.integers(2))}
    return options


def stored_otherwise(model, dice):
    """The same numbers in another coding, byte order, layout or order of dimensions."""
    options = model.options
    if model.kind not in ("vtk ascii", "vtk binary"):
        options["endian"] = str(dice.choice(["big", "little"]))
    if model.kind == "netcdf-4":
        chunks = tuple(int(dice.integers(1, n + 1)) for n in model.shape)
        options["storage"] = {"zlib": bool(dice.integers(2)), "shuffle": bool(dice.integers(2)),
                              "complevel": int(dice.integers(1, 10)), "chunksizes": chunks,
                              "fletcher32": bool(dice.integers(2)), "endian": options["endian"]}
    if model.kind == "zarr":
        options["compressor"] = str(dice.choice(["none", "zlib", "gzip", "lz4", "zstd", "blosc"]))
        options["memory"] = str(dice.choice(["C", "F"]))
        options["chunks"] = tuple(int(dice.integers(1, n + 3)) for n in model.shape)
    if model.kind in ("vti", "vtr", "vts", "vtu"):
        options["coding"] = str(dice.choice(["ascii", "base64", "appended", "appended-base64"]))
        options["compressor"] = str(dice.choice(["", "ZLib", "LZ4"]))
    options["grid"] = str(dice.choice(["STRUCTURED_POINTS", "RECTILINEAR_GRID"]))
    if model.kind == "nrrd":
        options["coding"] = str(dice.choice(["raw", "gzip", "ascii", "hex"]))
        options["detached"] = bool(dice.integers(2))
    if model.kind == "opendx":
        options["coding"] = str(dice.choice(["binary", "text"]))
    options["layout"] = str(dice.choice(["planar", "interleaved"]))
    options["order"] = "".join(dice.permutation(list("xyz")))
    options["sequential"] = bool(dice.integers(2))
    if is_text(model) and not all(np.isfinite(f.stored.astype(float)).all() for f in model.fields):
        model.must_open = False
    return model.kind not in GRIB


def transposed(model, dice):
    if model.kind not in NETCDF:
        return False
    model.options["dims"] = "".join(dice.permutation(list("tzyx")))
    model.options["axis type"] = str(dice.choice(["f8", "f4"]))
    return True


def chunk_by_layer(model, dice):
    """False if the storage has no chunks or orders them differently."""
    if model.kind not in ("netcdf-4", "zarr") or "dims" in model.options:
        return False
    chunks = (1, 1, *model.shape[2:])
    model.options["chunks"] = chunks
    storage = model.options.get("storage", {"zlib": bool(dice.integers(2))})
    model.options["storage"] = storage | {"chunksizes": chunks}
    return True


def chunks_swapped(model, dice):
    """Swaps two chunks of each variable in a complete chunk table."""
    layers = list(np.ndindex(model.shape[:2]))
    if len(layers) < 2 or "tables" in model.options or not chunk_by_layer(model, dice):
        return False
    a, b = (layers[int(i)] for i in dice.choice(len(layers), 2, replace=False))
    for field in model.fields:
        field.in_file = field.stored.copy()
        field.stored[a], field.stored[b] = field.in_file[b], field.in_file[a]
    model.options.setdefault("tables", []).append(
        lambda table: table.update({a: table[b], b: table[a]}))
    return True


def chunks_missing(model, dice):
    """Values outside of all chunks are the fill value."""
    if not chunk_by_layer(model, dice):
        return False
    gone = [at for at in np.ndindex(model.shape[:2]) if dice.random() < 0.3]
    for field in model.fields:
        eight_bits = {"int8": -127, "uint8": 255}
        fill = models.DEFAULT_FILL.get(field.stored.dtype.name, eight_bits.get(
            field.stored.dtype.name))
        if model.kind == "zarr":
            field.attributes.setdefault("_FillValue", of_type(field, 0))
        field.in_file = field.stored.copy() if field.in_file is None else field.in_file
        for at in gone:
            field.stored[at] = field.attributes.get("_FillValue", fill)
    model.options.setdefault("tables", []).append(
        lambda table: [table.pop(at) for at in gone])
    return True


# --- GRIB ----------------------------------------------------------------------------------------

def each_message(model, dice, share=0.5):
    for field in model.fields:
        for at in np.ndindex(field.packing.shape):
            if dice.random() < share:
                yield field, at


def grib_bitmap(model, dice):
    if model.kind not in GRIB:
        return False
    for field, at in each_message(model, dice):
        field.absent[at] = dice.random(field.absent[at].shape) < dice.choice([0.1, 0.5, 1.0])
    model.options["bitmap"] = bool(dice.integers(2))
    return True


def grib_scaling(model, dice):
    """Reference, binary and decimal scale, bits per value: any valid numbers."""
    if model.kind not in GRIB:
        return False
    for field, at in each_message(model, dice, 0.3):
        # ecCodes uses only the reference of a constant field, whatever the decimal scale.
        bits = int(dice.choice([0, 1, 2, 3, 7, 8, 11, 16, 24]))
        reference = model_grib.kept_reference(
            float(dice.choice([0.0, -1.5, 9999.0, -273.15, 1e10, 1e-10, 1e35])),
            model_grib.edition_of(model))
        field.packing[at] = (reference, int(dice.integers(-30, 60)) if bits else 0,
                             int(dice.integers(-8, 9)) if bits else 0, bits)
        field.stored[at] = dice.integers(0, 2**bits, field.stored[at].shape)
    return True


def grib_9999(model, dice):
    """Values equal to ecCodes' default missing value are not masked."""
    if model.kind not in GRIB:
        return False
    edition = model_grib.edition_of(model)
    for field, at in each_message(model, dice, 0.3):
        field.packing[at] = (model_grib.kept_reference(9990.0, edition), 0, 0, 4)
        field.stored[at] = dice.integers(0, 16, field.stored[at].shape)
    return True


def grib_scan(model, dice):
    if model.kind not in GRIB:
        return False
    for a in "xy":
        if dice.random() < 0.5:
            model.axes[a].values = model.axes[a].values[::-1].copy()
    model.options["scan"] = int(dice.choice([0, model_grib.J_CONSECUTIVE]))
    if model.kind == "grib 2":
        model.options["scan"] |= int(dice.choice([0, model_grib.ALTERNATING]))
    return True


def grib_points(model, dice):
    """First and last points: across Greenwich, around the globe, over the poles, impossible."""
    if model.kind not in GRIB:
        return False
    nx, ny = model.shape[3], model.shape[2]
    kind = int(dice.integers(4))
    if kind == 0:
        model.axes["x"].values = 350.0 + 5.0 * np.arange(nx)
    elif kind == 1:
        model.axes["x"].values = np.round(360.0 / nx, 3) * np.arange(nx)
    elif kind == 2:
        model.axes["y"].values = np.linspace(90, -90, ny)
    else:
        model.axes["y"].values = np.linspace(90, -90, ny) * dice.choice([0.0, 5.0])
        model.must_open = False
    model.placed &= kind == 2
    return True


def grib_messages(model, dice):
    """Messages omitted or reordered."""
    if model.kind not in GRIB:
        return False
    field = model.fields[-1]
    # Keep every step and level at least once; otherwise the field gets separate axes.
    gone = [(t, z) for t, z in np.ndindex(model.shape[:2])
            if t > 0 and z > 0 and dice.random() < 0.3]
    if gone:
        model.options["left out"] = {(field.name, *at) for at in gone}
        for at in gone:
            field.absent[at] = True
    order = dice.permutation(4096)
    model.options["messages"] = lambda count: [i for i in order if i < count]
    return True
