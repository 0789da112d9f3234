#!/usr/bin/python3
"""Stationary mountain waves over Wales for the gallery, in the layout of WRF's output files.

No output of WRF: a linear solution by Fourier transforms, for a uniform wind and a uniform
stability (R. B. Smith 1980, Tellus 32, 348-364, with the vertical acceleration kept). With the
wind (U, V), sigma = U k + V l - i / damping time and the height h of the ground,

    w(k, l, z) = i (U k + V l) h(k, l) exp(i m z),  m^2 = K^2 (N^2 - sigma^2) / sigma^2,
    (u, v) = -(k, l) m w / K^2,  p = density sigma m w / K^2,  displacement = w / (i sigma)

with K^2 = k^2 + l^2 and the root m that decays upward: with damping, that of waves whose energy
goes up. The equations are Boussinesq. Values of height z are stored at z + h (1 - z / top), so that
the lowest flow follows the ground; the error of both is of second order in N h / U (at most 0.6).

Every parcel keeps its potential temperature (of liquid water) and total water of far upstream; what
exceeds saturation is cloud water, which does not act on the waves. The relief is a sum of hills at
the places and heights of mountains of Snowdonia, and the humidity has two moist layers.

Dimensions, staggering, names, units and attributes are those of WRF-ARW version 4 (user's guide,
chapter 5); the projection is Lambert's on a sphere of 6370 km.

Usage: mountain_waves.py FILE
"""
import os
import sys

import netCDF4
import numpy as np

CELLS, SPACING, MARGIN = (160, 128), 800.0, 3  # of the file; m; the transform's domain is 3 times
LEVELS, TOP = 80, 9000.0  # as wide. Heights of full levels are uniform where the ground is at 0.
SPEED, FROM = 20.0, 285.0  # of the wind, m s-1, and degrees clockwise from north
STABILITY = 0.0115  # Brunt-Vaisala frequency, s-1
DAMPING = 1 / 5400  # s-1
GRAVITY, HEAT_CAPACITY, VAPORIZATION = 9.81, 1004.5, 2.5e6  # m s-2, J kg-1 K-1, J kg-1
GAS, VAPOUR_GAS, BASE_THETA = 287.0, 461.6, 300.0  # J kg-1 K-1, J kg-1 K-1, K
SURFACE_THETA, SURFACE_PRESSURE = 284.0, 1.01e5  # K, Pa
EARTH, TRUE_LATITUDES, CENTRE = 6.37e6, (48.0, 58.0), (52.93, -3.95)  # m, degrees, latitude first
HILLS = (  # latitude, longitude, height in m, half-width in m: the mountains of Snowdonia
    (53.068, -4.076, 1085, 4200),
    (53.165, -3.965, 1064, 4600),
    (53.105, -4.010, 1000, 4200),
    (53.010, -4.140, 750, 3000),
    (52.975, -4.430, 520, 2500),
    (52.810, -4.000, 756, 4800),
    (52.900, -4.000, 620, 3800),
    (52.917, -3.746, 854, 4200),
    (52.980, -3.890, 700, 3800),
    (52.787, -3.688, 905, 4800),
    (52.700, -3.910, 893, 4200),
    (52.880, -3.400, 800, 5600),
    (53.090, -3.560, 480, 7500),
    (53.140, -3.260, 520, 3600),
    (52.620, -3.550, 480, 7500),
)
HUMIDITY = (  # height in m, relative humidity
    (0, 0.65), (1000, 0.72), (1500, 0.60), (2000, 0.70), (2500, 0.93), (3000, 0.93), (3500, 0.60),
    (4400, 0.55), (4900, 0.90), (5300, 0.90), (5800, 0.40), (9000, 0.20),
)


class Lambert:
    """Conformal conic projection with two true latitudes; distances in m from CENTRE."""

    def __init__(self):
        first, second = np.radians(TRUE_LATITUDES)
        self.cone = np.log(np.cos(first) / np.cos(second)) / np.log(
            np.tan(np.pi / 4 + second / 2) / np.tan(np.pi / 4 + first / 2))
        self.scale = EARTH * np.cos(first) * np.tan(np.pi / 4 + first / 2) ** self.cone / self.cone
        self.origin = self.radius(CENTRE[0])

    def radius(self, latitude):
        return self.scale / np.tan(np.pi / 4 + np.radians(latitude) / 2) ** self.cone

    def plane(self, latitude, longitude):
        angle = self.cone * np.radians(longitude - CENTRE[1])
        radius = self.radius(latitude)
        return radius * np.sin(angle), self.origin - radius * np.cos(angle)

    def place(self, x, y):
        """(latitude, longitude) in degrees."""
        radius = np.hypot(x, self.origin - y)
        latitude = 2 * np.arctan((self.scale / radius) ** (1 / self.cone)) - np.pi / 2
        turn = np.arctan2(x, self.origin - y) / self.cone
        return np.degrees(latitude), CENTRE[1] + np.degrees(turn)


