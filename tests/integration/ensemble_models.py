"""Ensembles, forecasts, spectra -> what a reader must find of one entry of a dimension."""

import netCDF4
import numpy as np

from model_values import as_masked, axis, noise, put
from real_files import Independent

X, Y = np.arange(6) * 60.0, np.linspace(-60, 60, 5)
PRESSURE = np.array([100000.0, 50000, 10000])
SPACE = ("plev", "lat", "lon")
UNITS = {"x": "degrees_east", "y": "degrees_north", "z": "Pa"}


def of_path(path):
    """The file that a path denotes, and the value chosen of each dimension."""
    name, _, selection = path.name.partition("?")
    return path.with_name(name), dict(one.split("=") for one in selection.split("&") if one)


def space(file):
    axis(file, "plev", PRESSURE, units="Pa", axis="Z", positive="down",
         standard_name="air_pressure")
    axis(file, "lat", Y, units="degrees_north", axis="Y", standard_name="latitude")
    axis(file, "lon", X, units="degrees_east", axis="X", standard_name="longitude")


def times(file, hours):
    file.createDimension("time", None)
    put(file, "time", ("time",), np.array(hours, float), units="hours since 2000-01-01",
        standard_name="time", axis="T")


def expected(scalars, units, vectors=None):
    return Independent({"x": X, "y": Y, "z": PRESSURE}, as_masked(scalars), vectors or {},
                       UNITS | units)


def write_members(path):
    """An ensemble in one file, (number, time, plev, lat, lon); surface pressure is left out."""
    path, chosen = of_path(path)
    file = netCDF4.Dataset(path, "w")
    numbers = [4, 7, 11]
    axis(file, "number", numbers, units="1", standard_name="realization")
    times(file, [0, 6])
    space(file)
    at = numbers.index(int(chosen.get("number", 4)))
    kept = {}
    for name, unit in (("ua", "m s-1"), ("va", "m s-1"), ("ta", "K")):
        values = put(file, name, ("number", "time", *SPACE), noise(3, 2, 3, 5, 6), units=unit)
        kept[name] = values[at]
    put(file, "ps", ("number", "time", "lat", "lon"), noise(3, 2, 5, 6), units="Pa")
    file.close()
    return expected(kept, {"ua": "m s-1", "va": "m s-1", "ta": "K"}, {"wind": ["ua", "va"]})


def write_members_of_variables(pattern):
    """CMIP-like: a file for each variable and year, with all realizations."""
    folder, (_, chosen) = pattern.parent, of_path(pattern)
    at = int(chosen["realization"]) - 1
    kept = {}
    for name, unit in (("ta", "K"), ("ua", "m s-1")):
        years = []
        for year in (0, 1):
            file = netCDF4.Dataset(folder / f"ens_{name}_{2000 + year}.nc", "w")
            axis(file, "realization", [1, 2, 3], standard_name="realization")
            times(file, [8760 * year, 8760 * year + 744])
            space(file)
            values = put(file, name, ("time", "realization", *SPACE), noise(2, 3, 3, 5, 6),
                         units=unit, fill=np.float32(1e20))
            years.append(values[:, at])
            file.close()
        kept[name] = np.concatenate(years)
    return expected(kept, {"ta": "K", "ua": "m s-1"})


def write_seasonal(path):
    """A seasonal forecast, (forecast_reference_time, number, forecast_period, plev, lat, lon):
    lead times in days, without valid times; members without a coordinate."""
    path, chosen = of_path(path)
    file = netCDF4.Dataset(path, "w")
    starts = [0, 30, 61]
    axis(file, "forecast_reference_time", starts, units="days since 1993-11-01",
         standard_name="forecast_reference_time")
    file.createDimension("number", 4)
    axis(file, "forecast_period", [15, 45], units="days", standard_name="forecast_period")
    space(file)
    values = put(file, "ta", ("forecast_reference_time", "number", "forecast_period", *SPACE),
                 noise(3, 4, 2, 3, 5, 6), units="K")
    file.close()
    return expected({"ta": values[starts.index(int(chosen["forecast_reference_time"])),
                                  int(chosen["number"])]}, {"ta": "K"})


def write_cfgrib(path):
    """As written by cfgrib: (time, step, ...), where `time` is the reference time and valid_time
    depends on both."""
    path, _ = of_path(path)
    file = netCDF4.Dataset(path, "w")
    start, step = np.array([0.0, 86400]), np.array([0.0, 3, 6])
    axis(file, "time", start, units="seconds since 2020-01-01", calendar="proleptic_gregorian",
         standard_name="forecast_reference_time", long_name="initial time of forecast")
    axis(file, "step", step, units="hours", standard_name="forecast_period")
    space(file)
    put(file, "valid_time", ("time", "step"), start[:, None] + 3600 * step[None, :],
        units="seconds since 2020-01-01", calendar="proleptic_gregorian", standard_name="time")
    values = put(file, "t", ("time", "step", *SPACE), noise(2, 3, 3, 5, 6), units="K",
                 coordinates="valid_time")
    file.close()
    return expected({"t": values[1]}, {"t": "K"})


def write_spectrum(path):
    """An aerosol's optical properties by wavelength in single precision, packed."""
    path, chosen = of_path(path)
    file = netCDF4.Dataset(path, "w")
    waves = np.array([0.34, 0.55, 1.064], np.float32)
    file.createDimension("wavelength", len(waves))
    put(file, "wavelength", ("wavelength",), waves, units="um")
    times(file, [0, 24])
    space(file)
    variable = file.createVariable("extinction", "i2", ("time", *SPACE, "wavelength"),
                                   fill_value=-32768)
    variable.setncatts({"scale_factor": 0.001, "add_offset": 2.0, "units": "km-1"})
    variable.set_auto_maskandscale(False)
    stored = np.round(1000 * noise(2, 3, 5, 6, 3)).astype(np.int16)
    variable[:] = stored
    file.close()
    at = int(np.argmin(abs(waves - float(chosen["wavelength"]))))
    return expected({"extinction": 0.001 * stored[..., at] + 2.0}, {"extinction": "km-1"})
