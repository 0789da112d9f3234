"""A dataset of a server: its fields, axes and times, values at places, and views of it."""
from __future__ import annotations

import dataclasses
import html
import math
from typing import TYPE_CHECKING, Any, Mapping, Sequence

from ._documents import suggestion
from ._times import CALENDARS, SAME, dates_of, is_date, moment_of, step_of
from .errors import NotFound
from .view import View

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .server import Server


@dataclasses.dataclass(frozen=True)
class Field:
    """A field that can be drawn or probed."""

    name: str
    kind: str
    """scalar or vector."""
    units: str
    long_name: str
    standard_name: str
    components: tuple[str, ...]
    derived: bool
    """Whether the server computes it from others."""


@dataclasses.dataclass(frozen=True)
class Step:
    """A time step."""

    index: int
    value: float
    """The coordinate, in the unit of the dataset's time axis."""
    text: str
    """The time as text, in UTC where the unit tells; else the value and its unit."""


@dataclasses.dataclass(frozen=True)
class Position:
    """The sample that was read."""

    index: tuple[int, int, int]
    """Numbers of the sample along x, y and z, from 0 at the west, south and bottom."""
    x: float
    y: float
    z: float
    units: Mapping[str, str]


@dataclasses.dataclass(frozen=True)
class Probe:
    """Values of the fields at a sample; None: masked."""

    position: Position
    step: int
    values: Mapping[str, float | list[float] | None]
    units: Mapping[str, str]

    def __getitem__(self, field: str) -> float | list[float] | None:
        return self.values[field]


@dataclasses.dataclass(frozen=True, eq=False)
class Series:
    """A field at a sample over all steps."""

    position: Position
    times: NDArray[Any]
    """As Dataset.times."""
    values: NDArray[np.float64]
    """Shape (steps), of a vector (steps, 3); masked ones are NaN."""
    units: str


@dataclasses.dataclass(frozen=True, eq=False)
class Histogram:
    """Counts of the samples of a field at a step."""

    counts: NDArray[np.int64]
    edges: NDArray[np.float64]
    """One more than counts."""
    below: int
    above: int
    masked: int


@dataclasses.dataclass(frozen=True, eq=False)
class Values:
    """Samples of a field in a box."""

    field: str
    array: NDArray[np.float32]
    """Masked samples are NaN."""
    dims: tuple[str, ...]
    """Of the array: z, y, x; of a vector component before them; without z of one level."""
    coordinates: Mapping[str, NDArray[np.float64]]
    """Of the axes x, y and z, from the west, south and bottom."""
    units: str
    step: int
    description: Mapping[str, Any]
    """The whole description of the server (values.json)."""

    def to_xarray(self) -> Any:
        """A DataArray with the names, coordinates and units of the axes."""
        import xarray

        axes = self.description["axes"]
        names = {axis: str(axes[axis].get("name") or axis) for axis in axes}
        coords: dict[str, Any] = {
            names[axis]: (names[axis] if axis in self.dims else (), places if axis in self.dims
                          else places[0], {"units": axes[axis].get("units", "")})
            for axis, places in self.coordinates.items()}
        return xarray.DataArray(self.array, coords, [names.get(one, one) for one in self.dims],
                                self.field, {"units": self.units})


def _position(document: Mapping[str, Any]) -> Position:
    index = document["index"]
    return Position((index["x"], index["y"], index["z"]), document["x"], document["y"],
                    document["z"], document.get("units", {}))


