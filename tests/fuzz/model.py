"""A small dataset whose values are all known, and the meaning of its stored numbers by the
conventions of the format. The expected values are those written; no file is read."""

import warnings

import numpy as np

# Casts and sums overflow intentionally.
warnings.simplefilter("ignore", RuntimeWarning)

FLOAT_MAX = float(np.finfo(np.float32).max)
# netCDF's default fill values (netcdf.h); 8-bit types have none.
DEFAULT_FILL = {"int16": -32767, "uint16": 65535, "int32": -2147483647, "uint32": 4294967295,
                "int64": -9223372036854775806, "uint64": 18446744073709551614,
                "float32": float(np.float32(9.969209968386869e36)),
                "float64": 9.969209968386869e36}


def as_float32(values):
    """Values as the renderer receives them: NaN and values beyond float32 are masked."""
    values = np.array(values, np.float64)
    values[~(np.abs(values) <= FLOAT_MAX)] = np.nan
    return values.astype(np.float32)


class Axis:
    def __init__(self, name, values, units, **attributes):
        self.name = name
        self.values = np.array(values, np.float64)
        self.attributes = {"units": units} | attributes


class Field:
    """stored: (time, z, y, x), the numbers in the file; absent: samples without a number."""

    def __init__(self, name, stored, **attributes):
        self.name = name
        self.stored = np.array(stored)
        self.attributes = attributes
        self.absent = np.zeros(self.stored.shape, bool)
        # the numbers in the file if they differ from `stored`, because of a chunk table
        self.in_file = None
        self.packing = None  # GRIB only

    def written(self):
        return self.stored if self.in_file is None else self.in_file

    def physical(self, rule):
        values = as_float32(RULES[rule](self))
        values[self.absent] = np.nan
        return values


def plain(field):
    return field.stored


def listed(field):
    """Raw files: the listed missing values are masked."""
    values = field.stored.astype(np.float64)
    for missing in np.atleast_1d(field.attributes.get("missing", [])):
        values[field.stored == missing] = np.nan
    return values


def near_undef(field):
    """GrADS: values within a hundred thousandth of undef are masked."""
    values = field.stored.astype(np.float64)
    undef = field.attributes["missing"]
    values[np.abs(values - undef) <= abs(undef) / 1e5] = np.nan
    return values


def conventions(field, default_fill=DEFAULT_FILL):
    """netCDF User's Guide, attribute conventions; CF 2.5.1 and 8.1."""
    about = field.attributes
    wrap = 256.0**field.stored.itemsize if about.get("_Unsigned") == "true" else 0

    def widened(number):
        number = np.float64(number)
        return number + wrap * (number < 0)

    stored = widened(field.stored)
    valid = ~np.isnan(stored)
    fill = about.get("_FillValue", default_fill.get(field.stored.dtype.name))
    for missing in [fill, *np.atleast_1d(about.get("missing_value", []))]:
        if missing is not None:
            valid &= stored != widened(missing)
    low, high = about.get("valid_range", (about.get("valid_min"), about.get("valid_max")))
    if low is not None:
        valid &= stored >= widened(low)
    if high is not None:
        valid &= stored <= widened(high)
    if "scale_factor" in about or "add_offset" in about:
        with np.errstate(all="ignore"):
            stored = stored * about.get("scale_factor", 1.0) + about.get("add_offset", 0.0)
    return np.where(valid, stored, np.nan)


def grib(field):
    """Simple packing: (R + X 2^E) / 10^D, with parameters for each message."""
    out = np.empty(field.stored.shape)
    for at, (reference, binary, decimal, _bits) in np.ndenumerate(field.packing):
        with np.errstate(all="ignore"):
            out[at] = (reference + field.stored[at] * 2.0**binary) / 10.0**decimal
    return out


RULES = {"plain": plain, "listed": listed, "near undef": near_undef, "cf": conventions,
         "grib": grib, "cf without default fill values": lambda field: conventions(field, {})}


