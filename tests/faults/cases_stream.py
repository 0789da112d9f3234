"""Streams that violate the protocol, never end, never read, or use a slow link."""
import os
import pathlib
import select
import shutil
import socket
import statistics
import subprocess
import sys
import time

from support import (KIB, MIB, PATIENCE_S, ROOT, SAMPLE, Daemon, Stream, case, is_sanitized,
                     metric, need, rss, small_view, wait_for)

sys.path.insert(0, str(ROOT / "tests/bench"))
from link_path import Proxy  # noqa: E402

MESSAGE_MAX = 64 * KIB
MESSAGE_CUT_S = 10  # deadline of an incomplete message
SLACK_S = 5
LARGE = (2560, 1440)


def codes_of(world, count, spoil, allowed):
    """The close codes of streams that send these invalid bytes; 0 is an end without a code."""
    daemon = world.daemon()
    seen = {}
    for n in range(count):
        with Stream(daemon.port) as one:
            try:
                spoil(one, n)
            except OSError:
                pass  # it may have been closed already
            code = one.until_closed()
        need(code in allowed, f"ended by {code}")
        seen[code] = seen.get(code, 0) + 1
    return "ended by " + ", ".join(f"{code or 'a reset'} {n} times"
                                   for code, n in sorted(seen.items()))


@case("oversize and high-bit frame lengths", 100, 10)
def lengths(world, count):
    tell = [MESSAGE_MAX + 1, 1 << 20, (1 << 31) - 1, 1 << 32, (1 << 63) - 1, 1 << 63, (1 << 64) - 1]

    def spoil(one, n):
        one.send(1, b"{}", length=tell[n % len(tell)])
    return codes_of(world, count, spoil, {1009, 1002})


@case("a deflate bomb", 50, 10)
def deflate(world, count):
    daemon = world.daemon()
    with Stream(daemon.port, [("Sec-WebSocket-Extensions", "permessage-deflate")]) as one:
        need(b"permessage-deflate" not in one.head.lower(), "compression was negotiated")
    # 64 kB of which each byte decompresses to a thousand.
    packed = b"\xec\xc1" + bytes(60000)
    return codes_of(world, count, lambda one, n: one.send(1, packed, reserved=4),
                    {1002}) + "; no compression is agreed to"


@case("endless fragments", 6, 2)
def fragments(world, count):
    daemon = world.daemon()
    outcome = []
    for n in range(count):
        with Stream(daemon.port, timeout=MESSAGE_CUT_S + 20) as one:
            one.send(1, b"", fin=False)
            since, sent = time.monotonic(), 0
            size = (0, 1, 1000)[n % 3]
            one.socket.settimeout(0)
            code = None
            while code is None and time.monotonic() < since + MESSAGE_CUT_S + SLACK_S:
                try:
                    one.send(0, bytes(size), fin=False)
                    sent += 1
                    if sent % 500 == 0:
                        time.sleep(0.01)
                except BlockingIOError:
                    time.sleep(0.01)
                except OSError:
                    break
            one.socket.settimeout(PATIENCE_S)
            try:
                code = one.until_closed()
            except OSError:
                code = 0
            took = time.monotonic() - since
            need(took < MESSAGE_CUT_S + SLACK_S, f"held open for {took:.1f} s")
            need(code in (0, 1009, 1002), f"ended by {code}")
            outcome.append(f"{sent} of {size} bytes in {took:.1f} s")
    return "disconnected after " + ", ".join(outcome[:3])


def deaf(daemon, count, size):
    out = []
    for n in range(count):
        one = Stream(daemon.port, receive_buffer=4 * KIB)
        for turn in range(3):
            one.patch(small_view(turn=0.01 * n + 0.1 * turn, size=size))
        out.append(one)
    return out


