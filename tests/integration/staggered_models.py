"""Small files with the headers of models on staggered grids -> what a reader must find in them."""

import netCDF4
import numpy as np

from model_values import as_masked, axis, between, noise, put
from real_files import Independent


# --- WRF ------------------------------------------------------------------------------------------

def write_wrf(path, times=(0.0, 60.0), ground=None):
    nt, nz, ny, nx = len(times), 5, 7, 9
    ground = noise(ny, nx, low=0, high=900) if ground is None else ground
    file = netCDF4.Dataset(path, "w", format="NETCDF3_64BIT_OFFSET")
    file.TITLE = " OUTPUT FROM WRF V4.2 MODEL"
    file.MAP_PROJ = np.int32(1)
    sizes = {"Time": None, "DateStrLen": 19, "west_east": nx, "south_north": ny, "bottom_top": nz,
             "bottom_top_stag": nz + 1, "soil_layers_stag": 4, "west_east_stag": nx + 1,
             "south_north_stag": ny + 1}
    for name, size in sizes.items():
        file.createDimension(name, size)
    put(file, "XTIME", ("Time",), np.array(times, np.float32),
        units="minutes since 2000-01-24 12:00:00", description="minutes since start")
    mass = ("Time", "bottom_top", "south_north", "west_east")
    east = np.linspace(-105, -95, nx)[None, :] + 0.3 * np.arange(ny)[:, None]
    north = np.linspace(35, 42, ny)[:, None] - 0.1 * np.arange(nx)[None, :]
    for name, values, units in (("XLONG", east, "degree_east"), ("XLAT", north, "degree_north")):
        put(file, name, ("Time", "south_north", "west_east"),
            np.repeat(values[None], nt, 0).astype(np.float32), units=units, stagger="",
            description=name + "ITUDE")
    for name, values, units in (("XLONG_U", between(np.pad(east, ((0, 0), (1, 1)), "edge"), 1),
                                 "degree_east"),
                                ("XLAT_U", between(np.pad(north, ((0, 0), (1, 1)), "edge"), 1),
                                 "degree_north")):
        put(file, name, ("Time", "south_north", "west_east_stag"),
            np.repeat(values[None], nt, 0).astype(np.float32), units=units, stagger="X")
    beside = dict(coordinates="XLONG XLAT XTIME", MemoryOrder="XYZ")
    u = put(file, "U", mass[:3] + ("west_east_stag",), noise(nt, nz, ny, nx + 1), units="m s-1",
            stagger="X", description="x-wind component", coordinates="XLONG_U XLAT_U XTIME")
    v = put(file, "V", mass[:2] + ("south_north_stag", "west_east"), noise(nt, nz, ny + 1, nx),
            units="m s-1", stagger="Y", description="y-wind component")
    full = ("Time", "bottom_top_stag", "south_north", "west_east")
    w = put(file, "W", full, noise(nt, nz + 1, ny, nx, low=-1, high=1), units="m s-1",
            stagger="Z", description="z-wind component", **beside)
    rise = np.linspace(0, 12000, nz + 1)[None, :, None, None] + noise(nt, 1, ny, nx, low=0, high=9)
    heights = ground + rise
    phb = put(file, "PHB", full, (9.81 * heights).astype(np.float32), units="m2 s-2", stagger="Z",
              **beside)
    ph = put(file, "PH", full, noise(nt, nz + 1, ny, nx), units="m2 s-2", stagger="Z", **beside)
    base = np.broadcast_to(np.linspace(9e4, 2e4, nz)[None, :, None, None], (nt, nz, ny, nx))
    pb = put(file, "PB", mass, base.astype(np.float32), units="Pa", stagger="", **beside)
    p = put(file, "P", mass, noise(nt, nz, ny, nx, low=-500, high=500), units="Pa", stagger="",
            **beside)
    t = put(file, "T", mass, noise(nt, nz, ny, nx, low=-20, high=60), units="K", stagger="",
            description="perturbation potential temperature theta-t0", **beside)
    cloud = put(file, "QCLOUD", mass, noise(nt, nz, ny, nx, low=0, high=1e-3), units="kg kg-1",
                stagger="", **beside)
    put(file, "TSLB", ("Time", "soil_layers_stag", "south_north", "west_east"),
        noise(nt, 4, ny, nx, low=270, high=290), units="K", stagger="Z")
    put(file, "HGT", ("Time", "south_north", "west_east"), np.repeat(ground[None], nt, 0),
        units="m", stagger="", description="Terrain Height")
    file.close()
    pressure = p.astype(float) + pb
    height = between(ph, 1) / 9.81 + between(phb, 1) / 9.81
    scalars = {"U": between(u, 3), "V": between(v, 2), "W": between(w, 1), "P": p, "PB": pb,
               "T": t, "QCLOUD": cloud, "PH": between(ph, 1), "PHB": between(phb, 1),
               "pressure": pressure, "height": height,
               "temperature": (t.astype(float) + 300) * (pressure / 1e5) ** (2 / 7)}
    units = {"U": "m s-1", "V": "m s-1", "W": "m s-1", "P": "Pa", "PB": "Pa", "T": "K",
             "QCLOUD": "kg kg-1", "PH": "m2 s-2", "PHB": "m2 s-2", "pressure": "Pa",
             "height": "m", "temperature": "K", "z": "m"}
    axes = {"x": np.arange(nx), "y": np.arange(ny), "z": height[0].mean(axis=(1, 2))}
    return Independent(axes, as_masked(scalars), {"wind": ["U", "V", "W"]}, units, (east, north),
                       ground=("HGT", "land", ground))


