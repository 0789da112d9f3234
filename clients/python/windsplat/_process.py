"""Starts and ends the program `windsplat serve` for a client on the same machine."""
from __future__ import annotations

import collections
import os
import pathlib
import queue
import shutil
import subprocess
import sys
import threading
import time
import weakref
from typing import IO, Any, Mapping, Sequence

from .errors import StartFailed

LOG_LINES = 200


def find_program(program: str | os.PathLike[str] | None = None) -> str:
    """The program: the argument, $WINDSPLAT, or `windsplat` in PATH. Raises StartFailed."""
    named = (("argument program", program), ("$WINDSPLAT", os.environ.get("WINDSPLAT")))
    for source, name in named:
        if name:
            found = shutil.which(os.fspath(name))
            if found is None:
                raise StartFailed(f"{source}: '{os.fspath(name)}' is not a program")
            return found
    found = shutil.which("windsplat")
    if found is None:
        raise StartFailed(
            "the program windsplat was not found in PATH: install it, name it by the environment "
            "variable WINDSPLAT or the argument program, or use windsplat.connect(url)"
        )
    return found


def arguments_of(options: Mapping[str, Any]) -> list[str]:
    """Options of the command line: threads=2 is --threads 2, True a flag, a list repeats one."""
    out: list[str] = []
    for key, value in options.items():
        name = "--" + key.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            out.append(name)
            continue
        many = isinstance(value, Sequence) and not isinstance(value, (str, bytes))
        for one in value if many else [value]:
            out += [name, os.fspath(one) if isinstance(one, os.PathLike) else str(one)]
    return out


def _read_lines(pipe: IO[str], sink: Any) -> None:
    with pipe:
        for line in pipe:
            sink(line.rstrip("\n"))
    sink(None)


# Ends the server once its input is closed: also when this process is killed and can end nothing.
GUARD = 'read -r line; kill "$1" 2>/dev/null'


_inputs: weakref.WeakSet[IO[bytes]] = weakref.WeakSet()  # of guards


def _close_inputs() -> None:
    for pipe in list(_inputs):
        pipe.close()


if hasattr(os, "register_at_fork"):
    # A fork, as a worker of multiprocessing, would keep the guard's input open.
    os.register_at_fork(after_in_child=_close_inputs)


def _guard_of(process: subprocess.Popen[str]) -> subprocess.Popen[bytes] | None:
    try:
        guard = subprocess.Popen(
            ["/bin/sh", "-c", GUARD, "windsplat-guard", str(process.pid)], stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    except OSError:  # a system without a shell: the server ends with close() and at exit
        return None
    assert guard.stdin is not None
    _inputs.add(guard.stdin)
    return guard


def _end(process: subprocess.Popen[str], guard: subprocess.Popen[bytes] | None) -> None:
    if guard is not None:  # first, so that it never signals a process of another number
        guard.kill()
        guard.wait()
        assert guard.stdin is not None
        guard.stdin.close()
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


class Process:
    """A running `windsplat serve`, ended by close(), at exit, or when it is collected."""

    def __init__(
        self, program: str, files: Sequence[str], options: Mapping[str, Any], timeout: float
    ) -> None:
        if not sys.platform.startswith("linux"):
            raise StartFailed("the program windsplat runs on Linux only: start it there, and use "
                              "windsplat.connect(url)")
        command = [program, "serve", *arguments_of({"listen": "127.0.0.1:0", **options}), *files]
        # A group of its own, so that an interrupt of the notebook's kernel does not end it.
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        )
        self._process = process
        self._parent = os.getpid()
        self._lines: collections.deque[str] = collections.deque(maxlen=LOG_LINES)
        self._finalizer = weakref.finalize(self, _end, process, _guard_of(process))
        urls: queue.Queue[str | None] = queue.Queue()
        lines = self._lines

        def keep(line: str | None) -> None:
            if line is not None:
                lines.append(line)

        assert process.stdout is not None and process.stderr is not None
        reader = threading.Thread(target=_read_lines, args=(process.stderr, keep), daemon=True)
        reader.start()
        threading.Thread(
            target=_read_lines, args=(process.stdout, urls.put), daemon=True
        ).start()
        self.url = self._wait_for_url(urls, reader, timeout)

    def _wait_for_url(
        self, urls: queue.Queue[str | None], reader: threading.Thread, timeout: float
    ) -> str:
        end = time.monotonic() + timeout
        try:
            while True:
                try:
                    line = urls.get(timeout=max(0.0, end - time.monotonic()))
                except queue.Empty:
                    raise StartFailed(f"windsplat serve was not ready after {timeout:g} s "
                                      f"(start_timeout): {self._said()}") from None
                if line is None:
                    self._process.wait()
                    reader.join(5)
                    raise StartFailed(self.ended())
                if line.startswith("http"):
                    return line.strip()
        except BaseException:  # an interrupt, too
            self.close()
            raise

    def _said(self) -> str:
        # The message of the program says what its log says, too.
        own = [one for one in self._lines if one.startswith("windsplat: ")]
        return "\n".join(own or list(self._lines)[-5:]) or "without a message"

    def ended(self) -> str:
        """How the program ended, with what it said last; empty: it runs, or this is a fork of the
        process that started it, which alone is told."""
        if os.getpid() != self._parent:
            return ""
        code = self._process.poll()
        if code is None:
            return ""
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        return f"windsplat serve ended with {how}: {self._said()}"

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def log(self) -> str:
        """The last lines that the server wrote to its log."""
        return "\n".join(self._lines)

    def close(self) -> None:
        self._finalizer()


def is_below(path: pathlib.Path, folder: pathlib.Path) -> bool:
    return path == folder or folder in path.parents
