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
    put(file, "HSURF", ("rlat", "rlon"), ground[0], units="m", standard_name="surface_altitude")
    t = put(file, "T", ("level", "rlat", "rlon"), noise(4, 5, 6), units="K")
    w = put(file, "W", ("level1", "rlat", "rlon"), noise(5, 5, 6), units="m s-1",
            standard_name="upward_air_velocity")
    file.close()
    heights = between(faces, 0)[::-1]
    fields = {"T": t[::-1], "W": between(w, 0)[::-1], "HHL": heights}
    return Independent({"x": x, "y": y, "z": heights.mean(axis=(1, 2))},
                       as_masked({name: values[None] for name, values in fields.items()}), {},
                       {"x": "degrees", "y": "degrees", "z": "m", "T": "K", "W": "m s-1",
                        "HHL": "m"}, ground=("HSURF", "land", ground))


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


def between_all(values, along, count):
    """Means of both neighbours of `count` samples, of which the first lies before all of them."""
    before = np.take(values, np.clip(np.arange(count) - 1, 0, None), along)
    after = np.take(values, np.clip(np.arange(count), None, values.shape[along] - 1), along)
    return (before.astype(float) + after) / 2


def write_palm(path):
    """As many levels of w as of the others; the lowest of both is the ground."""
    file = netCDF4.Dataset(path, "w")
    file.title = "PALM 6.0"
    z = axis(file, "zu_3d", np.array([0, 2.5, 7.5, 12.5, 17.5]), units="meters", axis="Z")
    axis(file, "zw_3d", np.array([0, 5, 10, 15, 20.0]), units="meters", axis="Z")
    x = axis(file, "x", np.arange(6.0) * 10 + 5, units="meters", axis="X")
    axis(file, "xu", np.arange(6.0) * 10, units="meters", axis="X")
    y = axis(file, "y", np.arange(4.0) * 10 + 5, units="meters", axis="Y")
    axis(file, "yv", np.arange(4.0) * 10, units="meters", axis="Y")
    u = put(file, "u", ("zu_3d", "y", "xu"), noise(5, 4, 6), units="m/s", long_name="u")
    v = put(file, "v", ("zu_3d", "yv", "x"), noise(5, 4, 6), units="m/s", long_name="v")
    w = put(file, "w", ("zw_3d", "y", "x"), noise(5, 4, 6), units="m/s", long_name="w")
    theta = put(file, "theta", ("zu_3d", "y", "x"), noise(5, 4, 6), units="K", long_name="theta")
    file.close()
    def from_the_next(values, along):  # the last has no face beyond it
        return np.flip(between_all(np.flip(values, along), along, values.shape[along]), along)
    fields = {"theta": theta, "u": from_the_next(u, 2), "v": from_the_next(v, 1),
              "w": between_all(w, 0, 5)}
    return Independent({"x": x, "y": y, "z": z},
                       as_masked({name: values[None] for name, values in fields.items()}),
                       {"wind": ("u", "v", "w")},
                       {"x": "meters", "y": "meters", "z": "meters", "u": "m/s", "v": "m/s",
                        "w": "m/s", "theta": "K", "wind": "m/s"})


def write_um(path, levels_shared=False):
    """The Unified Model as saved by iris: winds half a cell beside and half a level below, on a
    dimension of their own unless their levels have the same numbers."""
    file = netCDF4.Dataset(path, "w")
    lat = axis(file, "latitude", np.arange(5.0) + 50, units="degrees_north",
               standard_name="latitude")
    lon = axis(file, "longitude", np.arange(6.0) + 3, units="degrees_east",
               standard_name="longitude")
    axis(file, "latitude_0", np.arange(6.0) + 49.5, units="degrees_north",
         standard_name="latitude")
    axis(file, "longitude_0", np.arange(6.0) + 2.5, units="degrees_east",
         standard_name="longitude")
    theta = np.array([0, 20, 60, 120, 200.0])[levels_shared:]
    rho = np.array([10, 40, 90, 160.0])
    axis(file, "model_level_number", np.arange(5.0)[levels_shared:], units="1", positive="up",
         standard_name="model_level_number")
    winds = "model_level_number"
    if not levels_shared:
        winds += "_0"
        axis(file, winds, np.arange(4.0) + 1, units="1", positive="up",
             standard_name="model_level_number")
    for name, along, heights in (("level_height", "model_level_number", theta),
                                 ("level_height_0", winds, rho)):
        put(file, name, (along,), heights, units="m", long_name="level_height", positive="up")
    fields = {}
    for name, units in (("air_temperature", "K"), ("specific_humidity", "1"),
                        ("upward_air_velocity", "m s-1")):
        fields[name] = put(file, name, ("model_level_number", "latitude", "longitude"),
                           noise(len(theta), 5, 6), units=units, standard_name=name,
                           coordinates="level_height")
    u = put(file, "x_wind", (winds, "latitude", "longitude_0"), noise(4, 5, 6), units="m s-1",
            standard_name="x_wind", coordinates="level_height_0")
    v = put(file, "y_wind", (winds, "latitude_0", "longitude"), noise(4, 6, 6), units="m s-1",
            standard_name="y_wind", coordinates="level_height_0")
    file.close()
    # Longitude i lies between faces i and i + 1, of which the last is missing.
    u, v = np.flip(between_all(np.flip(u, 2), 2, 6), 2), between(v, 1)
    for name, values in (("x_wind", u), ("y_wind", v)):
        # Linear in height; beyond the ends masked.
        fields[name] = np.apply_along_axis(
            lambda column: np.interp(theta, rho, column, np.nan, np.nan), 0,
            np.asarray(values, float))
    units = {name: "m s-1" for name in ("x_wind", "y_wind", "upward_air_velocity", "wind")}
    return Independent({"x": lon, "y": lat, "z": theta},
                       as_masked({name: values[None] for name, values in fields.items()}),
                       {"wind": ("x_wind", "y_wind", "upward_air_velocity")},
                       units | {"x": "degrees_east", "y": "degrees_north", "z": "m",
                                "air_temperature": "K", "specific_humidity": "1"})


def write_um_of_one_dimension(path):
    return write_um(path, levels_shared=True)


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
