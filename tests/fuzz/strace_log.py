"""Checks a log of strace: the files opened and sockets created by the daemon and its loaders.

A process is the daemon until it becomes a loader (execve of "... load"), and a loader is confined
after its seccomp call. Calls that the filter traps show the call's number as their result and a
SIGSYS behind them: they were not executed."""

import collections
import re

CALLS = "%network,openat,openat2,open,creat,execve,prctl,seccomp"
OPENS = {"open", "openat", "openat2", "creat"}
# Calls that create or accept connections, not those that use an existing socket.
CONNECTS = {"socket", "connect", "bind", "listen", "accept", "accept4", "socketpair"}
LINE = re.compile(r"(\d+)\s+(.*)")
CALL = re.compile(r"(\w+)\((.*)\)\s+= (-?\d+|\?)(.*)", re.DOTALL)
RESULT_PATH = re.compile(r"<(.*?)>")
# The last two are read by glibc's allocator.
OWN = ("/dev/null", "/proc/sys/vm/overcommit_memory", "/sys/devices/system/cpu/online")
STARTUP = ("/etc/", "/lib", "/usr/", "/proc/", "/sys/", "/dev/null", "/dev/urandom", "/var/lib/")


class Judge:
    def __init__(self, inside, outside, libraries, program):
        self.inside = [str(folder) for folder in inside]
        self.outside = str(outside)
        self.libraries = libraries
        self.program = str(program)
        # process id -> "startup" or "confined"; the daemon's threads are not included
        self.stage = {}
        self.serving = False
        self.unfinished = {}
        # last call of each process, withheld until it is known whether it was trapped
        self.last_call = {}
        self.counts = collections.Counter()
        self.faults = []
        self.at_startup = set()
        self.looked_here = collections.Counter()

    def read(self, path):
        with open(path, encoding="latin-1") as log:
            for line in log:
                found = LINE.match(line)
                if found:
                    self.line(found[1], found[2].rstrip("\n"))
        for process in list(self.last_call):
            self.settle(process)

    def line(self, process, text):
        if text.startswith("---"):
            trapped = re.search(r"si_syscall=__NR_(\w+)", text)
            self.settle(process, trapped and trapped[1])
        elif text.startswith("+++"):
            self.settle(process)
            self.stage.pop(process, None)
        elif text.endswith("<unfinished ...>"):
            self.unfinished[process] = text[:-len("<unfinished ...>")]
        else:
            resumed = re.match(r"<\.\.\. \w+ resumed>(.*)", text, re.DOTALL)
            if resumed:
                text = self.unfinished.pop(process, "") + resumed[1]
            self.settle(process)
            self.last_call[process] = text

    def settle(self, process, trapped=None):
        text = self.last_call.pop(process, None)
        found = CALL.match(text) if text else None
        if not found:
            return
        call, arguments, result, more = found[1], found[2], found[3], found[4]
        role = self.stage.get(process, "daemon")
        if trapped == call:
            self.counts[f"{role}: {call} trapped"] += 1
            return
        good = result not in ("?",) and int(result) >= 0
        if call == "execve" and good:
            if '"load"]' in arguments:
                self.stage[process] = "startup"
                self.counts["loaders"] += 1
            return
        if call == "seccomp" and good and role == "startup" and "SET_MODE_FILTER" in arguments:
            self.stage[process] = "confined"
            self.counts["loaders confined"] += 1
            return
        if call == "listen" and good and role == "daemon":
            self.serving = True
        if call in OPENS:
            self.opened(role, text, good, more)
        elif call in CONNECTS:
            self.connected(role, call, text, good)

    def opened(self, role, text, good, more):
        self.counts[f"{role}: opens {'that succeeded' if good else 'refused'}"] += 1
        starts = role == "startup" or not self.serving
        if starts and re.match(r'\w+\((AT_FDCWD(<[^>]*>)?, )?"(?!/)', text):
            self.looked_here[role] += 1
            if self.looked_here[role] == 1:
                self.faults.append(f"{role}: looks in the current folder as it starts: {text}")
        if not good:
            return
        named = RESULT_PATH.search(more)
        path = named[1] if named else text
        if self.outside in path:
            self.faults.append(f"{role} opened a file outside: {text}")
        elif role == "confined":
            self.faults.append(f"a confined loader opened: {text}")
        elif starts:
            self.at_startup.add(path)
            if role == "startup" and not path.startswith(STARTUP) and path != self.program:
                self.faults.append(f"a starting loader opened: {text}")
        elif not self.may_open(path):
            self.faults.append(f"the daemon opened: {text}")

    def may_open(self, path):
        if path in OWN or re.match(r"/proc/(self|\d+)/", path):
            return True
        return any(path == folder or path.startswith(folder + "/")
                   for folder in [*self.inside, *self.libraries])

    def connected(self, role, call, text, good):
        self.counts[f"{role}: {call} {'that succeeded' if good else 'refused'}"] += 1
        if not good:
            return
        if role != "daemon":
            self.faults.append(f"a loader ({role}): {text}")
        elif call == "connect" or (self.serving and call in ("socket", "bind", "listen")
                                   and "listen(" not in text):
            self.faults.append(f"the daemon: {text}")

    def report(self):
        for call in ("opens", "socket", "connect"):
            self.counts[f"confined: {call} that succeeded"] += 0
        self.counts["daemon: connect that succeeded"] += 0
        out = [f"  {name}: {count}" for name, count in sorted(self.counts.items())]
        out.append(f"  files opened while starting: {len(self.at_startup)}")
        if self.counts["loaders"] == 0 or self.counts["loaders confined"] == 0:
            self.faults.append("the log shows no confined loader")
        return out
