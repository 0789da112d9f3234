"""Inputs with sizes at boundaries: 2^k - 1, 2^k and 2^k + 1, and every limit with its neighbours.
Coverage does not lead a fuzzer to sizes that matter only to a library's buffer: a trailer of 66 kB
crashed a server that 627,000 executions had not. Deterministic; yields (target, name, bytes).
"""

import json
import struct

HEADER_MAX = 8192
BODY_MAX = 65536
DEPTH_MAX = 32
VIEW = {"dataset": "climate", "image": {"width": 8, "height": 6}}
UPGRADED = b"\0"  # fuzz_websocket: raw bytes on the wire
LINES = b"\1"     # one message per line


def around(*limits, most=17):
    """Every power of two with its neighbours, and the limits with theirs."""
    sizes = {0, 1}
    for middle in [1 << k for k in range(1, most + 1)] + list(limits):
        sizes |= {middle - 1, middle, middle + 1}
    return sorted(sizes)


def get(target=b"/livez", fields=(), version=b"HTTP/1.1"):
    lines = [b"GET " + target + b" " + version, b"Host: localhost", *fields]
    return b"\r\n".join(lines) + b"\r\n\r\n"


def post(body, length=None, fields=(), target=b"/v1/views"):
    length = len(body) if length is None else length
    lines = [b"POST " + target + b" HTTP/1.1", b"Host: localhost",
             b"Content-Type: application/json", b"Content-Length: %d" % length, *fields]
    return b"\r\n".join(lines) + b"\r\n\r\n" + body


def padded_view(size):
    """A view of exactly that many bytes; truncated below its minimal length."""
    text = json.dumps(VIEW).encode()
    return text[:size] if size < len(text) else text + b" " * (size - len(text))


def http_sizes():
    """(what grows, bytes); the header's fixed lines count towards its limit."""
    bare = len(get())
    for size in around(HEADER_MAX, HEADER_MAX - bare, HEADER_MAX - bare - 5, most=16):
        yield f"target-{size}", get(b"/" + b"a" * size)
        yield f"query-{size}", get(b"/?a=" + b"b" * size)
        yield f"field-{size}", get(fields=[b"X: " + b"y" * size])
        yield f"name-{size}", get(fields=[b"X" * (size + 1) + b": y"])
        yield f"host-{size}", b"GET / HTTP/1.1\r\nHost: " + b"h" * size + b"\r\n\r\n"
        yield f"method-{size}", b"M" * size + b" / HTTP/1.1\r\nHost: localhost\r\n\r\n"
        yield f"unended-{size}", b"GET / HTTP/1.1\r\nHost: " + b"h" * size
    for count in around(most=11):
        yield f"fields-{count}", get(fields=[b"A:1"] * count)
        yield f"parameters-{count}", get(
            b"/v1/datasets/climate/probe?" + b"&".join([b"a=1"] * count))
        yield f"segments-{count}", get(b"/a" * count + b"/")
        yield f"pipelined-{count}", get() * min(count, 64)
    for size in around(BODY_MAX):
        yield f"body-{size}", post(padded_view(size))
        if size:
            yield f"claimed-{size}", post(b"{}", size)
    for length in (2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**63 - 1, 2**63, 2**64 - 1, 2**64, 10**30):
        yield f"claimed-{length}", post(b"{}", length)
    chunked = [b"Transfer-Encoding: chunked"]
    start = b"POST /v1/views HTTP/1.1\r\nHost: localhost\r\n" + chunked[0] + b"\r\n\r\n"
    for size in around(65535, 66000):
        yield f"trailer-{size}", start + b"0\r\nX: " + b"t" * size + b"\r\n\r\n"
        yield f"extension-{size}", start + b"1;x=" + b"e" * size + b"\r\na\r\n0\r\n\r\n"
        yield f"chunk-{size}", start + b"%x\r\n" % size + b"c" * size + b"\r\n0\r\n\r\n"
        yield f"chunk-length-{size}", start + b"0" * size + b"1\r\na\r\n0\r\n\r\n"


