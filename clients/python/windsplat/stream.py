"""A live stream of frames (docs/design/wire-format.md): patches go to the server, frames come back
as fast as they are consumed."""
from __future__ import annotations

import asyncio
import base64
import dataclasses
import json
import os
import struct
import time
from typing import TYPE_CHECKING, Any, Mapping

from ._documents import merged, plain
from .errors import ConnectionFailed, Unauthorized, WindsplatError, problem_of
from .frame import Format, Frame, Report
from .view import View

if TYPE_CHECKING:
    from ._http import Http
    from .server import Server

PROTOCOL = "windsplat.v1"
HEADER_BYTES = 64
CODECS: Mapping[int, Format] = {1: "jpeg", 2: "png"}
FINAL = 1  # flag of a header


@dataclasses.dataclass(frozen=True, repr=False)
class StreamFrame(Frame):
    """A frame of a stream."""

    seq: int = 0
    """Number of the frame, from 1."""
    rev: int = 0
    """Number of the newest patch that it shows."""
    step: int = 0
    final: bool = False
    """Whether the view is at rest and this is its best picture."""

    def __repr__(self) -> str:
        kind = "final" if self.final else "moving"
        return (f"<StreamFrame {self.seq}: {kind}, rev {self.rev}, step {self.step}, "
                f"{self.width} x {self.height} {self.format}, {len(self.bytes)} bytes>")


@dataclasses.dataclass(frozen=True)
class Header:
    """The header of a frame; times in milliseconds."""

    length: int
    seq: int
    rev: int
    step: int
    flags: int
    width: int
    height: int
    codec: int
    timing: Mapping[str, float]
    payload: int


def header_of(message: bytes) -> Header:
    """The header of a binary message. Raises WindsplatError for one that is damaged."""
    if len(message) < HEADER_BYTES or message[:4] != b"WSPL":
        raise WindsplatError("a binary message of the server is not a frame")
    version, kind, length = struct.unpack_from("<BBH", message, 4)
    if (version, kind, length) != (1, 1, HEADER_BYTES):
        raise WindsplatError(f"a frame has version {version}, kind {kind}, header {length} bytes")
    seq, rev, step, flags = struct.unpack_from("<4I", message, 8)
    width, height, codec, _, method = struct.unpack_from("<HHBBB", message, 24)
    if codec not in (1, 2, 3) or method not in (1, 2, 3) or 0 in (seq, width, height):
        raise WindsplatError(f"frame {seq} has {width} x {height} pixels of codec {codec} and "
                             f"method {method}")
    queue, render, encode, payload = struct.unpack_from("<4I", message, 40)
    timing = {"queue": queue / 1000, "render": render / 1000, "encode": encode / 1000}
    return Header(length, seq, rev, step, flags, width, height, codec, timing, payload)


def frame_of(message: bytes, report: Mapping[str, Any]) -> StreamFrame:
    """The frame of a binary message. Raises WindsplatError for one that is damaged."""
    head = header_of(message)
    if head.codec not in CODECS or len(message) != head.length + head.payload:
        raise WindsplatError(f"frame {head.seq} has codec {head.codec} and {head.payload} of "
                             f"{len(message) - head.length} bytes")
    return StreamFrame(message[head.length :], CODECS[head.codec], head.width, head.height,
                       Report(report, head.timing), head.seq, head.rev, head.step,
                       bool(head.flags & FINAL))


def _options(http: Http) -> dict[str, Any]:
    """Options of a connection besides the protocol."""
    options: dict[str, Any] = {} if http.tls is None else {"ssl": http.tls}
    import websockets.version

    if http.loopback and int(websockets.version.version.split(".")[0]) >= 15:
        options["proxy"] = None  # earlier versions use none
    return options


def difference_of(old: Any, new: Any) -> dict[str, Any]:
    """The merge patch that makes `new` of `old`."""
    patch: dict[str, Any] = {key: None for key in old if key not in new}
    for key, value in new.items():
        if key not in old or old[key] != value:
            both = isinstance(old.get(key), dict) and isinstance(value, dict)
            patch[key] = difference_of(old[key], value) if both else value
    return patch


