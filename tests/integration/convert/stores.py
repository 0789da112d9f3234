"""Stores that `windsplat convert` writes, read without code of the project: shards by the
specification and libblosc. Levels are computed by numpy."""
import importlib.util
import itertools
import json
import pathlib

import numpy as np

READER = pathlib.Path(__file__).parents[2] / "unit/data/formats/read_zarr.py"
SPEC = importlib.util.spec_from_file_location("read_zarr", READER)
read_zarr = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(read_zarr)
read_zarr.without_crc = lambda data: data[:-4]  # in Python a second for each megabyte


class Store:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.root = json.loads((self.folder / "zarr.json").read_text())
        self.nodes = self.root["consolidated_metadata"]["metadata"]
        self.attributes = self.root["attributes"]
        self.own = self.attributes["windsplat"]
        self.levels = [tuple(level["halvings"]) for level in self.own["levels"]]

    def has(self, path):
        return path in self.nodes

    def read(self, path):
        meta = self.nodes[path]
        shape = meta["shape"]
        region = meta["chunk_grid"]["configuration"]["chunk_shape"]
        first = meta["codecs"][0]
        chunk = (first["configuration"]["chunk_shape"] if first["name"] == "sharding_indexed"
                 else region)
        dtype = np.dtype(meta["data_type"]).newbyteorder("<")
        fill = np.nan if meta["fill_value"] == "NaN" else meta["fill_value"]
        padded = [-(-n // r) * r for n, r in zip(shape, region)]
        out = np.full(padded, fill, dtype)
        for place in itertools.product(*[range(n // r) for n, r in zip(padded, region)]):
            file = self.folder / path / "c" / "/".join(map(str, place))
            if not file.exists():
                continue
            size = dtype.itemsize * int(np.prod(chunk))
            for within, data in read_zarr.chunks_of(file.read_bytes(), meta, size):
                begin = [p * r + w * c for p, r, w, c in zip(place, region, within, chunk)]
                where = tuple(slice(b, b + c) for b, c in zip(begin, chunk))
                out[where] = np.frombuffer(data, dtype).reshape(chunk)
        return out[tuple(slice(0, n) for n in shape)]

    def widths(self):
        """Of the cells along x, y and z; None: even."""
        return [None if self.own["widths"][axis] is None else self.read(self.own["widths"][axis])
                for axis in "xyz"]


def groups(values, halvings):
    """(z, y, x) -> (groups along z, y, x, samples of a group); NaN beyond the end."""
    sizes = [1 << h for h in halvings[::-1]]
    ends = [-(-n // s) * s for n, s in zip(values.shape, sizes)]
    padded = np.full(ends, np.nan, values.dtype)
    padded[tuple(slice(0, n) for n in values.shape)] = values
    split = padded.reshape([n for end, s in zip(ends, sizes) for n in (end // s, s)])
    return split.transpose(0, 2, 4, 1, 3, 5).reshape(*split.shape[::2], -1)


def weights(shape, halvings, widths):
    """Of the samples in their groups; they sum up to 1 in every whole or cut group."""
    along = [np.ones(n) if w is None or h == 0 else w
             for n, h, w in zip(shape, halvings[::-1], widths[::-1])]
    product = along[0][:, None, None] * along[1][None, :, None] * along[2][None, None, :]
    out = np.nan_to_num(groups(product, halvings))
    return out / out.sum(axis=-1, keepdims=True)


def two_values(values, halvings, widths):
    """mean, low, high, low share, high share"""
    split = groups(values.astype("f8"), halvings)
    weight = weights(values.shape, halvings, widths)
    there = ~np.isnan(split)
    known = np.where(there, split, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (weight * known).sum(-1) / (weight * there).sum(-1)
        out = [mean]
        shares = []
        below = there & (split < mean[..., None])
        for part in (below, there & ~below):
            share = (weight * part).sum(-1)
            value = np.where(share > 0, (weight * known * part).sum(-1) / share, mean)
            out.append(np.where(np.isnan(mean), np.nan, value))
            shares.append(np.where(np.isnan(mean), np.nan, share))
    return out + shares


def strided(values, stride):
    """The middle sample, the lower of two, of every kernel."""
    def middles(samples):
        first = np.arange(0, samples, stride)
        last = np.minimum(first + stride, samples) - 1
        return first + (last - first) // 2
    return values[np.ix_(*map(middles, values.shape))]