def frame(first, payload, length=None, wide=None, mask=b"\0\0\0\0"):
    """A frame with the declared length `length`, in 7, 16 or 64 bits (`wide`)."""
    length = len(payload) if length is None else length
    wide = wide or (7 if length < 126 else 16 if length < 65536 else 64)
    if wide == 7:
        head = struct.pack("!BB", first, 0x80 | length)
    elif wide == 16:
        head = struct.pack("!BBH", first, 0x80 | 126, length)
    else:
        head = struct.pack("!BBQ", first, 0x80 | 127, length)
    return head + mask + payload


def websocket_sizes():
    for size in around(BODY_MAX, 125, 126):
        text = padded_view(size)
        yield f"text-{size}", UPGRADED + frame(0x81, text)
        if size < 2 or size > 65534:
            yield f"binary-{size}", UPGRADED + frame(0x82, text)
        yield f"message-{size}", LINES + json.dumps(
            {"type": "open", "id": 1, "dataset": "d" * size}).encode()
        if size < 65536:
            yield f"ping-{size}", UPGRADED + frame(0x89, b"p" * size)
            yield f"close-{size}", UPGRADED + frame(0x88, b"\x03\xe8" + b"r" * max(0, size - 2))
            yield f"wide-{size}", UPGRADED + frame(0x81, text, wide=64)
    for length in (2**31 - 1, 2**31, 2**32, 2**63 - 1, 2**63, 2**64 - 1):
        yield f"claimed-{length}", UPGRADED + frame(0x81, b"x", length, 64)
    for count in around(BODY_MAX, most=12):
        rest = frame(0x80, b"") if count else b""
        yield f"empty-fragments-{count}", UPGRADED + frame(1, b"") + frame(0, b"") * count + rest
        if count <= 4097:
            yield f"fragments-{count}", UPGRADED + frame(1, b"{") + frame(0, b" ") * count + frame(
                0x80, b"}")
            yield f"pings-{count}", UPGRADED + frame(0x89, b"p") * count
            yield f"messages-{count}", LINES + b'{"type":"pause"}\n' * count
    for code in (0, 999, 1000, 1004, 1005, 1006, 1015, 1016, 2999, 3000, 4999, 5000, 65535):
        yield f"close-code-{code}", UPGRADED + frame(0x88, struct.pack("!H", code))


def json_sizes(wrap):
    """Documents that grow in each direction, passed through wrap(text)."""
    for size in around(BODY_MAX):
        yield f"padded-{size}", wrap(padded_view(size))
        yield f"name-{size}", wrap(json.dumps({"dataset": "n" * size}).encode())
        yield f"key-{size}", wrap(json.dumps({"k" * size: 1}).encode())
        yield f"digits-{size}", wrap(b'{"step":' + b"1" * size + b"}")
        yield f"fraction-{size}", wrap(b'{"step":0.' + b"0" * size + b"1}")
        yield f"exponent-{size}", wrap(b'{"step":1e' + b"0" * size + b"1}")
    for size in around(256):
        yield f"wide-name-{size}", wrap(json.dumps({"dataset": "\u00e9" * (size % 40000)},
                                                   ensure_ascii=False).encode())
    for depth in around(DEPTH_MAX, most=15):
        yield f"arrays-{depth}", wrap(b"[" * depth + b"]" * depth)
        yield f"objects-{depth}", wrap(b'{"a":' * depth + b"1" + b"}" * depth)
        yield f"nested-{depth}", wrap(b'{"camera":' + b"[" * depth + b"]" * depth + b"}")
        yield f"open-{depth}", wrap(b"[" * depth)
    for count in around(64, most=12):
        points = [[i, 1] for i in range(count)]
        yield f"points-{count}", wrap(json.dumps(
            {"scalars": [{"field": "cloud", "extinction": points}]}).encode())
        yield f"scalars-{count}", wrap(json.dumps(
            {"scalars": [{"field": f"f{i}"} for i in range(count)]}).encode())
        yield f"faults-{count}", wrap(json.dumps({f"k{i}": 1 for i in range(count)}).encode())


