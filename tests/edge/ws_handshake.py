"""Cases of RFC 6455, chapter 4: the opening handshake with errors of the client."""
import functools

from suite import Case, require
from wire_client import Connection, accept_of, frame

KEY = "dGhlIHNhbXBsZSBub25jZQ=="  # the RFC's own example, 1.3
ACCEPT = "s3pPLMBiTxaQ9kYGzzhZRbK+xOo="
NAMED = "Sec-WebSocket-Protocol: windsplat.v1"
GOOD = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": KEY,
        "Sec-WebSocket-Version": "13"}


def handshake(target, line="GET {path} HTTP/1.1", change=None, more=(), host=None):
    """The request's bytes: valid fields, those of `change` instead (None: omitted), then `more`."""
    fields = {"Host": host or target.authority(), **GOOD, **(change or {})}
    lines = [line.format(path=target.base + "v1/stream", authority=target.authority())]
    lines += [f"{name}: {value}" for name, value in fields.items() if value is not None]
    lines += more
    return ("\r\n".join(lines) + "\r\n" + target.authorization() + "\r\n").encode("latin-1")


def accepted(target, check=None, **how):
    with Connection(target) as connection:
        connection.raw(handshake(target, **how))
        answer = connection.answer()
        require(answer.status == 101, f"{answer.status} {answer.body!r}")
        require(answer.header("Upgrade").lower() == "websocket", "no Upgrade: websocket")
        require(answer.header("Connection").lower() == "upgrade", "no Connection: Upgrade")
        require(answer.header("Sec-WebSocket-Accept") == ACCEPT, "another accept value")
        require(not answer.header("Sec-WebSocket-Extensions"), "an extension was negotiated")
        require(len(answer.header("Sec-WebSocket-Protocol").split(",")) == 1, "two protocols")
        first = connection.take(1)[0]
        require(first == 0x81, f"the first frame starts with {first:#x}, not with a complete text")
        if check:
            check(answer)


def refused(target, statuses, version=False, **how):
    """Expects no session, and a final answer with one of those statuses which, for a wrong
    version, names the supported one (4.2.2, 4)."""
    with Connection(target) as connection:
        connection.raw(handshake(target, **how))
        method = how.get("line", "GET").split(" ")[0]
        answer = connection.answer(method)
        require(answer.status in statuses, f"{answer.status} {answer.body[:300]!r}")
        require(not answer.header("Sec-WebSocket-Accept"), "an accept value despite the refusal")
        if version and answer.status == 426:
            require(answer.header("Sec-WebSocket-Version") == "13", "no supported version named")
        if answer.header("Connection") == "close":
            require(connection.ended(), "announces close but stays open")


def good(name, section, what, check=None, **how):
    return Case("ws.open." + name, section, what, "101 and a session",
                functools.partial(accepted, check=check, **how))


def bad(name, section, what, statuses, version=False, **how):
    return Case("ws.open." + name, section, what, " or ".join(map(str, statuses)),
                functools.partial(refused, statuses=statuses, version=version, **how))


def names_protocol(expected):
    def check(answer):
        got = answer.header("Sec-WebSocket-Protocol")
        require(got == expected, f"the protocol {got!r}")
    return check


def request_cases():
    where = "RFC 6455 4.2.1"
    yield good("plain", "RFC 6455 1.3", "the RFC's key gives the RFC's accept value")
    yield bad("post", where, "POST with all fields", (400, 405), line="POST {path} HTTP/1.1",
              more=["Content-Length: 0"])
    yield bad("put", where, "PUT with all fields", (400, 405), line="PUT {path} HTTP/1.1",
              more=["Content-Length: 0"])
    yield bad("head", where, "HEAD with all fields", (400, 405, 426), line="HEAD {path} HTTP/1.1")
    yield bad("http10", where, "HTTP/1.0", (400, 426, 505), line="GET {path} HTTP/1.0")
    yield bad("http09", where, "no version", (400, 505), line="GET {path}")
    yield bad("http20", where, "HTTP/2.0", (400, 505), line="GET {path} HTTP/2.0")
    yield bad("elsewhere", where, "a path that is not a WebSocket", (400, 404),
              line="GET /v1/nothing HTTP/1.1")
    yield good("absolute", "RFC 9112 3.2.2", "absolute form of the target",
               line="GET http://{authority}{path} HTTP/1.1")
    yield bad("nohost", where, "no Host", (400,), change={"Host": None})
    yield bad("body", "RFC 6455 4.1", "a body announced", (400, 413),
              more=["Content-Length: 5"])
    yield bad("chunked", "RFC 9112 6.1", "a chunked body announced", (400, 501),
              more=["Transfer-Encoding: chunked"])


