"""Cases of RFC 6455, chapters 5 and 6: masks, reserved bits and opcodes, lengths, fragments,
pings, binary messages, delivery, deadlines."""
import functools
import json
import socket
import struct
import time

from suite import Case, require
from wire_client import (BINARY, CLOSE, PING, PONG, TEXT, Closed, WebSocket, frame)

CONTINUE = 0
MESSAGE_MAX = 65536
NAMES = {CONTINUE: "continuation", TEXT: "text", BINARY: "binary", CLOSE: "close", PING: "ping",
         PONG: "pong"}


def session(target):
    viewer = WebSocket(target)
    viewer.text("hello")
    return viewer


def question(number=5, size=0):
    """A text message, padded to `size` bytes, whose answer contains its number."""
    text = json.dumps({"type": "open", "id": number, "dataset": "nowhere"})
    return text.encode().ljust(size)


def require_life(viewer, errors=None):
    """A request is answered, preceded by that many errors, if given."""
    viewer.send(TEXT, question(4242))
    before = 0
    while viewer.text("error").get("id") != 4242:
        before += 1
    require(errors is None or before == errors, f"{before} answers, not {errors}")


def require_close(viewer, codes):
    """Expects a close frame with one of those codes (None: no close frame needed), then the end
    of TCP."""
    try:
        while True:
            viewer.message()
    except Closed as end:
        require(end.code in codes, f"closed with {end.code}: {end}")
        if end.code:  # otherwise the daemon waits for the answering close
            viewer.raw_or_lost(frame(CLOSE, struct.pack(">H", 1000)))
    require(viewer.ended(), "TCP stays open behind the close frame")


def pieces(viewer, data):
    """`data`: bytes to send at once, or a list of them to send one by one."""
    for part in data if isinstance(data, list) else [data]:
        if not viewer.raw_or_lost(part):
            break


def run_closing(target, data, codes):
    with session(target) as viewer:
        pieces(viewer, data)
        require_close(viewer, codes)


def run_living(target, data, errors):
    with session(target) as viewer:
        pieces(viewer, data)
        require_life(viewer, errors)


def closing(name, section, what, data, *codes):
    outcome = " or ".join("the end" if code is None else str(code) for code in codes)
    return Case("ws." + name, section, what, f"closed with {outcome}",
                functools.partial(run_closing, data=data, codes=codes))


def living(name, section, what, data, errors):
    return Case("ws." + name, section, what, f"{errors} answers, the session lives",
                functools.partial(run_living, data=data, errors=errors))


def custom(name, section, what, expected, run, slow=False):
    def with_session(target):
        with session(target) as viewer:
            run(viewer)
    return Case("ws." + name, section, what, expected, with_session, slow)


def mask_cases():
    where = "RFC 6455 5.1"
    for opcode, name in NAMES.items():
        body = struct.pack(">H", 1000) if opcode == CLOSE else b"hi"
        yield closing(f"mask.none.{name}", where, f"an unmasked {name} frame",
                      frame(opcode, body, mask=b""), 1002)
    yield closing("mask.none.empty", where, "an unmasked text of length zero",
                  frame(TEXT, mask=b""), 1002)
    yield closing("mask.none.medium", where, "an unmasked text of 300 bytes",
                  frame(TEXT, b"x" * 300, mask=b""), 1002)
    yield closing("mask.none.second", where, "a masked fragment, then an unmasked one",
                  frame(TEXT, b"{", fin=False) + frame(CONTINUE, b"}", mask=b""), 1002)
    for name, mask in (
            ("zero", bytes(4)), ("ones", b"\xff" * 4), ("low", b"\0\0\0\1"),
            ("frame", b"\x81\x80\x88\x80")):
        yield living(f"mask.{name}", "RFC 6455 5.3", f"the mask {mask.hex()}",
                     frame(TEXT, question(), mask=mask), 1)
        yield living(f"mask.{name}.long", "RFC 6455 5.3", f"the mask {mask.hex()}, 65535 bytes",
                     frame(TEXT, question(5, 65535), mask=mask), 1)
    halves = frame(TEXT, question()[:11], fin=False) + frame(CONTINUE, question()[11:])
    yield living("mask.each", "RFC 6455 5.3", "a separate mask for each fragment", halves, 1)
    for size in range(9):
        yield living(f"mask.tail.{size}", "RFC 6455 5.3", f"a text of {size} bytes (mask tail)",
                     frame(TEXT, b"x" * size), 1)


