"""The view: an immutable document that determines a picture, with methods that derive others."""
from __future__ import annotations

import copy
import functools
import inspect
import json
import math
import os
import pathlib
import urllib.parse
from typing import TYPE_CHECKING, Any, Callable, Literal, Mapping, Sequence, TypeVar

from . import _camera
from ._documents import at_pointer, check, merged, own_schema, plain
from .errors import InvalidView, MissingPackage
from .frame import FORMATS, Format, Frame, Report, format_of
from .generated.view_types import UNSET, ViewDocument, ViewParts

if TYPE_CHECKING:
    from .dataset import Dataset
    from .jupyter import IFrame
    from .movie import Movie, Steps

SelfView = TypeVar("SelfView", bound="View")


def _with_checked_keys(key: str, method: Callable[..., Any]) -> Callable[..., Any]:
    """A method of ViewParts whose unknown keywords are checked like keys of a document: refused
    with a suggestion, unless the server knows them."""
    known = inspect.signature(method).parameters

    @functools.wraps(method)
    def checked(self: View, *items: Any, **given: Any) -> Any:
        if items or all(name in known for name in given):
            return method(self, *items, **given)
        return self._merged(key, given)

    return checked


for _name, _method in list(vars(ViewParts).items()):
    if inspect.isfunction(_method) and not _name.startswith("_") and any(
            one.kind is one.KEYWORD_ONLY for one in inspect.signature(_method).parameters.values()):
        setattr(ViewParts, _name, _with_checked_keys(_name, _method))


