"""Datasets of several files: CMIP6 and NEMO -> what a reader must find in them."""

import netCDF4
import numpy as np

from model_values import as_masked, axis, noise, put
from real_files import Independent


def write_cmip(path):
    """CMIP6: a file for each variable and year; cloud cover in percent has no year of its own."""
    nz, ny, nx = 4, 5, 6
    pressure = np.array([100000.0, 85000, 50000, 10000])
    x, y = np.arange(nx) * 60.0, np.linspace(-80, 80, ny)
    scalars, units = {}, {"x": "degrees_east", "y": "degrees_north", "z": "Pa"}
    for name, standard_name, unit in (
            ("ua", "eastward_wind", "m s-1"), ("va", "northward_wind", "m s-1"),
            ("wap", "lagrangian_tendency_of_air_pressure", "Pa s-1"),
            ("hus", "specific_humidity", "1")):
        parts = []
        for year in (0, 1):
            file = netCDF4.Dataset(path.parent / f"{name}_Amon_model_{2000 + year}.nc", "w")
            file.createDimension("time", None)
            file.createDimension("bnds", 2)
            put(file, "time", ("time",), 365.0 * year + np.array([15.5, 45.0]), axis="T",
                units="days since 2000-01-01", calendar="noleap", standard_name="time")
            axis(file, "plev", pressure, units="Pa", axis="Z", positive="down",
                 standard_name="air_pressure")
            axis(file, "lat", y, units="degrees_north", axis="Y", standard_name="latitude",
                 bounds="lat_bnds")
            put(file, "lat_bnds", ("lat", "bnds"), np.stack([y - 20, y + 20], 1))
            axis(file, "lon", x, units="degrees_east", axis="X", standard_name="longitude")
            parts.append(put(file, name, ("time", "plev", "lat", "lon"), noise(2, nz, ny, nx),
                             units=unit, standard_name=standard_name, fill=np.float32(1e20)))
            file.close()
        scalars[name], units[name] = np.concatenate(parts), unit
    return Independent({"x": x, "y": y, "z": pressure}, as_masked(scalars),
                       {"wind": ["ua", "va", "wap"]}, units)


def write_nemo(path):
    """NEMO: files of T, U, V and W points with the same names of dimensions; U lies at the right
    face of T, V at the upper one, W above it. Masked values are 1e20."""
    nt, nz, ny, nx = 2, 4, 6, 7
    fill = np.float32(1e20)
    lon = np.linspace(-20, -14, nx)[None, :] + 0.1 * np.arange(ny)[:, None]
    lat = np.linspace(40, 45, ny)[:, None] + 0.05 * np.arange(nx)[None, :]
    wet = np.ones((nz, ny, nx), bool)
    wet[:, :2, 4:] = False
    wet[3, 3:, :3] = False
    wet_u = wet & np.concatenate([wet[..., 1:], np.ones((nz, ny, 1), bool)], 2)
    wet_v = wet & np.concatenate([wet[:, 1:], np.ones((nz, 1, nx), bool)], 1)
    depth_t, depth_w = np.array([5.0, 20, 60, 150]), np.array([0.0, 10, 40, 100])
    kept, dry = {}, np.where(wet, 0.0, np.nan)
    for points, depth, moved, fields in (
            ("T", depth_t, (0, 0), {"votemper": (wet, "degC"), "vosaline": (wet, "1e-3")}),
            ("U", depth_t, (0, 0.5), {"vozocrtx": (wet_u, "m/s")}),
            ("V", depth_t, (0.5, 0), {"vomecrty": (wet_v, "m/s")}),
            ("W", depth_w, (0, 0), {"vovecrtz": (wet, "m/s")})):
        file = netCDF4.Dataset(path.parent / f"ORCA_grid_{points}.nc", "w")
        for name, size in (("time_counter", None), ("y", ny), ("x", nx)):
            file.createDimension(name, size)
        put(file, "time_counter", ("time_counter",), np.arange(nt) * 86400.0, axis="T",
            units="seconds since 1900-01-01 00:00:00", calendar="gregorian")
        axis(file, "depth" + points.lower(), depth, units="m", positive="down", axis="Z")
        step_y = (lat[1:] - lat[:-1]).mean()
        step_x = (lon[:, 1:] - lon[:, :-1]).mean()
        put(file, "nav_lon", ("y", "x"), lon + moved[1] * step_x + moved[0] * 0.1,
            units="degrees_east", standard_name="longitude")
        put(file, "nav_lat", ("y", "x"), lat + moved[0] * step_y + moved[1] * 0.05,
            units="degrees_north", standard_name="latitude")
        for name, (mask, unit) in fields.items():
            values = noise(nt, nz, ny, nx)
            put(file, name, ("time_counter", "depth" + points.lower(), "y", "x"),
                np.where(mask, values, fill).astype(np.float32), fill=fill, units=unit,
                coordinates="time_counter nav_lat nav_lon")
            kept[name] = values
        file.close()
    u = np.where(wet_u, kept["vozocrtx"].astype(float), np.nan)
    v = np.where(wet_v, kept["vomecrty"].astype(float), np.nan)
    w = np.where(wet, kept["vovecrtz"].astype(float), np.nan)

    def left_and_own(values, index_axis):
        """Walls are 0, unless both faces are; the first cell has its own face only."""
        before = np.take(values, range(values.shape[index_axis] - 1), index_axis)
        here = np.take(values, range(1, values.shape[index_axis]), index_axis)
        mean = (np.nan_to_num(before) + np.nan_to_num(here)) / 2
        mean[np.isnan(before) & np.isnan(here)] = np.nan
        return np.concatenate([np.take(values, [0], index_axis), mean], index_axis)

    below = np.concatenate([w[:, 1:], w[:, -1:]], 1)
    mean = (np.nan_to_num(w) + np.nan_to_num(below)) / 2
    mean[np.isnan(w) & np.isnan(below)] = np.nan
    scalars = {"votemper": kept["votemper"] + dry, "vosaline": kept["vosaline"] + dry,
               "vozocrtx": left_and_own(u, 3), "vomecrty": left_and_own(v, 2), "vovecrtz": mean}
    units = {"votemper": "degC", "vosaline": "1e-3", "vozocrtx": "m/s", "vomecrty": "m/s",
             "vovecrtz": "m/s", "z": "m"}
    return Independent({"x": np.arange(nx), "y": np.arange(ny), "z": depth_t}, as_masked(scalars),
                       {"current": ["vozocrtx", "vomecrty", "vovecrtz"]}, units, (lon, lat))
