"""Writes HDF5 files byte by byte (superblock 0, object headers 1), for features that no library
writes: datasets stored elsewhere by an external link, external storage or as a virtual dataset.
Also corrects header checksums after a mutation, which would otherwise be detected first."""

import struct

UNDEFINED = 0xFFFFFFFFFFFFFFFF
ROOT_AT = 96


def padded(data, to=8):
    return data + b"\0" * (-len(data) % to)


def object_header(messages):
    body = b"".join(struct.pack("<HHB3x", kind, len(padded(data)), 0) + padded(data)
                    for kind, data in messages)
    return struct.pack("<BxHII4x", 1, len(messages), 1, len(body)) + body


def link(name, kind, value):
    return (6, bytes([1, 8, kind, len(name)]) + name.encode() + value)


def hard_link(name, address):
    return link(name, 0, struct.pack("<Q", address))


def external_link(name, file, path):
    value = b"\0" + file.encode() + b"\0" + path.encode() + b"\0"
    return link(name, 64, struct.pack("<H", len(value)) + value)


def dataset(dims, layout, more=()):
    """The type of 32-bit little-endian floats."""
    space = struct.pack("<BBBx4x", 1, len(dims), 0) + struct.pack(f"<{len(dims)}Q", *dims)
    number = struct.pack("<BBBBIHHBBBBI", 0x11, 0x20, 31, 0, 4, 0, 32, 23, 8, 0, 23, 127)
    return object_header([(1, space), (3, number), (5, bytes([2, 2, 2, 0])), (8, layout), *more])


def contiguous(address, size):
    return struct.pack("<BBQQ", 3, 1, address, size)


class File:
    def __init__(self, links_bytes=1024):
        self.links = []
        self.body = b""
        self.begin = ROOT_AT + links_bytes

    def put(self, data):
        address = self.begin + len(self.body)
        self.body += padded(data)
        return address

    def add(self, name, dims, values):
        layout = contiguous(self.put(values), len(values))
        self.links.append(hard_link(name, self.put(dataset(dims, layout))))

    def add_linked(self, name, file, path):
        self.links.append(external_link(name, file, path))

    def add_stored_elsewhere(self, name, dims, file, size):
        names = padded(b"\0" * 8 + file.encode() + b"\0")
        heap = self.put(b"HEAP\0\0\0\0" + struct.pack("<QQQ", len(names), 1, self.put(names)))
        slots = struct.pack("<B3xHHQQQQ", 1, 1, 1, heap, 8, 0, size)
        header = dataset(dims, contiguous(UNDEFINED, size), [(7, slots)])
        self.links.append(hard_link(name, self.put(header)))

    def add_virtual(self, name, dims, file, source):
        everything = struct.pack("<IIII", 3, 1, 0, 0)
        block = struct.pack("<BQ", 0, 1) + file.encode() + b"\0" + source.encode() + b"\0"
        block += everything * 2
        block += struct.pack("<I", lookup3(block))
        item = struct.pack("<HH4xQ", 1, 1, len(block)) + padded(block)
        rest = 4096 - 16 - len(item)
        heap = b"GCOL\1\0\0\0" + struct.pack("<Q", 4096) + item
        heap += struct.pack("<HH4xQ", 0, 0, rest) + b"\0" * (rest - 16)
        layout = struct.pack("<BBQI", 4, 3, self.put(heap), 1)
        self.links.append(hard_link(name, self.put(dataset(dims, layout))))

    def bytes(self):
        info = struct.pack("<BBQQ", 0, 0, UNDEFINED, UNDEFINED)
        root = object_header([(2, info), (10, b"\0\0"), *self.links])
        assert ROOT_AT + len(root) <= self.begin, "room for links"
        root += b"\0" * (self.begin - ROOT_AT - len(root))
        end = self.begin + len(self.body)
        head = b"\x89HDF\r\n\x1a\n" + struct.pack("<8BHHI", 0, 0, 0, 0, 0, 8, 8, 0, 4, 16, 0)
        head += struct.pack("<QQQQ", 0, UNDEFINED, end, UNDEFINED)
        head += struct.pack("<QQII16x", 0, ROOT_AT, 0, 0)
        return head + root + self.body


def lookup3(data):
    """Bob Jenkins' hash, the checksum of the format's blocks."""
    mask = 0xFFFFFFFF

    def rotated(x, by):
        return ((x << by) | (x >> (32 - by))) & mask

    a = b = c = (0xDEADBEEF + len(data)) & mask
    blocks = max(0, (len(data) - 1) // 12)
    for i in range(blocks):
        x, y, z = struct.unpack_from("<III", data, 12 * i)
        a, b, c = (a + x) & mask, (b + y) & mask, (c + z) & mask
        for by_a, by_b, by_c in ((4, 6, 8), (16, 19, 4)):
            a = (a - c) & mask ^ rotated(c, by_a)
            c = (c + b) & mask
            b = (b - a) & mask ^ rotated(a, by_b)
            a = (a + c) & mask
            c = (c - b) & mask ^ rotated(b, by_c)
            b = (b + a) & mask
    tail = data[12 * blocks:]
    if not tail:
        return c
    x, y, z = struct.unpack("<III", tail + b"\0" * (12 - len(tail)))
    a, b, c = (a + x) & mask, (b + y) & mask, (c + z) & mask
    for target, source, by in (("c", "b", 14), ("a", "c", 11), ("b", "a", 25), ("c", "b", 16),
                               ("a", "c", 4), ("b", "a", 14), ("c", "b", 24)):
        values = {"a": a, "b": b, "c": c}
        values[target] = ((values[target] ^ values[source]) - rotated(values[source], by)) & mask
        a, b, c = values["a"], values["b"], values["c"]
    return c


def summed_anew(data):
    """Corrects the checksums of superblocks 2 and 3 and of version 2 object headers."""
    out = bytearray(data)
    if data[8:9] in (b"\2", b"\3") and len(data) >= 48:
        out[44:48] = struct.pack("<I", lookup3(data[:44]))
    at = data.find(b"OHDR")
    while at >= 0:
        flags = data[at + 5] if at + 5 < len(data) else 0
        begin = at + 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        end = begin + width + int.from_bytes(data[begin:begin + width], "little")
        if end + 4 <= min(len(data), at + 8192):
            out[end:end + 4] = struct.pack("<I", lookup3(bytes(out[at:end])))
        at = data.find(b"OHDR", at + 4)
    return bytes(out)
