#!/usr/bin/env python3
"""Sends requests and WebSocket frames of sizes at boundaries to one daemon, which must answer each
as documented, keep running, and serve a well-behaved client after every hundred.

    tests/edge/boundaries.py                      # starts build/release/windsplat; every shot
    tests/edge/boundaries.py --count=1000 --seed=7 # 1000 shots, chosen and ordered by the seed
    tests/edge/boundaries.py --kind=trailer        # kinds whose name holds that
    tests/edge/boundaries.py --url=https://127.0.0.1:8443/ --ca=cert.pem --token-file=token

Sizes are 2^k - 1, 2^k, 2^k + 1 and each limit reported by GET /v1 with its neighbours. The data
sent depend on --seed and those limits only. Exit code 0: no failure."""
import collections
import random
import sys
import time

import suite
from boundary_shots import Kinds
from suite import KIB, Watched, Wrong
from wire_client import request

EVERY = 100
# Factors of the permitted growth. Each of up to six threads that computed a forecast keeps its
# scratch memory, some 640 KiB; rendered pictures leave steps of the sample in memory, 4 MiB each.
REFUSED_SHARE = 4
DRAWN_SHARE = 64


class Gunner:
    def __init__(self, daemon):
        self.daemon = daemon
        self.answers = collections.Counter()
        self.kinds = collections.Counter()
        self.failures = []
        self.most = 0

    def one(self, shot):
        self.kinds[shot.kind] += 1
        try:
            self.answers[shot.run(self.daemon.target)] += 1
        except (Wrong, RuntimeError, OSError, ValueError) as fault:
            self.answers["FAILED"] += 1
            self.failures.append(f"{shot.kind}, size {shot.size}: {type(fault).__name__}: "
                                 f"{str(fault)[:300]}")

    def look_after(self, before, sent):
        growth = self.daemon.settled_growth(before)
        self.most = max(self.most, growth)
        if self.daemon.growth_max and growth > self.daemon.growth_max:
            self.failures.append(f"after {sent}: the daemon holds {growth / KIB:.0f} KiB more")
        try:
            self.daemon.check_good_client()
        except (Wrong, RuntimeError, OSError, ValueError, KeyError) as fault:
            self.failures.append(f"after {sent}: {fault}")
            return False
        return True

    def all(self, name, shots):
        before, self.most = 0, 0
        for number, shot in enumerate(shots, 1):
            if number <= EVERY:  # memory that the largest size needs once does not count as growth
                before = self.daemon.resident()
            self.one(shot)
            last = number == len(shots)
            if (last or number % EVERY == 0) and not self.look_after(before, f"{number} {name}"):
                return
        print(f"{name}: {len(shots)} sent, peak memory growth {self.most / KIB:.0f} KiB")


def main():
    parser = suite.parser_of(__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=0, help="0: all inputs")
    parser.add_argument("--kind", default="")
    options = parser.parse_args()
    daemon = Watched(options)
    for _ in range(3):  # one-time allocations do not count as growth
        daemon.check_good_client()
    chance = random.Random(options.seed)
    limits = request(daemon.target, "GET", "v1").json()["limits"]
    kinds = Kinds(daemon.target, limits, chance)
    gunner = Gunner(daemon)
    begun = time.monotonic()
    permitted = daemon.growth_max
    for name, every, share in (("refused", kinds.refused(), REFUSED_SHARE),
                               ("drawn", kinds.numbers(), DRAWN_SHARE)):
        daemon.growth_max = share * permitted
        shots = [shot for shot in every if options.kind in shot.kind]
        chance.shuffle(shots)
        gunner.all(name, shots[:options.count // 2 if options.count else None])
    code = daemon.stop()
    if code != 0:
        gunner.failures.append(f"the daemon exited with {code}")
    if options.verbose:
        for kind, count in sorted(gunner.kinds.items()):
            print(f"{count:6} {kind}")
    print(f"{sum(gunner.kinds.values())} sent of {len(gunner.kinds)} kinds, seed {options.seed}, "
          f"{time.monotonic() - begun:.0f} s; answers:")
    print("  " + ", ".join(f"{word}: {count}" for word, count in sorted(gunner.answers.items())))
    print(f"{len(gunner.failures)} failures")
    for failure in gunner.failures[:60]:
        print("FAILED " + failure)
    return 1 if gunner.failures else 0


if __name__ == "__main__":
    sys.exit(main())
