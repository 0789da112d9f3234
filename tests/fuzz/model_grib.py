"""Writes GRIB 1 and 2 messages byte by byte, in simple packing on a grid of latitudes and
longitudes (WMO Manual on Codes, templates 3.0, 4.0, 5.0 and 7.0; edition 1 likewise)."""

import struct

import numpy as np

import model as models

# Edition 2: discipline 0, category, number. Edition 1: ECMWF's table 128.
PARAMETERS = {2: {"u": (2, 2), "v": (2, 3), "wz": (2, 9), "t": (0, 0)},
              1: {"u": 131, "v": 132, "t": 130, "q": 133}}
UNITS = {"u": "m s**-1", "v": "m s**-1", "wz": "m s**-1", "t": "K", "q": "kg kg**-1"}
I_NEGATIVE, J_POSITIVE, J_CONSECUTIVE, ALTERNATING = 128, 64, 32, 16


def signed(value, size):
    """Sign and magnitude, the encoding of negative numbers in GRIB."""
    value = int(value)
    sign = 1 << (8 * size - 1) if value < 0 else 0
    return (abs(value) | sign).to_bytes(size, "big")


def ibm_float(value):
    """The four bytes, and the number that they represent."""
    if value == 0:
        return b"\0\0\0\0", 0.0
    sign = 0x80 if value < 0 else 0
    exponent, fraction = 64, abs(float(value))
    while fraction >= 1:
        fraction, exponent = fraction / 16, exponent + 1
    while fraction < 1 / 16:
        fraction, exponent = fraction * 16, exponent - 1
    mantissa = min(int(fraction * 2**24), 2**24 - 1)
    kept = mantissa / 2.0**24 * 16.0 ** (exponent - 64)
    return bytes([sign | exponent]) + mantissa.to_bytes(3, "big"), -kept if sign else kept


def packed_bits(numbers, bits):
    """Packs numbers of that many bits each, most significant bit first."""
    if not bits:
        return b""
    shifts = np.arange(bits - 1, -1, -1, dtype=np.uint64)
    numbers = np.asarray(numbers, np.uint64).reshape(-1, 1)
    return np.packbits((numbers >> shifts & np.uint64(1)).astype(np.uint8).ravel()).tobytes()


def scanned(grid, scan):
    """A (y, x) array in the order of the message: rows unchanged unless `scan` reorders them."""
    if scan & J_CONSECUTIVE:
        grid = grid.T
    if scan & ALTERNATING:
        grid = grid.copy()
        grid[1::2] = grid[1::2, ::-1]
    return grid.ravel()


def section(number, body):
    return struct.pack(">IB", 5 + len(body), number) + body


def scan_of(model):
    lon, lat = model.axes["x"].values, model.axes["y"].values
    return ((I_NEGATIVE if lon[-1] < lon[0] else 0) | (J_POSITIVE if lat[-1] > lat[0] else 0)
            | model.options.get("scan", 0))


def corners(model, unit):
    lon, lat = model.axes["x"].values % 360, model.axes["y"].values
    ends = [round(v * unit) for v in (lat[0], lon[0], lat[-1], lon[-1])]
    steps = [round(abs(v[-1] - v[0]) / max(1, len(v) - 1) * unit)
             for v in (model.axes["x"].values, lat)]
    return ends, steps


def message2(model, field, t, z):
    nx, ny = model.shape[3], model.shape[2]
    (la1, lo1, la2, lo2), (di, dj) = corners(model, 1e6)
    hour = int(model.axes["t"].values[t])
    reference, binary, decimal, bits = field.packing[t, z]
    absent = scanned(field.absent[t, z], scan_of(model))
    numbers = scanned(field.stored[t, z], scan_of(model))[~absent]
    category, number = PARAMETERS[2][field.name]
    grid = struct.pack(">BIBBH", 0, nx * ny, 0, 0, 0) + b"\6" + b"\xff" * 15
    grid += struct.pack(">IIII", nx, ny, 0, 0xFFFFFFFF) + signed(la1, 4) + signed(lo1, 4)
    grid += bytes([0x30]) + signed(la2, 4) + signed(lo2, 4) + struct.pack(">II", di, dj)
    grid += bytes([scan_of(model)])
    product = struct.pack(">HHBBBBBHBBIBBIBBI", 0, 0, category, number, 2, 0, 255, 0, 0, 1, hour,
                          103, 0, int(model.axes["z"].values[z]), 255, 255, 0xFFFFFFFF)
    packing = struct.pack(">IHf", len(numbers), 0, reference) + signed(binary, 2)
    packing += signed(decimal, 2) + bytes([bits, 0])
    bitmap = b"\xff"
    if absent.any() or model.options.get("bitmap"):
        bitmap = b"\0" + np.packbits(~absent).tobytes()
    body = section(1, struct.pack(">HHBBBHBBBBBBB", 98, 0, 4, 0, 1, 2001, 1, 1, 0, 0, 0, 0, 1))
    body += section(3, grid) + section(4, product) + section(5, packing) + section(6, bitmap)
    body += section(7, packed_bits(numbers, bits)) + b"7777"
    return b"GRIB\0\0" + struct.pack(">BBQ", 0, 2, 16 + len(body)) + body


