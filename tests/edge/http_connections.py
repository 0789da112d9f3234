"""Cases of HTTP/1.1: sizes of headers, connections and pipelines, deadlines, conditional
requests, and content negotiation."""
import functools
import gzip
import socket
import struct
import threading
import time

from http_requests import BODY, fill, get, post, row
from suite import Case, require
from wire_client import Connection, request

HEADER_MAX = 8192
CUT_S = 5  # seconds until a slow header or body is cut off
FRAME = "v1/datasets/tornado/frame.jpg?width=16&height=12"


def sized(target, size, statuses, shape):
    """A header of exactly that many bytes."""
    start, end = fill(target, get())[:-2], b"\r\n"
    room = size - len(start) - len(end)
    if shape == "value":
        middle = b"X: " + b"a" * (room - 5) + b"\r\n"
    elif shape == "name":
        middle = b"a" * (room - 4) + b": \r\n"
    elif shape == "many":
        count, rest = divmod(room, 4)
        middle = b"a:\r\n" * (count - 1) + b"a:" + b" " * rest + b"\r\n"
    else:  # the target
        middle = b""
        start = start.replace(b" HTTP", b"?" + b"a" * (room - 1) + b" HTTP", 1)
    with Connection(target) as connection:
        data = start + middle + end
        require(len(data) == size, f"invalid test case: {len(data)} bytes")
        connection.raw_or_lost(data)
        answer = connection.answer()
        require(answer.status in statuses, f"{answer.status} {answer.body[:200]!r}")
        if answer.status >= 414:
            require(connection.ended(), "stays open")


def size_cases():
    where = "the limit of a header"
    for size in (HEADER_MAX - 1, HEADER_MAX):
        for shape, status in (("value", 200), ("name", 200), ("many", 200), ("target", 400)):
            yield Case(f"http.size.{shape}.{size}", where, f"a header of {size} bytes: {shape}",
                       str(status), functools.partial(sized, size=size, statuses=(status,),
                                                      shape=shape))
    for size in (HEADER_MAX + 1, HEADER_MAX + 2, 9000, 16383, 16384, 16385, 65536, 1 << 20):
        for shape in ("value", "name", "many", "target"):
            yield Case(f"http.size.{shape}.{size}", where, f"a header of {size} bytes: {shape}",
                       "431 (or 414), closed",
                       functools.partial(sized, size=size, statuses=(414, 431), shape=shape))
    yield row("size.endless", where, "a header that never ends",
              "GET / HTTP/1.1\r\nHost: HOST\r\nX:" + "a" * (1 << 21), 431)


def pipeline(target, count, kind):
    """Sends requests in one segment; the answers must be in order, each identified by its own
    id."""
    paths = {"livez": ["livez"], "mixed": ["livez", FRAME, "nothing", "v1"]}[kind]
    with Connection(target, timeout=60) as connection:
        asked, data = [], b""
        for number in range(count):
            path = paths[number % len(paths)]
            method = "HEAD" if kind == "mixed" and number % 5 == 4 else "GET"
            asked.append((method, path))
            data += fill(target, get(f"X-Request-Id: pipelined-{number}\r\n", "BASE" + path)
                         .replace("GET", method, 1))
        connection.raw(data)
        for number, (method, path) in enumerate(asked):
            answer = connection.answer(method)
            require(answer.header("X-Request-Id") == f"pipelined-{number}",
                    f"answer {number} belongs to {answer.header('X-Request-Id')}")
            require(answer.status == (404 if path == "nothing" else 200),
                    f"{path}: {answer.status}")


def pipeline_ends(target, data, count, statuses):
    """Expects this many answers, then the end of the connection, although more was requested."""
    with Connection(target) as connection:
        connection.raw_or_lost(fill(target, data))
        got = [connection.answer().status for _ in range(count)]
        require(got[-1] in statuses, f"{got}")
        require(connection.ended(), "stays open")
        require(not connection.buffer, f"unexpected data: {bytes(connection.buffer[:200])!r}")