def write_wrf_series(path):
    """Two files of two steps each; path has an asterisk in its name."""
    ground = noise(7, 9, low=0, high=900)
    parts = [write_wrf(path.with_name(path.name.replace("*", str(n))), (120.0 * n, 120.0 * n + 60),
                       ground) for n in range(2)]
    first = parts[0]
    first.scalars = {name: np.ma.concatenate([part.scalars[name] for part in parts])
                     for name in first.scalars}
    return first


# --- ROMS -----------------------------------------------------------------------------------------

def with_walls(faces, axis, wet):
    """Mean of the faces of each cell along an axis; land faces are walls, beyond the grid the
    other face counts. wet: whether a face is in the water."""
    faces = np.where(wet, np.asarray(faces, float), np.nan)
    shape = list(faces.shape)
    shape[axis] = 1
    edge = np.full(shape, -np.inf)  # marks what lies beyond the grid
    padded = np.concatenate([edge, faces, edge], axis)
    a = np.take(padded, range(padded.shape[axis] - 1), axis)
    b = np.take(padded, range(1, padded.shape[axis]), axis)
    mean = (np.nan_to_num(a, nan=0, neginf=0) + np.nan_to_num(b, nan=0, neginf=0)) / 2
    mean = np.where(np.isinf(a), b, np.where(np.isinf(b), a, mean))
    return np.where(np.isnan(a) & np.isnan(b), np.nan, mean)