def axis(cells, spacing, staggered=False):
    """Distances of cells or, one more, of their faces from the middle, in m."""
    return (np.arange(cells + staggered) - (cells + staggered - 1) / 2) * spacing


def ground(x, y):
    """Height in m: hills joined smoothly, so that neighbours do not add up."""
    lambert = Lambert()
    total = np.zeros(np.broadcast_shapes(x.shape, y.shape))
    for latitude, longitude, height, width in HILLS:
        east, north = lambert.plane(latitude, longitude)
        distance = (x - east) ** 2 + (y - north) ** 2
        total += (height * np.exp(-np.log(2) * distance / width**2)) ** 3
    return np.maximum(np.cbrt(total) - 1, 0)


class Waves:
    """The solution for a relief on a periodic plane; wind in m s-1."""

    def __init__(self, relief, spacing, wind):
        ny, nx = relief.shape
        self.k = 2 * np.pi * np.fft.rfftfreq(nx, spacing)[None, :]
        self.l = 2 * np.pi * np.fft.fftfreq(ny, spacing)[:, None]
        self.square = self.k**2 + self.l**2
        self.square[0, 0] = 1  # The mean makes no wave.
        steady = wind[0] * self.k + wind[1] * self.l
        self.sigma = steady - 1j * DAMPING
        root = np.sqrt(self.square * (STABILITY**2 - self.sigma**2) / self.sigma**2)
        self.m = np.where(root.imag < 0, -root, root)
        self.lift = 1j * steady * np.fft.rfft2(relief)
        self.shape, self.spacing = relief.shape, spacing

    def at(self, z, shift=(0, 0)):
        """u, v, w in m s-1, pressure over density in m2 s-2 and displacement in m at a height, half
        a cell west or south of the centres where shift is 1."""
        half = np.exp(-0.5j * self.spacing * (shift[0] * self.k + shift[1] * self.l))
        w = self.lift * np.exp(1j * self.m * z) * half
        along = -self.m * w / self.square
        spectra = (self.k * along, self.l * along, w, -self.sigma * along, w / (1j * self.sigma))
        return [np.fft.irfft2(spectrum, self.shape) for spectrum in spectra]


def check_waves():
    """Compares the pressure at the ground with Smith's closed form (equation 37) for hydrostatic
    waves over a wide bell-shaped mountain: -N U h (x / a) / (1 + r^2 / a^2)^(3/2)."""
    cells, spacing, height, width = 512, 10e3, 100.0, 100e3
    x = axis(cells, spacing)
    radius = 1 + (x[None, :] ** 2 + x[:, None] ** 2) / width**2
    waves = Waves(height / radius**1.5, spacing, (SPEED, 0.0))
    expected = -STABILITY * SPEED * height * (x[None, :] / width) / radius**1.5
    error = np.abs(waves.at(0.0)[3] - expected).max() / np.abs(expected).max()
    print(f"pressure of a wide mountain: {error:.1%} from the closed form")
    if not error < 0.02:  # of damping and of the periodic plane
        sys.exit("mountain_waves: the solution differs from the closed form")


def exner_of(z):
    """Exner function far upstream: hydrostatic, of uniform stability."""
    drop = GRAVITY**2 / (HEAT_CAPACITY * STABILITY**2 * SURFACE_THETA)
    start = (SURFACE_PRESSURE / 1e5) ** (GAS / HEAT_CAPACITY)
    return start - drop * (1 - np.exp(-(STABILITY**2) * z / GRAVITY))


def theta_of(z):
    return SURFACE_THETA * np.exp(STABILITY**2 * z / GRAVITY)