def pipeline_cases():
    where = "RFC 9112 9.3.2"
    for count in (1, 2, 3, 5, 10, 20, 50):
        for kind in ("livez", "mixed"):
            yield Case(f"http.pipeline.{kind}.{count}", where, f"{count} requests at once: {kind}",
                       "as many answers, in order",
                       functools.partial(pipeline, count=count, kind=kind))
    one = get()
    for name, data, count, statuses in (
            ("close", one + get("Connection: close\r\n") + one, 2, (200,)),
            ("close-list", get("Connection: foo, Close\r\n") + one, 1, (200,)),
            ("bad", one + "rubbish\r\n\r\n" + one, 2, (400,)),
            ("chunked", one + post("Transfer-Encoding: chunked\r\n", b"0\r\n\r\n").decode() + one,
             2, (501,)),
            ("http10", get(version="HTTP/1.0") + one, 1, (200,)),
            ("large", one + get("X: " + "a" * 9000 + "\r\n") + one, 2, (431,))):
        yield Case(f"http.pipeline.ends.{name}", where, f"a pipeline ended by one request: {name}",
                   f"{count} answers, then the end", functools.partial(
                       pipeline_ends, data=data, count=count, statuses=statuses))
    yield Case("http.body.next", where, "a body, and the next request in its segment",
               "two answers", body_then_request)
    yield Case("http.reuse", "RFC 9112 9.3", "100 requests, one after the other", "100 answers",
               hundred)


def body_then_request(target):
    with Connection(target) as connection:
        connection.raw(fill(target, post(f"Content-Length: {len(BODY)}\r\n"))
                       + fill(target, get()))
        require(connection.answer().body[:2] == b"\xff\xd8", "no picture")
        require(connection.answer().status == 200, "the second is not answered")


def hundred(target):
    with Connection(target) as connection:
        for _ in range(100):
            connection.raw(fill(target, get()))
            require(connection.answer().status == 200, "not answered")


def expecting(target, fields, version="HTTP/1.1"):
    connection = Connection(target)
    connection.raw(fill(target, post(fields, b"", version)))
    return connection


def expected_100(target, word):
    with expecting(target, f"Expect: {word}\r\nContent-Length: {len(BODY)}\r\n") as connection:
        head = connection.until(b"\r\n\r\n")
        require(head == b"HTTP/1.1 100 Continue\r\n\r\n", f"{head!r}")
        connection.raw(BODY)
        require(connection.answer().status == 200, "the body is not read")


def old_expectation(target):
    """RFC 9110, 10.1.1: an expectation in HTTP/1.0 must be ignored."""
    with expecting(target, f"Expect: 100-continue\r\nContent-Length: {len(BODY)}\r\n",
                   "HTTP/1.0") as connection:
        connection.socket.settimeout(0.5)
        try:
            connection.receive()
        except TimeoutError:
            connection.socket.settimeout(20)
            connection.raw(BODY)
            require(connection.answer().status == 200, "the body is not read")
        else:
            require(False, f"received {bytes(connection.buffer[:60])!r}")


def expect_cases():
    where = "RFC 9110 10.1.1"
    for word in ("100-continue", "100-Continue"):
        yield Case(f"http.expect.{word}", where, f"Expect: {word}", "100, then 200",
                   functools.partial(expected_100, word=word))
    length = f"Content-Length: {len(BODY)}\r\n"
    yield row("expect.at-once", where, "the body follows without waiting",
              post("Expect: 100-continue\r\n" + length), 200, closed=False)
    yield row("expect.large", where, "an expectation of a body too large, in place of 100",
              post("Expect: 100-continue\r\nContent-Length: 65537\r\n", b""), 413)
    for value in ("wonders", "100-continue, wonders", "200-ok", "100"):
        yield row(f"expect.{value}", where, f"Expect: {value}",
                  post(f"Expect: {value}\r\n{length}", b""), 417)
    yield row("expect.chunked", where, "an expectation of a chunked body",
              post("Expect: 100-continue\r\nTransfer-Encoding: chunked\r\n", b""), 400, 501)
    yield row("expect.nobody", where, "an expectation without a body",
              get("Expect: 100-continue\r\n"), 200, closed=False)
    yield Case("http.expect.http10", where, "Expect in HTTP/1.0", "no 100, then 200",
               old_expectation)


def cut(target, data, drip, pause):
    """The connection must end between 4 s and 9 s after its start, however slowly bytes arrive;
    the limit is 5 s."""
    with Connection(target) as connection:
        begun = time.monotonic()
        connection.raw(fill(target, data))
        while time.monotonic() - begun < 12:
            if connection.ended(pause):
                break
            if drip and not connection.raw_or_lost(drip):
                break
        else:
            require(False, "not cut off in 12 s")
        took = time.monotonic() - begun
        require(CUT_S - 1 <= took <= CUT_S + 4, f"cut off after {took:.1f} s")
        require(b"HTTP/1.1 2" not in connection.buffer, "served")