def edges_of_numbers():
    """Integers and pixel counts at the limits of types and of the protocol."""
    for value in (0, 1, 8191, 8192, 8193, 65535, 65536, 2**31 - 1, 2**31, 2**32, 2**53, 2**63,
                  2**64):
        for sign in (1, -1):
            for key in ("width", "height"):
                yield f"{key}-{sign * value}", {"image": {key: sign * value}}
            yield f"step-{sign * value}", {"step": sign * value}
            yield f"seed-{sign * value}", {"vector": {"jitter": {"seed": sign * value}}}
            yield f"stride-{sign * value}", {"vector": {"stride": sign * value}}
            yield f"slice-{sign * value}", {"geometry": {"slice": {"axis": "z",
                                                                    "index": sign * value}}}
    for width, height in ((8192, 4320), (8192, 4321), (4320, 8192), (8192, 8192), (1, 8192)):
        yield f"pixels-{width}x{height}", {"image": {"width": width, "height": height}}
    for value in (0, 1e-310, 1e-30, 1e-6, 0.05, 0.1, 64, 64.5, 1e3, 1e6, 1e9, 1e30, 1e38, 1e39,
                  1e308):
        for part, key in (("vector", "span"), ("vector", "length"), ("vector", "r2"),
                          ("method", "slabThickness"), ("camera", "fovY"), ("camera", "height")):
            yield f"{part}-{key}-{value}", {part: {key: value}}
        yield f"eye-{value}", {"camera": {"eye": [value, 0, value], "up": [0, value, 0]}}
        yield f"scale-{value}", {"geometry": {"scale": [value, 1, 1]}}


def query_sizes():
    frame_of = b"/v1/datasets/climate/frame.jpeg?"
    for size in around(HEADER_MAX, most=14):
        yield f"value-{size}", frame_of + b"preset=" + b"p" * size
        yield f"key-{size}", frame_of + b"k" * size + b"=1"
        yield f"digits-{size}", frame_of + b"width=" + b"1" * size
        yield f"escaped-{size}", frame_of + b"preset=" + b"%41" * min(size, 3000)
        yield f"id-{size}", b"/v1/datasets/" + b"i" * size
        yield f"accept-{size}", b"/\0" + b"a/b;q=0.1," * min(size, 900)
    for count in around(most=11):
        yield f"parameters-{count}", frame_of + b"&".join(b"a%d=1" % i for i in range(count))
        yield f"slashes-{count}", b"/" * count
    for value in (b"-1", b"0", b"1", b"8192", b"8193", b"2147483647", b"2147483648", b"1e308",
                  b"1e309", b"-0", b"nan", b"inf", b"0x10", b"999999999999999999",
                  b"1000000000000000000", b""):
        for key in (b"width", b"height", b"step", b"quality", b"azimuth", b"zoom"):
            yield f"{key.decode()}-{value.decode()}", frame_of + key + b"=" + value
        for key in (b"bins", b"clip", b"range", b"step"):
            yield (f"histogram-{key.decode()}-{value.decode()}",
                   b"/v1/datasets/climate/fields/wind/histogram?" + key + b"=" + value + b",1")
        yield f"probe-{value.decode()}", b"/v1/datasets/climate/probe?x=" + value


def sizes():
    targets = {
        "http": http_sizes(), "websocket": websocket_sizes(), "query": query_sizes(),
        "view": json_sizes(lambda text: text), "config": json_sizes(lambda text: text),
        "messages": json_sizes(lambda text: b'{"type":"patch","rev":1,"patch":' + text + b"}"),
        "saved_view": json_sizes(lambda text: b'{"id":"0123456789","created":'
                                              b'"2001-01-01T03:00:00Z","view":' + text + b"}"),
    }
    for target, inputs in targets.items():
        for name, data in inputs:
            yield target, name, data
    for name, part in edges_of_numbers():
        text = json.dumps(part).encode()
        yield "view", name, text
        yield "messages", name, b'{"type":"open","id":1,"dataset":"a"}\n' + (
            b'{"type":"patch","rev":1,"patch":' + text + b"}")