def saturation(temperature, pressure):
    """Saturation mixing ratio in kg/kg and its derivative by temperature (D. Bolton 1980)."""
    vapour = 611.2 * np.exp(17.67 * (temperature - 273.15) / (temperature - 29.65))
    ratio = 0.622 * vapour / (pressure - vapour)
    return ratio, ratio * VAPORIZATION / (VAPOUR_GAS * temperature**2)


def pressure_of(z):
    return 1e5 * exner_of(z) ** (HEAT_CAPACITY / GAS)


def moisture_of(z):
    """Mixing ratio far upstream, kg/kg."""
    humidity = np.interp(z, *zip(*HUMIDITY))
    return humidity * saturation(theta_of(z) * exner_of(z), pressure_of(z))[0]


def condense(z, displacement):
    """Potential temperature in K, vapour and cloud water in kg/kg of parcels at height z that have
    risen by the displacement."""
    start, water = theta_of(z - displacement) * exner_of(z), moisture_of(z - displacement)
    pressure, warm = pressure_of(z), start.copy()
    for _ in range(6):  # Newton's method for saturated air
        ratio, slope = saturation(warm, pressure)
        heat = VAPORIZATION / HEAT_CAPACITY
        warm -= (warm - start - heat * (water - ratio)) / (1 + heat * slope)
    cloud = np.where(warm > start, water - saturation(warm, pressure)[0], 0)
    cloud = np.maximum(cloud, 0)
    warm = np.where(cloud > 0, warm, start)
    return warm / exner_of(z), water - cloud, cloud


def solve():
    """Fields of the file by WRF's names, levels first."""
    nx, ny = CELLS
    x, y = axis(nx * MARGIN, SPACING), axis(ny * MARGIN, SPACING)
    turn = np.radians(FROM)
    wind = (-SPEED * np.sin(turn), -SPEED * np.cos(turn))
    relief = ground(x[None, :], y[:, None])
    waves = Waves(relief, SPACING, wind)
    west, south = nx * (MARGIN - 1) // 2, ny * (MARGIN - 1) // 2
    rows, columns = slice(south, south + ny), slice(west, west + nx)
    more_rows, more_columns = slice(south, south + ny + 1), slice(west, west + nx + 1)
    hgt = relief[rows, columns]
    full = np.linspace(0, TOP, LEVELS + 1)
    out = {"U": [], "V": [], "W": [], "P": [], "PB": [], "T": [], "QVAPOR": [], "QCLOUD": []}
    for z in full:
        out["W"].append(waves.at(z)[2][rows, columns])
    for z in (full[1:] + full[:-1]) / 2:
        out["U"].append(wind[0] + waves.at(z, (1, 0))[0][rows, more_columns])
        out["V"].append(wind[1] + waves.at(z, (0, 1))[1][more_rows, columns])
        _, _, _, pressure, displacement = (field[rows, columns] for field in waves.at(z))
        height = z + hgt * (1 - z / TOP)
        theta, vapour, cloud = condense(height, displacement)
        density = pressure_of(height) / (GAS * theta_of(height) * exner_of(height))
        out["P"].append(density * pressure)
        out["PB"].append(pressure_of(height))
        out["T"].append(theta - BASE_THETA)
        out["QVAPOR"].append(vapour)
        out["QCLOUD"].append(cloud)
    heights = full[:, None, None] + hgt * (1 - full[:, None, None] / TOP)
    return {name: np.array(levels) for name, levels in out.items()} | {
        "PHB": GRAVITY * heights, "PH": np.zeros_like(heights), "HGT": hgt,
        "ZNW": 1 - full / TOP, "ZNU": 1 - (full[1:] + full[:-1]) / 2 / TOP}


FIELDS = {  # name: (staggered dimension, description, unit)
    "U": ("X", "x-wind component", "m s-1"),
    "V": ("Y", "y-wind component", "m s-1"),
    "W": ("Z", "z-wind component", "m s-1"),
    "PH": ("Z", "perturbation geopotential", "m2 s-2"),
    "PHB": ("Z", "base-state geopotential", "m2 s-2"),
    "T": ("", "perturbation potential temperature theta-t0", "K"),
    "P": ("", "perturbation pressure", "Pa"),
    "PB": ("", "BASE STATE PRESSURE", "Pa"),
    "QVAPOR": ("", "Water vapor mixing ratio", "kg kg-1"),
    "QCLOUD": ("", "Cloud water mixing ratio", "kg kg-1"),
}
HORIZONTAL = {"X": ("south_north", "west_east_stag"), "Y": ("south_north_stag", "west_east")}