def reserved_cases():
    where = "RFC 6455 5.2"
    for opcode, name in NAMES.items():
        body = struct.pack(">H", 1000) if opcode == CLOSE else b"hi"
        start = frame(TEXT, b"{", fin=False) if opcode == CONTINUE else b""
        for rsv in range(1, 8):
            bits = "+".join(str(4 - bit) for bit in (1, 2, 3) if rsv >> (bit - 1) & 1)
            yield closing(f"rsv.{name}.{rsv}", where, f"RSV{bits} set on a {name} frame",
                          start + frame(opcode, body, rsv=rsv), 1002)
    for opcode in (3, 4, 5, 6, 7, 11, 12, 13, 14, 15):
        for how, data in (
                ("empty", frame(opcode)), ("full", frame(opcode, b"hi")),
                ("part", frame(opcode, b"hi", fin=False))):
            yield closing(f"opcode.{opcode:x}.{how}", where, f"opcode {opcode:#x}, {how}", data,
                          1002)
        yield closing(f"opcode.{opcode:x}.inside", where, f"opcode {opcode:#x} between fragments",
                      frame(TEXT, b"{", fin=False) + frame(opcode), 1002)


def length_cases():
    where = "RFC 6455 5.2"
    for size in (0, 1, 2, 124):
        yield living(f"length.{size}", where, f"a text of {size} bytes",
                     frame(TEXT, b" " * size), 1)
    for size in (125, 126, 127, 128, 255, 256, 1000, 32767, 32768, 65534, 65535, MESSAGE_MAX):
        yield living(f"length.{size}", where, f"a text of {size} bytes",
                     frame(TEXT, question(5, size)), 1)
    for size in (MESSAGE_MAX + 1, 70000, 131072, 1 << 20):
        yield closing(f"length.{size}", "the limit of a message", f"a text of {size} bytes",
                      frame(TEXT, b" " * size), 1009)
    for size in (
            MESSAGE_MAX + 1, 1 << 31, (1 << 32) - 1, 1 << 32, (1 << 32) + 5, 1 << 40,
            (1 << 63) - 1):
        yield closing(f"length.claim.{size:x}", "the limit of a message",
                      f"a text with the declared length {size:#x}",
                      frame(TEXT, b"hi", length=size, width=64), 1009)
    for size in (1 << 63, (1 << 63) + 5, (1 << 64) - 1):
        yield closing(f"length.high.{size:x}", where, f"the highest bit set: {size:#x}",
                      frame(TEXT, b"hi", length=size, width=64), 1002, 1009)
    for width, sizes in ((16, (0, 1, 124, 125)), (64, (0, 1, 125, 126, 127, 1000, 65535))):
        for size in sizes:
            yield closing(f"length.wide.{width}.{size}", where,
                          f"{size} bytes, length in {width} bits",
                          frame(TEXT, b" " * size, width=width), 1002)


def fragment_cases():
    where = "RFC 6455 5.4"
    text = question()

    def cut(*sizes, between=b"", opcode=TEXT):
        """The request in fragments of those sizes, the remainder last."""
        out, at = b"", 0
        for number, size in enumerate(sizes):
            out += frame(CONTINUE if number else opcode, text[at:at + size], fin=False) + between
            at += size
        return out + frame(CONTINUE, text[at:])

    for name, sizes in (
            ("two", (20,)), ("three", (3, 20)), ("bytes", (1,) * (len(text) - 1)),
            ("first-empty", (0,)), ("last-empty", (len(text),)),
            ("empties", (0, 0, 7, 0, 0, 9, 0))):
        yield living(f"fragments.{name}", where, f"a text in fragments of {str(sizes):.30}",
                     cut(*sizes), 1)
    yield living("fragments.nothing", where, "a text of three empty fragments",
                 frame(TEXT, fin=False) + frame(CONTINUE, fin=False) + frame(CONTINUE), 1)
    yield living("fragments.thousands", where, "5,000 fragments of a byte",
                 frame(TEXT, b"{", fin=False) + frame(CONTINUE, b" ", fin=False) * 5000
                 + frame(CONTINUE, b"}"), 1)
    yield living("fragments.twice", where, "two texts, each in fragments",
                 cut(5) + cut(2, 2, 2), 2)
    for name, control in (
            ("ping", frame(PING, b"in")), ("pong", frame(PONG, b"in")), ("pings", frame(PING) * 3)):
        yield living(f"fragments.{name}", where, f"{name} between fragments",
                     cut(5, 5, between=control), 1)
    yield custom("fragments.answered", where, "a ping between fragments is answered at once",
                 "its pong before the end of the text is sent", ping_between)
    yield closing("fragments.close", where, "a close between fragments",
                  cut(5, between=frame(CLOSE, struct.pack(">H", 1000))), 1000)
    yield closing("fragments.no-start", where, "a continuation of nothing",
                  frame(CONTINUE, b"hi"), 1002)
    yield closing("fragments.no-start.part", where, "a continuation without a start, not final",
                  frame(CONTINUE, b"hi", fin=False), 1002)
    yield closing("fragments.over", where, "a continuation after the last one",
                  cut(5) + frame(CONTINUE, b"hi"), 1002)
    for opcode in (TEXT, BINARY):
        for fin in (True, False):
            yield closing(f"fragments.new.{NAMES[opcode]}.{fin}", where,
                          f"a new {NAMES[opcode]} within a text, FIN {fin}",
                          frame(TEXT, b"{", fin=False) + frame(opcode, b"}", fin=fin), 1002)
    half = MESSAGE_MAX // 2
    yield living("fragments.limit", "the limit of a message", "65,536 bytes in two fragments",
                 frame(TEXT, question(5, half), fin=False) + frame(CONTINUE, b" " * half), 1)
    yield closing("fragments.beyond", "the limit of a message", "65,537 bytes in two fragments",
                  frame(TEXT, b" " * half, fin=False) + frame(CONTINUE, b" " * (half + 1)), 1009)
    yield closing("fragments.overflow", "the limit of a message",
                  "a fragment, then one of 2^64 - 1 bytes", frame(TEXT, b" ", fin=False)
                  + frame(CONTINUE, b" ", length=(1 << 64) - 1, width=64), 1002, 1009)


