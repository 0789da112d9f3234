"""Cases of RFC 6455, chapters 7 and 8: close codes, data after a close, and UTF-8."""
import functools
import struct

from suite import Case, require
from wire_client import CLOSE, PING, TEXT, Closed, frame
from ws_frames import CONTINUE, closing, custom, living, question, require_close, session

# Codes neither in use nor reserved for others (7.4.2), or never to be sent (7.4.1).
BAD_CODES = (0, 1, 999, 1004, 1005, 1006, 1015, 1016, 1100, 1999, 2000, 2500, 2999)
GOOD_CODES = (1000, 1001, 1002, 1003, 1007, 1008, 1009, 1010, 1011, 1012, 1013, 3000, 3001, 3500,
              3999, 4000, 4001, 4400, 4410, 4999)
# Codes registered after the RFC, or beyond its ranges: the reaction is unspecified.
OPEN_CODES = (1014, 5000, 32768, 65535)

# The first and last characters of each encoded length, and those next to the surrogates.
VALID = {
    "ascii": b"hello", "nul": b"\0", "u7f": b"\x7f", "u80": b"\xc2\x80", "u7ff": b"\xdf\xbf",
    "u800": b"\xe0\xa0\x80", "ufff": b"\xe0\xbf\xbf", "u1000": b"\xe1\x80\x80",
    "ucfff": b"\xec\xbf\xbf", "ud000": b"\xed\x80\x80", "ud7ff": b"\xed\x9f\xbf",
    "ue000": b"\xee\x80\x80", "ufeff": b"\xef\xbb\xbf", "ufffd": b"\xef\xbf\xbd",
    "ufffe": b"\xef\xbf\xbe", "uffff": b"\xef\xbf\xbf", "u10000": b"\xf0\x90\x80\x80",
    "u3ffff": b"\xf0\xbf\xbf\xbf", "u40000": b"\xf1\x80\x80\x80", "ufffff": b"\xf3\xbf\xbf\xbf",
    "u100000": b"\xf4\x80\x80\x80", "u10ffff": b"\xf4\x8f\xbf\xbf",
    "mixed": "κόσμε \U0001f32a ひ é".encode(), "combined": "é̂".encode()}
INVALID = {
    "lone80": b"\x80", "lonebf": b"\xbf", "lone2": b"\x80\xbf", "lone-inside": b"ab\x80cd",
    "over-nul": b"\xc0\x80", "over-slash2": b"\xc0\xaf", "over-7f": b"\xc1\xbf",
    "over-slash3": b"\xe0\x80\xaf", "over-7ff": b"\xe0\x9f\xbf", "over-slash4": b"\xf0\x80\x80\xaf",
    "over-ffff": b"\xf0\x8f\xbf\xbf", "over-slash5": b"\xf8\x80\x80\x80\xaf",
    "over-slash6": b"\xfc\x80\x80\x80\x80\xaf", "ud800": b"\xed\xa0\x80", "udb7f": b"\xed\xad\xbf",
    "udbff": b"\xed\xaf\xbf", "udc00": b"\xed\xb0\x80", "udfff": b"\xed\xbf\xbf",
    "pair": b"\xed\xa0\x80\xed\xb0\x80", "u110000": b"\xf4\x90\x80\x80",
    "u13ffff": b"\xf4\xbf\xbf\xbf", "u140000": b"\xf5\x80\x80\x80", "f7": b"\xf7\xbf\xbf\xbf",
    "f8": b"\xf8\x88\x80\x80\x80", "fc": b"\xfc\x84\x80\x80\x80\x80", "fe": b"\xfe",
    "ff": b"\xff", "feff": b"\xfe\xff", "cut2": b"\xc2", "cut3": b"\xe2\x82", "cut3-1": b"\xe2",
    "cut4": b"\xf0\x9f\x8c", "cut4-2": b"\xf0\x9f", "cut4-1": b"\xf0", "cut-text": b"abc\xc3",
    "broken2": b"\xc2a", "broken3": b"\xe2\x82a", "broken4": b"\xf0\x9f\x8ca",
    "lead-lead": b"\xc2\xc2\x80", "latin1": "Föhn".encode("latin-1"),
    "long": b"x" * 3000 + b"\xff" + b"x" * 3000}


def goodbye(code, reason=b""):
    return frame(CLOSE, struct.pack(">H", code) + reason)