class Stream:
    """Frames of a view, moving ones while it changes and a final one at rest.

        async with server.stream(view) as stream:
            async for frame in stream:
                ...

    A frame is acknowledged when the next one is asked for, so that the server sends no more than
    the loop can take. A patch that the server refuses is raised as Problem by the loop, which may
    be entered again. A stream belongs to the process that entered it: a fork enters one of its own.
    """

    def __init__(self, server: Server, view: View) -> None:
        self._server = server
        self._accepted = view.to_dict()  # what the server has accepted
        self._patches: dict[int, dict[str, Any]] = {}  # by rev, not answered yet
        self._socket: Any = None
        self._process = 0  # that entered the stream
        self._rev = 0
        self._shown: int | None = None  # seq of the frame that is not acknowledged yet
        self._chosen: dict[int, Mapping[str, Any]] = {}
        self._last_final: StreamFrame | None = None
        self._unchanged = 0  # rev of the newest patch that the last final frame shows
        self._closed = False
        self.hello: Mapping[str, Any] = {}
        """The first message of the server: version, limits, datasets."""

    @property
    def rev(self) -> int:
        """Number of the newest patch."""
        return self._rev

    async def __aenter__(self) -> Stream:
        import websockets
        import websockets.exceptions

        http = self._server.http
        protocols = [PROTOCOL]
        if http.token:
            text = base64.urlsafe_b64encode(http.token.encode()).decode().rstrip("=")
            protocols.append("bearer." + text)
        url = "ws" + http.base.removeprefix("http") + "v1/stream"
        options = {"subprotocols": protocols, "max_size": None, **_options(http)}
        try:
            if http.socket is None:
                self._socket = await websockets.connect(  # type: ignore[attr-defined]
                    url, **options)
            else:
                self._socket = await websockets.unix_connect(  # type: ignore[attr-defined]
                    http.socket, url, **options)
            self._process = os.getpid()
            self.hello = json.loads(await self._socket.recv())
        except (OSError, asyncio.TimeoutError, websockets.exceptions.WebSocketException) as error:
            answer = getattr(error, "response", None)
            status = getattr(error, "status_code", getattr(answer, "status_code", None))
            if status in (401, 403):
                raise Unauthorized(status, "Unauthorized",
                                   f"{http.name} refuses the stream") from error
            raise ConnectionFailed(f"{http.name}: {http.ended() or error}") from error
        self._rev += 1
        await self._send({"type": "patch", "rev": self._rev, "patch": self._accepted})
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        self._closed = True
        if self._socket is not None and self._process == os.getpid():
            await self._socket.close()

    def _check_entered(self) -> None:
        if self._socket is None:
            raise WindsplatError("enter the stream first: async with server.stream(view) as stream")
        if self._process != os.getpid():
            raise WindsplatError("the stream was entered by another process, of which this one is "
                                 "a fork: enter a stream here")

    async def _send(self, message: Mapping[str, Any]) -> None:
        import websockets.exceptions

        self._check_entered()
        try:
            await self._socket.send(json.dumps(message))
        except websockets.exceptions.ConnectionClosed as error:
            raise ConnectionFailed(f"the stream was closed: {error}") from error

    @property
    def document(self) -> dict[str, Any]:
        """The view as this client has changed it; refused patches are left out."""
        out = self._accepted
        for patch in self._patches.values():
            out = merged(out, patch)
        return out

    def _answered(self, rev: int) -> None:
        """Patches up to `rev` have been accepted."""
        for number in [one for one in self._patches if one <= rev]:
            self._accepted = merged(self._accepted, self._patches.pop(number))

    async def patch(self, patch: Mapping[str, Any]) -> int:
        """Changes the view by a merge patch and returns its number: frames with this `rev` or a
        later one show it."""
        document = plain(patch)
        View(merged(self.document, document))  # unknown keys are refused with a suggestion
        self._rev += 1
        self._patches[self._rev] = document
        await self._send({"type": "patch", "rev": self._rev, "patch": document})
        return self._rev

    async def show(self, view: View) -> int:
        """Shows another view."""
        return await self.patch(difference_of(self.document, view.to_dict()))

    async def play(self, start: int = 0, stop: int | None = None, fps: float = 10, *,
                   loop: bool = True, drop: bool = True) -> None:
        """Plays the steps from `start` to `stop`, both included; by default to the last one.
        drop: skip steps to keep the rate."""
        if stop is None:
            stop = len(self._server[self.document["dataset"]].steps) - 1
        await self._send({"type": "play", "from": start, "to": stop, "fps": fps, "loop": loop,
                          "drop": drop})

    async def pause(self) -> None:
        """Stops playing."""
        await self._send({"type": "pause"})

    def __aiter__(self) -> Stream:
        return self

    async def __anext__(self) -> StreamFrame:
        frame = await self._next(None)
        assert frame is not None
        return frame

    async def _next(self, rev: int | None) -> StreamFrame | None:
        """The next frame; None: the last final frame shows the patch `rev` already."""
        import websockets.exceptions

        self._check_entered()
        if self._shown is not None:
            seq, self._shown = self._shown, None
            await self._send({"type": "ack", "seq": seq})
        while True:
            if rev is not None and self._unchanged >= rev and self._last_final is not None:
                return None
            try:
                message = await self._socket.recv()
            except websockets.exceptions.ConnectionClosed as error:
                if self._closed:
                    raise StopAsyncIteration from None
                ended = self._server.http.ended()
                raise ConnectionFailed(f"the stream was closed: {ended or error}") from error
            if isinstance(message, str):
                self._take(json.loads(message))
                continue
            frame = frame_of(message, {})
            report = self._chosen.pop(frame.seq, {})
            frame = dataclasses.replace(frame, report=Report(report, frame.report.timing))
            self._shown = frame.seq
            self._answered(frame.rev)
            if frame.final:
                self._last_final = frame
            return frame

    def _take(self, message: Mapping[str, Any]) -> None:
        """A text message. Raises the Problem of an error."""
        kind = message.get("type")
        if kind == "chosen":
            self._chosen[message["seq"]] = message
        elif kind == "unchanged":
            self._unchanged = max(self._unchanged, message["rev"])
            self._answered(message["rev"])
        elif kind == "error":
            self._patches.pop(message.get("rev", 0), None)
            raise problem_of(message["problem"])

    async def final(self, timeout: float = 120) -> StreamFrame:
        """Waits for the final frame of the newest patch. Raises TimeoutError."""
        rev = self._rev
        end = time.monotonic() + timeout
        while True:
            left = end - time.monotonic()
            try:
                frame = await asyncio.wait_for(self._next(rev), max(0.0, left))
            except asyncio.TimeoutError:
                raise TimeoutError(f"no final frame in {timeout:g} s") from None
            if frame is None:
                assert self._last_final is not None
                return self._last_final
            if frame.final and frame.rev >= rev:
                return frame
