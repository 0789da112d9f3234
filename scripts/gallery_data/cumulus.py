#!/usr/bin/python3
"""Large-eddy simulation of trade-wind cumulus for the gallery: writes a CF netCDF file.

The case is BOMEX (A. P. Siebesma et al. 2003, J. Atmos. Sci. 60, 1201-1219, appendix B): initial
profiles, surface fluxes, subsidence, cooling, drying and geostrophic wind are theirs. The method:

- Boussinesq equations for u, v, w, the liquid water potential temperature theta_l and the total
  water q_t on a staggered grid (Arakawa C), periodic in x and y, with walls at bottom and top. The
  grid moves with the mean wind.
- Advection in flux form with upwind-biased fluxes of fifth order and three Runge-Kutta stages
  (L. J. Wicker and W. C. Skamarock 2002, Mon. Weather Rev. 130, 2088-2097). Their dissipation is
  the only subgrid closure (an implicit large-eddy simulation).
- Pressure by Fourier transforms in x and y and cosines in z, after every stage.
- Condensation by adjustment to saturation; cloud water does not fall.
- Coriolis acts on the horizontal means only.

The default grid, 96 x 96 x 90 cells of 50 x 50 x 33 m, takes some 7 minutes of one core for 75
minutes of model time. The run prints, and at its end checks, the divergence, the budget of water
and the height of the cloud base above which parcels of the mixed layer condense.

Usage: cumulus.py [--cells NX NY NZ] [--minutes M] [--every M] FILE
"""
import argparse
import datetime
import os
import sys
import time

import netCDF4
import numpy as np

SPACING, TOP = 50.0, 3000.0  # width of cells and height of the domain, m
GRAVITY, HEAT_CAPACITY, VAPORIZATION = 9.81, 1004.0, 2.5e6  # m s-2, J kg-1 K-1, J kg-1
DRY_GAS, VAPOUR_GAS = 287.0, 461.5  # J kg-1 K-1
SURFACE_PRESSURE, REFERENCE = 101500.0, 299.0  # Pa, K
HEAT_FLUX, WATER_FLUX, FRICTION = 8e-3, 5.2e-5, 0.28  # K m s-1, m s-1, m s-1
CORIOLIS = 0.376e-4  # s-1
FRAME = -7.5  # eastward velocity of the grid, m s-1
SPONGE = 2300.0  # height from which vertical motion is damped, m
FLOAT = np.float32


def profile(z, *points):
    """Piecewise linear function of height through points (height, value)."""
    return np.interp(z, *zip(*points))


def saturation(temperature, pressure):
    """Saturation specific humidity in kg/kg and its derivative by temperature (D. Bolton 1980,
    equation 10)."""
    vapour = 611.2 * np.exp(17.67 * (temperature - 273.15) / (temperature - 29.65))
    humid = 0.622 * vapour / (pressure - 0.378 * vapour)
    return humid, humid * VAPORIZATION / (VAPOUR_GAS * temperature**2)


def lifting_condensation_level(temperature, humidity, pressure):
    """Height in m above a parcel at which it condenses (Bolton 1980, equation 21)."""
    vapour = humidity * pressure / (0.622 + 0.378 * humidity) / 100
    condenses = 2840 / (3.5 * np.log(temperature) - np.log(vapour) - 4.805) + 55
    return (temperature - condenses) * HEAT_CAPACITY / GRAVITY


def periodic_divergence(q, speed, axis, spacing):
    """-d(speed q)/dx along a periodic axis; speed[i] is at the face below q[i]."""
    n = q.shape[axis]
    padded = np.concatenate([q.take(range(n - 3, n), axis), q, q.take(range(3), axis)], axis)
    flux = face_flux(padded, speed, axis)
    change = np.empty_like(q)
    below = [slice(None)] * 3
    above = [slice(None)] * 3
    below[axis], above[axis] = slice(0, n - 1), slice(1, n)
    np.subtract(flux[tuple(below)], flux[tuple(above)], out=change[tuple(below)])
    last, first = [slice(None)] * 3, [slice(None)] * 3
    last[axis], first[axis] = slice(n - 1, n), slice(0, 1)
    np.subtract(flux[tuple(last)], flux[tuple(first)], out=change[tuple(last)])
    change *= FLOAT(1 / spacing)
    return change


