"""Valid and hostile messages of a loader to the daemon: payloads, frames, and whole calls as
turns (see targets/fuzz_loader*.cpp). Mirrors server/data/loader/{messages,channel}."""

import struct

import sizes

KINDS = {name: i + 1 for i, name in enumerate(
    "open read descriptor names yes no ask_open ask_list ask_exists ask_library progress opened "
    "filled failed".split())}
TURN = b"\n#!turn\n"
RAW = b"\x80"
PAYLOAD, SOCKET = b"\0", b"\1"


def text(value):
    return struct.pack("<Q", len(value)) + value


def texts(values):
    return struct.pack("<Q", len(values)) + b"".join(map(text, values))


def doubles(values):
    return struct.pack(f"<Q{len(values)}d", len(values), *values)


def axis(name, values, kind=6):
    return text(name) + text(b"") + text(b"m") + bytes([kind]) + doubles(values)


def field(name, components, derived=0):
    kind = bytes([0 if len(components) == 1 else 1])
    units = texts([b"m/s"] * len(components))
    names = text(b"") + text(b"") + text(b"float32")
    sizes_decoded = struct.pack("<QQ", 1024, 256)  # sizes of a step and of a chunk
    return (text(name) + kind + texts(components) + text(b"m/s") + units + names +
            bytes([derived]) + sizes_decoded)


def info(axes=((0.0, 1.0), (0.0, 1.0), (1.0, 0.0)), fields=((b"wind", (b"u", b"v")),),
         columns=None, steps=(0.0,), count_of_steps=None, choices=((b"number", 2, (b"0", b"1")),)):
    out = b"".join(map(text, (b"told", b"", b"told.nc", b"x", b"0", b"", b"")))
    out += b"".join(axis(name, values) for name, values in zip((b"x", b"y", b"z"), axes))
    out += struct.pack("<Q", len(fields)) + b"".join(field(*f) for f in fields)
    out += struct.pack("<Q", 1) + text(b"left") + text(b"out") + texts([b"a note"])
    out += struct.pack("<Q", len(choices))
    out += b"".join(text(name) + struct.pack("<Q", length) + texts(values) + text(b"1")
                    for name, length, values in choices)
    out += struct.pack("<Q", len(steps) if count_of_steps is None else count_of_steps)
    out += b"".join(struct.pack("<d", step) + text(b"0") for step in steps)
    out += bytes([columns is not None])
    if columns is not None:
        out += doubles(columns[0]) + doubles(columns[1])
    return out


def error(kind=3, message=b"bad\x1b data"):
    return bytes([kind]) + text(message)


def frame(kind, payload, size=None, zero=0):
    return struct.pack("<IIQ", kind, zero, len(payload) if size is None else size) + payload


def turn(kind, payload=b""):
    return bytes([KINDS[kind]]) + payload


def loader_seeds():
    square = ([0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0])
    infos = [info(), info(fields=((b"T", (b"T",)), (b"w", (b"u", b"v", b"w"), 1))),
             info(columns=square), info(steps=(0.0, 6.0, 12.0)),
             info(axes=((0.0,), (0.0,), (5.0,))), info(choices=()),
             info(choices=((b"bin", 1, (b"0", b"1")),)),
             info(fields=()), info(steps=()), info(axes=((1.0, 0.0), (0.0,), (0.0,))),
             info(axes=((float("nan"),), (0.0,), (0.0,)))]
    task = struct.pack("<Q", 1 << 30) + texts([b"/usr/share"]) + b"\0\1\0" + text(b"a") + text(
        b"") + text(b"") + text(b"{}") + struct.pack("<Q", 1) + text(b"number") + text(
        b"3") + texts([b"a.nc"])
    payloads = [*infos, error(), error(200), texts([b"a", b"b/"]), task, struct.pack("<d", 0.5)]
    for i, payload in enumerate(payloads):
        yield "loader", f"payload-{i}", PAYLOAD + payload
        yield "loader", f"framed-{i}", SOCKET + frame(12, payload) + frame(13, b"")
    asked = [turn("ask_open", b"some.nc"), turn("ask_open", b"../../etc/passwd"),
             turn("ask_open", b"/etc/passwd"), turn("ask_list"), turn("ask_list", b".."),
             turn("ask_exists", b"some.nc"), turn("ask_library", b"/etc/passwd"),
             turn("ask_library", b"/usr/share/eccodes/definitions/boot.def"),
             turn("progress", struct.pack("<d", 0.5)), turn("progress", struct.pack("<d", 2)),
             turn("failed", error())]
    opened = turn("opened", infos[0])
    for i, said in enumerate(asked):
        yield "loader_call", f"asked-{i}", TURN.join([said, opened, turn("filled")])
        yield "loader_call", f"asked-while-read-{i}", TURN.join([opened, said, turn("filled")])
    values = [b"", struct.pack("<f", 1)[1:], b"\0\xc0\x7f", b"\x80\x7f\0\0\x80"]
    for i, payload in enumerate(infos):
        for j, value in enumerate(values):
            yield "loader_call", f"opened-{i}-{j}", TURN.join(
                [turn("opened", payload), turn("filled", value), turn("filled", value)])


def loader_sizes():
    whole = info()
    for cut in range(0, len(whole), 7):
        yield "loader", f"cut-{cut}", PAYLOAD + whole[:cut]
    for size in sizes.around(65536, 10**6, 2**24, 2**30, 2**31, 2**63, most=20) + [2**64 - 1]:
        count = struct.pack("<Q", min(size, 2**64 - 1))
        yield "loader", f"frame-{size}", SOCKET + frame(12, b"x", min(size, 2**64 - 1))
        yield "loader", f"count-{size}", PAYLOAD + count + b"a" * min(size, 65536)
        yield "loader", f"error-{size}", PAYLOAD + bytes([3]) + count + b"e" * min(size, 70_000)
        yield "loader", f"steps-{size}", PAYLOAD + info(count_of_steps=size)
        yield "loader_call", f"frame-{size}", RAW + frame(12, b"x", min(size, 2**64 - 1))
        yield "loader_call", f"name-{size}", turn("ask_open", b"n" * min(size, 70_000))
    for count in sizes.around(most=8):
        line = tuple(float(i) for i in range(count))
        yield "loader", f"axis-{count}", PAYLOAD + info(axes=(line, line, (0.0,)))
        yield "loader_call", f"asked-{count}", TURN.join(
            [turn("ask_exists", b"a")] * count + [turn("opened", whole), turn("filled")])
        yield "loader_call", f"progress-{count}", TURN.join(
            [turn("progress", struct.pack("<d", 0))] * count + [turn("opened", whole)])
