"""Requests and frames of sizes at boundaries: each kind is a function from a size to bytes and
the permitted reactions. Sizes are powers of two and the documented limits, each with its
neighbours."""
import collections
import functools
import json
import struct

from suite import require
from wire_client import (CLOSE, PING, PONG, TEXT, Closed, Connection, WebSocket, frame)

# `run(target)` returns the reaction as a short word to be counted.
Shot = collections.namedtuple("Shot", "kind size run")
REFUSED = {"400", "404", "413", "414", "415", "422"}
COMMA = ","


def around(highest, *limits, lowest=0):
    """2^k - 1, 2^k, 2^k + 1 up to 2^highest, and each limit with its neighbours."""
    sizes = {max(lowest, base + step) for k in range(highest + 1) for base in [1 << k]
             for step in (-1, 0, 1)}
    sizes |= {max(lowest, limit + step) for limit in limits for step in (-1, 0, 1)}
    return sorted(sizes)


def http(target, data, expected, method="GET", end=False):
    with Connection(target) as connection:
        try:
            whole = connection.raw_or_lost(data)
            if end and whole:
                connection.half_close()
            word = str(connection.answer(method).status)
        except Closed:
            word = "ended"
    require(word in expected, f"{word}, not one of {sorted(expected)}")
    return word