class Model:
    """axes: t, z, y, x. vectors: names of components by the name of the vector, if the file
    groups them. Mutations clear the flags of unknown properties: `must_open` (no reader may refuse
    the file), `exact` (values are known), `placed` (axes are known), `timed` (times are known)."""

    def __init__(self, kind, rule, axes, fields, vectors=None):
        self.kind = kind
        self.rule = rule
        self.axes = axes
        self.fields = fields
        self.vectors = vectors or {}
        self.options = {}  # options of the writer: coding, chunks, byte order
        self.must_open = self.exact = self.placed = self.timed = True
        self.resampled = False  # values lie between those of the file
        self.applied = []  # names of mutations

    @property
    def shape(self):
        return tuple(len(self.axes[a].values) for a in "tzyx")

    def field(self, name):
        return next((field for field in self.fields if field.name == name), None)

    def truth(self, components):
        """(component, time, z, y, x) with common masks, or None if a component is unknown."""
        fields = [self.field(name) for name in components]
        if not fields or None in fields:
            return None
        values = np.stack([field.physical(self.rule) for field in fields])
        values[:, np.isnan(values).any(axis=0)] = np.nan
        return values


def magnitude(values):
    """The components of a vector, or the values of a scalar, limited to float32."""
    if len(values) == 1:
        return values[0].astype(np.float64)
    length = np.sqrt((values.astype(np.float64) ** 2).sum(axis=0))
    return np.minimum(length, FLOAT_MAX)


def range_and_masked(values):
    """Least and greatest unmasked value, or None, and the number of masked values."""
    lengths = magnitude(values)
    valid = lengths[~np.isnan(lengths)]
    return ([valid.min(), valid.max()] if valid.size else None), lengths.size - valid.size


def random_values(dice, shape, scale=10.0):
    """Smooth values of both signs with noise; the same for the same generator."""
    t, z, y, x = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")
    a, b, c = dice.uniform(0.2, 1.2, 3)
    smooth = np.sin(a * x + t) + np.cos(b * y) + 0.3 * np.sin(c * z + t)
    return (scale * (smooth + 0.1 * dice.standard_normal(shape))).astype(np.float32)


def geographic_axes(dice, steps):
    nx, ny, nz = (int(dice.integers(*span)) for span in ((5, 11), (4, 9), (2, 6)))
    return {"t": Axis("time", 6.0 * np.arange(steps), "hours since 2001-01-01 00:00:00",
                      standard_name="time"),
            "z": Axis("height", 100.0 * np.arange(1, nz + 1), "m", positive="up"),
            "y": Axis("lat", np.linspace(-40, 40, ny), "degrees_north", standard_name="latitude"),
            "x": Axis("lon", np.linspace(10, 80, nx), "degrees_east", standard_name="longitude")}


def cartesian_axes(dice, steps):
    nx, ny, nz = (int(dice.integers(*span)) for span in ((5, 11), (4, 9), (2, 6)))
    axes = {a: Axis(a, first + spacing * np.arange(n), "")
            for a, n, first, spacing in (("x", nx, -2.0, 0.5), ("y", ny, 1.0, 0.25),
                                         ("z", nz, 0.0, 1.0))}
    return axes | {"t": Axis("time", 6.0 * np.arange(steps), "hours since 2001-01-01 00:00:00")}


WIND = ["wind_x", "wind_y", "wind_z"]
NAMES = {"u": ("m s-1", "eastward_wind"), "v": ("m s-1", "northward_wind"),
         "w": ("m s-1", "upward_air_velocity"), "t": ("K", "air_temperature")}


def cf_model(kind, dice):
    axes = geographic_axes(dice, int(dice.integers(1, 4)))
    shape = tuple(len(axes[a].values) for a in "tzyx")
    fields = [Field(name, random_values(dice, shape), units=units, standard_name=standard)
              for name, (units, standard) in NAMES.items()]
    rule = "cf without default fill values" if kind == "zarr" else "cf"
    return Model(kind, rule, axes, fields)


def grouped_model(kind, dice, rule, steps):
    """A vector of three components, and a scalar, on a cartesian grid."""
    axes = cartesian_axes(dice, steps)
    shape = tuple(len(axes[a].values) for a in "tzyx")
    fields = [Field(name, random_values(dice, shape)) for name in (*WIND, "heat")]
    return Model(kind, rule, axes, fields, {"wind": WIND})