def ping_between(viewer):
    viewer.send(TEXT, question()[:9], fin=False)
    viewer.send(PING, b"now")
    while viewer.frame() != (0x80 | PONG, b"now"):
        pass
    viewer.send(CONTINUE, question()[9:])
    require(viewer.text("error")["id"] == 5, "the text is not answered")


def echo(viewer, payload):
    viewer.send(PING, payload)
    while True:
        first, got = viewer.frame()
        if first == 0x80 | PONG:
            require(got == payload, f"another payload: {got!r}")
            return


def ping_cases():
    where = "RFC 6455 5.5.2"
    for size in (0, 1, 2, 4, 63, 64, 124, 125):
        yield custom(f"ping.{size}", where, f"a ping of {size} bytes", "its pong",
                     functools.partial(echo, payload=bytes(range(size))))
    yield custom("ping.every", where, "pings of every size in sequence", "126 pongs",
                 lambda viewer: [echo(viewer, b"\xff" * size) for size in range(126)])
    yield custom("ping.many", where, "20 pings at once",
                 "pongs in order, including the last one", many_pings)
    yield custom("ping.flood", where, "20,000 pings of 125 bytes, pongs not read meanwhile",
                 "the session continues, or is closed", flood)
    for name, payload in (
            ("empty", b""), ("text", b"hello"), ("number", b"1"), ("huge", b"99999999999999999999"),
            ("longest", b"\x80" * 125)):
        yield living(f"pong.{name}", "RFC 6455 5.5.3", f"an unsolicited pong: {name}",
                     frame(PONG, payload), 0)
    where = "RFC 6455 5.5"
    for opcode in (PING, PONG, CLOSE):
        body = struct.pack(">H", 1000) if opcode == CLOSE else b""
        for size in (126, 127, 1000, 65536):
            yield closing(f"control.{NAMES[opcode]}.{size}", where,
                          f"a {NAMES[opcode]} of {size} bytes",
                          frame(opcode, body.ljust(size, b"x")), 1002)
        yield closing(f"control.{NAMES[opcode]}.wide", where,
                      f"a {NAMES[opcode]} of 5 bytes, length in 16 bits",
                      frame(opcode, body.ljust(5, b"x"), width=16), 1002)
        yield closing(f"control.{NAMES[opcode]}.part", where, f"a {NAMES[opcode]} without FIN",
                      frame(opcode, body, fin=False), 1002)
        yield closing(f"control.{NAMES[opcode]}.cut", where, f"a {NAMES[opcode]} in two fragments",
                      frame(opcode, body, fin=False) + frame(CONTINUE), 1002)


def many_pings(viewer):
    viewer.raw(b"".join(frame(PING, str(n).encode()) for n in range(20)))
    heard = []
    while "19" not in heard:
        first, payload = viewer.frame()
        if first == 0x80 | PONG:
            heard.append(payload.decode())
    require(heard == sorted(heard, key=int), f"out of order: {heard}")


def flood(viewer):
    data = b"".join(frame(PING, bytes(125), mask=bytes(4)) for _ in range(200))
    viewer.socket.settimeout(3)
    try:
        for _ in range(100):
            viewer.raw(data)
        viewer.send(PING, b"last")
        while viewer.frame() != (0x80 | PONG, b"last"):
            pass
    except (TimeoutError, OSError, Closed):
        pass  # the peer may have closed; the daemon is checked after the group