class Kinds:
    """Shots for a daemon with those limits (as reported by GET /v1); `chance` chooses the free
    bytes."""

    def __init__(self, target, limits, chance):
        self.target, self.limits, self.chance = target, limits, chance
        self.header_max = limits["httpHeaderBytesMax"]
        self.body_max = limits["httpBodyBytesMax"]

    def head(self, line, fields=""):
        return (f"{line} HTTP/1.1\r\nHost: {self.target.authority()}\r\n"
                f"{self.target.authorization()}{fields}\r\n").encode("latin-1")

    def letters(self, count):
        return self.chance.choice("abcxyz019") * count

    def shot(self, kind, size, data, expected, **how):
        return Shot(kind, size, functools.partial(http, data=data, expected=expected, **how))

    def by_header(self, data, otherwise):
        return otherwise if len(data) <= self.header_max else {"414", "431"}

    def headers(self):
        base = self.target.base
        for size in around(17, self.header_max, lowest=1):
            letters = self.letters(size)
            for kind, data, otherwise in (
                    ("target", self.head(f"GET {base}{letters}"), {"404"}),
                    ("query", self.head(f"GET {base}livez?{letters}"), {"400"}),
                    ("method", self.head(f"{letters} {base}livez"), {"501"}),
                    ("field name", self.head(f"GET {base}livez", f"X{letters}: 1\r\n"), {"200"}),
                    ("field value", self.head(f"GET {base}livez", f"X: {letters}\r\n"), {"200"}),
                    ("white space", self.head(f"GET {base}livez", f"X:{' ' * size}1\r\n"),
                     {"200"}),
                    ("path segments", self.head(f"GET {base}{'a/' * size}"), {"404"}),
                    ("host", self.head(f"GET {base}livez").replace(
                        self.target.authority().encode(), letters.encode(), 1), {"400", "421"})):
                yield self.shot(kind, size, data, self.by_header(data, otherwise))
        for count in around(13, 1000):
            data = self.head(f"GET {base}livez", "a:b\r\n" * count)
            yield self.shot("number of fields", count, data, self.by_header(data, {"200"}))
            data = self.head(f"GET {base}livez?" + "&".join(["a=1"] * count))
            yield self.shot("number of parameters", count, data,
                            self.by_header(data, {"400"} if count else {"200"}))
        whole = self.head(f"GET {base}livez", "X: \r\n")
        for size in around(17, self.header_max):
            if size > len(whole):
                data = whole.replace(b"X: ", b"X: " + b"a" * (size - len(whole)))
                yield self.shot("header", size, data, self.by_header(data, {"200"}))

    def post(self, path, body, length=None, fields=""):
        length = len(body) if length is None else length
        return self.head(f"POST {self.target.base}{path}", "Content-Type: application/json\r\n"
                         f"{fields}Content-Length: {length}\r\n") + body

    def bodies(self):
        for size in around(64, self.body_max, 10 ** 19, 10 ** 20):
            beyond = size > self.body_max
            yield self.shot("length without body", size, self.post("v1/frames", b"", size),
                            {"400", "413"} if beyond else {"400", "ended"}, end=not beyond)
        for size in around(17, self.body_max):
            body = b'{"a":1}'.ljust(size)[:size]
            too_large = {"413"} if size > self.body_max else None
            yield self.shot("body", size, self.post("v1/frames", body),
                            too_large or {"400", "422"})
            beyond = size + 1 > self.body_max
            yield self.shot("body, a byte short", size, self.post("v1/frames", body, size + 1),
                            {"413"} if beyond else {"ended", "400"}, end=not beyond)
            yield self.shot("body, a byte more", size, self.post("v1/frames", body + b"x", size),
                            too_large or {"400", "422"})

    def chunks(self):
        coded = self.head(f"POST {self.target.base}v1/frames", "Transfer-Encoding: chunked\r\n")
        for size in around(17):
            letters = self.letters(size).encode()
            chunk = b"%x\r\n%s\r\n" % (size, letters)
            for kind, body in (("chunk", chunk + b"0\r\n\r\n"), ("trailer", b"0\r\nX: " + letters
                               + b"\r\n\r\n"), ("trailers", b"0\r\n" + b"X: y\r\n" * (size // 6)
                               + b"\r\n"), ("chunk extension", b"1;" + letters + b"\r\nx\r\n0"
                               b"\r\n\r\n"), ("chunk, a byte short", chunk[:-3]),
                               ("zeros of a chunk size", b"0" * size + b"1\r\nx\r\n")):
                yield self.shot(kind, size, coded + body, {"501"})
        for size in around(64):
            yield self.shot("chunk size", size, coded + b"%x\r\n" % size, {"501"})

    def documents(self):
        """JSON of the greatest permitted depth, length and width, and beyond."""
        for depth in around(15, self.limits["jsonDepthMax"], lowest=1):
            for kind, body in (("arrays in arrays", "[" * depth + "]" * depth),
                               ("objects in objects", '{"a":' * depth + "1" + "}" * depth),
                               ("open brackets", "[" * depth),
                               ("depth below a key",
                                '{"camera":' + "[" * depth + "]" * depth + "}")):
                yield self.document(kind, depth, body, {"400", "422"})
        for size in around(16, self.limits["nameCharsMax"], self.limits["pathCharsMax"]):
            name = self.letters(size)
            yield self.document("a name", size, json.dumps({"dataset": name}), {"404", "422"})
            yield self.document("a key", size, json.dumps({name: 1}), {"422"})
            yield self.document("characters of 4 bytes", size, json.dumps(
                {"dataset": "\U0001f32a" * (size // 4)}, ensure_ascii=False), {"404", "422"})
            yield self.document("escapes", size, '{"dataset":"' + "\\u0041" * (size // 6) + '"}',
                                {"404", "422"})
            yield self.document("digits", size, '{"step":' + "1" * max(1, size) + "}",
                                {"400", "422"} if size > 1 else {"200", "400", "422"})
        for count in around(13, self.limits["scalarsMax"], self.limits["extinctionPointsMax"]):
            yield self.document("items of a vector", count, '{"dataset":"tornado","camera":{"eye":['
                                + COMMA.join("1" * count) + "]}}",
                                {"200"} if count == 3 else {"400", "413", "422"})
            yield self.document("media", count, '{"scalars":[' + COMMA.join(["{}"] * count) + "]}",
                                {"400", "413", "422"})
            yield self.document("keys", count, "{" + COMMA.join(
                f'"k{n}":{n}' for n in range(count)) + "}", {"400", "413", "422"})

    def document(self, kind, size, text, expected):
        body = text.encode()
        return self.shot(kind, size, self.post("v1/forecasts", body),
                         expected if len(body) <= self.body_max else {"413"})

    def numbers(self):
        edge_max, pixels_max = self.limits["imageEdgeMax"], self.limits["imagePixelsMax"]
        fine, bad = {"200"}, {"400", "413", "422"}
        for size in around(64, edge_max, pixels_max):
            for sign in ("", "-"):
                edge = size if not sign else -size
                yield self.size_of_view("a picture's width", edge, edge, 1,
                                        fine if 1 <= edge <= edge_max else bad)
            yield self.size_of_view("a picture's edges", size, size, size,
                                    fine if 1 <= size <= edge_max and size * size <= pixels_max
                                    else bad)
        for edge in around(13, pixels_max // edge_max, lowest=1):
            other = pixels_max // edge
            for step in (0, 1):
                whole = edge <= edge_max and other + step <= edge_max
                small = edge * (other + step) <= pixels_max
                yield self.size_of_view("a picture's pixels", edge, edge, other + step,
                                        fine if whole and small else bad)
        for size in around(64, edge_max):
            for value in (f"{size}", f"-{size}"):
                good = value[0] != "-" and 1 <= size <= edge_max
                yield self.query("width", size, "frame.jpg?height=1&width=" + value,
                                 fine if good else bad)
            yield self.query("bins", size, f"fields/wind/histogram?bins={size}",
                             fine if 1 <= size <= self.limits["histogramBinsMax"]
                             else bad | {"404"})
            yield self.query("step", size, f"frame.jpg?width=16&height=12&step={size}",
                             fine | bad)
        for power in (*range(-330, 311, 10), 29, 30, 31, 308, 309):
            yield self.query("a number's power", power, f"frame.jpg?width=16&height=12&azimuth=1e"
                             f"{power}", fine | bad)
            yield self.query("a place's power", power, f"probe?x=1e{power}&y=0&z=0", fine | bad)

    def size_of_view(self, kind, size, width, height, expected):
        view = {"dataset": "tornado", "image": {"width": width, "height": height}}
        return self.document(kind, size, json.dumps(view), expected)

    def query(self, kind, size, path, expected):
        return self.shot(f"query: {kind}", size,
                         self.head(f"GET {self.target.base}v1/datasets/tornado/{path}"), expected)

    def messages(self):
        message_max = self.limits["messageBytesMax"]
        for size in around(18, message_max, message_max // 2):
            good = "answered" if size <= message_max else "1009"
            yield self.session("message", size, frame(TEXT, b" " * size), good)
            yield self.session("message of one repeated letter", size, frame(
                TEXT, b'"' + self.letters(size).encode()[2:] + b'"'), good if size > 1 else None)
            half = size // 2
            yield self.session("message in two fragments", size, frame(TEXT, b" " * half, fin=False)
                               + frame(0, b" " * (size - half)), good)
        for size in around(63, message_max):
            if size > message_max:
                yield self.session("length in 64 bits", size, frame(
                    TEXT, b"x", length=size, width=64), "1009" if size < 1 << 63 else None)
        for count in around(12):
            yield self.session("empty fragments", count, frame(TEXT, fin=False) + frame(
                0, fin=False) * count + frame(0), "answered")
            yield self.session("fragments of a byte", count, frame(TEXT, b"[", fin=False) + frame(
                0, b" ", fin=False) * count + frame(0, b"]"), "answered")
            yield self.session("pings", count, frame(PING, b"x") * count, "answered")
            yield self.session("texts at once", count // 8, frame(TEXT, b"{}") * (count // 8),
                               "answered")
        for size in around(17, 125):
            for opcode, name in ((PING, "ping"), (PONG, "pong")):
                yield self.session(f"bytes of a {name}", size, frame(opcode, b"x" * size),
                                   "answered" if size <= 125 else "1002")
            yield self.session("bytes of a close", size, frame(CLOSE, struct.pack(">H", 1000)
                               + b"x" * size), "1000" if size <= 123 else "1002")
        for code in range(0, 65536, 257):
            yield self.session("close code", code, frame(CLOSE, struct.pack(">H", code)), None)
        for depth in around(14, self.limits["jsonDepthMax"], lowest=1):
            yield self.session("depth of a message", depth, frame(
                TEXT, b"[" * depth + b"]" * depth), "answered")
        for number in around(64, self.limits["serialMax"]):
            for key, more in (("ack", "seq"), ("patch", "rev"), ("play", "from")):
                text = f'{{"type":"{key}","{more}":{number},"patch":{{}}}}'
                yield self.session(f"{more} of {key}", number, frame(TEXT, text.encode()),
                                   "answered")

    @staticmethod
    def session(kind, size, data, expected):
        """`expected`: a close code, "answered" if the session continues, None: either."""
        return Shot("stream: " + kind, size, functools.partial(stream, data=data,
                                                               expected=expected))

    def refused(self):
        """Shots that yield no picture, and therefore must not increase memory."""
        for make in (self.headers, self.bodies, self.chunks, self.documents, self.messages):
            yield from make()


def stream(target, data, expected):
    with WebSocket(target) as viewer:
        word = "answered"
        try:
            viewer.raw_or_lost(data)
            viewer.raw_or_lost(frame(TEXT, b'{"type":"open","id":77,"dataset":"nowhere"}'))
            while viewer.text("error").get("id") != 77:
                pass
        except Closed as end:
            word = str(end.code) if end.code else "ended"
            viewer.raw_or_lost(frame(CLOSE, struct.pack(">H", 1000)))
    require(expected in (None, word), f"{word}, not {expected}")
    known = word if not word.isdigit() or int(word) <= 1015 else "its own code"
    return "stream " + known
