"""A picture with its report."""
from __future__ import annotations

import base64
import dataclasses
import io
import os
import pathlib
from typing import TYPE_CHECKING, Any, Literal, Mapping

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from PIL.Image import Image

Format = Literal["jpeg", "png", "npy", "pdf", "svg"]
FORMATS: Mapping[str, str] = {
    "jpeg": "image/jpeg",
    "png": "image/png",
    "npy": "application/x-npy",
    "pdf": "application/pdf",
    "svg": "image/svg+xml",
}
SUFFIXES: Mapping[str, Format] = {
    ".jpg": "jpeg", ".jpeg": "jpeg", ".png": "png", ".npy": "npy", ".pdf": "pdf", ".svg": "svg",
}

Raw = bytes  # the attribute `bytes` hides the type


def format_of(path: str | os.PathLike[str]) -> Format:
    """The format that the suffix of a file names. Raises ValueError."""
    suffix = pathlib.Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"'{os.fspath(path)}' does not end in {', '.join(SUFFIXES)}")
    return SUFFIXES[suffix]


@dataclasses.dataclass(frozen=True)
class Error:
    """The error of a picture: linear RMSE of premultiplied RGBA."""

    value: float | None
    kind: str
    """estimated, measured or unknown."""
    asked: float | None = None
    """The error that the view allowed."""
    kept: bool | None = None
    """Whether the value is at most the error asked for."""


@dataclasses.dataclass(frozen=True)
class Report:
    """How a picture was made: the header Windsplat-Frame, or `chosen` of a stream."""

    document: Mapping[str, Any]
    """All of it, as the server sent it."""
    timing: Mapping[str, float] = dataclasses.field(default_factory=dict)
    """Milliseconds of queue, render and encode."""

    @property
    def method(self) -> str:
        """slab, kernel or reference."""
        return str(self.document.get("method", ""))

    @property
    def error(self) -> Error:
        one = self.document.get("error") or {}
        return Error(one.get("value"), str(one.get("kind", "unknown")), one.get("asked"),
                     one.get("kept"))

    @property
    def work(self) -> Mapping[str, Any]:
        """Counts of samples, pixels and bytes."""
        work = self.document.get("work", {})
        assert isinstance(work, dict)
        return work

    @property
    def empty(self) -> str | None:
        """Why nothing of the data is drawn; None: something is."""
        text = self.document.get("empty")
        return None if text is None else str(text)

    def __repr__(self) -> str:
        error = self.error
        value = "unknown" if error.value is None else f"{error.value:.2g} ({error.kind})"
        times = ", ".join(f"{name} {ms:.1f} ms" for name, ms in self.timing.items())
        return f"<Report: {self.method}, error {value}{', ' + times if times else ''}>"


@dataclasses.dataclass(frozen=True, repr=False)
class Frame:
    """An encoded picture."""

    bytes: Raw
    format: Format
    width: int
    height: int
    report: Report

    @property
    def image(self) -> Image:
        """The picture as an image of Pillow; only of jpeg and png."""
        if self.format not in ("jpeg", "png"):
            raise ValueError(f"a frame of format {self.format} is not an image of Pillow; "
                             "ask for format='png'")
        import PIL.Image

        return PIL.Image.open(io.BytesIO(self.bytes))

    @property
    def array(self) -> NDArray[np.uint8] | NDArray[np.float32]:
        """The pixels, shape (height, width, channels): sRGB uint8; of format npy float32, linear
        RGBA premultiplied by its opacity, without the background."""
        import numpy as np

        if self.format == "npy":
            values: NDArray[np.float32] = np.load(io.BytesIO(self.bytes), allow_pickle=False)
            return values
        return np.asarray(self.image.convert("RGB"), dtype=np.uint8)

    def save(self, path: str | os.PathLike[str]) -> pathlib.Path:
        """Writes the bytes. The suffix has to name the format of the frame."""
        if format_of(path) != self.format:
            raise ValueError(f"a frame of format {self.format} cannot be saved as "
                             f"'{os.fspath(path)}'; use view.save(path)")
        out = pathlib.Path(path)
        out.write_bytes(self.bytes)
        return out

    def __repr__(self) -> str:
        return (f"<Frame: {self.width} x {self.height} {self.format}, {len(self.bytes)} bytes, "
                f"{self.report!r}>")

    def _repr_mimebundle_(
        self, include: Any = None, exclude: Any = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """What Jupyter shows."""
        data: dict[str, Any] = {"text/plain": repr(self)}
        metadata: dict[str, Any] = {}
        kind = FORMATS[self.format]
        if self.format in ("jpeg", "png"):
            data[kind] = base64.b64encode(self.bytes).decode("ascii")
            metadata[kind] = {"width": self.width, "height": self.height}
        elif self.format == "svg":
            data[kind] = self.bytes.decode("utf-8")
        return data, metadata