def vertical_divergence(q, speed, spacing):
    """-d(speed q)/dz; speed has one level more than q. Values beyond walls equal the nearest."""
    padded = np.concatenate([q[:1]] * 3 + [q] + [q[-1:]] * 3)
    flux = face_flux(padded, speed, 0)
    return (flux[:-1] - flux[1:]) * FLOAT(1 / spacing)


def face_flux(padded, speed, axis):
    """Flux through each face by Wicker and Skamarock's fifth order; three values of padding."""
    faces = speed.shape[axis]

    def at(offset):
        part = [slice(None)] * 3
        part[axis] = slice(offset, offset + faces)
        return padded[tuple(part)]

    inner, inner_step = at(2) + at(3), at(3) - at(2)
    middle, middle_step = at(1) + at(4), at(4) - at(1)
    outer, outer_step = at(0) + at(5), at(5) - at(0)
    inner *= FLOAT(37 / 60)
    middle *= FLOAT(8 / 60)
    outer *= FLOAT(1 / 60)
    inner -= middle
    inner += outer
    inner_step *= FLOAT(10 / 60)
    middle_step *= FLOAT(5 / 60)
    outer_step *= FLOAT(1 / 60)
    inner_step -= middle_step
    inner_step += outer_step
    inner *= speed
    inner_step *= np.abs(speed)
    inner -= inner_step
    return inner


def column(values):
    """Values of levels, for fields of the order z, y, x."""
    return values.astype(FLOAT)[:, None, None]


def before(field, axis):
    """Mean of each value and the one before it along a periodic axis."""
    return (field + np.roll(field, 1, axis)) * FLOAT(0.5)


class Projection:
    """Makes staggered velocities free of divergence by the exact inverse of the discrete
    Laplacian."""

    def __init__(self, shape, spacing):
        nz, ny, nx = shape
        self.spacing = spacing
        k = np.arange(nz)
        self.cosines = np.cos(np.pi * np.outer(k, k + 0.5) / nz) * np.sqrt(2 / nz)
        self.cosines[0] *= np.sqrt(0.5)
        dz, dy, dx = spacing
        laplacian = ((2 * np.cos(np.pi * k / nz) - 2) / dz**2)[:, None, None] \
            + ((2 * np.cos(2 * np.pi * np.fft.fftfreq(ny)) - 2) / dy**2)[None, :, None] \
            + ((2 * np.cos(2 * np.pi * np.fft.rfftfreq(nx)) - 2) / dx**2)[None, None, :]
        laplacian[0, 0, 0] = np.inf  # The mean of the pressure is zero.
        self.inverse = 1 / laplacian

    def divergence(self, u, v, w):
        dz, dy, dx = self.spacing
        return (np.roll(u, -1, 2) - u) / dx + (np.roll(v, -1, 1) - v) / dy + (w[1:] - w[:-1]) / dz

    def apply(self, u, v, w):
        """Subtracts the gradient of a potential from the velocities in place."""
        spectrum = np.fft.rfft2(self.divergence(u, v, w))
        flat = self.cosines @ spectrum.reshape(len(spectrum), -1)
        flat = self.cosines.T @ (flat * self.inverse.reshape(flat.shape))
        potential = np.fft.irfft2(flat.reshape(spectrum.shape), u.shape[1:]).astype(FLOAT)
        dz, dy, dx = self.spacing
        u -= (potential - np.roll(potential, 1, 2)) / FLOAT(dx)
        v -= (potential - np.roll(potential, 1, 1)) / FLOAT(dy)
        w[1:-1] -= (potential[1:] - potential[:-1]) / FLOAT(dz)