@case("peers that never read", 20, 4)
def never_read(world, count):
    """Several such peers connect at once. Each may hold two frames and 256 KiB; they are closed at
    the deadline."""
    daemon = world.start("--max-sessions", "64", SAMPLE)
    with Stream(daemon.port) as reader:
        frame = len(reader.final_frame(small_view(size=LARGE)))
    first = deaf(daemon, 2, LARGE)  # one-time allocations of the renderer are complete after these
    time.sleep(1.0 if world.quick else 4.0)
    before, unsent = rss(daemon.pid), metric(daemon.port, "windsplat_unsent_bytes")
    many = deaf(daemon, count, LARGE)
    highest = 0
    end = time.monotonic() + (4 if world.quick else 12)
    while time.monotonic() < end:
        highest = max(highest, rss(daemon.pid))
        time.sleep(0.1)
    held = (metric(daemon.port, "windsplat_unsent_bytes") - unsent) / count
    room = 2 * frame + 256 * KIB
    each = (highest - before) / count
    need(each <= room + 2 * MIB / count,
         f"{each / KIB:.0f} KiB each, a frame has {frame / KIB:.0f}")
    need(held <= room, f"{held / KIB:.0f} KiB wait for each")
    outcome = (f"{max(0, each) / KIB:.0f} KiB each (two frames and 256 KiB are {room / KIB:.0f}), "
            f"{held / KIB:.0f} KiB of them unsent")
    if not world.quick:
        # The deadline of a frame is 15 s plus its size at 64 KiB/s. A frame that fits the kernel's
        # buffers is not blocked, and its session ends after 60 s without an answer to a ping.
        wait_for(lambda: metric(daemon.port, "windsplat_sessions") == 0, 90 + PATIENCE_S,
                 "sessions that never read are still open")
        outcome += "; closed by the deadline"
    for one in first + many:
        one.close()
    return outcome


def crawl(daemon, port, seconds):
    """A client that continuously changes its view over a slow link; the delays of the frames in
    revs."""
    behind, frames = [], 0
    with Stream(port, timeout=30) as one:
        one.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 16 * KIB)
        one.final_frame(small_view(size=(640, 480)))
        before = rss(daemon.pid)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            one.patch(small_view(turn=0.01 * one.rev, size=(640, 480)))
            if not one.buffer and not select.select([one.socket], [], [], 0.05)[0]:
                continue
            opcode, payload = one.message()
            if opcode == 2:
                seq, rev = (int.from_bytes(payload[at:at + 4], "little") for at in (8, 12))
                one.say({"type": "ack", "seq": seq, "decodeMs": 1})
                behind.append(one.rev - rev)
                frames += 1
        one.answer_to_patch()
        more = rss(daemon.pid) - before
    return frames, behind, more


@case("a slow link", 3, 1)
def slow_link(world, count):
    seconds = 3 if world.quick else 10
    ways, outcome = [], []
    if os.geteuid() == 0 and shutil.which("tc") and can_shape():
        ways.append("tc")
    ways.append("proxy")
    for _ in range(count):
        for way in ways:
            outcome.append(by_tc(world, seconds) if way == "tc" else by_proxy(world, seconds))
    if "tc" not in ways:
        outcome.append("tc in a network namespace was not tried (needs root and iproute2)")
    return "; ".join(outcome[-2:])


def by_proxy(world, seconds):
    daemon = world.daemon()
    link = Proxy(125_000, 0.02)
    try:
        return judged_crawl("proxy of 1 Mbit/s", world.program,
                            *crawl(daemon, link.port_of(daemon.port), seconds))
    finally:
        link.close()


def judged_crawl(name, program, frames, behind, more):
    need(frames >= 3, f"{name}: only {frames} frames were received")
    # The renderer's one-time memory for the final picture may be included.
    need(more < 8 * MIB or is_sanitized(program),
         f"{name}: the daemon grew by {more / MIB:.1f} MiB")
    late = statistics.median(behind)
    # Patches are sent every 50 ms or with each message; queued old frames would increase the delay
    # steadily.
    early, last = statistics.median(behind[:3]), statistics.median(behind[-3:])
    need(last <= early + 20, f"{name}: frames fall behind, from {early} to {last} changes")
    return (f"{name}: {frames} frames, each {late:.0f} changes old, memory "
            f"+{max(0, more) / MIB:.1f} MiB")


