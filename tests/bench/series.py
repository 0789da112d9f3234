"""Writes a series of time steps as a netCDF classic file (64-bit offsets) without any library:
one scalar field of 32-bit floats, whose steps differ."""
import array
import math
import struct
import sys

NC_DIMENSION, NC_VARIABLE, NC_FLOAT, NC_DOUBLE = 10, 11, 5, 6


def big_endian(values):
    out = array.array("f", values)
    if sys.byteorder == "little":
        out.byteswap()
    return out.tobytes()


def name(text):
    return struct.pack(">I", len(text)) + text.encode().ljust(-len(text) % 4 + len(text), b"\0")


def header(dims, steps):
    x, y, z = dims
    begin = 4096
    sizes = (("time", 0), ("z", z), ("y", y), ("x", x))  # 0: the record dimension
    out = b"CDF\x02" + struct.pack(">I", steps)
    out += struct.pack(">II", NC_DIMENSION, len(sizes))
    out += b"".join(name(key) + struct.pack(">I", size) for key, size in sizes)
    out += struct.pack(">II", 0, 0)  # no global attributes
    out += struct.pack(">II", NC_VARIABLE, 1) + name("density")
    out += struct.pack(">IIIII", 4, 0, 1, 2, 3) + struct.pack(">II", 0, 0)
    out += struct.pack(">IIQ", NC_FLOAT, 4 * x * y * z, begin)
    return out.ljust(begin, b"\0")


def write_series(path, dims, steps):
    """Cloud layers that move up by one sample each step."""
    x, y, z = dims
    wave = [0.5 + 0.5 * math.sin(0.1 * i) for i in range(max(x, y) + z)]
    layers = []
    for k in range(z):
        rows = [big_endian(wave[k:k + x]), big_endian(wave[k + 1:k + 1 + x])]
        layers.append(b"".join(rows[j % 2] for j in range(y)))
    with open(path, "wb") as out:
        out.write(header(dims, steps))
        for step in range(steps):
            for k in range(z):
                out.write(layers[(k + step) % z])