def write_roms(path, transform=2, terms=True):
    nt, nz, ny, nx = 2, 6, 8, 9
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    sizes = {"ocean_time": None, "s_rho": nz, "s_w": nz + 1, "xi_rho": nx, "eta_rho": ny,
             "xi_u": nx - 1, "eta_u": ny, "xi_v": nx, "eta_v": ny - 1, "xi_psi": nx - 1,
             "eta_psi": ny - 1}
    for name, size in sizes.items():
        file.createDimension(name, size)
    put(file, "ocean_time", ("ocean_time",), np.arange(nt) * 3600.0,
        units="seconds since 2006-01-01 00:00:00", long_name="time since initialization")
    put(file, "Vtransform", (), np.array(transform, np.int32))
    s = (np.arange(nz) + 0.5) / nz - 1
    c = np.sinh(3 * s) / np.sinh(3)
    form = "s: s_rho C: Cs_r eta: zeta depth: h depth_c: hc"
    attributes = {"standard_name": f"ocean_s_coordinate_g{transform}", "positive": "up",
                  "long_name": "S-coordinate at RHO-points", "valid_min": -1.0, "valid_max": 0.0}
    if terms:
        attributes["formula_terms"] = form
    else:
        del attributes["standard_name"]
    put(file, "s_rho", ("s_rho",), s, **attributes)
    put(file, "Cs_r", ("s_rho",), c, long_name="S-coordinate stretching curves at RHO-points")
    put(file, "s_w", ("s_w",), np.arange(nz + 1) / nz - 1, positive="up",
        standard_name=f"ocean_s_coordinate_g{transform}")
    put(file, "hc", (), np.array(20.0), units="meter")
    h = put(file, "h", ("eta_rho", "xi_rho"), noise(ny, nx, low=30, high=900).astype(float),
            units="meter", long_name="bathymetry at RHO-points")
    wet = np.ones((ny, nx), bool)
    wet[:3, 5:] = False
    wet[6, 2] = False
    put(file, "mask_rho", ("eta_rho", "xi_rho"), wet.astype(float), flag_values=[0.0, 1.0])
    lon = np.linspace(10, 12, nx)[None, :] + 0.05 * np.arange(ny)[:, None]
    lat = np.linspace(50, 51, ny)[:, None] + 0.01 * np.arange(nx)[None, :]
    for name, values, at in (("lon", lon, "longitude"), ("lat", lat, "latitude")):
        unit = "degree_east" if name == "lon" else "degree_north"
        for points, dims, moved in (("rho", ("eta_rho", "xi_rho"), values),
                                    ("u", ("eta_u", "xi_u"), between(values, 1)),
                                    ("v", ("eta_v", "xi_v"), between(values, 0))):
            put(file, f"{name}_{points}", dims, moved, units=unit, standard_name=at)
    put(file, "angle", ("eta_rho", "xi_rho"), np.full((ny, nx), 0.05), units="radians")
    fill = np.float32(1e37)

    def on(name, dims, values, mask, units, **more):
        stored = np.where(mask, values, fill).astype(np.float32)
        put(file, name, ("ocean_time",) + dims, stored, fill=fill, units=units, time="ocean_time",
            field=name, **more)
        return values

    wet_u, wet_v = wet[:, :-1] & wet[:, 1:], wet[:-1] & wet[1:]
    zeta = on("zeta", ("eta_rho", "xi_rho"), noise(nt, ny, nx, low=-1, high=1), wet, "meter")
    u = on("u", ("s_rho", "eta_u", "xi_u"), noise(nt, nz, ny, nx - 1), wet_u, "meter second-1",
           long_name="u-momentum component", coordinates="lon_u lat_u s_rho ocean_time")
    v = on("v", ("s_rho", "eta_v", "xi_v"), noise(nt, nz, ny - 1, nx), wet_v, "meter second-1",
           long_name="v-momentum component", coordinates="lon_v lat_v s_rho ocean_time")
    w = on("w", ("s_w", "eta_rho", "xi_rho"), noise(nt, nz + 1, ny, nx), wet, "meter second-1",
           long_name="vertical momentum component", coordinates="lon_rho lat_rho s_w ocean_time")
    temp = on("temp", ("s_rho", "eta_rho", "xi_rho"), noise(nt, nz, ny, nx), wet, "Celsius",
              coordinates="lon_rho lat_rho s_rho ocean_time")
    file.close()
    s, c = s[:, None, None], c[:, None, None]
    if transform == 2:
        z = zeta[:, None] + (zeta[:, None] + h) * (20.0 * s + h * c) / (20.0 + h)
    else:
        at_rest = 20.0 * s + (h - 20.0) * c
        z = at_rest + zeta[:, None] * (1 + at_rest / h)
    dry = np.where(wet, 0.0, np.nan)
    scalars = {"u": with_walls(u, 3, wet_u), "v": with_walls(v, 2, wet_v),
               "w": between(w, 1) + dry, "temp": temp + dry, "height": z + dry}
    units = {"u": "meter second-1", "v": "meter second-1", "w": "meter second-1",
             "temp": "Celsius", "height": "m", "z": "m"}
    axes = {"x": np.arange(nx), "y": np.arange(ny),
            "z": np.nanmean((z + dry)[0], axis=(1, 2))}
    return Independent(axes, as_masked(scalars), {"current": ["u", "v", "w"]}, units, (lon, lat),
                       ground=("h", "seaFloor", np.where(wet, -h, 0.0)))


# --- grids told by their coordinates --------------------------------------------------------------

def write_mitgcm(path):
    """MITgcm's own netCDF (package mnc): left faces in Xp1 and Yp1, upper faces in Zl."""
    nz, ny, nx = 4, 6, 7
    file = netCDF4.Dataset(path, "w", format="NETCDF3_CLASSIC")
    file.createDimension("T", None)
    put(file, "T", ("T",), np.array([0.0, 86400.0]), units="s", long_name="model_time")
    x = axis(file, "X", 0.5 + np.arange(nx), units="degrees_east", long_name="X coordinate")
    axis(file, "Xp1", np.arange(nx + 1.0), units="degrees_east", long_name="X at corners")
    y = axis(file, "Y", 20.5 + np.arange(ny), units="degrees_north")
    axis(file, "Yp1", 20.0 + np.arange(ny + 1), units="degrees_north")
    z = axis(file, "Z", -np.array([5.0, 20.0, 50.0, 110.0]), units="meters", positive="up")
    axis(file, "Zl", -np.array([0.0, 10.0, 30.0, 70.0]), units="meters", positive="up")
    u = put(file, "U", ("T", "Z", "Y", "Xp1"), noise(2, nz, ny, nx + 1), units="m/s")
    v = put(file, "V", ("T", "Z", "Yp1", "X"), noise(2, nz, ny + 1, nx), units="m/s")
    w = put(file, "W", ("T", "Zl", "Y", "X"), noise(2, nz, ny, nx), units="m/s")
    temp = put(file, "Temp", ("T", "Z", "Y", "X"), noise(2, nz, ny, nx), units="degC")
    salt = put(file, "S", ("T", "Z", "Y", "X"), noise(2, nz, ny, nx), units="psu")
    file.close()
    lowest = w[:, -1:]  # the face below it is the sea floor, which the file does not hold
    w = np.concatenate([between(w, 1), lowest], 1)
    scalars = {"U": between(u, 3), "V": between(v, 2), "W": w, "Temp": temp, "S": salt}
    units = {"U": "m/s", "V": "m/s", "W": "m/s", "Temp": "degC", "S": "psu", "x": "degrees_east",
             "y": "degrees_north", "z": "meters"}
    return Independent({"x": x, "y": y, "z": z}, as_masked(scalars),
                       {"wind": ["U", "V", "W"]}, units)


