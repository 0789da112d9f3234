"""The side of a live widget that talks to the server: frames go to a page, gestures come back.

It knows nothing of Jupyter: `send(message, buffers)` carries both, whatever they travel through.
"""
from __future__ import annotations

import asyncio
import math
import threading
from typing import Any, Callable, Mapping

from ._documents import merged
from .errors import WindsplatError
from .stream import Stream, StreamFrame
from .view import View

Send = Callable[[dict[str, Any], list[bytes]], None]

STEEPEST = 89.0  # degrees of elevation
DEGREES_PER_PIXEL = 0.35
SHOWN_TIMEOUT = 10.0  # seconds; a page that is hidden shows no frames
EDGE_MOST = 4096  # pixels


def orbited(camera: Mapping[str, Any], dx: float, dy: float) -> dict[str, Any]:
    """Keys of a camera that was dragged by pixels around its target: the scene follows."""
    eye, target = camera["eye"], camera["target"]
    away = [a - b for a, b in zip(eye, target)]
    distance = math.hypot(*away)
    level = math.hypot(away[0], away[1])
    elevation = math.degrees(math.atan2(away[2], level))
    # Straight from above the azimuth follows from what is up in the picture.
    x, y = (away[0], away[1]) if level > 1e-6 * distance else (-camera["up"][0], -camera["up"][1])
    azimuth = math.degrees(math.atan2(x, -y)) - DEGREES_PER_PIXEL * dx
    elevation = max(-STEEPEST, min(STEEPEST, elevation + DEGREES_PER_PIXEL * dy))
    a, e = math.radians(azimuth), math.radians(elevation)
    place = (math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), math.sin(e))
    return {"eye": [t + distance * p for t, p in zip(target, place)], "target": list(target),
            "up": [0.0, 0.0, 1.0]}


def panned(camera: Mapping[str, Any], dx: float, dy: float) -> dict[str, Any]:
    """Keys of a camera that was shifted by parts of the height of the picture."""
    eye, target, up = camera["eye"], camera["target"], camera["up"]
    forward = [b - a for a, b in zip(eye, target)]
    distance = math.hypot(*forward)
    right = _cross(forward, up)
    right = [one / math.hypot(*right) for one in right]
    above = [one / distance for one in _cross(right, forward)]
    whole = 2 * distance * math.tan(math.radians(camera["fovY"]) / 2)
    if camera.get("projection") == "orthographic":
        whole = camera["height"]
    shift = [(dy * u - dx * r) * whole for r, u in zip(right, above)]
    return {"eye": [a + b for a, b in zip(eye, shift)],
            "target": [a + b for a, b in zip(target, shift)], "up": list(up)}


def zoomed(camera: Mapping[str, Any], factor: float) -> dict[str, Any]:
    """Keys of a camera that is closer by a factor."""
    factor = max(0.1, min(10.0, factor))
    eye = [t + (e - t) / factor for e, t in zip(camera["eye"], camera["target"])]
    return {"eye": eye, "target": list(camera["target"]), "height": camera["height"] / factor}


def _cross(a: Any, b: Any) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


