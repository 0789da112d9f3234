"""Memory of a process and its children as the kernel accounts for it: sizes in, peaks out. Linux
only (/proc)."""
import pathlib
import threading
import time

UNITS = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30}


def bytes_of(text):
    return int(text[:-1]) * UNITS[text[-1]] if text[-1] in UNITS else int(text)


def children(pid):
    try:
        tasks = list(pathlib.Path(f"/proc/{pid}/task").iterdir())
        return [int(child) for task in tasks
                for child in (task / "children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return []


def proportional_bytes(pid):
    """The proportional set size: a page shared by n processes counts as 1/n in each."""
    try:
        for line in pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return 1024 * int(line.split()[1])
    except (FileNotFoundError, ProcessLookupError):
        pass
    return 0


class PeakPss(threading.Thread):
    """Samples the proportional set size of a process and its children until stop()."""

    def __init__(self, pid, period_s=0.01):
        super().__init__(daemon=True)
        self.pid, self.period_s = pid, period_s
        self.peak, self.parts, self.over = 0, [], False
        self.start()

    def run(self):
        while not self.over:
            parts = [proportional_bytes(p) for p in [self.pid, *children(self.pid)]]
            if sum(parts) > self.peak:
                self.peak, self.parts = sum(parts), parts
            time.sleep(self.period_s)

    def stop(self):
        self.over = True
        self.join()
        return self.peak