def write_mom6(path):
    """MOM6, not symmetric: right faces in xq and yq; interfaces in zi, downward."""
    nz, ny, nx = 5, 6, 8
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    file.createDimension("time", None)
    put(file, "time", ("time",), np.array([15.0]), units="days since 1900-01-01",
        calendar="noleap")
    x = axis(file, "xh", -270.0 + np.arange(nx), units="degrees_east", axis="X",
             long_name="h point nominal longitude")
    axis(file, "xq", -269.5 + np.arange(nx), units="degrees_east", axis="X",
         long_name="q point nominal longitude")
    y = axis(file, "yh", -30.0 + np.arange(ny), units="degrees_north", axis="Y")
    axis(file, "yq", -29.5 + np.arange(ny), units="degrees_north", axis="Y")
    z = axis(file, "zl", np.array([5.0, 15.0, 40.0, 100.0, 300.0]), units="meters", axis="Z",
             positive="down")
    axis(file, "zi", np.array([0.0, 10.0, 25.0, 60.0, 180.0, 450.0]), units="meters", axis="Z",
         positive="down")
    u = put(file, "uo", ("time", "zl", "yh", "xq"), noise(1, nz, ny, nx), units="m s-1",
            standard_name="sea_water_x_velocity")
    v = put(file, "vo", ("time", "zl", "yq", "xh"), noise(1, nz, ny, nx), units="m s-1",
            standard_name="sea_water_y_velocity")
    thetao = put(file, "thetao", ("time", "zl", "yh", "xh"), noise(1, nz, ny, nx), units="degC")
    so = put(file, "so", ("time", "zl", "yh", "xh"), noise(1, nz, ny, nx), units="psu")
    e = put(file, "e", ("time", "zi", "yh", "xh"), noise(1, nz + 1, ny, nx), units="m")
    depth = noise(ny, nx, low=20, high=440)
    depth[1, 2:4] = 0
    put(file, "depth_ocean", ("yh", "xh"), depth, units="m", long_name="Depth of the ocean")
    file.close()
    u = np.concatenate([np.asarray(u[..., :1], float), between(u, 3)], 3)
    v = np.concatenate([np.asarray(v[:, :, :1], float), between(v, 2)], 2)
    scalars = {"uo": u, "vo": v, "thetao": thetao, "so": so, "e": between(e, 1)}
    units = {"uo": "m s-1", "vo": "m s-1", "thetao": "degC", "so": "psu", "e": "m",
             "x": "degrees_east", "y": "degrees_north", "z": "meters"}
    return Independent({"x": x, "y": y, "z": z}, as_masked(scalars),
                       {"current": ["uo", "vo"]}, units, ground=("depth_ocean", "seaFloor", -depth))


def write_sgrid(path):
    """SGRID 0.3 on a lattice without coordinates; nodes at both ends of the faces."""
    nz, ny, nx = 3, 5, 6
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    for name, size in {"nmax": ny, "mmax": nx, "nnode": ny + 1, "mnode": nx + 1,
                       "kmax": nz}.items():
        file.createDimension(name, size)
    topology = file.createVariable("grid", "i4")
    topology.setncatts({
        "cf_role": "grid_topology", "topology_dimension": np.int32(2),
        "node_dimensions": "mnode nnode",
        "face_dimensions": "mmax: mnode (padding: none) nmax: nnode (padding: none)"})
    u = put(file, "u1", ("kmax", "nmax", "mnode"), noise(nz, ny, nx + 1), units="m/s", grid="grid",
            location="edge1")
    v = put(file, "v1", ("kmax", "nnode", "mmax"), noise(nz, ny + 1, nx), units="m/s", grid="grid",
            location="edge2")
    salt = put(file, "r1", ("kmax", "nmax", "mmax"), noise(nz, ny, nx), units="ppt", grid="grid",
               location="face")
    file.close()
    scalars = {"u1": between(u, 2)[None], "v1": between(v, 1)[None], "r1": salt[None]}
    return Independent({"x": np.arange(nx), "y": np.arange(ny), "z": np.arange(nz)},
                       as_masked(scalars), {"wind1": ["u1", "v1"]},
                       {"u1": "m/s", "v1": "m/s", "r1": "ppt"})


def roms_without_terms(path):
    return write_roms(path, terms=False)


def roms_transform_1(path):
    return write_roms(path, transform=1)