class Simulation:
    """Fields have the order z, y, x: u, v, w on the lower faces of the cells (w also on the top),
    theta and water at the centres."""

    def __init__(self, cells, seed=1):
        nx, ny, nz = cells
        self.spacing = (TOP / nz, SPACING, SPACING)
        self.z = (np.arange(nz) + 0.5) * self.spacing[0]
        z = self.z
        theta = profile(z, (0, 298.7), (520, 298.7), (1480, 302.4), (2000, 308.2), (3000, 311.85))
        water = profile(z, (0, 17.0), (520, 16.3), (1480, 10.7), (2000, 4.2), (3000, 3.0)) / 1000
        wind = profile(z, (0, -8.75), (700, -8.75), (3000, -4.61)) - FRAME
        shape = (nz, ny, nx)
        random = np.random.default_rng(seed)
        noise = random.uniform(-1, 1, (2, *shape)) * (z < 1600)[:, None, None]
        full = np.ones(shape)
        self.theta = (theta[:, None, None] * full + 0.1 * noise[0]).astype(FLOAT)
        self.water = (water[:, None, None] * full + 2.5e-5 * noise[1]).astype(FLOAT)
        self.u = (wind[:, None, None] * full).astype(FLOAT)
        self.v = np.zeros(shape, FLOAT)
        self.w = np.zeros((nz + 1, ny, nx), FLOAT)
        self.set_base(theta, water)
        self.set_forcing()
        self.projection = Projection(shape, self.spacing)
        self.seconds = 0.0
        self.water_gained = 0.0  # column mean, kg/kg m

    def set_base(self, theta, water):
        """Exner function by the hydrostatic equation of the initial profiles."""
        dz = self.spacing[0]
        slope = GRAVITY / (HEAT_CAPACITY * theta * (1 + 0.608 * water))
        ground = (SURFACE_PRESSURE / 1e5) ** (DRY_GAS / HEAT_CAPACITY)
        exner = ground - (np.cumsum(slope) - slope / 2) * dz
        self.exner = exner.astype(FLOAT)[:, None, None]
        self.pressure = (1e5 * exner ** (HEAT_CAPACITY / DRY_GAS)).astype(FLOAT)[:, None, None]

    def set_forcing(self):
        z = self.z
        self.subsidence = profile(z, (0, 0), (1500, -0.0065), (2100, 0))
        self.cooling = profile(z, (0, -2), (1500, -2), (3000, 0)) / 86400
        self.drying = profile(z, (0, -1.2e-8), (300, -1.2e-8), (500, 0))
        self.geostrophic = -10 + 1.8e-3 * z - FRAME
        faces = np.arange(1, len(z)) * self.spacing[0]
        rise = np.clip((faces - SPONGE) / (TOP - SPONGE), 0, 1)
        self.damping = (0.02 * np.sin(np.pi / 2 * rise) ** 2).astype(FLOAT)[:, None, None]

    def liquid(self, theta, water):
        """Cloud water in kg/kg: Newton's method for T = T_l + L/c_p (q_t - q_s(T)) where air is
        saturated."""
        cold = theta * self.exner
        cloudy = water > saturation(cold, self.pressure)[0]
        condensate = np.zeros_like(theta)
        if cloudy.any():
            start, total = cold[cloudy], water[cloudy]
            pressure = np.broadcast_to(self.pressure, theta.shape)[cloudy]
            warm = start.copy()
            for _ in range(4):
                humid, slope = saturation(warm, pressure)
                excess = warm - start - VAPORIZATION / HEAT_CAPACITY * (total - humid)
                warm -= excess / (1 + VAPORIZATION / HEAT_CAPACITY * slope)
            condensate[cloudy] = np.maximum(total - saturation(warm, pressure)[0], 0)
        return condensate

    def buoyancy(self, theta, water):
        liquid = self.liquid(theta, water)
        warm = theta + FLOAT(VAPORIZATION / HEAT_CAPACITY) / self.exner * liquid
        virtual = warm * (1 + FLOAT(0.608) * water - FLOAT(1.608) * liquid)
        virtual -= virtual.mean((1, 2), dtype=np.float64, keepdims=True).astype(FLOAT)
        return virtual * FLOAT(GRAVITY / REFERENCE)

    def transport(self, q, u, v, w):
        """Change of q by advection; velocities are at the lower faces of q's cells."""
        dz, dy, dx = self.spacing
        change = periodic_divergence(q, u, 2, dx)
        change += periodic_divergence(q, v, 1, dy)
        change += vertical_divergence(q, w, dz)
        return change

    def column_sources(self, q, own):
        """Subsidence of the mean profile of q and its own source, as columns."""
        mean = q.mean((1, 2), dtype=np.float64)
        return own - self.subsidence * np.gradient(mean, self.spacing[0])

    def changes(self, u, v, w, theta, water):
        """Time derivatives of all five fields without pressure."""
        dz = self.spacing[0]
        du = self.transport(u, before(u, 2), before(v, 2), before(w, 2))
        dv = self.transport(v, before(u, 1), before(v, 1), before(w, 1))
        half = FLOAT(0.5)
        dw = np.zeros_like(w)
        dw[1:-1] = self.transport(w[1:-1], (u[1:] + u[:-1]) * half, (v[1:] + v[:-1]) * half,
                                  (w[1:] + w[:-1]) * half)
        float_up = self.buoyancy(theta, water)
        dw[1:-1] += (float_up[1:] + float_up[:-1]) * half - self.damping * w[1:-1]
        dtheta = self.transport(theta, u, v, w)
        dwater = self.transport(water, u, v, w)
        east, north = u.mean((1, 2), dtype=np.float64), v.mean((1, 2), dtype=np.float64)
        du += column(self.column_sources(u, CORIOLIS * north))
        dv += column(self.column_sources(v, CORIOLIS * (self.geostrophic - east)))
        dtheta += column(self.column_sources(theta, self.cooling))
        wet = self.column_sources(water, self.drying)
        dwater += column(wet)
        speed = np.hypot(east[0] + FRAME, north[0])
        du[0] -= FLOAT(FRICTION**2 / speed / dz) * (u[0] + FLOAT(FRAME))
        dv[0] -= FLOAT(FRICTION**2 / speed / dz) * v[0]
        dtheta[0] += FLOAT(HEAT_FLUX / dz)
        dwater[0] += FLOAT(WATER_FLUX / dz)
        return (du, dv, dw, dtheta, dwater), wet.sum() * dz + WATER_FLUX

    def step(self, longest):
        """One step of three stages, at most `longest` seconds."""
        dz, dy, dx = self.spacing
        rate = (np.abs(self.u) / dx + np.abs(self.v) / dy + np.abs(self.w[1:]) / dz).max()
        duration = min(longest, 10.0, 0.9 / max(float(rate), 1e-9))
        start = (self.u, self.v, self.w, self.theta, self.water)
        state = start
        for part in (3, 2, 1):
            changes, gain = self.changes(*state)
            state = tuple(a + FLOAT(duration / part) * b for a, b in zip(start, changes))
            self.projection.apply(*state[:3])
        self.u, self.v, self.w, self.theta, self.water = state
        self.seconds += duration
        self.water_gained += duration * gain

    def column_water(self):
        return self.water.mean((1, 2), dtype=np.float64).sum() * self.spacing[0]


