"""Lattices that resemble staggered or unstructured grids and are neither."""

import netCDF4
import numpy as np

from model_values import as_masked, axis, noise, put
from real_files import Independent


def write_instruments(path):
    """Winds of a mast and of a sounder: heights of one interleave with those of the other, but do
    not lie in the middle of them. A second row of latitudes differs by rounding."""
    file = netCDF4.Dataset(path, "w")
    x = axis(file, "lon", np.arange(6.0), units="degrees_east")
    y = axis(file, "lat", np.arange(5.0), units="degrees_north")
    axis(file, "lat_2", np.arange(5.0) + 1e-6, units="degrees_north")
    z = axis(file, "h", [2.0, 50, 100, 200], units="m", positive="up", axis="Z")
    axis(file, "h_2", [49.0, 99, 190, 1000], units="m", positive="up", axis="Z")
    axis(file, "h_3", [26.0, 75, 150, 230], units="m", positive="up", axis="Z")
    put(file, "r", ("h_3", "lat", "lon"), noise(4, 5, 6), units="1")
    file.createDimension("x", 1)
    file.createDimension("x_stag", None)  # no entries yet
    file.createVariable("empty", "f4", ("h", "lat", "x_stag"))
    t = put(file, "t", ("h", "lat", "lon"), noise(4, 5, 6), units="K")
    q = put(file, "q", ("h", "lat", "lon"), noise(4, 5, 6), units="1")
    put(file, "w", ("h_2", "lat", "lon"), noise(4, 5, 6), units="m s-1")
    put(file, "s", ("h", "lat_2", "lon"), noise(4, 5, 6), units="1")
    file.close()
    units = {"x": "degrees_east", "y": "degrees_north", "z": "m", "t": "K", "q": "1"}
    return Independent({"x": x, "y": y, "z": z}, as_masked({"t": t[None], "q": q[None]}), {}, units)


def write_auxiliary(path):
    """An axis of longitudes with latitudes of a rotated grid beside it."""
    file = netCDF4.Dataset(path, "w")
    x = axis(file, "lon", np.arange(6.0), units="degrees_east")
    y = axis(file, "lat", np.arange(5.0), units="degrees_north")
    put(file, "rotated_lat", ("lon",), np.arange(6.0), units="degrees_north")
    t = put(file, "t", ("lat", "lon"), noise(5, 6), units="K")
    file.close()
    return Independent({"x": x, "y": y, "z": None}, as_masked({"t": t[None, None]}), {},
                       {"x": "degrees_east", "y": "degrees_north", "t": "K"})
