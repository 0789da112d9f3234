"""The test's side of shim.cpp: a page of memory that both share, and a daemon with it preloaded."""
import ctypes
import errno
import mmap
import os
import pathlib
import struct

from support import Daemon, Untried

KINDS = ["malloc", "send", "recv", "read", "write", "fsync", "open", "accept", "socket", "thread",
         "mmap", "random"]  # the same order as in shim.cpp
FAULTS = {"malloc": errno.ENOMEM, "send": errno.ENOBUFS, "recv": errno.ECONNRESET,
          "read": errno.EIO, "write": errno.ENOSPC, "fsync": errno.EIO, "open": errno.EMFILE,
          "accept": errno.EMFILE, "socket": errno.EMFILE, "thread": errno.EAGAIN,
          "mmap": errno.ENOMEM, "random": errno.ENOSYS}
FIELDS = ["at", "times", "sites", "fault", "seen", "failed", "known", "depth"]
SITES_MAX = 1 << 16
BYTES = 8 * (2 + len(KINDS) * len(FIELDS) + SITES_MAX)
ADDR_NO_RANDOMIZE = 0x0040000
DEPTH = 7


def plain_addresses():
    """Runs in the child: disables address randomization, so that call sites have the same
    addresses."""
    libc = ctypes.CDLL(None)
    libc.personality(ADDR_NO_RANDOMIZE)


class Shim:
    def __init__(self, library, folder):
        if not pathlib.Path(library).exists():
            raise Untried(f"{library} is not built: no failing call was tried")
        self.library = str(library)
        self.path = folder / "control"
        self.path.write_bytes(bytes(BYTES))
        with open(self.path, "r+b") as file:
            self.page = mmap.mmap(file.fileno(), BYTES)

    def start(self, program, *arguments, must_start=True, env=None, **how):
        """Starts a daemon with this shim's page, in place of the previous one."""
        struct.pack_into("q", self.page, 0, 0)
        more = dict(env or os.environ, LD_PRELOAD=self.library, FAULTS_CONTROL=str(self.path))
        return Daemon(program, *arguments, env=more, must_start=must_start, prepare=plain_addresses,
                      **how)

    def set(self, kind, field, value):
        struct.pack_into("q", self.page, self.at(kind, field), value)

    def get(self, kind, field):
        return struct.unpack_from("q", self.page, self.at(kind, field))[0]

    @staticmethod
    def at(kind, field):
        return 8 * (2 + KINDS.index(kind) * len(FIELDS) + FIELDS.index(field))

    def arm(self, kind, at, times=1, fault=None):
        """Makes the at-th and all later calls fail."""
        self.disarm(kind)
        self.set(kind, "fault", FAULTS[kind] if fault is None else fault)
        self.set(kind, "times", times)
        self.set(kind, "at", at)

    def arm_sites(self, kind, times=1):
        """Makes the next call from each new call site fail."""
        self.disarm(kind)
        self.set(kind, "fault", FAULTS[kind])
        self.set(kind, "times", times)
        self.set(kind, "depth", DEPTH)
        self.set(kind, "sites", 1)

    def disarm(self, kind):
        """How many calls have failed since it was armed."""
        failed = self.get(kind, "failed")
        for field in ("at", "sites", "seen", "failed"):
            self.set(kind, field, 0)
        return failed

    def forget(self, kind):
        """Forgets the call sites of all kinds that have failed."""
        struct.pack_into("q", self.page, self.at(kind, "known"), 0)
        begin = 8 * (2 + len(KINDS) * len(FIELDS))
        self.page[begin:BYTES] = bytes(BYTES - begin)

    def jump(self, seconds):
        struct.pack_into("q", self.page, 8, seconds)