def describe(model):
    """Figures of the state: a dictionary of numbers."""
    liquid = model.liquid(model.theta, model.water)
    cloudy = liquid > 1e-5
    levels = np.nonzero(cloudy.mean((1, 2)) > 5e-4)[0]
    mixed = model.z < 400
    theta = model.theta[mixed].mean(dtype=np.float64)
    water = model.water[mixed].mean(dtype=np.float64)
    exner, pressure = float(model.exner[0, 0, 0]), float(model.pressure[0, 0, 0])
    level = model.z[0] + lifting_condensation_level(theta * exner, water, pressure)
    half = model.spacing[0] / 2
    return {
        "minutes": model.seconds / 60,
        "w max": float(model.w.max()),
        "ql max": float(liquid.max()),
        "cover": float(cloudy.any(0).mean()),
        "base": model.z[levels[0]] - half if len(levels) else np.nan,
        "top": model.z[levels[-1]] + half if len(levels) else np.nan,
        "condensation": level,
        "divergence": float(np.abs(model.projection.divergence(model.u, model.v, model.w)).max()),
    }


def report(model, start_water):
    state = describe(model)
    state["water error"] = (model.column_water() - model.water_gained) / start_water - 1
    print(", ".join(f"{name} {value:.4g}" for name, value in state.items()), flush=True)
    return state