def served_meanwhile(target):
    """During the slow requests: a request every 0.2 s, each answered within a second."""
    end = time.monotonic() + CUT_S
    while time.monotonic() < end:
        begun = time.monotonic()
        require(request(target, "GET", "livez").status == 200, "not served")
        require(time.monotonic() - begun < 1, f"took {time.monotonic() - begun:.1f} s")
        time.sleep(0.2)


def slow_cases():
    where = "slow headers, slow bodies"
    start = get()[:-2]
    length = "Content-Length: 1000\r\n"
    for name, data, drip, pause in (
            ("silent", "G", b"", 0.5), ("line", "GET BASElivez HT", b"", 0.5),
            ("header", start, b"", 0.5), ("header-last", start + "\r", b"", 0.5),
            ("header-drip", start + "X: ", b"a", 0.3), ("header-fields", start, b"X: y\r\n", 0.3),
            ("line-drip", "GET /", b"a", 0.3), ("body", post(length, b""), b"", 0.5),
            ("body-part", post(length, b"{"), b"", 0.5),
            ("body-drip", post(length, b"{"), b" ", 0.3),
            ("body-expected", post("Expect: 100-continue\r\n" + length, b""), b"", 0.5),
            ("refused-body", post("Content-Length: 70000\r\n", b"{"), b" ", 0.3)):
        check = functools.partial(cut, data=data, drip=drip, pause=pause)
        if name == "refused-body":
            check = functools.partial(refused_dripping, data=data)
        yield Case(f"http.slow.{name}", where, f"{name}, a byte in {pause} s or none",
                   "ended within 4 to 9 s", check, True)
    yield Case("http.slow.others", where, "concurrent requests of other clients",
               "each answered within a second", served_meanwhile, True)
    yield Case("http.slow.crowd", where, "60 slow headers at a time", "ended within 4 to 9 s",
               functools.partial(crowd, count=60), True)


def refused_dripping(target, data):
    """The rest of a refused body is discarded for a limited time."""
    with Connection(target) as connection:
        connection.raw(fill(target, data))
        require(connection.answer().status == 413, "not refused")
        end = time.monotonic() + 12
        while time.monotonic() < end:
            if not connection.raw_or_lost(b" "):
                return
            time.sleep(0.3)
        require(False, "not closed within 12 s")


