"""Mutations of the values of a Model and of the attributes that define their meaning. Each takes
the model and a numpy generator, clears the flags of properties that are no longer known (Model),
and returns False if it does not apply to the format."""

import numpy as np

import model_writers

NETCDF = tuple(model_writers.NETCDF_FORMATS)
CF = (*NETCDF, "zarr")
GRIB = ("grib 1", "grib 2")
VTK = ("vti", "vtr", "vts", "vtu", "vtk ascii", "vtk binary")
BARE = ("nrrd", "raw+json", "grads", "opendx")
ALL = (*CF, *GRIB, *VTK, *BARE)
# Formats with a single step.
STILL = (*VTK, "nrrd", "opendx")


def is_text(model):
    coding = model.options.get("coding")
    return model.kind == "vtk ascii" or coding in ("ascii", "text")


def some(field, dice, share=0.1):
    """A random selection of at least one sample."""
    mask = dice.random(field.stored.shape) < share
    mask[tuple(int(dice.integers(n)) for n in mask.shape)] = True
    return mask


def floating(model):
    return [f for f in model.fields if f.stored.dtype.kind == "f"]


# --- values --------------------------------------------------------------------------------------

SPECIALS = (np.nan, np.inf, -np.inf, 1e-40, -1e-45, 3.4e38, -3.4e38, 1e30, -0.0, 9999.0, -999.0,
            1e20, 9.969209968386869e36, -9.969209968386869e36, 1e-30, 2.0**24 + 1, 65504.0)


def special_values(model, dice):
    """NaN, infinities, denormals, huge numbers, and the fill values of other formats."""
    fields = floating(model)
    for field in fields:
        for value in dice.choice(SPECIALS, int(dice.integers(1, 5))):
            field.stored[some(field, dice, 0.05)] = value
    if is_text(model) and any((~np.isfinite(f.stored)).any() for f in fields):
        model.must_open = False
    return bool(fields)


def huge_doubles(model, dice):
    """Values beyond float32, and close to its maximum."""
    fields = floating(model)
    if model.kind == "grads" or not fields:
        return False
    for field in model.fields:
        field.stored = field.stored.astype(np.float64)
        for value in (1e300, -1e300, 1e39, 3.4e38, 5e-324, 1e-310, -1e-60):
            if dice.random() < 0.6:
                field.stored[some(field, dice, 0.05)] = value
    return True


def flipped_signs(model, dice):
    for field in model.fields:
        if field.stored.dtype.kind in "if":
            mask = some(field, dice, 0.3)
            field.stored[mask] = -field.stored[mask]
    return True


def uniform(model, dice):
    for field in model.fields:
        field.stored[...] = dice.choice([0, 1, 100])
        if field.packing is not None:
            field.stored[...] = 0  # fits into any number of bits
    return True


def all_masked(model, dice):
    fields = floating(model)
    for field in fields if dice.random() < 0.5 else fields[:1]:
        field.stored[...] = np.nan
    model.must_open &= not is_text(model)
    return bool(fields)


def one_unmasked(model, dice):
    fields = floating(model)
    for field in fields:
        at = tuple(int(dice.integers(n)) for n in field.stored.shape)
        value = field.stored[at]
        field.stored[...] = np.nan
        field.stored[at] = value
    model.must_open &= not is_text(model)
    return bool(fields)


def swapped_bytes(model, dice):
    """Values with reversed byte order."""
    for field in model.fields:
        if field.stored.dtype.kind == "f" and dice.random() < 0.7:
            field.stored = field.stored.byteswap()
    if is_text(model):
        model.must_open = False
    return True


def random_bits(model, dice):
    fields = floating(model)
    for field in fields:
        bits = dice.integers(0, 256, field.stored.nbytes, np.uint8)
        field.stored = bits.view(field.stored.dtype).reshape(field.stored.shape).copy()
    if is_text(model):
        model.must_open = False
    return bool(fields)


INTEGERS = {"netcdf-4": "i1 i2 i4 i8 u1 u2 u4", "netcdf cdf5": "i1 i2 i4 i8 u1 u2 u4",
            "netcdf classic": "i1 i2 i4", "netcdf 64-bit": "i1 i2 i4",
            "zarr": "i1 i2 i4 i8 u1 u2 u4", "nrrd": "i1 u1 i2 u2 i4 u4",
            "raw+json": "i1 u1 i2 u2 i4 u4", "opendx": "i2 i4 u1"}


def integers(model, dice):
    """Values including the least and the greatest number of the type."""
    kinds = INTEGERS.get(model.kind, "u1 i2 i4" if model.kind in VTK else "").split()
    if not kinds:
        return False
    dtype = np.dtype(dice.choice(kinds))
    limits = np.iinfo(dtype)
    wide = min(limits.max, 1000)
    for field in model.fields:
        field.stored = dice.integers(max(limits.min, -wide), wide, field.stored.shape,
                                     endpoint=True).astype(dtype)
        for value in (limits.min, limits.max) if dtype.itemsize < 8 else (-2**52, 2**52):
            field.stored[some(field, dice, 0.03)] = value
    return True


