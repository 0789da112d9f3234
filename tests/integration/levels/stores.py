"""Stores with levels (docs/design/bricks.md, "The store"), written without code of the program, and
the same data as netCDF."""
import json
import pathlib
import struct

import netCDF4
import numpy as np

CHUNK = 64
SHARD = 128
NAN = np.float32(np.nan)


def crc32c(data):
    total = 0xffffffff
    for byte in data:
        total ^= byte
        for _ in range(8):
            total = total >> 1 ^ (0x82f63b78 if total & 1 else 0)
    return total ^ 0xffffffff


def group(attributes):
    return {"zarr_format": 3, "node_type": "group", "attributes": attributes}


class Writer:
    def __init__(self, path):
        self.path = pathlib.Path(path)
        self.nodes = {}

    def put(self, name, node):
        self.nodes[name] = node
        place = self.path / name / "zarr.json"
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(json.dumps(node))

    def array(self, name, values, names, attributes=None, fill="NaN"):
        """One chunk if it has fewer than four dimensions, otherwise shards of chunks."""
        sharded = values.ndim == 4
        little = {"name": "bytes", "configuration": {"endian": "little"}}
        chunk = [1, *(min(n, CHUNK) for n in values.shape[1:])] if sharded else list(values.shape)
        shard = [1, *(c if n <= CHUNK else SHARD for n, c in zip(values.shape[1:], chunk[1:]))
                 ] if sharded else chunk
        codecs = [little]
        if sharded:
            codecs = [{"name": "sharding_indexed", "configuration": {
                "chunk_shape": chunk, "codecs": [little], "index_location": "end",
                "index_codecs": [little, {"name": "crc32c"}]}}]
        self.put(name, {
            "zarr_format": 3, "node_type": "array", "shape": list(values.shape),
            "data_type": values.dtype.name, "fill_value": fill, "codecs": codecs,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": shard}},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
            "dimension_names": list(names), "attributes": attributes or {}})
        if not sharded:
            self.file(name, [0] * values.ndim).write_bytes(values.tobytes())
            return
        counts = [-(-n // s) for n, s in zip(values.shape, shard)]
        for place in np.ndindex(*counts):
            box = [slice(p * s, (p + 1) * s) for p, s in zip(place, shard)]
            self.write_shard(self.file(name, place), values[tuple(box)], shard, chunk)

    def file(self, name, place):
        path = self.path / name / "c" / "/".join(map(str, place))
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    @staticmethod
    def write_shard(path, values, shard, chunk):
        body, index = b"", []
        for place in np.ndindex(*(s // c for s, c in zip(shard, chunk))):
            part = values[tuple(slice(p * c, (p + 1) * c) for p, c in zip(place, chunk))]
            if part.size == 0 or np.isnan(part).all():
                index.append((2**64 - 1, 2**64 - 1))
                continue
            whole = np.full(chunk, NAN, "<f4")
            whole[tuple(slice(n) for n in part.shape)] = part
            index.append((len(body), whole.nbytes))
            body += whole.tobytes()
        if body:
            table = b"".join(struct.pack("<QQ", *one) for one in index)
            path.write_bytes(body + table + struct.pack("<I", crc32c(table)))

    def end(self, attributes):
        root = group(attributes)
        root["consolidated_metadata"] = {"kind": "inline", "must_understand": False,
                                         "metadata": self.nodes}
        (self.path / "zarr.json").write_text(json.dumps(root))


def shares(widths, halvings):
    """Weights within groups of 2^halvings."""
    out = np.ones(len(widths), "f4")
    size = 1 << halvings
    for first in range(0, len(widths), size if halvings else len(widths) + 1):
        part = np.asarray(widths[first:first + size], "f8")
        total = 0.0
        for width in part:
            total += width
        if halvings:
            out[first:first + size] = (part / total).astype("f4")
    return out


def grouped(values, weights, halvings):
    """Sums of weighted values and of weights in groups, in the order of the program: over rows, y
    fastest, at full width, then along x."""
    (hz, hy, hx), (wz, wy, wx) = halvings, weights
    nz, ny, nx = values.shape
    dims = [(n - 1 >> h) + 1 for n, h in zip(values.shape, halvings)]
    there = ~np.isnan(values)
    clean = np.where(there, values, np.float32(0))
    total = np.zeros((dims[0], dims[1], nx), "f4")
    weight = np.zeros_like(total)
    for dz in range(1 << hz):
        z = np.arange(dz, nz, 1 << hz)
        for dy in range(1 << hy):
            y = np.arange(dy, ny, 1 << hy)
            if not len(z) or not len(y):
                continue
            w = wz[z][:, None, None] * wy[y][None, :, None]
            at = np.s_[:len(z), :len(y)]
            rows = np.ix_(z, y)
            total[at] += w * clean[rows]
            weight[at] += np.where(there[rows], w, np.float32(0))
    sums = np.zeros(dims, "f4")
    parts = np.zeros(dims, "f4")
    for dx in range(1 << hx):
        x = np.arange(dx, nx, 1 << hx)
        sums[..., :len(x)] += wx[x] * total[..., x]
        parts[..., :len(x)] += wx[x] * weight[..., x]
    return sums, parts


def two_values(values, halvings, widths):
    """low, high and their shares of a scalar (z, y, x)."""
    weights = [shares(w, h) for w, h in zip(widths, halvings)]
    with np.errstate(all="ignore"):
        total, weight = grouped(values, weights, halvings)
        mean = np.where(weight > 0, total / weight, NAN)
        near = mean
        for axis, (h, n) in enumerate(zip(halvings, values.shape)):
            near = np.repeat(near, 1 << h, axis).take(range(n), axis)
        below = (values - near) + np.float32(0) < 0
        out = []
        for half in (below, ~below):
            one, share = grouped(np.where(half, values, NAN), weights, halvings)
            value = np.where(share > 0, one / share, mean)
            out.append((value, np.where(np.isnan(mean), NAN, share)))
    (low, low_share), (high, high_share) = out
    return low, high, low_share, high_share


def hashed(groups):
    """The three numbers of PCG3D (Jarzynski and Olano, 2020) of each index x, y, z."""
    x, y, z = (v * np.uint32(1664525) + np.uint32(1013904223) for v in groups)
    x += y * z
    y += z * x
    z += x * y
    x, y, z = (v ^ v >> np.uint32(16) for v in (x, y, z))
    x += y * z
    y += z * x
    z += x * y
    return x, y, z


def drawn(components, halvings, stride=1):
    """One sample of each group of a vector, masked where there is none at the place drawn."""
    shape = components[0].shape
    dims = [(n - 1 >> h) + 1 for n, h in zip(shape, halvings)]
    k, j, i = np.indices(dims, "u4")
    x, y, z = hashed((i, j, k))
    there = np.ones(dims, bool)
    at = []
    for index, number, h, n in zip((k, j, i), (z, y, x), halvings, shape):
        places = np.uint32(((1 << h) + stride - 1) // stride)
        first = index.astype("i8") << h
        kernel = (first + stride // 2) // stride + ((number >> np.uint32(16)) * places >> 16)
        last = np.minimum((kernel + 1) * stride, n) - 1
        sample = kernel * stride + (last - kernel * stride) // 2
        there &= (kernel * stride < n) & (sample >= first) & (sample < first + (1 << h))
        at.append(np.clip(sample, 0, n - 1))
    return [np.where(there, one[tuple(at)], NAN) for one in components]


def middles(components, level):
    stride = 1 << level
    at = []
    for n in components[0].shape:
        first = np.arange(0, n, stride)
        at.append(first + (np.minimum(first + stride, n) - 1 - first) // 2)
    return [one[np.ix_(*at)] for one in components]


def cell_widths(at):
    """Between the middles of neighbours; the first and last cell are symmetric."""
    edges = np.concatenate([[at[0] - (at[1] - at[0]) / 2], (at[1:] + at[:-1]) / 2,
                            [at[-1] + (at[-1] - at[-2]) / 2]])
    return np.diff(edges)


UNITS = {"cloud": "kg kg-1", "u": "m s-1", "v": "m s-1", "w": "m s-1"}
NAMES = ("time", "z", "y", "x")


def attributes_of(name):
    out = {"units": UNITS[name]}
    if name == "cloud":
        out["standard_name"] = "mass_fraction_of_cloud_condensed_water_in_air"
    else:
        out["windsplat_vector"] = f'wind {"uvw".index(name)}'
    return out


def write_netcdf(path, fields, axes, steps):
    """fields: by name, (time, z, y, x); axes: z, y, x in metres."""
    with netCDF4.Dataset(path, "w") as file:
        for name, values in zip(NAMES, (range(steps), *axes)):
            file.createDimension(name, len(values))
            axis = file.createVariable(name, "f8", (name,))
            axis.units = "hours since 2001-01-01" if name == "time" else "m"
            axis[:] = values
        for name, values in fields.items():
            variable = file.createVariable(name, "f4", NAMES)
            variable.setncatts(attributes_of(name))
            variable[:] = values


def write_store(path, fields, axes, steps, halvings, strided=0, uneven=False):
    """Levels of these halvings (z, y, x), the first of which has none."""
    store = Writer(path)
    store.put("0", group({}))
    for name, values in zip(NAMES, (range(steps), *axes)):
        units = "hours since 2001-01-01" if name == "time" else "m"
        store.array(f"0/{name}", np.asarray(values, "f8"), [name], {"units": units})
    for name, values in fields.items():
        store.array(f"0/{name}", values, NAMES, attributes_of(name))
    widths = [cell_widths(np.asarray(axis, "f8")) for axis in axes]
    for n, level in enumerate(halvings[1:], 1):
        if "cloud" in fields:
            reduced = [two_values(one, level, widths) for one in fields["cloud"]]
            for c, name in enumerate(("low", "high", "low_share", "high_share")):
                store.array(f"{n}/cloud_{name}", np.stack([one[c] for one in reduced]), NAMES)
        if "u" not in fields:
            continue
        for ending, reduce in (("", lambda one: drawn(one, level)),
                               ("_strided", lambda one: middles(one, n))):
            if ending and n > strided:
                continue
            made = [reduce([fields[c][step] for c in "uvw"]) for step in range(steps)]
            for c, name in enumerate("uvw"):
                store.array(f"{n}/{name}{ending}", np.stack([one[c] for one in made]), NAMES)
    told = []
    if "cloud" in fields:
        told.append({"name": "cloud", "components": ["cloud"], "levels": "two_values"})
    if "u" in fields:
        told.append({"name": "wind", "components": ["u", "v", "w"], "levels": "drawn",
                     "strided": strided})
    for one in told:
        squares = sum(fields[c].astype("f8")**2 for c in one["components"])
        values = fields["cloud"] if one["name"] == "cloud" else np.sqrt(squares)
        ranges = [(np.nanmin(step), np.nanmax(step)) for step in values]
        store.array(f'statistics/{one["name"]}_range', np.asarray(ranges, "f4"), ["time", "end"])
        masked = np.isnan(values).sum(axis=(1, 2, 3)).astype("u4")
        store.array(f'statistics/{one["name"]}_masked', masked, ["time"], fill=0)
    if uneven:
        store.array("0/z_widths", widths[0], ["z"])
    store.end({"windsplat": {
        "store": 1, "program": "a test", "source": "a test", "contents": str(path),
        "levels": [{"path": str(n), "halvings": list(one[::-1])}
                   for n, one in enumerate(halvings)],
        "fields": told, "widths": {"x": None, "y": None, "z": "0/z_widths" if uneven else None},
        "statistics": "statistics"}})