def field_cases():
    where = "RFC 6455 4.2.1"
    refusals = (400, 426)
    yield bad("upgrade.missing", where, "no Upgrade", refusals, change={"Upgrade": None})
    yield bad("upgrade.empty", where, "an empty Upgrade", refusals, change={"Upgrade": ""})
    yield bad("upgrade.other", where, "Upgrade: h2c", refusals, change={"Upgrade": "h2c"})
    yield bad("upgrade.part", where, "Upgrade: websocket2", refusals,
              change={"Upgrade": "websocket2"})
    yield good("upgrade.case", where, "Upgrade: WebSocket", change={"Upgrade": "WebSocket"})
    yield good("upgrade.list", "RFC 9110 7.8", "Upgrade: h2c, websocket",
               change={"Upgrade": "h2c, websocket"})
    yield good("upgrade.lines", "RFC 9110 5.3", "Upgrade in two lines, h2c first",
               change={"Upgrade": "h2c"}, more=["Upgrade: websocket"])
    yield good("upgrade.twice", "RFC 9110 5.3", "the same Upgrade twice",
               more=["Upgrade: websocket"])
    yield bad("connection.missing", where, "no Connection", refusals, change={"Connection": None})
    yield bad("connection.empty", where, "an empty Connection", refusals,
              change={"Connection": ""})
    yield bad("connection.alive", where, "Connection: keep-alive", refusals,
              change={"Connection": "keep-alive"})
    yield bad("connection.part", where, "Connection: Upgraded", refusals,
              change={"Connection": "Upgraded"})
    for name, value in (
            ("list", "keep-alive, Upgrade"), ("case", "UPGRADE"),
            ("tight", "keep-alive,upgrade,foo"), ("spaces", " ,, keep-alive ,\tUpgrade"),
            ("first", "Upgrade, keep-alive")):
        yield good("connection." + name, where, f"Connection: {value!r}",
                   change={"Connection": value})
    yield good("connection.lines", "RFC 9110 5.3", "Connection in two lines, keep-alive first",
               change={"Connection": "keep-alive"}, more=["Connection: Upgrade"])
    yield good("names.case", "RFC 9110 5.1", "names of fields in another case", change={
        "Upgrade": None, "Sec-WebSocket-Key": None, "Sec-WebSocket-Version": None},
        more=["UPGRADE: websocket", "sec-websocket-key: " + KEY, "SEC-WebSocket-version: 13"])


def key_cases():
    where = "RFC 6455 4.2.1 5"
    keys = {"missing": None, "empty": "", "of15": "AAAAAAAAAAAAAAAAAAAA",
            "of17": "AAAAAAAAAAAAAAAAAAAAAAA=", "of18": "AAAAAAAAAAAAAAAAAAAAAAAA",
            "unpadded": KEY[:-2], "halfpadded": KEY[:-1], "overpadded": KEY + "=",
            "noletters": "!" * 22 + "==", "urlsafe": "_-" * 11 + "==",
            "inner": "AAAA AAAAAAAAAAAAAAAAA==",
            "middle": "AAAA==AAAAAAAAAAAAAAAA==", "long": "A" * 1000 + "==", "plain": "hello",
            "highbytes": "\xe4" * 22 + "=="}
    for name, key in keys.items():
        yield bad("key." + name, where, f"the key {key!r:.40}", (400,),
                  change={"Sec-WebSocket-Key": key})
    yield bad("key.twice", "RFC 6455 11.3.1", "two keys", (400,),
              more=["Sec-WebSocket-Key: " + KEY])
    yield bad("key.list", "RFC 6455 11.3.1", "two keys in a line", (400,),
              change={"Sec-WebSocket-Key": f"{KEY}, {KEY}"})
    yield good("key.spaces", "RFC 9110 5.5", "a key surrounded by white space",
               change={"Sec-WebSocket-Key": f" \t {KEY}\t "})
    # The last two bits of 22 base64 letters are not part of the 16 bytes.
    odd = KEY[:21] + "R=="
    yield Case("ws.open.key.other", "RFC 6455 1.3", "another key has another accept value",
               "101 and its SHA-1", functools.partial(other_key, key=odd))


def other_key(target, key):
    with Connection(target) as connection:
        connection.raw(handshake(target, change={"Sec-WebSocket-Key": key}))
        answer = connection.answer()
        # RFC 4648, 3.5 permits a decoder to refuse non-zero padding bits.
        require(answer.status in (101, 400), str(answer.status))
        require(answer.status == 400 or answer.header("Sec-WebSocket-Accept") == accept_of(key),
                "another accept value")


def version_cases():
    where = "RFC 6455 4.2.2 4"
    for version in (
            "0", "4", "7", "8", "12", "14", "25", "99", "255", "256", "1013", "-13", "+13", "013",
            "13.0", "0x0D", "13, 8", "8, 13", "13;", "thirteen", ""):
        yield bad(f"version.{version or 'empty'}", where, f"Sec-WebSocket-Version: {version!r}",
                  (400, 426), version=True, change={"Sec-WebSocket-Version": version})
    yield bad("version.missing", where, "no version", (400, 426), version=True,
              change={"Sec-WebSocket-Version": None})
    yield bad("version.twice", "RFC 6455 11.3.5", "two versions", (400, 426), version=True,
              more=["Sec-WebSocket-Version: 8"])
    for version in ("7", "8", "99"):
        yield Case(f"ws.open.version.{version}.says", where,
                   f"the answer to version {version} names the supported one",
                   "426 with Sec-WebSocket-Version: 13", functools.partial(
                       refused, statuses=(426,), version=True,
                       change={"Sec-WebSocket-Version": version}))