def check(state):
    """Ends the program if the result contradicts the equations."""
    if not state["divergence"] < 1e-5:  # s-1; rounding of 5 m/s over 40 m is 1e-8 a step.
        sys.exit("cumulus: the flow is not free of divergence")
    if not abs(state["water error"]) < 1e-5:
        sys.exit("cumulus: total water differs from its sources")
    if state["cover"] > 0 and not abs(state["base"] - state["condensation"]) < 150:
        sys.exit("cumulus: the cloud base is not at the lifting condensation level")


FIELDS = {  # name: (standard name, long name, unit)
    "u": ("eastward_wind", "eastward wind", "m s-1"),
    "v": ("northward_wind", "northward wind", "m s-1"),
    "w": ("upward_air_velocity", "upward wind", "m s-1"),
    "ql": ("mass_fraction_of_cloud_liquid_water_in_air", "cloud water", "kg kg-1"),
    "qt": (None, "total water", "kg kg-1"),
    "thetal": (None, "liquid water potential temperature", "K"),
}


def create(path, model, command):
    with netCDF4.Dataset(path, "w") as file:
        file.Conventions = "CF-1.8"
        file.title = "Trade-wind cumulus"
        file.source = "scripts/gallery_data/cumulus.py, a large-eddy simulation of BOMEX"
        file.references = "Siebesma et al. 2003, J. Atmos. Sci. 60, 1201-1219"
        file.history = f"{datetime.date.today()}: {command}"
        file.createDimension("time", None)
        stamp = file.createVariable("time", "f8", ("time",))
        stamp.units, stamp.standard_name = "seconds since 1969-06-22 00:00:00", "time"
        lengths = model.theta.shape
        for axis, length, spacing in zip("zyx", lengths, model.spacing):
            file.createDimension(axis, length)
            points = file.createVariable(axis, "f4", (axis,))
            points.units, points.axis = "km", axis.upper()
            points[:] = (np.arange(length) + 0.5) * spacing / 1000
        file["z"].standard_name, file["z"].positive = "height", "up"
        file["x"].long_name, file["y"].long_name = "eastward distance", "northward distance"
        for name, (standard, long, unit) in FIELDS.items():
            field = file.createVariable(name, "f4", ("time", "z", "y", "x"), zlib=True, complevel=1,
                                        chunksizes=(1, *lengths))
            field.long_name, field.units = long, unit
            if standard:
                field.standard_name = standard


def append(path, model):
    half = FLOAT(0.5)
    centres = {
        "u": (model.u + np.roll(model.u, -1, 2)) * half + FLOAT(FRAME),
        "v": (model.v + np.roll(model.v, -1, 1)) * half,
        "w": (model.w[1:] + model.w[:-1]) * half,
        "ql": model.liquid(model.theta, model.water),
        "qt": model.water,
        "thetal": model.theta,
    }
    with netCDF4.Dataset(path, "a") as file:
        step = len(file["time"])
        file["time"][step] = model.seconds
        for name, values in centres.items():
            file[name][step] = values


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs=3, default=(96, 96, 90),
                        metavar=("NX", "NY", "NZ"))
    parser.add_argument("--minutes", type=float, default=75, help="of model time")
    parser.add_argument("--every", type=float, default=15, help="minutes between written steps")
    parser.add_argument("file")
    options = parser.parse_args()
    if min(options.cells) < 8 or not 0 < options.every <= options.minutes:
        parser.error("at least 8 cells a side, and a positive interval up to the run's length")
    began = time.process_time()
    model = Simulation(options.cells)
    start_water = model.column_water()
    part = options.file + ".part"
    create(part, model, " ".join(["cumulus.py"] + sys.argv[1:]))
    while model.seconds < options.minutes * 60 - 1e-6:
        goal = min(model.seconds + options.every * 60, options.minutes * 60)
        while model.seconds < goal - 1e-6:
            model.step(goal - model.seconds)
        state = report(model, start_water)
        append(part, model)
    check(state)
    os.replace(part, options.file)
    print(f"{options.file}: {time.process_time() - began:.0f} s of processor time")


if __name__ == "__main__":
    main()