class View(ViewParts):
    """Everything that determines a picture except its encoding.

    A view is never changed: each method returns another one. Methods named like the parts of the
    document (camera, image, geometry, ground, vector, scalars, surfaces, region, light, ...) set
    some of their keys and keep the others; None returns a key to the default of the dataset.
    """

    def __init__(
        self, document: ViewDocument | Mapping[str, Any] | None = None,
        *, dataset: Dataset | None = None,
    ) -> None:
        self._document = plain(document or {})
        self._dataset = dataset
        try:
            check(self._document, own_schema())
        except InvalidView:
            if dataset is None:
                raise
            check(self._document, dataset.server.view_schema)  # a newer server knows more keys

    def _like(self: SelfView, document: Mapping[str, Any]) -> SelfView:
        return type(self)(document, dataset=self._dataset)

    def _merged(self: SelfView, key: str, given: Mapping[str, Any]) -> SelfView:
        return self.patch({key: {name: one for name, one in given.items() if one is not UNSET}})

    def _listed(self: SelfView, key: str, items: Sequence[Any]) -> SelfView:
        return self.patch({key: [{"field": one} if isinstance(one, str) else one
                                 for one in items]})

    # --- documents -----------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """A copy of the document, with the keys that were set."""
        document = copy.deepcopy(self._document)
        assert isinstance(document, dict)
        return document

    def to_json(self, indent: int | None = 2) -> str:
        """The document as text: what `windsplat render --view FILE` reads."""
        return json.dumps(self._document, indent=indent)

    @property
    def dataset(self) -> Dataset:
        """The dataset that is shown. Raises ValueError for a view of none."""
        if self._dataset is None:
            raise ValueError("this view belongs to no dataset: make it by dataset.view()")
        return self._dataset

    def get(self, pointer: str, default: Any = None) -> Any:
        """The value at a JSON pointer such as /camera/eye; `default`: it is not set."""
        value: Any = self._document
        for key in pointer.split("/")[1:]:
            if isinstance(value, list) and key.isdigit() and int(key) < len(value):
                value = value[int(key)]
            elif isinstance(value, dict) and key in value:
                value = value[key]
            else:
                return default
        return copy.deepcopy(value)

    def patch(self: SelfView, patch: Mapping[str, Any]) -> SelfView:
        """The view after a merge patch (RFC 7396): None removes a key, which returns it to its
        default; except at /vector/field, where it means "draw no lines"."""
        return self._like(merged(self._document, plain(patch)))

    def set(self: SelfView, pointer: str | None = None, value: Any = None, **keys: Any) -> SelfView:
        """The view with the value at a JSON pointer, set("/camera/fovY", 30), or with keys of the
        document, set(step=3, image={"background": "#ffffff"})."""
        out = self if pointer is None else self.patch(at_pointer(pointer, plain(value)))
        return out.patch(keys) if keys else out

    def __eq__(self, other: object) -> bool:
        return isinstance(other, View) and self._document == other._document

    def __hash__(self) -> int:
        return hash(json.dumps(self._document, sort_keys=True))

    def __repr__(self) -> str:
        return f"<View: {json.dumps(self._document)}>"

    # --- shortcuts -----------------------------------------------------------------------------

    def size(self: SelfView, width: int, height: int) -> SelfView:
        """The view with a picture of this size, pixels."""
        return self.patch({"image": {"width": width, "height": height}})

    def at(self: SelfView, step: int | None = None, *, time: Any = None,
           nearest: bool = False) -> SelfView:
        """The view at a step, or at a time (text, datetime, datetime64).

        nearest: take the nearest step where there is none at that time. Without it, InvalidView
            names the steps before and after it (see Dataset.step_at).
        """
        if (step is None) == (time is None):
            raise ValueError("give either step or time")
        if step is None:
            step = self.dataset.step_at(time, nearest=nearest)
        elif nearest:
            raise ValueError("nearest requires time")
        return self.patch({"step": int(step)})

    def look(
        self: SelfView, azimuth: float = 0, elevation: float = 30, zoom: float = 1,
        projection: Literal["perspective", "orthographic"] | None = UNSET,
    ) -> SelfView:
        """The view from a side, at the distance from which the box of the data, or of the region,
        just fits the picture.

        azimuth: degrees: 0 looks north, 90 west (from the east), as in the REST interface.
        elevation: degrees of the eye above the horizon, -90 to 90.
        zoom: above 1 closer.
        """
        keys = _camera.looking(self.dataset.description, self._document, azimuth, elevation, zoom)
        if projection is not UNSET:
            keys["projection"] = projection
        return self.patch({"camera": keys})

    def turn(self: SelfView, frames: int, degrees: float = 360) -> list[SelfView]:
        """Views on a turn about the vertical axis through the middle of the box of the data, or of
        the region, for `windsplat.movie`. A full turn ends one frame before its start, so that it
        can be repeated.

        If the view shows the whole box, as by default and after look(), all of them do: they are
        at one distance, from which the box fits at every angle. A view that shows a part of it is
        turned as it is."""
        first = self._first_of_turn(degrees)
        full = math.isclose(abs(degrees) % 360, 0, abs_tol=1e-9)
        parts = frames if full else max(1, frames - 1)
        _, centre = _camera.corners_of(self.dataset.description, self._document)
        axes = {"eye": centre, "target": centre, "up": (0, 0, 0)}
        out = []
        for index in range(frames):
            angle = math.radians(degrees * index / parts)
            out.append(self.patch({"camera": {**first, **{
                key: _camera.turned(first[key], axis, angle) for key, axis in axes.items()}}}))
        return out

    def _first_of_turn(self, degrees: float) -> dict[str, Any]:
        """The keys eye, target, up and height of the first camera of a turn."""
        description = self.dataset.description
        camera = {**self.dataset.default_view["camera"], **(self.get("/camera") or {})}
        if self.get("/camera/eye") is None and self.get("/camera/target") is None:
            # The side of the default camera; where it is depends on region and picture.
            sides = _camera.sides_of(camera["eye"], camera["target"])
            camera.update(_camera.looking(description, self._document, *sides, zoom=1))
        return {**_camera.turning(description, self._document, camera, degrees),
                "up": camera["up"]}

    def volume(self: SelfView, field: str, **keys: Any) -> SelfView:
        """The view with one more translucent medium of a scalar field; keys are those of
        ScalarView: color, extinction, shading, ..."""
        one = {"field": field, **keys}
        return self.patch({"scalars": [*(self.get("/scalars") or []), one]})

    def isosurface(self: SelfView, field: str, value: float, **keys: Any) -> SelfView:
        """The view with one more isosurface; keys are those of SurfaceView: opacity, color, ..."""
        return self._with_surface({"field": field, "isovalue": value, **keys})

    def section(self: SelfView, field: str, axis: Literal["x", "y", "z"], index: float,
                **keys: Any) -> SelfView:
        """The view with one more section through a layer of the grid; keys are those of
        SurfaceView: opacity, color, contours, ..."""
        return self._with_surface({"field": field, "slice": {"axis": axis, "index": index},
                                   **keys})

    def _with_surface(self: SelfView, one: Mapping[str, Any]) -> SelfView:
        return self.patch({"surfaces": [*(self.get("/surfaces") or []), one]})

    # --- pictures ------------------------------------------------------------------------------

    def frame(self, format: Format = "png", *, dpi: float | None = None) -> Frame:
        """The picture of the view.

        format: png, jpeg, npy (linear premultiplied RGBA as float32), pdf or svg.
        dpi: pixels to the inch, 10 to 2400; of pdf, svg and png only.
        """
        if format not in FORMATS:
            raise ValueError(f"format '{format}' is none of {', '.join(FORMATS)}")
        http = self.dataset.server.http
        answer = http.request("POST", "v1/frames", json=self._document, accept=FORMATS[format],
                              params={"dpi": dpi})
        document = json.loads(answer.headers.get("Windsplat-Frame", "{}"))
        timing = {}
        for part in answer.headers.get("Server-Timing", "").split(","):
            name, _, duration = part.strip().partition(";dur=")
            if duration:
                timing[name] = float(duration)
        default = self.dataset.default_view["image"]
        width = self.get("/image/width", default["width"])
        height = self.get("/image/height", default["height"])
        return Frame(answer.content, format, int(width), int(height), Report(document, timing))

    def save(self, path: str | os.PathLike[str], *, dpi: float | None = None) -> pathlib.Path:
        """Writes the picture; the suffix names the format: .png, .jpg, .npy, .pdf or .svg."""
        return self.frame(format_of(path), dpi=dpi).save(path)

    def pick(self, x: float, y: float) -> dict[str, Any] | None:
        """What the pixel at x, y from the upper left corner shows: its layer, field, value, units
        and position (`feature` of POST /v1/picks). None: nothing of the data."""
        answer = self.dataset.server.http.request("POST", "v1/picks", json=self._document,
                                                  params={"x": x, "y": y})
        feature = answer.json()["feature"]
        assert feature is None or isinstance(feature, dict)
        return feature

    def reference(self, timeout: float = 600) -> tuple[Frame, float]:
        """The rendering integral of the view, and the error of the view's own picture against it
        (linear RMSE). May take minutes. Raises JobTimeout after `timeout` seconds."""
        server = self.dataset.server
        job = server.http.request("POST", "v1/references", json=self._document).json()
        result = server.finished(job, timeout)
        answer = server.http.request("GET", result["picture"], accept=FORMATS["png"])
        report = Report({"method": "reference", "error": {"value": 0.0, "kind": "measured"}})
        frame = Frame(answer.content, "png", result["width"], result["height"], report)
        return frame, float(result["error"]["value"])

    def share(self) -> str:
        """Stores the view at the server and returns the short address of the page with it. Anyone
        who has the address may see and change the stored view; without --state-dir it is kept
        until the server ends."""
        server = self.dataset.server
        page = server.page
        saved = server.http.request("POST", "v1/views", json=self._document).json()
        return f"{page}#!view={saved['id']}"

    def movie(
        self, path: str | os.PathLike[str], steps: Steps | None = None,
        fps: float | None = None, *, turn: float | None = None,
        camera_path: Mapping[str, Any] | None = None,
        frames: int | None = None, per_step: int | None = None, workers: int | None = None,
        timeout: float = 3600, progress: Callable[[int, int], object] | None = None,
    ) -> Movie:
        """A movie of steps of the dataset.

        path: .mp4, .webm and .zip (PNG files) are drawn by a job of the server, which needs the
            program ffmpeg for the first two; .apng is made here.
        steps: numbers; "FIRST:LAST" or "FIRST:LAST:STRIDE", the last one included, as `windsplat
            animate --steps` takes them; or the keys first, last and stride of POST /v1/animations.
            By default all.
        fps: pictures a second, by default 24.
        turn: degrees by which the camera turns about the vertical axis, eastward.
        camera_path: keyframes of the camera (POST /v1/animations) in place of a turn.
        frames, per_step: of the movie in all, or for each step.
        workers: draws the pictures by single requests, so many at a time, and makes any movie
            here (see windsplat.movie). So are those of steps at unequal distances.
        timeout: seconds after which the job of the server is ended.
        progress: called with what is done and all of it: of a job per cent, otherwise frames.

        Raises the Problem that the server reports, JobTimeout, and what windsplat.movie raises.
        """
        from .movie import FPS, OF_SERVER, animation, movie, step_range, steps_of

        out = pathlib.Path(path)
        chosen = steps_of(steps, len(self.dataset.steps))
        shown = step_range(chosen)
        moves = {"turn": turn, "path": camera_path, "frames": frames, "perStep": per_step}
        if workers is None and shown is not None and out.suffix.lower() in OF_SERVER:
            return animation(out, self, {**moves, "steps": shown, "fps": fps}, timeout, progress)
        if any(value is not None for value in moves.values()):
            raise ValueError("turn, camera_path, frames and per_step are for movies of the server: "
                             f"{', '.join(OF_SERVER)} of steps at equal distances, without workers")
        return movie(out, [self.at(step) for step in chosen], FPS if fps is None else fps,
                     workers=workers or 2, progress=progress)

    # --- Jupyter and the page ------------------------------------------------------------------

    @property
    def url(self) -> str:
        """The address of the page with this view."""
        return f"{self.dataset.server.page}#!{urllib.parse.quote(self.to_json(None))}"

    def widget(self, width: int | str = "100%", height: int = 450) -> IFrame:
        """A live view for Jupyter: the page without its panels, in a frame. The address has to
        be one that the browser reaches, and the server has to permit the notebook's page to show
        it (option --allow-embed; Server.start does so for Jupyter on this machine)."""
        from .jupyter import IFrame

        hash = urllib.parse.quote(self.to_json(None))
        return IFrame(f"{self.dataset.server.page}?embed#!{hash}", width, height)

    def live(self, height: int = 450) -> Any:
        """A live view as a widget of Jupyter, windsplat.widget.LiveView: frames pass through the
        kernel, so that the browser need not reach the server. Raises MissingPackage without the
        package anywidget."""
        try:
            from .widget import LiveView
        except ModuleNotFoundError as error:
            if error.name not in ("anywidget", "traitlets"):
                raise
            raise MissingPackage(f"view.live() needs the package anywidget ({error}): install it "
                                 "by 'pip install anywidget', or use view.widget(), which needs no "
                                 "package") from error

        return LiveView(self, height=height)

    def _repr_mimebundle_(
        self, include: Any = None, exclude: Any = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """What Jupyter shows: the picture as JPEG."""
        if self._dataset is None:
            return {"text/plain": repr(self)}, {}
        data, metadata = self.frame("jpeg")._repr_mimebundle_()
        return {**data, "text/plain": repr(self)}, metadata
