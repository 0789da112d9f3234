"""Movies: drawn by a job of the server, or made here of the pictures of any views."""
from __future__ import annotations

import base64
import concurrent.futures
import contextlib
import dataclasses
import errno
import os
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import zipfile
import zlib
from typing import Any, Callable, Iterable, Iterator, Mapping, Sequence, Union

from .errors import MovieFailed, WindsplatError
from .view import View

CODECS: Mapping[str, Sequence[str]] = {
    # Players expect 4:2:0, which needs even edges (FILTER), and colours of ITU-R BT.709.
    ".mp4": ("-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart"),
    ".webm": ("-c:v", "libvpx-vp9", "-crf", "30", "-b:v", "0", "-pix_fmt", "yuv420p"),
}
FILTER = ("scale=in_range=pc:out_range=tv:out_color_matrix=bt709,"
          "pad=ceil(iw/2)*2:ceil(ih/2)*2")
COLOURS = ("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1")
KINDS = {".mp4": "video/mp4", ".webm": "video/webm", ".apng": "image/png"}
SUFFIXES = (*CODECS, ".apng", ".zip")
PNG_START = b"\x89PNG\r\n\x1a\n"
OF_SERVER = (".mp4", ".webm", ".zip")  # what its jobs write
FPS = 24  # as that of the server's animations
RANGE = ("first", "last", "stride")
INLINE_BYTES_MAX = 20_000_000  # of a movie in the text of a notebook

Steps = Union[Iterable[int], Mapping[str, int], str]