def unsigned(model, dice):
    """Signed integers that the attribute _Unsigned makes unsigned (netCDF User's Guide)."""
    if model.kind not in NETCDF:
        return False
    dtype = np.dtype(dice.choice(["i1", "i2", "i4"]))
    limits = np.iinfo(dtype)
    for field in model.fields:
        field.stored = dice.integers(limits.min, limits.max, field.stored.shape, dtype,
                                     endpoint=True)
        field.attributes["_Unsigned"] = "true"
    return True


# --- attributes ----------------------------------------------------------------------------------

def of_type(field, value):
    return field.stored.dtype.type(value)


def existing(field, dice):
    finite = field.stored[np.isfinite(field.stored.astype(np.float64))]
    return dice.choice(finite) if finite.size else of_type(field, 0)


def filled(model, dice):
    """A fill value that occurs in the data."""
    for field in model.fields:
        if model.kind in CF:
            special = [-32767, 127, 0] if field.stored.dtype.kind in "iu" else [
                -999, 1e20, 0, np.nan, np.inf, 3.4e38, 1e-40]
            limits = np.iinfo(field.stored.dtype) if field.stored.dtype.kind in "iu" else None
            value = dice.choice(special)
            if limits and not limits.min <= value <= limits.max:
                value = limits.max
            value = existing(field, dice) if dice.random() < 0.4 else of_type(field, value)
            field.attributes["_FillValue"] = value
            field.stored[some(field, dice)] = value
        elif "missing" in field.attributes or model.kind == "raw+json":
            value = model.fields[0].attributes.get("missing", -999)
            field.attributes["missing"] = value
            field.stored[some(field, dice)] = of_type(field, np.clip(
                value, *(limits_of(field.stored.dtype))))
        else:
            return False
    return True


def limits_of(dtype):
    about = np.iinfo(dtype) if dtype.kind in "iu" else np.finfo(dtype)
    return about.min, about.max


def missing_values(model, dice):
    if model.kind not in CF:
        return False
    for field in model.fields:
        values = [existing(field, dice) for _ in range(int(dice.integers(1, 4)))]
        if model.kind == "netcdf-4" or len(values) > 1:
            values = np.array(values, field.stored.dtype)
        field.attributes["missing_value"] = values if np.ndim(values) and len(values) > 1 else (
            np.atleast_1d(values)[0])
    return True


def valid_limits(model, dice):
    """Valid ranges, including ones that no value satisfies."""
    if model.kind not in CF:
        return False
    for field in model.fields:
        low, high = sorted((existing(field, dice), existing(field, dice)))
        if dice.random() < 0.1:
            low, high = high, low
        low, high = of_type(field, low), of_type(field, high)
        kind = dice.integers(3)
        if kind == 0:
            field.attributes["valid_range"] = np.array([low, high], field.stored.dtype)
        else:
            field.attributes["valid_min" if kind == 1 else "valid_max"] = (low, high)[kind - 1]
    return True


def packed(model, dice):
    """Scales and offsets, including ones that make the numbers huge, tiny, negative or equal."""
    if model.kind not in CF:
        return False
    for field in model.fields:
        if dice.random() < 0.8:
            field.attributes["scale_factor"] = np.float64(dice.choice(
                [0.01, -0.5, 1e-38, 1e35, 0.0, 2.0, -1e-300, 1e300]))
        if dice.random() < 0.6:
            field.attributes["add_offset"] = np.float64(dice.choice([273.15, -1e6, 1e38, 0.0]))
    # With packing, valid ranges may apply to packed or unpacked values: see the reader's unit
    # tests.
    if any(k.startswith("valid") for field in model.fields for k in field.attributes):
        model.exact = False
    return True


def attribute_of_wrong_type(model, dice):
    if model.kind not in CF:
        return False
    for field in model.fields:
        key = dice.choice(["scale_factor", "add_offset", "missing_value", "valid_range",
                           "valid_min", "units", "standard_name"])
        values = ["much", "", "1.5", np.int32(7), np.float64(np.nan), np.float64(np.inf),
                  np.array([1.0, 2.0, 3.0]), np.float32(-1e38)]
        field.attributes[key] = values[int(dice.integers(len(values)))]
    model.must_open = model.exact = False
    return True


def unnamed(model, dice):
    """Removes standard names and units, or replaces them with those of another quantity."""
    if model.kind not in CF:
        return False
    for field in model.fields:
        for key in ("units", "standard_name"):
            if dice.random() < 0.5:
                field.attributes.pop(key, None)
            elif dice.random() < 0.5:
                field.attributes[key] = str(dice.choice(
                    ["1", "K", "Pa s-1", "kg m-3", "sea_water_salinity", "air_temperature",
                     "% ", "\u00b0C", "m/s m/s", "x" * 300]))
    return True