def put(file, name, dimensions, values, unit, stagger, description):
    variable = file.createVariable(name, "f4", ("Time", *dimensions), zlib=True, complevel=4)
    variable.FieldType = np.int32(104)
    variable.MemoryOrder = {1: "Z  ", 2: "XY ", 3: "XYZ"}[len(dimensions)]
    variable.description, variable.units, variable.stagger = description, unit, stagger
    if len(dimensions) == 3:
        suffix = f"_{stagger}" if stagger in HORIZONTAL else ""
        variable.coordinates = f"XLONG{suffix} XLAT{suffix} XTIME"
    variable[0] = values


def write(path, fields):
    nx, ny = CELLS
    with netCDF4.Dataset(path, "w", format="NETCDF4_CLASSIC") as file:
        file.TITLE = " LINEAR MOUNTAIN WAVES IN THE LAYOUT OF WRF (NO OUTPUT OF WRF)"
        file.START_DATE = "2020-03-21_12:00:00"
        file.setncattr("WEST-EAST_GRID_DIMENSION", np.int32(nx + 1))
        file.setncattr("SOUTH-NORTH_GRID_DIMENSION", np.int32(ny + 1))
        file.setncattr("BOTTOM-TOP_GRID_DIMENSION", np.int32(LEVELS + 1))
        file.DX, file.DY, file.GRIDTYPE = np.float32(SPACING), np.float32(SPACING), "C"
        file.CEN_LAT, file.CEN_LON = (np.float32(value) for value in CENTRE)
        file.TRUELAT1, file.TRUELAT2 = (np.float32(value) for value in TRUE_LATITUDES)
        file.MOAD_CEN_LAT, file.STAND_LON = file.CEN_LAT, file.CEN_LON
        file.POLE_LAT, file.POLE_LON = np.float32(90), np.float32(0)
        file.MAP_PROJ, file.MAP_PROJ_CHAR = np.int32(1), "Lambert Conformal"
        for name, length in (("Time", None), ("DateStrLen", 19), ("west_east", nx),
                             ("south_north", ny), ("bottom_top", LEVELS),
                             ("bottom_top_stag", LEVELS + 1), ("west_east_stag", nx + 1),
                             ("south_north_stag", ny + 1)):
            file.createDimension(name, length)
        times = file.createVariable("Times", "S1", ("Time", "DateStrLen"))
        times[0] = np.array(list("2020-03-21_12:00:00"), "S1")
        minutes = file.createVariable("XTIME", "f4", ("Time",))
        minutes.description = "minutes since 2020-03-21 12:00:00"
        minutes.units, minutes[0] = minutes.description, 0
        lambert = Lambert()
        for stagger, suffix in (("", ""), ("X", "_U"), ("Y", "_V")):
            x, y = axis(nx, SPACING, stagger == "X"), axis(ny, SPACING, stagger == "Y")
            plane = HORIZONTAL.get(stagger, ("south_north", "west_east"))
            latitude, longitude = lambert.place(x[None, :], y[:, None])
            put(file, "XLAT" + suffix, plane, latitude, "degree_north", stagger,
                "LATITUDE, SOUTH IS NEGATIVE")
            put(file, "XLONG" + suffix, plane, longitude, "degree_east", stagger,
                "LONGITUDE, WEST IS NEGATIVE")
        put(file, "HGT", ("south_north", "west_east"), fields["HGT"], "m", "", "Terrain Height")
        put(file, "ZNU", ("bottom_top",), fields["ZNU"], "", "", "eta values on half (mass) levels")
        put(file, "ZNW", ("bottom_top_stag",), fields["ZNW"], "", "Z",
            "eta values on full (w) levels")
        for name, (stagger, description, unit) in FIELDS.items():
            level = "bottom_top_stag" if stagger == "Z" else "bottom_top"
            plane = HORIZONTAL.get(stagger, ("south_north", "west_east"))
            put(file, name, (level, *plane), fields[name], unit, stagger, description)


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit("usage: mountain_waves.py FILE")
    check_waves()
    fields = solve()
    for name in ("W", "QCLOUD", "HGT", "U", "P"):
        print(f"{name}: {fields[name].min():.4g} to {fields[name].max():.4g}")
    write(sys.argv[1] + ".part", fields)
    os.replace(sys.argv[1] + ".part", sys.argv[1])


if __name__ == "__main__":
    main()