def crowd(target, count):
    faults = []

    def one():
        try:
            cut(target, "GET BASElivez HTTP/1.1\r\nX: ", b"a", 0.5)
        except (AssertionError, OSError, RuntimeError) as fault:
            faults.append(fault)
    threads = [threading.Thread(target=one) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    require(not faults, f"{len(faults)} of {count}: {faults[:3]}")


def half_closed(target, data, statuses):
    """Unspecified in RFC 9112: answered or closed, but not left open."""
    with Connection(target) as connection:
        connection.raw(fill(target, data))
        connection.half_close()
        require(connection.ended(10), "stays open")
        if target.tls:
            return
        got = bytes(connection.buffer[:12])
        good = [f"HTTP/1.1 {status}".encode() for status in statuses]
        require(not got or got in good, f"{got!r}")


def left(target, data, reset):
    connection = Connection(target)
    connection.raw(fill(target, data))
    if reset:
        connection.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    connection.close()


def leaving_cases():
    where = "RFC 9112 9.5"
    whole, part = get(), get()[:20]
    body = post("Content-Length: 100\r\n", b"{")
    picture = get(path="BASEv1/datasets/tornado/frame.png?width=2000&height=2000")
    for name, data, statuses in (
            ("request", whole, (200,)), ("header", part, ()), ("body", body, ()),
            ("nothing", "", ()), ("picture", picture, (200,))):
        yield Case(f"http.half.{name}", where, f"half-closed after the {name}",
                   "an answer or none, then the end",
                   functools.partial(half_closed, data=data, statuses=statuses))
        for reset in (False, True):
            yield Case(f"http.leave.{name}.{'reset' if reset else 'end'}", where,
                       f"disconnected after the {name}", "the daemon runs",
                       functools.partial(left, data=data, reset=reset))


def conditional(target, word, status):
    """`word` with TAG for the entity tag."""
    tag = request(target, "GET", FRAME).header("ETag")
    require(tag.startswith('"'), f"the tag {tag}")
    with Connection(target) as connection:
        connection.raw(fill(target, get(f"If-None-Match: {word.replace('TAG', tag)}\r\n",
                                        "BASE" + FRAME)))
        answer = connection.answer()
        require(answer.status == status, str(answer.status))
        require(answer.header("ETag") == tag, "another tag")
        require(status != 304 or not answer.header("Content-Length"), "304 with a length")
        connection.raw(fill(target, get()))
        require(connection.answer().status == 200, "the next request")


def accepting(target, value, status, kind):
    answer = request(target, "POST", "v1/frames",
                     {"Content-Type": "application/json", **({} if value is None else
                                                             {"Accept": value})}, BODY)
    require(answer.status == status, f"{answer.status} {answer.body[:200]!r}")
    require(status != 200 or answer.header("Content-Type") == kind, answer.header("Content-Type"))


def coded(target, value, zipped):
    plain = request(target, "GET", "")
    require(plain.status == 200 and not plain.header("Content-Encoding"), "the page as it is")
    answer = request(target, "GET", "", {"Accept-Encoding": value})
    require((answer.header("Content-Encoding") == "gzip") == zipped,
            f"coded by {answer.header('Content-Encoding')!r}")
    require("accept-encoding" in answer.header("Vary").lower(), "Vary does not say so")
    body = gzip.decompress(answer.body) if zipped else answer.body
    require(body == plain.body, "another page")
    require(answer.header("ETag") != plain.header("ETag") if zipped else True,
            "one tag for two representations")


def same_without_body(target, path):
    whole, head = request(target, "GET", path), request(target, "HEAD", path)
    for name in ("Content-Length", "Content-Type", "ETag", "Cache-Control"):
        require(whole.header(name) == head.header(name),
                f"{name}: {whole.header(name)} by GET, {head.header(name)} by HEAD")


def negotiation_cases():
    where = "RFC 9110 13.1.2"
    for name, word, status in (
            ("same", "TAG", 304), ("star", "*", 304), ("weak", "W/TAG", 304),
            ("list", '"a", TAG, "b"', 304), ("lines", '"a"\r\nIf-None-Match: TAG', 304),
            ("other", '"a"', 200), ("unquoted", "abc", 200), ("empty", "", 200),
            ("part", '"TAG', 200), ("long", '"' + "a" * 5000 + '"', 200)):
        yield Case(f"http.match.{name}", where, f"If-None-Match: {word!r:.40}", str(status),
                   functools.partial(conditional, word=word, status=status))
    where = "RFC 9110 12.5.1"
    jpeg, png = "image/jpeg", "image/png"
    for name, value, status, kind in (
            ("none", None, 200, jpeg), ("empty", "", 200, jpeg), ("any", "*/*", 200, jpeg),
            ("png", png, 200, png), ("family", "image/*", 200, jpeg),
            ("case", "IMAGE/PNG", 200, png), ("weights", f"{jpeg};q=0.1, {png};q=0.9", 200, png),
            ("not", f"{jpeg};q=0, */*", 200, png), ("nothing", "*/*;q=0", 406, ""),
            ("other", "text/html", 406, ""), ("zero", f"{png};q=0", 406, ""),
            ("spaces", f" {png} ; q = 1", 200, png), ("commas", f",, {png} ,,", 200, png),
            ("parameters", f"{png};level=1", 200, png),
            ("weight-small", f"{png};q=0.001", 200, png),
            ("browser", f"text/html, {png}, */*;q=0.8", 200, png)):
        if name == "spaces":
            continue  # white space about "=" (RFC 9110, 5.6.6): the reaction is unspecified
        yield Case(f"http.accept.{name}", where, f"Accept: {value}", str(status),
                   functools.partial(accepting, value=value, status=status, kind=kind))
    where = "RFC 9110 12.5.3"
    for value, zipped in (
            ("gzip", True), ("GZIP", True), ("gzip;q=0", False), ("*", True), ("*;q=0", False),
            ("identity", False), ("br, gzip", True), ("br", False), ("gzip;q=0.001", True),
            ("gzip;q=0, *", False), ("", False), ("gzip;q=0.0", False),
            ("deflate, gzip;q=1.0", True), ("gzipped", False)):
        yield Case(f"http.gzip.{value or 'empty'}", where, f"Accept-Encoding: {value}",
                   "gzip" if zipped else "as it is",
                   functools.partial(coded, value=value, zipped=zipped))
    for path in ("", "v1", "v1/datasets", FRAME, "view.schema.json", "livez"):
        yield Case(f"http.head.{path or 'page'}", "RFC 9110 9.3.2",
                   f"HEAD and GET of {path or '/'}",
                   "the same fields, no body", functools.partial(same_without_body, path=path))


def groups():
    return [("sizes of headers", list(size_cases())), ("pipelines", list(pipeline_cases())),
            ("expectations", list(expect_cases())), ("slow headers and bodies", list(slow_cases())),
            ("half-closed and disconnected", list(leaving_cases())),
            ("conditions and negotiation", list(negotiation_cases()))]