class Relay:
    """Streams a view to a page, in a thread of its own.

    Messages to the page: `frame` (seq, step, final, width, height, mime; the picture is the
    buffer), `problem` (detail). From the page: `ready`, `shown` (seq), `orbit` (dx, dy, pixels of
    the page), `pan` (dx, dy, parts of the height of the picture), `zoom` (factor), `step`, `size`
    (width, height, pixels of the picture), `reset`, `close`.
    """

    def __init__(self, view: View, send: Send) -> None:
        self._first = view
        self._send = send
        self._document: Mapping[str, Any] = view.to_dict()
        self._camera: dict[str, Any] | None = None  # resolved, of the newest frame or gesture
        self._loop = asyncio.new_event_loop()
        self._shown = asyncio.Event()
        self._stream: Stream | None = None
        self._task: asyncio.Task[None] | None = None
        self._pages = 0  # that show the widget
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="windsplat-relay", daemon=True)
        self._thread.start()

    @property
    def view(self) -> View:
        """The view as it was last dragged."""
        return View(self._document, dataset=self._first.dataset)

    def show(self, view: View) -> None:
        """Shows another view."""
        self._post(self._show(view))

    def receive(self, message: Mapping[str, Any]) -> None:
        """A message of the page. Unknown ones are ignored."""
        kind = message.get("type")
        if kind == "ready":
            self._loop.call_soon_threadsafe(self._begin)
        elif kind == "close":
            self._loop.call_soon_threadsafe(self._leave)
        elif kind == "shown":
            self._loop.call_soon_threadsafe(self._shown.set)
        elif kind == "reset":
            self.show(self._first)
        elif kind in ("orbit", "pan", "zoom", "step", "size"):
            self._post(self._gesture(dict(message)))

    def close(self) -> None:
        """Ends the stream and the thread."""
        if not self._closed:
            self._closed = True
            self._loop.call_soon_threadsafe(self._loop.stop)
            if threading.current_thread() is not self._thread:
                self._thread.join(10)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_forever()
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._loop.close()

    def _post(self, work: Any) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop)

    def _begin(self) -> None:
        """A page is there: the stream starts anew, so that it gets a frame."""
        self._pages += 1
        self._pause()
        self._task = self._loop.create_task(self._serve())

    def _leave(self) -> None:
        self._pages = max(0, self._pages - 1)
        if self._pages == 0:
            self._pause()

    def _pause(self) -> None:
        if self._task is not None:
            self._task.cancel()
            self._task = None

    async def _serve(self) -> None:
        stream = self._first.dataset.server.stream(self.view)
        try:
            async with stream:
                self._stream = stream
                if stream.document != self._document:  # changed while the stream was opened
                    await stream.show(self.view)
                while True:
                    try:
                        await self._pass_on(await stream.__anext__())
                    except WindsplatError as error:
                        self._send({"type": "problem", "detail": str(error)}, [])
                        if isinstance(error, ConnectionError):
                            return
        except WindsplatError as error:
            self._send({"type": "problem", "detail": str(error)}, [])
        finally:
            if self._stream is stream:
                self._stream = None

    async def _pass_on(self, frame: StreamFrame) -> None:
        assert self._stream is not None
        if frame.rev == self._stream.rev:
            shown = frame.report.document.get("view", {})
            self._camera = shown.get("camera", self._camera)
        self._shown.clear()
        self._send({"type": "frame", "seq": frame.seq, "step": frame.step, "final": frame.final,
                    "width": frame.width, "height": frame.height,
                    "mime": f"image/{frame.format}"}, [frame.bytes])
        try:
            await asyncio.wait_for(self._shown.wait(), SHOWN_TIMEOUT)
        except asyncio.TimeoutError:
            pass

    async def _gesture(self, message: dict[str, Any]) -> None:
        if self._task is not None and self._task.done():  # the connection was lost
            self._task = self._loop.create_task(self._serve())
        patch = self._patch_of(message)
        if patch is None:
            return
        if "camera" in patch and self._camera is not None:
            self._camera.update(patch["camera"])
        await self._patch(patch)

    def _patch_of(self, message: dict[str, Any]) -> dict[str, Any] | None:
        kind = message["type"]
        if kind == "step":
            return {"step": int(message["step"])}
        if kind == "size":
            edges = (min(EDGE_MOST, max(16, int(message[name]))) for name in ("width", "height"))
            return {"image": dict(zip(("width", "height"), edges))}
        if self._camera is None:
            return None
        if kind == "zoom":
            return {"camera": zoomed(self._camera, float(message["factor"]))}
        dx, dy = float(message["dx"]), float(message["dy"])
        if kind == "orbit":
            return {"camera": orbited(self._camera, dx, dy)}
        return {"camera": panned(self._camera, dx, dy)}

    async def _patch(self, patch: Mapping[str, Any]) -> None:
        if self._stream is None:
            self._document = merged(self._document, patch)
            return
        try:
            await self._stream.patch(patch)
        except WindsplatError as error:
            self._send({"type": "problem", "detail": str(error)}, [])
            return
        self._document = self._stream.document

    async def _show(self, view: View) -> None:
        if self._stream is None:
            self._document = view.to_dict()
            return
        size = self._document.get("image")
        await self._stream.show(view if size is None else view.patch({"image": size}))
        self._document = self._stream.document
