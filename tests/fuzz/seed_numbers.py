"""Common to the small files of all formats: the type Seed, its grid and its numbers."""

import gzip
import math
import struct
import zlib

DIMS = (8, 6, 4)  # x, y, z
COUNT = math.prod(DIMS)


class Seed:
    """Files by name, the first of them the one to open; links by name. `sure`: the unmodified
    file must load. `escapes`: it refers to files outside the data root."""

    def __init__(self, kind, name, files, links=None, path=None, escapes=False, sure=True):
        self.kind = kind
        self.name = name
        self.files = files
        self.links = links or {}
        self.path = path or next(iter(files))
        self.escapes = escapes
        self.sure = sure and not escapes


def numbers(component, step=0):
    nx, ny, nz = DIMS
    return [math.sin(0.7 * x + component) + 0.5 * math.cos(0.9 * y - step) + 0.25 * z
            for z in range(nz) for y in range(ny) for x in range(nx)]


def floats(values, big=False):
    return struct.pack(f"{'>' if big else '<'}{len(values)}f", *values)


def as_text(values):
    return " ".join(f"{v:.4f}" for v in values) + "\n"


def winds(big=False, step=0):
    """Planar order: all u, all v, all w."""
    return b"".join(floats(numbers(c, step), big) for c in range(3))


def interleaved(step=0):
    return [v for triple in zip(*(numbers(c, step) for c in range(3))) for v in triple]


def lz4_block(data):
    """Literals only, without compression."""
    if len(data) < 15:
        return bytes([len(data) << 4]) + data
    rest = len(data) - 15
    return b"\xf0" + b"\xff" * (rest // 255) + bytes([rest % 255]) + data


def coded(data, compressor):
    if compressor == "zlib":
        return {"id": "zlib", "level": 1}, zlib.compress(data)
    if compressor == "gzip":
        return {"id": "gzip", "level": 1}, gzip.compress(data, mtime=0)
    if compressor == "lz4":
        return {"id": "lz4", "acceleration": 1}, struct.pack("<I", len(data)) + lz4_block(data)
    if compressor == "zstd":
        frame = struct.pack("<IBI", 0xFD2FB528, 0xA0, len(data))
        return {"id": "zstd", "level": 1}, frame + struct.pack("<I", 1 | len(data) << 3)[:3] + data
    if compressor == "blosc":
        head = struct.pack("<BBBBIII", 2, 1, 2, 4, len(data), len(data), len(data) + 16)
        return {"id": "blosc", "cname": "lz4", "clevel": 5, "shuffle": 1, "blocksize": 0}, \
            head + data
    return None, data