SHAPE = ("ip link set lo mtu 1500 up && tc qdisc add dev lo root tbf rate 1mbit burst 8kb "
         "latency 100ms")


def can_shape():
    return subprocess.run(["unshare", "--net", "sh", "-c", SHAPE], capture_output=True,
                          check=False).returncode == 0


def by_tc(world, seconds):
    """Runs the daemon and its client in a network namespace whose loopback is slow."""
    done = subprocess.run(
        ["unshare", "--net", "sh", "-c", f'{SHAPE} && exec "$@"', "sh", sys.executable,
         str(pathlib.Path(__file__)), world.program, str(seconds)],
        capture_output=True, text=True, timeout=PATIENCE_S + 4 * seconds, check=False)
    need(done.returncode == 0, f"tc: {done.stderr.strip()[-300:]}")
    return done.stdout.strip()


@case("malformed messages", 200, 40)
def no_messages(world, count):
    """Broken JSON and unknown types are answered with errors; binary messages and invalid UTF-8
    close the stream."""
    daemon = world.daemon()
    answered = [b"{", b"[]", b"null", b'{"type": "nothing"}', b'{"type": "ack", "seq": 99}',
                b'{"type": "patch"}', b"[" * 5000, b'{"type": "open", "id": 1e400, "dataset": "x"}',
                b'{"type": "patch", "rev": 4294967296, "patch": {}}',
                b'{"type": "still", "id": -1}']
    closing = [(2, b"x", {4400}), (1, b"\xff\xfe", {1007}), (3, b"", {1002}), (11, b"", {1002})]
    errors = closed = 0
    for n in range(count):
        with Stream(daemon.port) as one:
            one.send(1, answered[n % len(answered)])
            while b'"error"' not in one.message()[1]:
                pass
            errors += 1
            opcode, payload, codes = closing[n % len(closing)]
            one.send(opcode, payload)
            code = one.until_closed()
            need(code in codes, f"opcode {opcode} is answered by {code}")
            closed += 1
    return (f"{errors} answered with an error and kept open, then {closed} closed by 4400, 1007 "
            "or 1002")


@case("streams cut off without a close frame", 100, 20)
def cut_off(world, count):
    daemon = world.daemon()
    wait_for(lambda: metric(daemon.port, "windsplat_sessions") == 0, PATIENCE_S, "sessions")
    for n in range(count):
        one = Stream(daemon.port)
        one.patch(small_view(turn=0.01 * n))
        if n % 2:
            one.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            one.socket.sendall(b"\x81\xfe")  # in the middle of a frame
        one.close()
    wait_for(lambda: metric(daemon.port, "windsplat_sessions") == 0, PATIENCE_S,
             "sessions of disconnected peers")
    return "every session is closed"


@case("more sessions than allowed", 20, 5)
def too_many(world, count):
    daemon = world.start("--max-sessions", "3", SAMPLE)
    kept = [Stream(daemon.port) for _ in range(3)]
    for one in kept:
        one.message()
    for _ in range(count):
        with Stream(daemon.port) as one:
            if one.status == 101:
                need(one.until_closed() == 1013, "not closed with 1013")
            else:
                need(one.status in (429, 503), f"answered by {one.status}")
    for one in kept:
        one.final_frame(small_view())
        one.close()
    return "1013 or 503; the earlier sessions continue"






def main():
    """Runs one slow client in a network namespace created by by_tc."""

    daemon = Daemon(sys.argv[1], SAMPLE)
    try:
        print(judged_crawl("tc tbf of 1 Mbit/s", sys.argv[1],
                           *crawl(daemon, daemon.port, float(sys.argv[2]))))
    finally:
        daemon.stop()


if __name__ == "__main__":
    main()