def code_cases():
    where = "RFC 6455 7.4"
    for code in GOOD_CODES:
        yield closing(f"close.{code}", where, f"close with {code}", goodbye(code), code, 1000)
    for code in BAD_CODES:
        yield closing(f"close.{code}", where, f"close with {code}", goodbye(code), 1002)
    for code in OPEN_CODES:
        yield closing(f"close.{code}", where, f"close with {code}, unspecified in the RFC",
                      goodbye(code), code, 1000, 1002)
    yield closing("close.empty", "RFC 6455 5.5.1", "a close without a code", frame(CLOSE), 1000,
                  1005)
    yield closing("close.byte", "RFC 6455 5.5.1", "a close of one byte", frame(CLOSE, b"\x03"),
                  1002)
    for name, reason in (
            ("short", b"bye"), ("longest", b"x" * 123), ("utf8", "αω".encode()), ("nul", b"a\0b")):
        yield closing(f"close.reason.{name}", "RFC 6455 5.5.1", f"a reason: {name}",
                      goodbye(1000, reason), 1000)
    for name in ("lone80", "over-slash2", "ud800", "u110000", "ff", "cut3", "broken2"):
        yield closing(f"close.reason.{name}", "RFC 6455 8.1", f"a reason that is not UTF-8: {name}",
                      goodbye(1000, INVALID[name]), 1002, 1007)


def silence_after(viewer, data):
    """Data after a close are ignored; the close is answered once."""
    viewer.raw(goodbye(1000) + data)
    closes, texts = 0, []
    try:
        while True:
            first, payload = viewer.frame()
            closes += first == 0x80 | CLOSE
            if first == 0x80 | TEXT:
                texts.append(payload)
    except Closed:
        pass
    require(closes == 1, f"{closes} close frames")
    require(not any(b'"id":5' in text for text in texts), "a text after the close was answered")


def after_cases():
    where = "RFC 6455 5.5.1"
    for name, data in (("nothing", b""), ("text", frame(TEXT, question())),
                       ("texts", frame(TEXT, question()) * 100), ("ping", frame(PING, b"x")),
                       ("close", goodbye(1001)), ("part", frame(TEXT, b"{", fin=False)),
                       ("rubbish", b"\xff" * 50), ("head", b"\x81")):
        yield custom(f"after.{name}", where, f"a close, then {name}",
                     "one close frame, no answer, TCP ended",
                     functools.partial(silence_after, data=data))
    yield Case("ws.after.waits", "RFC 6455 7.1.1", "the daemon closes TCP first",
               "TCP ended within 5 s", ends_first)
    yield custom("after.error", "RFC 6455 7.1.7", "texts after a frame that fails the session",
                 "1002 and no answer to them", failing_then_text)


def ends_first(target):
    with session(target) as viewer:
        viewer.raw(goodbye(1000))
        require_close(viewer, (1000,))


def failing_then_text(viewer):
    viewer.raw(frame(3) + frame(TEXT, question()))
    try:
        while True:
            kind, payload = viewer.message()
            require(b'"id":5' not in payload, "a text after the fault was answered")
    except Closed as end:
        require(end.code == 1002, f"closed with {end.code}")


def in_fragments(data, size=1):
    """A text message in fragments of `size` bytes."""
    parts = [data[at:at + size] for at in range(0, len(data), size)]
    return b"".join(frame(CONTINUE if number else TEXT, part, fin=number == len(parts) - 1)
                    for number, part in enumerate(parts))


def fail_fast(viewer, bad):
    """The close code is 1007; the RFC permits it at once or at the end of the message."""
    viewer.raw(frame(TEXT, b"abc" + bad, fin=False))
    viewer.raw_or_lost(frame(CONTINUE, b"xyz"))
    require_close(viewer, (1007,))


def utf8_cases():
    where = "RFC 6455 8.1, RFC 3629"
    for name, data in VALID.items():
        yield living(f"utf8.good.{name}", where, f"the text {data.hex():.40}", frame(TEXT, data), 1)
        if len(data) > 1:
            yield living(f"utf8.good.{name}.split", where, f"{data.hex():.40}, a byte a fragment",
                         in_fragments(data), 1)
    for name, data in INVALID.items():
        yield closing(f"utf8.bad.{name}", where, f"the text {data.hex():.40}", frame(TEXT, data),
                      1007)
        if 1 < len(data) < 100:
            yield closing(f"utf8.bad.{name}.split", where, f"{data.hex():.40}, a byte a fragment",
                          in_fragments(data), 1007)
    for name in ("lone80", "over-slash3", "ud800", "u110000", "ff"):
        yield custom(f"utf8.early.{name}", where, f"{INVALID[name].hex()} in the first fragment",
                     "closed with 1007, at once or at the end",
                     functools.partial(fail_fast, bad=INVALID[name]))
    name = '{"type":"open","id":5,"dataset":"κόσμε \U0001f32a"}'.encode()
    for size in (1, 2, 3, 5):
        yield living(f"utf8.json.{size}", where, f"non-ASCII names, {size} bytes a fragment",
                     in_fragments(name, size), 1)
    yield living("utf8.ping", where, "a ping in a character", frame(TEXT, b"\xe2\x82", fin=False)
                 + frame(PING, b"\xff") + frame(CONTINUE, b"\xac"), 1)
    yield closing("utf8.resumed", where, "a character divided between two messages",
                  frame(TEXT, b"\xe2\x82") + frame(TEXT, b"\xac"), 1007)


def groups():
    return [("close codes and reasons", list(code_cases())), ("after a close", list(after_cases())),
            ("UTF-8", list(utf8_cases()))]
