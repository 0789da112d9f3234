"""Lattices that resemble staggered or unstructured grids and are neither."""

import netCDF4
import numpy as np

from model_values import as_masked, axis, between, noise, put
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


def write_section(path):
    """A vertical section along a line: longitudes and latitudes of the samples in order."""
    file = netCDF4.Dataset(path, "w")
    file.createDimension("x", 8)
    x = put(file, "lon", ("x",), np.arange(10.0, 18.0), units="degrees_east")
    put(file, "lat", ("x",), np.arange(50.0, 42.0, -1.0), units="degrees_north")
    z = axis(file, "z", np.arange(5.0) * 100, units="m", positive="up")
    t = put(file, "t", ("z", "x"), noise(5, 8), units="K")
    file.close()
    return Independent({"x": x, "y": None, "z": z}, as_masked({"t": t[None, :, None]}), {},
                       {"x": "degrees_east", "z": "m", "t": "K"})


def write_icon(path):
    """ICON on a latitude-longitude grid: numbered levels from the top, W between them."""
    file = netCDF4.Dataset(path, "w")
    x = axis(file, "lon", np.arange(6.0), units="degrees_east")
    y = axis(file, "lat", np.arange(5.0), units="degrees_north")
    of_levels = {"standard_name": "height", "long_name": "generalized_height", "axis": "Z"}
    z = axis(file, "height", np.arange(1.0, 5), **of_levels)
    axis(file, "height_2", np.arange(1.0, 6), **of_levels)
    u, v = (put(file, name, ("height", "lat", "lon"), noise(4, 5, 6), units="m s-1",
                standard_name=standard)
            for name, standard in (("u", "eastward_wind"), ("v", "northward_wind")))
    faces = put(file, "w", ("height_2", "lat", "lon"), noise(5, 5, 6), units="m s-1",
                standard_name="upward_air_velocity")
    file.close()
    fields = {"u": u[::-1], "v": v[::-1], "w": between(faces, 0)[::-1]}
    return Independent({"x": x, "y": y, "z": z[::-1]},
                       as_masked({name: values[None] for name, values in fields.items()}),
                       {"wind": ("u", "v", "w")},
                       {"x": "degrees_east", "y": "degrees_north", "z": "",
                        "u": "m s-1", "v": "m s-1", "w": "m s-1"}, falls=("z",))


def write_cosmo(path):
    """COSMO: levels without coordinates from the top, whose order and heights HHL tells."""
    file = netCDF4.Dataset(path, "w")
    x = axis(file, "rlon", np.arange(6.0), units="degrees", standard_name="grid_longitude")
    y = axis(file, "rlat", np.arange(5.0), units="degrees", standard_name="grid_latitude")
    file.createDimension("level", 4)
    file.createDimension("level1", 5)
    ground = noise(1, 5, 6, low=0, high=500)
    faces = ground + np.float32(1000) * np.arange(4, -1, -1, dtype=np.float32)[:, None, None]
    put(file, "HHL", ("level1", "rlat", "rlon"), faces, units="m", standard_name="altitude")
    t = put(file, "T", ("level", "rlat", "rlon"), noise(4, 5, 6), units="K")
    w = put(file, "W", ("level1", "rlat", "rlon"), noise(5, 5, 6), units="m s-1",
            standard_name="upward_air_velocity")
    file.close()
    heights = between(faces, 0)[::-1]
    fields = {"T": t[::-1], "W": between(w, 0)[::-1], "HHL": heights}
    return Independent({"x": x, "y": y, "z": heights.mean(axis=(1, 2))},
                       as_masked({name: values[None] for name, values in fields.items()}), {},
                       {"x": "degrees", "y": "degrees", "z": "m", "T": "K", "W": "m s-1",
                        "HHL": "m"})


def write_one_place(path):
    """An idealised case, whose longitudes and latitudes are all 0."""
    file = netCDF4.Dataset(path, "w")
    for name, length in (("west_east", 6), ("south_north", 5), ("bottom_top", 4)):
        file.createDimension(name, length)
    for name, units in (("XLONG", "degree_east"), ("XLAT", "degree_north")):
        put(file, name, ("south_north", "west_east"), np.zeros((5, 6), np.float32), units=units)
    t = put(file, "T", ("bottom_top", "south_north", "west_east"), noise(4, 5, 6), units="K")
    file.close()
    return Independent({"x": np.arange(6.0), "y": np.arange(5.0), "z": np.arange(4.0)},
                       as_masked({"T": t[None]}), {}, {"T": "K"})


def write_cm1(path):
    """CM1 and MicroHH: centres and faces by coordinates, without attributes of axes."""
    file = netCDF4.Dataset(path, "w")
    x = axis(file, "xh", np.arange(6.0) + 0.5, units="km")
    axis(file, "xf", np.arange(7.0), units="km")
    y = axis(file, "yh", np.arange(5.0) + 0.5, units="km")
    axis(file, "yf", np.arange(6.0), units="km")
    z = axis(file, "zh", np.arange(4.0) + 0.5, units="km")
    axis(file, "zf", np.arange(5.0), units="km")
    q = put(file, "qc", ("zh", "yh", "xh"), noise(4, 5, 6), units="kg/kg")
    u = put(file, "u", ("zh", "yh", "xf"), noise(4, 5, 7), units="m/s")
    v = put(file, "v", ("zh", "yf", "xh"), noise(4, 6, 6), units="m/s")
    w = put(file, "w", ("zf", "yh", "xh"), noise(5, 5, 6), units="m/s")
    file.close()
    fields = {"qc": q, "u": between(u, 2), "v": between(v, 1), "w": between(w, 0)}
    return Independent({"x": x, "y": y, "z": z},
                       as_masked({name: values[None] for name, values in fields.items()}),
                       {"wind": ("u", "v", "w")},
                       {"x": "km", "y": "km", "z": "km", "qc": "kg/kg", "u": "m/s", "v": "m/s",
                        "w": "m/s", "wind": "m/s"})


def write_chain(path):
    """Names of faces of faces, and positions of steps of which there are none yet."""
    file = netCDF4.Dataset(path, "w")
    x = axis(file, "x", np.arange(6.0), units="m")
    y = axis(file, "y", np.arange(5.0), units="m")
    file.createDimension("x_stag", 7)
    file.createDimension("x_stag_stag", 8)
    file.createDimension("time", None)
    for name, units in (("XLONG", "degree_east"), ("XLAT", "degree_north")):
        file.createVariable(name, "f4", ("time", "y", "x")).units = units
    t = put(file, "t", ("y", "x"), noise(5, 6), units="K")
    faces = put(file, "u", ("y", "x_stag"), noise(5, 7), units="K")
    put(file, "c", ("y", "x_stag_stag"), noise(5, 8), units="K")
    file.close()
    u = between(faces, 1)
    return Independent({"x": x, "y": y, "z": None},
                       as_masked({"t": t[None, None], "u": u[None, None]}), {},
                       {"x": "m", "y": "m", "t": "K", "u": "K"})