def section1(body):
    return (3 + len(body)).to_bytes(3, "big") + body


def message1(model, field, t, z):
    nx, ny = model.shape[3], model.shape[2]
    (la1, lo1, la2, lo2), (di, dj) = corners(model, 1e3)
    reference, binary, decimal, bits = field.packing[t, z]
    absent = scanned(field.absent[t, z], scan_of(model))
    numbers = scanned(field.stored[t, z], scan_of(model))[~absent]
    masked = absent.any() or model.options.get("bitmap")
    product = bytes([128, 98, 1, 255, 128 | (64 if masked else 0), PARAMETERS[1][field.name], 100])
    product += struct.pack(">HBBBBBBBBBHBBB", int(model.axes["z"].values[z]), 1, 1, 1, 0, 0, 1,
                           int(model.axes["t"].values[t]), 0, 0, 0, 0, 21, 0)
    product += signed(decimal, 2)
    grid = struct.pack(">BBBHH", 0, 255, 0, nx, ny) + signed(la1, 3) + signed(lo1, 3) + b"\x80"
    grid += signed(la2, 3) + signed(lo2, 3) + struct.pack(
        ">HHB4x", min(di, 65535), min(dj, 65535), scan_of(model))
    body = section1(product) + section1(grid)
    if masked:
        bitmap = np.packbits(~absent).tobytes()
        bitmap += b"\0" * (len(bitmap) % 2)
        body += section1(bytes([8 * len(bitmap) - len(absent)]) + b"\0\0" + bitmap)
    data = packed_bits(numbers, bits)
    data += b"\0" * ((11 + len(data)) % 2)
    unused = 8 * len(data) - bits * len(numbers)
    body += section1(bytes([unused]) + signed(binary, 2) + ibm_float(reference)[0] + bytes([bits])
                     + data) + b"7777"
    return b"GRIB" + (8 + len(body)).to_bytes(3, "big") + b"\1" + body


def edition_of(model):
    return 1 if model.kind == "grib 1" else 2


def written(model):
    """A message for every field, step and level; messages may be omitted or repeated."""
    messages = []
    for field in model.fields:
        for t in range(model.shape[0]):
            for z in range(model.shape[1]):
                if (field.name, t, z) not in model.options.get("left out", ()):
                    make = message1 if edition_of(model) == 1 else message2
                    messages.append(make(model, field, t, z))
    if "messages" in model.options:
        messages = [messages[i] for i in model.options["messages"](len(messages))]
    return {"g.grib": b"".join(messages)}, "g.grib"


def grib_model(kind, dice):
    out = models.cf_model(kind, dice)
    out.rule = "grib"
    steps, nz, ny, nx = out.shape
    # Multiples of the edition's unit, so that coordinates are exact.
    out.axes["x"].values = np.round(10 + 7.5 * np.arange(nx), 3)
    out.axes["y"].values = np.round(40 - 8.5 * np.arange(ny), 3)
    # ecCodes has separate parameters for 10, 100 and 200 m.
    out.axes["z"].values += 50
    if kind == "grib 1":
        out.axes["z"].values = np.array([1000.0, 850, 500, 200, 100])[:nz]
        out.axes["z"].attributes["units"] = "hPa"
    out.fields = []
    for name in PARAMETERS[edition_of(out)]:
        values = models.random_values(dice, (steps, nz, ny, nx)).astype(np.float64)
        field = models.Field(name, np.zeros(values.shape, np.int64), units=UNITS[name])
        field.packing = np.empty((steps, nz), object)
        for at in np.ndindex(steps, nz):
            pack(field, at, values[at], 16, 3, edition_of(out))
        out.fields.append(field)
    return out


def pack(field, at, values, bits, decimal, edition):
    """Chooses the reference value and the binary scale factor as encoders do."""
    reference = kept_reference(values.min() * 10.0**decimal, edition)
    span = max((values * 10.0**decimal - reference).max(), 1e-30)
    binary = int(np.ceil(np.log2(span / (2**bits - 1)))) if bits else 0
    field.packing[at] = (reference, binary, decimal, bits)
    numbers = np.round((values * 10.0**decimal - reference) / 2.0**binary)
    field.stored[at] = np.clip(numbers, 0, 2**bits - 1)


def kept_reference(wanted, edition):
    """The nearest representable number: IBM's float in edition 1, IEEE's in edition 2."""
    return ibm_float(wanted)[1] if edition == 1 else float(np.float32(wanted))
