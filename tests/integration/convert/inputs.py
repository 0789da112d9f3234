"""Files of each kind of grid, with what convert has to find in them."""
import json

import netCDF4
import numpy as np


def smooth(shape, rng):
    """A field with noise, as of weather."""
    axes = np.ogrid[tuple(slice(0, 1, complex(0, n)) for n in shape)]
    out = sum(np.sin(7 * (a + 1) * axis + rng.random()) for a, axis in enumerate(axes))
    return (out + 0.1 * rng.standard_normal(shape)).astype("f4")


def pressures(count):
    """hPa, uneven as drawn, by their logarithm."""
    return 20 + 980 * (np.arange(count) / max(count - 1, 1)) ** 1.5


def write_raw(folder, name, sides, rng, across=1):
    """A wind and a scalar without a mask, x fastest; sides: x, y, z; across: metres between samples
    along y, 1 along the others."""
    shape = sides[::-1]
    document = {"windsplat": "raw", "file": f"{name}.raw", "dims": dict(zip("xyz", sides)),
                "type": "float32", "endian": "little",
                "axes": {axis: {"units": "m", "first": 0, "spacing": across if axis == "y" else 1}
                         for axis in "xyz"},
                "fields": [{"name": "q"}, {"name": "wind", "components": ["u", "v", "w"]}]}
    (folder / f"{name}.json").write_text(json.dumps(document))
    q = smooth(shape, rng)
    wind = np.stack([smooth(shape, rng) for _ in range(3)], -1)
    with open(folder / f"{name}.raw", "wb") as file:
        file.write(q.tobytes())
        file.write(wind.tobytes())
    known = dict(zip("uvw", np.moveaxis(wind, -1, 0)[:, None]))
    return folder / f"{name}.json", {"q": q[None], **known}


def write_pressures(path, shape, rng, steps=2):
    """Uneven pressures, the top and the north first; packed, masked; a wind of two components."""
    with netCDF4.Dataset(path, "w") as file:
        file.title = "A storm"
        latitudes = np.sin(np.linspace(-1.2, 1.2, shape[1]))[::-1] * 60
        axes = {"time": (np.arange(steps) * 6.0, "hours since 2001-01-01", None),
                "level": (pressures(shape[0]), "hPa", "air_pressure"),
                "lat": (latitudes, "degrees_north", "latitude"),
                "lon": (np.arange(shape[2]) * 0.5, "degrees_east", "longitude")}
        for name, (values, units, standard) in axes.items():
            file.createDimension(name, len(values))
            axis = file.createVariable(name, "f8", (name,))
            axis.units = units
            if standard:
                axis.standard_name = standard
            axis[:] = values
        storage = {"zlib": True, "complevel": 1}
        chunk = (1, min(shape[0], 8), min(shape[1], 40), min(shape[2], 50))
        t = file.createVariable("t", "i2", tuple(axes), fill_value=-32768, chunksizes=chunk,
                                **storage)
        t.units, t.scale_factor, t.add_offset = "K", 0.01, 250.0
        t.set_auto_maskandscale(False)
        for step in range(steps):
            data = (1000 * smooth(shape, rng)).astype("i2")
            data[rng.random(shape) < 0.1] = -32768
            data[:, :40, :70] = -32768  # bricks without a number
            t[step] = data
        for name, standard in (("u", "eastward_wind"), ("v", "northward_wind")):
            one = file.createVariable(name, "f4", tuple(axes), fill_value=np.float32(-999))
            one.units, one.standard_name = "m s-1", standard
            for step in range(steps):
                data = smooth(shape, rng)
                data[:, 10:20, ::7] = -999
                one[step] = data
    return path


def write_columns(path, shape, rng):
    """A layer whose columns have longitudes and latitudes of their own; y, x."""
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("y", shape[0])
        file.createDimension("x", shape[1])
        rows, columns = np.meshgrid(*map(np.arange, shape), indexing="ij")
        for name, units, values in (("lat", "degrees_north", 40 + 0.02 * rows + 0.004 * columns),
                                    ("lon", "degrees_east", 5 + 0.02 * columns - 0.004 * rows)):
            axis = file.createVariable(name, "f8", ("y", "x"))
            axis.units = units
            axis[:] = values
        variable = file.createVariable("t", "f4", ("y", "x"))
        variable.units, variable.coordinates = "K", "lon lat"
        variable[:] = smooth(shape, rng)
    return path


def read_netcdf(path, name, turned):
    """(time, z, y, x) as convert orients it: turned axes are reversed. NaN where masked."""
    with netCDF4.Dataset(path) as file:
        out = np.ma.filled(file[name][:].astype("f4"), np.nan)
    while out.ndim < 4:
        out = out[None]
    return out[tuple(slice(None, None, -1 if axis in turned else None) for axis in range(4))]