class Dataset:
    """A dataset that a server has opened."""

    def __init__(self, server: Server, id: str) -> None:
        self.server = server
        self.id = id
        self.upload_id: str | None = None
        """Name of the upload that it was opened from by Server.upload."""
        self._description: dict[str, Any] | None = None
        self._moments: list[int] | None = None

    @property
    def description(self) -> dict[str, Any]:
        """The whole description of the server (GET /v1/datasets/{id}), asked for once."""
        if self._description is None:
            self._description = self.server.http.get(f"v1/datasets/{_quoted(self.id)}")
        assert self._description is not None
        return self._description

    def refresh(self) -> None:
        """Forgets the description, for example after the files have changed."""
        self._description = None
        self._moments = None

    @property
    def title(self) -> str:
        return str(self.description.get("title", ""))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of samples along z, y and x."""
        dims = self.description["dims"]
        return dims["z"], dims["y"], dims["x"]

    @property
    def fields(self) -> dict[str, Field]:
        """Fields by name; derived ones too."""
        return {one["name"]: Field(one["name"], one["kind"], one.get("units", ""),
                                   one.get("longName", ""), one.get("standardName", ""),
                                   tuple(one.get("components", ())), one["dtype"] == "derived")
                for one in self.description["fields"]}

    @property
    def steps(self) -> list[Step]:
        return [Step(index, one["value"], one["text"])
                for index, one in enumerate(self.description["steps"]["times"])]

    @property
    def calendar(self) -> str | None:
        """The CF calendar of the dates of the steps: standard, proleptic_gregorian, julian,
        noleap, all_leap or 360_day; None: the steps have no dates."""
        texts = self.description["steps"]["times"]
        if " since " not in (self.description.get("timeUnits") or "") or not (
                texts and is_date(texts[0]["text"])):
            return None
        return CALENDARS.get(self.description.get("timeCalendar", "").strip().lower())

    @property
    def times(self) -> NDArray[Any]:
        """The times of the steps as numpy's datetime64[ms], UTC; in calendars that it lacks as
        objects of cftime, or as texts without that package; without dates float64 coordinates."""
        return self._as_times(self.description["steps"]["times"])

    def _as_times(self, times: list[Mapping[str, Any]]) -> NDArray[Any]:
        import numpy as np

        calendar = self.calendar
        if calendar is None:
            return np.array([one["value"] for one in times], dtype=np.float64)
        return dates_of([str(one["text"]) for one in times], calendar)

    def step_at(self, time: Any, *, nearest: bool = False) -> int:
        """The step at a time: a text as 2001-01-01T06:00 (UTC, or with an offset) in the calendar
        of the dataset, a datetime, datetime64 or time of cftime; a number where the steps have no
        dates.

        nearest: take the nearest step, of two the earlier, where there is none at that time.

        Raises InvalidView with the steps before and after it if there is none, ValueError for
        what is no time of the calendar.
        """
        calendar = self.calendar
        steps = self.steps
        texts = [step.text for step in steps]
        if calendar is not None:
            if self._moments is None:
                self._moments = [moment_of(text, calendar) for text in texts]
            return step_of(self._moments, moment_of(time, calendar), nearest, texts, time)
        values = [step.value for step in steps]
        try:
            wanted = float(time)
        except (TypeError, ValueError):
            raise ValueError(f"{time!r} is no time: the steps have no dates, give a number from "
                             f"{min(values):g} to {max(values):g}") from None
        return step_of(values, wanted, nearest, texts, time, SAME)

    def _step(self, step: int | None, time: Any, nearest: bool) -> int:
        """The step of a request: number, or time; without either the first."""
        if step is not None and time is not None:
            raise ValueError("give either step or time")
        if time is not None:
            return self.step_at(time, nearest=nearest)
        if nearest:
            raise ValueError("nearest requires time")
        return 0 if step is None else step

    def coordinates(self, axis: str) -> NDArray[np.float64]:
        """The coordinates of the axis x, y or z, in its unit."""
        import numpy as np

        return np.array(self.description["axes"][axis]["coordinates"], dtype=np.float64)

    @property
    def default_view(self) -> dict[str, Any]:
        """What keys of a view are if they are not set."""
        view = self.description["defaultView"]
        assert isinstance(view, dict)
        return view

    def view(
        self, *, size: tuple[int, int] | None = None, step: int | None = None, **keys: Any
    ) -> View:
        """A view of the dataset. size: width and height, pixels; keys: parts of the document."""
        out = View({"dataset": self.id}, dataset=self)
        if size is not None:
            if isinstance(size, str) or not isinstance(size, Sequence) or len(size) != 2:
                raise ValueError("size must be the width and height in pixels, as (400, 200), "
                                 f"not {size!r}")
            out = out.size(*size)
        if step is not None:
            out = out.at(step)
        return out.patch(keys) if keys else out

    def probe(
        self, x: float | None = None, y: float | None = None, z: float | None = None, *,
        lon: float | None = None, lat: float | None = None, level: float | None = None,
        index: tuple[int, int, int] | None = None, step: int | None = None, time: Any = None,
        nearest: bool = False, fields: list[str] | None = None,
    ) -> Probe:
        """The value of every field at the sample nearest to a place.

        x, y, z: coordinates of the axes (longitude and latitude where columns have them).
        lon, lat, level: other names of them: degrees, and the unit of the vertical axis; refused
            where columns have no longitude and latitude.
        index: instead of coordinates the number of the sample along x, y and z.
        step, time, nearest: the first step, or that number, or the step at a time: see step_at().
        fields: derived fields to be computed, too.
        """
        document = self.server.http.get(
            f"v1/datasets/{_quoted(self.id)}/probe",
            **_place(x, y, z, lon, lat, level, index),
            step=self._step(step, time, nearest), fields=",".join(fields) if fields else None)
        values = document["values"]
        return Probe(_position(document["position"]), document["step"],
                     {name: one["value"] for name, one in values.items()},
                     {name: one.get("units", "") for name, one in values.items()})

    def series(
        self, field: str, x: float | None = None, y: float | None = None,
        z: float | None = None, *, lon: float | None = None, lat: float | None = None,
        level: float | None = None, index: tuple[int, int, int] | None = None,
    ) -> Series:
        """A field over all steps at one place, named as for probe()."""
        import numpy as np

        document = self.server.http.get(f"{self._field(field)}/series",
                                        **_place(x, y, z, lon, lat, level, index))
        vector = self.fields[field].kind == "vector"
        hole = [np.nan] * 3 if vector else np.nan
        values = np.array([hole if one is None else one for one in document["values"]],
                          dtype=np.float64)
        return Series(_position(document["position"]), self._as_times(document["times"]), values,
                      document.get("units", ""))

    def histogram(
        self, field: str, *, bins: int | None = None, range: tuple[float, float] | None = None,
        step: int | None = None, time: Any = None, nearest: bool = False,
    ) -> Histogram:
        """Counts of the values of a field at a step (of vectors of the magnitudes).

        step, time, nearest: the first step, or that number, or the step at a time: see step_at().
        """
        import numpy as np

        ends = None if range is None else f"{range[0]!r},{range[1]!r}"
        document = self.server.http.get(f"{self._field(field)}/histogram", bins=bins, range=ends,
                                        step=self._step(step, time, nearest))
        counts = np.array(document["counts"], dtype=np.int64)
        low, high = document["range"]
        return Histogram(counts, np.linspace(low, high, len(counts) + 1), document["below"],
                         document["above"], document["masked"])

    def values(
        self, field: str, *, box: tuple[float, float, float, float] | None = None,
        level: float | tuple[float, float] | None = None, step: int | None = None,
        time: Any = None, nearest: bool = False, stride: int | tuple[int, int, int] = 1,
    ) -> Values:
        """The samples of a field as an array.

        box: west, south, east, north in degrees, or coordinates of x and y.
        level: one, or the ends of a range, in the unit of the vertical axis.
        step, time, nearest: the first step, or that number, or the step at a time: see step_at().
        stride: every so many samples along x and y, or along x, y and z.

        At most 64 MiB at once. Raises NotFound for servers without this resource.
        """
        import io

        import numpy as np

        def joined(value: Any) -> str | None:
            if value is None:
                return None
            many = value if isinstance(value, (tuple, list)) else [value]
            return ",".join(f"{one:g}" if isinstance(one, int) else repr(float(one))
                            for one in many)

        asked = {"bbox": joined(box), "level": joined(level),
                 "step": self._step(step, time, nearest), "stride": joined(stride)}
        path = self._field(field)
        description = self.server.http.get(f"{path}/values.json", **asked)
        answer = self.server.http.request("GET", f"{path}/values.npy", params=asked,
                                          accept="application/x-npy")
        array = np.load(io.BytesIO(answer.content), allow_pickle=False)
        coordinates = {axis: np.array(one["coordinates"], dtype=np.float64)
                       for axis, one in description["axes"].items()}
        return Values(field, array, tuple(description["dims"]), coordinates,
                      description.get("units", ""), description["step"], description)

    def range(
        self, field: str, *, step: int | None = None, time: Any = None, nearest: bool = False,
    ) -> tuple[float, float]:
        """Least and greatest value of a field at a step, or at a time (see step_at()); without
        both at all steps. NaN: all samples are masked."""
        if time is not None or nearest:
            step = self._step(step, time, nearest)
        document = self.server.http.get(f"{self._field(field)}/range", step=step,
                                        of="all" if step is None else "step")
        low, high = document["range"] or (math.nan, math.nan)
        return low, high

    def close(self, forget: bool = False) -> None:
        """Releases the memory of the data at the server; `forget` removes the dataset from the
        list, and an uploaded file."""
        if forget and self.upload_id is not None:
            self.server.http.request("DELETE", f"v1/uploads/{self.upload_id}")
            return
        self.server.http.request("DELETE", f"v1/datasets/{_quoted(self.id)}",
                                 params={"forget": "true"} if forget else None)

    def _field(self, field: str) -> str:
        if field not in self.fields:
            raise NotFound(404, "Not Found", f"dataset '{self.id}' has no field '{field}': "
                           + suggestion(field, list(self.fields)))
        return f"v1/datasets/{_quoted(self.id)}/fields/{_quoted(field)}"

    def __repr__(self) -> str:
        return f"<Dataset '{self.id}' of {self.server.url}>"

    def _repr_html_(self) -> str:
        """What Jupyter shows: the grid, the times and a table of the fields."""
        steps = self.steps
        z, y, x = self.shape
        times = ""
        if steps:
            times = f", {len(steps)} steps from {steps[0].text} to {steps[-1].text}"
        rows = "".join(
            f"<tr><td>{html.escape(one.name)}</td><td>{one.kind}</td>"
            f"<td>{html.escape(one.units)}</td><td>{html.escape(one.long_name)}</td></tr>"
            for one in self.fields.values())
        return (f"<b>{html.escape(self.title)}</b> ({html.escape(self.id)})<br>{x} x {y} x {z} "
                f"samples{html.escape(times)}<table><tr><th>field</th><th>kind</th><th>units</th>"
                f"<th>long name</th></tr>{rows}</table>")


def _quoted(text: str) -> str:
    import urllib.parse

    return urllib.parse.quote(text, safe="")


def _place(
    x: float | None, y: float | None, z: float | None, lon: float | None, lat: float | None,
    level: float | None, index: tuple[int, int, int] | None,
) -> dict[str, Any]:
    """The parameters of a place. The server refuses what it cannot take together."""
    return {"x": x, "y": y, "z": z, "lon": lon, "lat": lat, "level": level,
            "index": None if index is None else ",".join(str(int(one)) for one in index)}
