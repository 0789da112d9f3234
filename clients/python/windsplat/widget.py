"""A live view as a widget of Jupyter; needs anywidget. Frames pass through the kernel, so that it
works where the browser does not reach the server itself, as with JupyterHub."""
from __future__ import annotations

import pathlib
from typing import Any

import anywidget
import traitlets

from .relay import Relay
from .view import View


class LiveView(anywidget.AnyWidget):  # type: ignore[misc]
    """A view that is dragged in a notebook: drag orbits, with shift or the right button it pans;
    the wheel zooms once the picture was chosen; keys: arrows, +, -, 0; double click: the first
    view again."""

    _esm = pathlib.Path(__file__).with_name("widget.js")
    height = traitlets.Int(450).tag(sync=True)
    title = traitlets.Unicode("").tag(sync=True)
    steps = traitlets.List(traitlets.Unicode()).tag(sync=True)

    def __init__(self, view: View, *, height: int = 450, **more: Any) -> None:
        dataset = view.dataset
        super().__init__(height=height, title=dataset.title,
                         steps=[step.text for step in dataset.steps], **more)
        self._relay = Relay(view, self.send)
        self.on_msg(lambda _, message, buffers: self._relay.receive(message))

    @property
    def view(self) -> View:
        """The view as it is shown now, after dragging: widget.view.save("a.png")."""
        return self._relay.view

    @view.setter
    def view(self, view: View) -> None:
        self._relay.show(view)

    def close(self) -> None:
        """Ends the stream and removes the widget."""
        self._relay.close()
        super().close()