def offer_cases():
    where = "RFC 6455 9.1, RFC 7692"
    for number, offer in enumerate((
            "permessage-deflate", "permessage-deflate; client_max_window_bits",
            "permessage-deflate; server_no_context_takeover; client_no_context_takeover",
            "permessage-deflate; server_max_window_bits=8, permessage-deflate",
            "x-webkit-deflate-frame", "foo, bar; baz=2", 'foo; x="permessage-deflate"',
            "permessage-bzip2")):
        yield good(f"extension.{number}", where, f"offer of {offer!r}",
                   more=["Sec-WebSocket-Extensions: " + offer])
    yield good("extension.lines", where, "offers in two lines",
               more=["Sec-WebSocket-Extensions: foo",
                     "Sec-WebSocket-Extensions: permessage-deflate"])
    where = "RFC 6455 4.2.2 5"
    named = names_protocol("windsplat.v1")
    none = names_protocol("")
    yield good("protocol.none", where, "no protocol requested", none)
    for name, value in (
            ("one", "windsplat.v1"), ("list", "other, windsplat.v1"),
            ("first", "windsplat.v1, other"), ("tight", "a,windsplat.v1,b")):
        yield good("protocol." + name, where, f"protocols {value!r}", named,
                   more=["Sec-WebSocket-Protocol: " + value])
    yield good("protocol.lines", where, "protocols in two lines", named,
               more=["Sec-WebSocket-Protocol: other", NAMED])
    for name, value in (
            ("unknown", "other"), ("case", "WINDSPLAT.V1"), ("older", "windsplat.v0"),
            ("longer", "windsplat.v10"), ("part", "windsplat")):
        yield good("protocol." + name, where, f"protocols {value!r}", none,
                   more=["Sec-WebSocket-Protocol: " + value])


def scheme(target):
    return "https" if target.tls else "http"


def origin_cases():
    where = "RFC 6455 4.2.2 1"
    yield good("origin.none", where, "no Origin")
    yield Case("ws.open.origin.same", where, "the Origin is the host itself", "101", lambda target:
               accepted(target, more=[f"Origin: {scheme(target)}://{target.authority()}"]))
    for name, value in (
            ("other", "http://evil.example"), ("null", "null"), ("empty", ""), ("file", "file://"),
            ("prefix", "http://127.0.0.1.evil.example"), ("port", "http://127.0.0.1:1")):
        if name == "empty":
            continue  # equivalent to an absent field
        yield bad("origin." + name, where, f"Origin: {value}", (403,), more=["Origin: " + value])
    yield Case("ws.open.origin.twice", where, "the server's own Origin and a foreign one",
               "400 or 403",
               lambda target: refused(target, (400, 403), more=[
                   f"Origin: http://{target.authority()}", "Origin: http://evil.example"]))
    yield bad("host.other", "the Host check", "a name that resolved to this machine", (421,),
              host="evil.example")


def early(target):
    """The client must wait (4.1); one that does not is refused or served, not both."""
    with Connection(target) as connection:
        text = b'{"type":"open","id":9,"dataset":"nowhere"}'
        connection.raw(handshake(target) + frame(1, text))
        answer = connection.answer()
        if answer.status == 101:
            connection.until(b'"id":9')
        else:
            require(answer.status == 400, str(answer.status))
            require(connection.ended(), "refused, and open")


def slowly(target, cuts):
    with Connection(target) as connection:
        data = handshake(target)
        step = max(1, len(data) // cuts)
        for at in range(0, len(data), step):
            connection.raw(data[at:at + step])
        require(connection.answer().status == 101, "not accepted")


def delivery_cases():
    yield Case("ws.open.early", "RFC 6455 4.1", "a frame in the handshake's own segment",
               "400, or 101 and an answer", early)
    yield Case("ws.open.bytes", "RFC 9293", "the handshake byte by byte", "101",
               functools.partial(slowly, cuts=10000))
    yield Case("ws.open.pieces", "RFC 9293", "the handshake in 7 pieces", "101",
               functools.partial(slowly, cuts=7))


def groups():
    return [("opening: request", list(request_cases())), ("opening: fields", list(field_cases())),
            ("opening: key", list(key_cases())), ("opening: version", list(version_cases())),
            ("opening: extensions, protocols", list(offer_cases())),
            ("opening: origin and host", list(origin_cases())),
            ("opening: delivery", list(delivery_cases()))]
