#!/usr/bin/env python3
"""Reads a Zarr store without code of the project: one of version 3 by its specification and
libblosc, one of version 2 by zarr-python and xarray. Writes the items of every array, little-endian
and with the last dimension fastest, to OUT/PATH with dots for slashes, and prints the size and the
CRC-32C of every chunk file. Usage: read_zarr.py STORE OUT"""
import ctypes
import itertools
import json
import math
import pathlib
import struct
import sys

ABSENT = 2**64 - 1
CODES = {"float32": "f", "float64": "d", "uint32": "I"}


def crc_table():
    for byte in range(256):
        for _ in range(8):
            byte = byte >> 1 ^ (0x82F63B78 if byte & 1 else 0)
        yield byte


TABLE = list(crc_table())


def crc32c(data):
    total = 0xFFFFFFFF
    for byte in data:
        total = total >> 8 ^ TABLE[(total ^ byte) & 0xFF]
    return total ^ 0xFFFFFFFF


def without_crc(data):
    (stored,) = struct.unpack("<I", data[-4:])
    assert stored == crc32c(data[:-4]), "a CRC-32C is wrong"
    return data[:-4]


def unpacked(data, codec, size):
    blosc = ctypes.CDLL("libblosc.so.1")
    name = blosc.blosc_cbuffer_complib
    name.restype = ctypes.c_char_p
    names = {"lz4": b"LZ4", "zstd": b"Zstd"}
    assert name(data) == names[codec["configuration"]["cname"]], name(data)
    out = ctypes.create_string_buffer(size)
    got = blosc.blosc_decompress_ctx(data, out, ctypes.c_size_t(size), 1)
    assert got == size, f"a chunk has {got} bytes"
    return out.raw


def decoded(data, codecs, size):
    for codec in reversed(codecs):
        if codec["name"] == "crc32c":
            data = without_crc(data)
        elif codec["name"] == "blosc":
            data = unpacked(data, codec, size)
        else:
            assert codec == {"name": "bytes", "configuration": {"endian": "little"}}, codec
    assert len(data) == size
    return data


def chunks_of(data, meta, size):
    """(index of the chunk within the file, its bytes) of every chunk that is there."""
    region = meta["chunk_grid"]["configuration"]["chunk_shape"]
    first = meta["codecs"][0]
    if first["name"] != "sharding_indexed":
        yield (0,) * len(region), decoded(data, meta["codecs"], size)
        return
    how = first["configuration"]
    assert how["index_location"] == "end" and len(how["index_codecs"]) == 2
    counts = [r // c for r, c in zip(region, how["chunk_shape"])]
    index = without_crc(data[-16 * math.prod(counts) - 4:])
    for number, place in enumerate(itertools.product(*map(range, counts))):
        begin, length = struct.unpack_from("<QQ", index, 16 * number)
        if (begin, length) != (ABSENT, ABSENT):
            yield place, decoded(data[begin:begin + length], how["codecs"], size)


def read_v3(store, path, meta):
    shape, code = meta["shape"], CODES[meta["data_type"]]
    region = meta["chunk_grid"]["configuration"]["chunk_shape"]
    first = meta["codecs"][0]
    chunk = first["configuration"]["chunk_shape"] if first["name"] == "sharding_indexed" else region
    assert meta["chunk_key_encoding"] == {"name": "default", "configuration": {"separator": "/"}}
    fill = math.nan if meta["fill_value"] == "NaN" else meta["fill_value"]
    items = [fill] * math.prod(shape)
    item = struct.calcsize(code)
    for place in itertools.product(*[range(-(-n // r)) for n, r in zip(shape, region)]):
        file = store / path / "c" / "/".join(map(str, place))
        if not file.exists():
            continue
        for within, data in chunks_of(file.read_bytes(), meta, item * math.prod(chunk)):
            values = struct.unpack(f"<{math.prod(chunk)}{code}", data)
            begin = [p * r + w * c for p, r, w, c in zip(place, region, within, chunk)]
            for value, at in zip(values, itertools.product(*map(range, chunk))):
                index = [b + a for b, a in zip(begin, at)]
                if all(i < n for i, n in zip(index, shape)):
                    place_in_all = 0
                    for i, n in zip(index, shape):
                        place_in_all = place_in_all * n + i
                    items[place_in_all] = value
    return struct.pack(f"<{len(items)}{code}", *items)


def arrays_v3(store):
    root = json.loads((store / "zarr.json").read_text())
    assert root["consolidated_metadata"]["must_understand"] is False
    for path, meta in root["consolidated_metadata"]["metadata"].items():
        alone = json.loads((store / path / "zarr.json").read_text())
        below = alone.pop("consolidated_metadata", None)
        assert alone == meta, f"{path} differs from its consolidated metadata"
        if meta["node_type"] == "array":
            assert below is None and len(meta["dimension_names"]) == len(meta["shape"])
            yield path, read_v3(store, path, meta)
        else:
            own = {name: node for name, node in root["consolidated_metadata"]["metadata"].items()
                   if name.startswith(path + "/")}
            assert {f"{path}/{name}": node for name, node in below["metadata"].items()} == own


def arrays_v2(store):
    import xarray
    import zarr

    root = zarr.open_consolidated(str(store), mode="r")
    plain = zarr.open_group(str(store), mode="r")
    groups = set()
    paths = []
    plain.visititems(lambda path, node: paths.append(path) if hasattr(node, "shape") else None)
    for path in paths:
        items = root[path][...]
        assert items.tobytes() == plain[path][...].tobytes()
        groups.add(path.rpartition("/")[0])
        yield path, items.tobytes()
    for group in groups:
        with xarray.open_zarr(str(store), group=group or None, consolidated=True) as dataset:
            names = {path.rpartition("/")[2] for path in paths if path.rpartition("/")[0] == group}
            assert names == set(dataset.variables), (names, dataset)


def main():
    store, out = map(pathlib.Path, sys.argv[1:])
    out.mkdir(parents=True)
    is_v3 = (store / "zarr.json").exists()
    for path, items in (arrays_v3 if is_v3 else arrays_v2)(store):
        (out / path.replace("/", ".")).write_bytes(items)
    for file in sorted(store.rglob("*")):
        if file.is_file() and file.name != "zarr.json" and not file.name.startswith("."):
            data = file.read_bytes()
            print(file.relative_to(store), len(data), crc32c(data))


if __name__ == "__main__":
    main()
