"""The page in a frame of a notebook."""
from __future__ import annotations

import dataclasses
import html


@dataclasses.dataclass(frozen=True)
class IFrame:
    """A frame with the page of a server; Jupyter shows it as the value of a cell."""

    src: str
    width: int | str
    height: int

    def _repr_html_(self) -> str:
        width = self.width if isinstance(self.width, str) else f"{self.width}px"
        return (f'<iframe src="{html.escape(self.src)}" title="windsplat" style="width: '
                f'{html.escape(width)}; height: {self.height}px; border: 0" '
                f'allow="fullscreen"></iframe>')
