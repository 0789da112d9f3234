#!/usr/bin/env python3
"""Measures frames of a real daemon over links of known rate and delay during a drag: frame rate,
size and age. Prints a Markdown table. Linux only.

Usage: links.py [--program=windsplat] [--how=auto|tunnel|proxy] [--mbit=0.5,2,...] [--trip-ms=...]
       [--size=1280x720] [--dataset=climate] [--seconds=10] [--video] [--check] [--smoke]

The client changes the camera every 16 ms and acknowledges frames as they arrive. A frame's age
is its arrival time minus the time of the newest change it shows. The link time is the round trip
plus the bytes of the frame and of the text messages before it, divided by the rate. The render
interval is the mean time between moving frames. A link is within bounds if the 99th percentile of
age minus link time is at most two render intervals; --check exits 1 if any link is not. Frames of
the first two seconds do not count, because the daemon and TCP are still adapting to the link. With
--video the client announces that it decodes H.264; the table tells the share of such frames and how
many of them are key frames."""
import argparse
import math
import statistics
import sys
import time

from link_client import H264, LinkViewer
from link_path import Proxy, Tunnel, can_tunnel

SETTLE_S = 2.0
PATCH_S = 0.016
COLUMNS = ["Mbit/s", "round trip", "frames/s", "kB", "H.264", "keys", "quality", "width",
           "drawn in", "interval", "link", "age p50", "age p99", "p99 of age - link - drawn",
           "p99 of age - link", "<= 2 intervals", "text waits, most", "final after, s", "kB"]


def quantile(values, share):
    ordered = sorted(values)
    return ordered[round(share * (len(ordered) - 1))] if ordered else math.nan


def drag(viewer, seconds):
    begin = time.monotonic()
    step = 0
    while time.monotonic() < begin + seconds:
        if viewer.fault:
            raise viewer.fault
        angle = 0.2 + 0.01 * step
        viewer.patch({"camera": {"eye": [2.4 * math.sin(angle), -2.4 * math.cos(angle), 1.6]}})
        step += 1
        if step % 25 == 0:
            viewer.ask()
        time.sleep(max(0, begin + step * PATCH_S - time.monotonic()))
    return begin, time.monotonic()


def measure(options, how, mbit, trip_ms):
    link = how(mbit * 125_000, trip_ms * 1e-3)
    daemon = None
    try:
        daemon = link.start([options.program, "serve", options.dataset, "--listen",
                             f"{link.host}:0", "--allow-remote", "--allow-root"])
        port = int(daemon.stdout.readline().strip().rstrip("/").rsplit(":", 1)[1])
        viewer = LinkViewer(link.host, link.port_of(port))
        if options.video:
            viewer.announce_video()
        width, height = map(int, options.size.split("x"))
        viewer.patch({"dataset": options.dataset, "image": {"width": width, "height": height}})
        if viewer.wait_for_final(120) is None:
            raise RuntimeError("no final frame was received")
        begin, end = drag(viewer, options.seconds)
        final = viewer.wait_for_final(60)
        viewer.close()
    finally:
        if daemon:
            daemon.terminate()
            daemon.wait()
        link.close()
    since = begin + min(SETTLE_S, options.seconds / 2)
    moving = [f for f in viewer.frames if not f.final and since < f.arrived < end]
    return row(options, viewer, moving, final, mbit, trip_ms, end - since, end)


def row(options, viewer, moving, final, mbit, trip_ms, seconds, end):
    if len(moving) < 2:
        print(f"| {mbit:g} | {trip_ms:g} | only {len(moving)} moving frames |")
        return False
    rate = mbit * 125_000
    trip = trip_ms * 1e-3
    drawn = [f.queue_s + f.render_s + f.encode_s for f in moving]
    ages = [f.arrived - f.t for f in moving]
    links = [trip + f.wire_bytes / rate for f in moving]
    interval = (moving[-1].arrived - moving[0].arrived) / (len(moving) - 1)
    beyond = quantile([age - link for age, link in zip(ages, links)], 0.99)
    rest = quantile([age - link - draw for age, link, draw in zip(ages, links, drawn)], 0.99)
    waits = [wait - trip for wait in viewer.answers]
    fine = beyond <= 2 * interval
    levels = sorted({f.width for f in moving})
    print(f"| {mbit:g} | {trip_ms:g} | {len(moving) / seconds:.1f} "
          f"| {statistics.mean(f.bytes for f in moving) / 1e3:.1f} "
          f"| {sum(f.codec == H264 for f in moving) / len(moving):.0%} "
          f"| {sum(f.key for f in moving)} "
          f"| {statistics.median(f.quality for f in moving):.0f} "
          f"| {'-'.join(str(w) for w in (levels[0], levels[-1])[:len(levels)])} "
          f"| {1e3 * statistics.median(drawn):.0f} | {1e3 * interval:.0f} "
          f"| {1e3 * statistics.median(links):.0f} "
          f"| {1e3 * quantile(ages, 0.5):.0f} | {1e3 * quantile(ages, 0.99):.0f} "
          f"| {1e3 * rest:.0f} | {1e3 * beyond:.0f} | {'yes' if fine else 'NO'} "
          f"| {1e3 * max(waits, default=math.nan):.0f} "
          f"| {'-' if final is None else f'{final.arrived - end:.2f}'} "
          f"| {'-' if final is None else f'{final.bytes / 1e3:.0f}'} |", flush=True)
    return fine and final is not None


def numbers(text):
    return [float(word) for word in text.split(",")]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default="build/release/windsplat")
    parser.add_argument("--how", choices=["auto", "tunnel", "proxy"], default="auto")
    parser.add_argument("--mbit", type=numbers, default=[0.5, 2, 10, 100, 1000])
    parser.add_argument("--trip-ms", type=numbers, default=[1, 20, 200])
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--dataset", default="climate")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--video", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one small, short link by each method")
    options = parser.parse_args()
    how = {"auto": Tunnel if can_tunnel() else Proxy, "tunnel": Tunnel, "proxy": Proxy}[options.how]
    if options.smoke:
        options.size, options.seconds, options.mbit, options.trip_ms = "320x180", 1, [2], [20]
    how.enter()
    fine = True
    for path in [Proxy, how] if options.smoke and how is not Proxy else [how]:
        print(f"\nBy {path.name}: {options.dataset}, {options.size}. Times in ms.\n")
        print("| " + " | ".join(COLUMNS) + " |\n" + "|---" * len(COLUMNS) + "|")
        for mbit in options.mbit:
            for trip_ms in options.trip_ms:
                fine = measure(options, path, mbit, trip_ms) and fine
    return 1 if options.check and not fine else 0


if __name__ == "__main__":
    sys.exit(main())