def binary_cases():
    where = "the stream: text messages only"
    for name, data in (
            ("empty", frame(BINARY)), ("short", frame(BINARY, b"\0\1\2")),
            ("long", frame(BINARY, bytes(60000))), ("json", frame(BINARY, question())),
            ("fragments", frame(BINARY, b"a", fin=False) + frame(CONTINUE, b"b")),
            ("bad-utf8", frame(BINARY, b"\xff\xfe"))):
        yield closing(f"binary.{name}", where, f"a binary message: {name}", data, 4400)
    yield closing("binary.after", where, "a text, then a binary message",
                  frame(TEXT, question()) + frame(BINARY, b"x"), 4400)
    yield closing("binary.beyond", "the limit of a message", "a binary message of 65,537 bytes",
                  frame(BINARY, bytes(MESSAGE_MAX + 1)), 1009)


def leave(viewer, data, reset):
    viewer.raw(data)
    if reset:
        viewer.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))


def delivery_cases():
    where = "RFC 6455 6.2"
    single = frame(TEXT, question())
    whole = frame(TEXT, question(5, MESSAGE_MAX))
    yield living("delivery.bytes", where, "a text byte by byte",
                 [bytes([byte]) for byte in single], 1)
    yield living("delivery.long", where, "65,536 bytes in 32 pieces",
                 [whole[at:at + 2050] for at in range(0, len(whole), 2050)], 1)
    yield living("delivery.many", where, "50 texts in one segment", single * 50, 50)
    yield living("delivery.cut", where, "a text and a half, then the other half",
                 [single + single[:9], single[9:]], 2)
    yield living("delivery.head", where, "the frame's header first, then its payload",
                 [single[:6], single[6:]], 1)
    yield living("delivery.ping", where, "a ping byte by byte",
                 [bytes([byte]) for byte in frame(PING, b"abc")], 0)
    for name, data in (
            ("head", single[:1]), ("mask", single[:4]), ("payload", single[:20]),
            ("fragment", frame(TEXT, b"{", fin=False)), ("ping", frame(PING, b"hello")[:5]),
            ("whole", single)):
        for reset in (False, True):
            yield custom(f"leaving.{name}.{'reset' if reset else 'end'}", "RFC 6455 7.1.7",
                         f"the client disconnects within the {name}", "the daemon runs",
                         functools.partial(leave, data=data, reset=reset))


def ended_within(viewer, seconds, data, every):
    """Sends the frame repeatedly; the daemon must close the connection."""
    end = time.monotonic() + seconds
    codes = (None, 1002, 1008, 1009)
    viewer.socket.settimeout(0.01)
    while time.monotonic() < end:
        if data and not viewer.raw_or_lost(data):
            return
        try:
            while viewer.frame()[0] != 0x80 | CLOSE:
                pass
        except TimeoutError:
            time.sleep(every)
            continue
        except Closed as outcome:
            require(outcome.code in codes, str(outcome))
            return
        require(viewer.ended(5), "TCP stays open behind the close frame")
        return
    require(False, f"not ended in {seconds} s")


def once_then(first, seconds, data, every):
    def run(viewer):
        viewer.raw(first)
        ended_within(viewer, seconds, data, every)
    return run


def deadline_cases():
    """A message is limited to 10 s and 128 KiB; the test sends for twice that time."""
    def patient(name, what, first, data, every):
        return custom("deadline." + name, "the time of a message", what, "ended within 20 s",
                      once_then(first, 20, data, every), slow=True)

    start = frame(TEXT, fin=False)
    yield patient("empties", "200,000 empty fragments", start,
                  frame(CONTINUE, fin=False, mask=bytes(4)) * 2000, 0)
    yield patient("empties.slow", "empty fragments, one in 0.2 s", start,
                  frame(CONTINUE, fin=False), 0.2)
    yield patient("bytes.slow", "a payload byte by byte, one in 0.2 s",
                  frame(TEXT, b"{", length=60000, width=16), b" ", 0.2)
    yield patient("head", "half of a frame's header, then nothing", start[:1], b"", 0.2)
    yield patient("fragment", "a fragment, then nothing", frame(TEXT, b"{", fin=False), b"", 0.2)


def groups():
    return [("masks", list(mask_cases())), ("reserved bits and opcodes", list(reserved_cases())),
            ("lengths", list(length_cases())), ("fragments", list(fragment_cases())),
            ("pings, pongs, control frames", list(ping_cases())),
            ("binary messages", list(binary_cases())), ("delivery", list(delivery_cases())),
            ("deadlines of a message", list(deadline_cases()))]
