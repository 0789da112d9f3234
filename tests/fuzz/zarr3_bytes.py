"""Arrays of Zarr 3 byte by byte, from zarr-specs.readthedocs.io/en/latest/v3."""

import json
import struct

from seed_numbers import coded

ABSENT = 2**64 - 1
# Names in version 3; other compressors of numcodecs have its prefix.
CORE = {"gzip": {"level": 1}, "zstd": {"level": 1, "checksum": False},
        "blosc": {"cname": "lz4", "clevel": 5, "shuffle": "shuffle", "typesize": 4,
                  "blocksize": 0}}


def crc32c(data):
    """The Castagnoli sum of RFC 3720, B.4, little-endian."""
    rest = 0xFFFFFFFF
    for byte in data:
        rest ^= byte
        for _ in range(8):
            rest = rest >> 1 ^ (0x82F63B78 if rest & 1 else 0)
    return struct.pack("<I", rest ^ 0xFFFFFFFF)


def codec(name, **configuration):
    return {"name": name, "configuration": configuration}


def encoded(data, compressor, summed):
    data = coded(data, compressor)[1]
    return data + crc32c(data) if summed else data


def codecs(rank, endian, memory, compressor, summed):
    """Those of a chunk; memory F: the last dimension varies slowest."""
    out = [codec("transpose", order=list(range(rank))[::-1])] if memory == "F" else []
    out.append(codec("bytes", endian=endian))
    if compressor in CORE:
        out.append(codec(compressor, **CORE[compressor]))
    elif compressor != "none":
        out.append(codec(f"numcodecs.{compressor}", level=1))
    return out + [{"name": "crc32c"}] if summed else out


def shard(parts, at_start):
    """parts: encoded chunks in the order of the index; None: absent."""
    index = b""
    data = b""
    first = 16 * len(parts) + 4 if at_start else 0
    for part in parts:
        index += struct.pack("<QQ", ABSENT, ABSENT) if part is None else struct.pack(
            "<QQ", first + len(data), len(part))
        data += part or b""
    index += crc32c(index)
    return index + data if at_start else data + index


def array(name, shape, chunks, dtype, parts, dims, attributes, *, fill=0, endian="little",
          memory="C", compressor="none", summed=False, shards=None, at_start=False):
    """The files of an array. parts: bytes of the chunks by place; absent ones have the value
    `fill`. shards: chunks of a shard along each dimension; None: a file holds one chunk."""
    inner = codecs(len(shape), endian, memory, compressor, summed)
    done = {at: encoded(data, compressor, summed) for at, data in parts.items()}
    outer = chunks
    if shards:
        outer = [n * many for n, many in zip(chunks, shards)]
        whole = {}
        for at in done:
            whole.setdefault(tuple(i // many for i, many in zip(at, shards)), None)
        for at in whole:
            inside = [[i * many + k for k in range(many)] for i, many in zip(at, shards)]
            places = [()]
            for along in inside:
                places = [(*place, k) for place in places for k in along]
            whole[at] = shard([done.get(place) for place in places], at_start)
        done = whole
        inner = [codec("sharding_indexed", chunk_shape=list(chunks), codecs=inner,
                       index_codecs=[codec("bytes", endian="little"), {"name": "crc32c"}],
                       index_location="start" if at_start else "end")]
    meta = {"zarr_format": 3, "node_type": "array", "shape": list(shape), "data_type": dtype,
            "chunk_grid": codec("regular", chunk_shape=list(outer)),
            "chunk_key_encoding": codec("default", separator="/"), "fill_value": fill,
            "codecs": inner, "dimension_names": dims, "attributes": attributes}
    return {f"{name}/zarr.json": json.dumps(meta).encode()} | {
        "/".join([name, "c", *map(str, at)]): data for at, data in done.items()}


def group(attributes, members=None):
    """zarr.json of a group; members: zarr.json of its arrays by name, to be consolidated."""
    meta = {"zarr_format": 3, "node_type": "group", "attributes": attributes}
    if members is not None:
        meta["consolidated_metadata"] = {"kind": "inline", "must_understand": False,
                                         "metadata": members}
    return json.dumps(meta).encode()