@dataclasses.dataclass(frozen=True)
class Movie:
    """A movie on disk. Jupyter plays it."""

    path: pathlib.Path
    frames: int
    fps: float
    width: int
    height: int

    def _repr_mimebundle_(
        self, include: Any = None, exclude: Any = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        data: dict[str, Any] = {"text/plain": repr(self)}
        kind = KINDS.get(self.path.suffix.lower())
        if kind is None or self.path.stat().st_size > INLINE_BYTES_MAX:
            return data, {}
        text = base64.b64encode(self.path.read_bytes()).decode("ascii")
        if kind == "image/png":
            data[kind] = text
            return data, {kind: {"width": self.width, "height": self.height}}
        data["text/html"] = (f'<video controls loop width="{self.width}" height="{self.height}" '
                             f'src="data:{kind};base64,{text}"></video>')
        return data, {}


def _png_of(view: View) -> bytes:
    return view.frame("png").bytes


def pictures(views: Iterable[View], workers: int) -> Iterator[bytes]:
    """The pictures of views as PNG, in order; at most `workers` requests at a time."""
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        waiting: list[concurrent.futures.Future[bytes]] = []
        try:
            for view in views:
                waiting.append(pool.submit(_png_of, view))
                if len(waiting) > workers:
                    yield waiting.pop(0).result()
            while waiting:
                yield waiting.pop(0).result()
        finally:
            for one in waiting:
                one.cancel()


def _chunks(png: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Types and contents of the chunks of a PNG file (ISO/IEC 15948, 5.3)."""
    place = len(PNG_START)
    while place < len(png):
        (length,) = struct.unpack_from(">I", png, place)
        yield png[place + 4 : place + 8], png[place + 8 : place + 8 + length]
        place += length + 12


def _size_of(png: bytes) -> tuple[int, int]:
    """Width and height, which a PNG file begins with."""
    width, height = struct.unpack_from(">II", png, 16)
    return width, height


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def write_apng(path: pathlib.Path, count: int, frames: Iterator[bytes], fps: float) -> None:
    """An animated PNG (PNG, third edition, 5.6 and 11.3.6): each picture is that of a frame; it
    is repeated for ever. Other viewers show the first frame."""
    delay = (max(1, round(1000 / fps)), 1000)  # numerator and denominator, seconds
    serial = 0
    with path.open("wb") as file:
        for index, png in enumerate(frames):
            parts = list(_chunks(png))
            head = parts[0][1]
            if index == 0:
                first = head
                file.write(PNG_START + _chunk(b"IHDR", head))
                file.write(_chunk(b"acTL", struct.pack(">II", count, 0)))
            elif head != first:
                raise MovieFailed("the pictures of a movie have different sizes or colours")
            width, height = struct.unpack_from(">II", head)
            file.write(_chunk(b"fcTL", struct.pack(">IIIIIHHBB", serial, width, height, 0, 0,
                                                   *delay, 0, 0)))
            serial += 1
            for kind, data in parts:
                if kind == b"IDAT" and index == 0:
                    file.write(_chunk(b"IDAT", data))
                elif kind == b"IDAT":
                    file.write(_chunk(b"fdAT", struct.pack(">I", serial) + data))
                    serial += 1
        file.write(_chunk(b"IEND", b""))


def write_zip(path: pathlib.Path, frames: Iterator[bytes]) -> None:
    """A ZIP of frame_000000.png and so on, as the server writes it."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as file:
        for index, png in enumerate(frames):
            file.writestr(f"frame_{index:06d}.png", png)


def write_video(path: pathlib.Path, suffix: str, frames: Iterator[bytes], fps: float,
                program: str) -> None:
    """Pictures encoded by the program ffmpeg."""
    command = [program, "-loglevel", "error", "-y", "-f", "image2pipe", "-framerate", f"{fps:g}",
               "-c:v", "png", "-i", "-", "-vf", FILTER, *CODECS[suffix], *COLOURS,
               "-f", suffix[1:], f"file:{os.fspath(path)}"]
    with tempfile.TemporaryFile() as said:
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=said) as process:
            assert process.stdin is not None
            try:
                with contextlib.suppress(BrokenPipeError):  # it says why below
                    for png in frames:
                        process.stdin.write(png)
                with contextlib.suppress(BrokenPipeError):
                    process.stdin.close()
            except BaseException:
                process.kill()
                raise
        if process.returncode != 0:
            said.seek(0)
            text = said.read().decode("utf-8", "replace").strip()[-500:]
            raise MovieFailed(f"ffmpeg ended with exit code {process.returncode}: {text}")


def _suffix_of(path: pathlib.Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"'{path}' does not end in {', '.join(SUFFIXES)}")
    return suffix


@contextlib.contextmanager
def _part_of(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """An empty file to write to, which becomes `path` unless there is an error."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    part = path.with_name(f".{path.name}.part")
    part.touch()  # a folder that cannot be written is found before pictures are drawn
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def steps_of(steps: Steps | None, count: int) -> Sequence[int]:
    """The steps that View.movie is asked for, of the `count` of a dataset. Raises ValueError."""
    asked = {} if steps is None else steps
    if isinstance(asked, str) and re.fullmatch(r"\d+:\d+(:\d+)?", asked, re.ASCII):
        asked = dict(zip(RANGE, map(int, asked.split(":"))))
    if isinstance(asked, Mapping) and asked.keys() <= set(RANGE):
        first, last, stride = (asked.get(key, value)
                               for key, value in zip(RANGE, (0, count - 1, 1)))
        whole = all(isinstance(one, int) for one in (first, last, stride))
        if whole and 0 <= first <= last < count and stride >= 1:
            return range(first, last + 1, stride)
    if isinstance(asked, (str, bytes, Mapping)) or not isinstance(asked, Iterable):
        raise ValueError(f"steps={steps!r} are none of 0 to {count - 1}: give numbers, "
                         "'FIRST:LAST[:STRIDE]', or the keys first, last and stride")
    return [int(step) for step in asked]


def step_range(steps: Iterable[int]) -> dict[str, int] | None:
    """Steps as the server's animations state them. None: they are at no equal distances."""
    every = [int(step) for step in steps]
    stride = every[1] - every[0] if len(every) > 1 else 1
    if not every or stride < 1 or every != list(range(every[0], every[-1] + 1, stride)):
        return None
    return {"first": every[0], "last": every[-1], "stride": stride}


def animation(
    path: pathlib.Path, view: View, motion: Mapping[str, Any], timeout: float,
    progress: Callable[[int, int], object] | None,
) -> Movie:
    """Has the server draw a movie of a view, and writes it. `motion`: keys of POST /v1/animations
    besides view and format, of which those that are None are left out.

    The job is ended if it takes longer than `timeout` seconds, or this call is interrupted. Raises
    the Problem that the server reports, JobTimeout, OSError for a place that cannot be written.
    """
    server = view.dataset.server
    asked = {key: value for key, value in motion.items() if value is not None}
    asked |= {"view": view.to_dict(), "format": path.suffix.lower()[1:]}
    tell = None if progress is None else lambda done: progress(round(100 * done), 100)
    with _part_of(path) as part:
        job = server.http.request("POST", "v1/animations", json=asked).json()
        try:
            made = server.finished(job, timeout, tell)
        except BaseException:
            with contextlib.suppress(WindsplatError):
                server.http.request("DELETE", f"v1/jobs/{job['id']}")
            raise
        part.write_bytes(server.http.request("GET", made["movie"], accept="*/*").content)
    return Movie(path, made["frames"], made["fps"], made["width"], made["height"])


def movie(
    path: str | os.PathLike[str], views: Iterable[View], fps: float = FPS, *, workers: int = 2,
    progress: Callable[[int, int], object] | None = None,
) -> Movie:
    """Writes the pictures of views, in order, as a movie.

    path: .mp4 or .webm need the program ffmpeg; .apng (an animated PNG, which browsers and
        Jupyter show) and .zip (PNG files) need nothing.
    views: all of one size, for example view.turn(36).
    fps: pictures a second, 0.1 to 120.
    workers: requests at a time, 1 to 16.
    progress: called with the number of frames done and of all.

    A file is only written if all frames could be drawn. Raises MovieFailed, and what
    view.frame() raises.
    """
    out = pathlib.Path(path)
    suffix = _suffix_of(out)
    if not 0.1 <= fps <= 120:
        raise ValueError(f"fps must be 0.1 to 120, not {fps:g}")
    if not 1 <= workers <= 16:
        raise ValueError(f"workers must be 1 to 16, not {workers}")
    every = list(views)
    if not every:
        raise ValueError("a movie needs at least one view")
    program = None
    if suffix in CODECS:
        program = shutil.which("ffmpeg")
        if program is None:
            raise MovieFailed(f"the program ffmpeg, which writes {suffix}, was not found; "
                              "install it or use .apng or .zip")
    size = (0, 0)

    def counted() -> Iterator[bytes]:
        nonlocal size
        for index, png in enumerate(pictures(every, workers)):
            this = _size_of(png)
            if index and this != size:
                raise MovieFailed(f"frame {index} has {this[0]} x {this[1]} pixels, "
                                  f"the first {size[0]} x {size[1]}")
            size = this
            yield png
            if progress is not None:
                progress(index + 1, len(every))

    with _part_of(out) as part:
        if suffix == ".apng":
            write_apng(part, len(every), counted(), fps)
        elif suffix == ".zip":
            write_zip(part, counted())
        else:
            assert program is not None
            write_video(part, suffix, counted(), fps, program)
    return Movie(out, len(every), fps, *size)
