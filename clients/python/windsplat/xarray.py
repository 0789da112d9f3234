"""Accessor `windsplat` of xarray's Dataset and DataArray: `import windsplat.xarray`.

The arrays are written to a netCDF file, in a folder that a server on this machine reads, or they
are uploaded to another one.
"""
from __future__ import annotations

import atexit
import itertools
import pathlib
import re
import tempfile
from typing import Any, Iterable, Mapping, Sequence

import xarray

from ._documents import suggestion
from .dataset import Dataset
from .server import Server
from .view import View

TIME_NAMES = ("time", "t", "valid_time", "step", "forecast_reference_time")
# Of the encoding of a variable; the rest, such as sizes of chunks, belongs to its file.
KEPT_ENCODING = ("units", "calendar", "_FillValue", "missing_value", "grid_mapping", "coordinates")

_numbers = itertools.count(1)
_local: list[Server] = []


def local_server(**options: Any) -> Server:
    """The server of the accessors, started by the first call and ended with this process; options
    are those of Server.start."""
    if not _local:
        folder = tempfile.TemporaryDirectory(prefix="windsplat-")
        server = Server.start("tornado:8", data_root=folder.name, **options)
        atexit.register(folder.cleanup)
        atexit.register(server.close)
        _local.append(server)
    elif options:
        raise ValueError("the server of the accessors runs already: give the options to the first "
                         "call of windsplat.xarray.local_server")
    return _local[0]


def _is_time(dataset: xarray.Dataset, dimension: str) -> bool:
    if dimension.lower() in TIME_NAMES:
        return True
    coordinate = dataset.coords.get(dimension)
    return coordinate is not None and (
        coordinate.dtype.kind in "mM" or coordinate.attrs.get("axis") == "T")


def space_dimensions(dataset: xarray.Dataset, name: str) -> list[str]:
    """The dimensions of a variable besides time."""
    return [str(one) for one in dataset[name].dims if not _is_time(dataset, str(one))]


def _related(dataset: xarray.Dataset, names: Iterable[str]) -> list[str]:
    """Variables that the attributes of others name: grid mappings, terms of vertical
    coordinates."""
    found = []
    variables = [dataset[one] for one in [*names, *dataset.coords]]
    for variable in variables:
        for source in (variable.attrs, variable.encoding):
            words = [str(source.get("grid_mapping", "")).rstrip(":")]
            words += re.findall(r"\w+:\s*(\w+)", str(source.get("formula_terms", "")))
            found += [one for one in words if one in dataset.variables]
    return found


class Accessor:
    """`dataset.windsplat`: pictures of the arrays of a Dataset."""

    def __init__(self, dataset: xarray.Dataset) -> None:
        self._dataset = dataset
        self._opened: dict[Any, Dataset] = {}

    def fields(self) -> list[str]:
        """Names of the variables with three dimensions in space."""
        return [str(one) for one in self._dataset.data_vars
                if len(space_dimensions(self._dataset, str(one))) >= 3
                and self._dataset[one].dtype.kind in "fiu"]

    def open(
        self, names: Sequence[str] | None = None, *, server: Server | None = None,
        rename: Mapping[str, str] | None = None, title: str | None = None,
    ) -> Dataset:
        """Hands variables over to a server and returns the dataset there. It is done once for each
        choice of variables: see refresh().

        names: variables; by default all with three dimensions in space.
        server: by default one that the first call starts on this machine. One of Server.start
            with a `data_root` reads the file there; others get an upload, if they take any.
        rename: names in the file.
        title: of the pictures; by default the attribute `title` of the Dataset, without one the
            long name or name of a variable that is handed over alone, otherwise "xarray".

        Raises ValueError if a variable is not there or has no three dimensions in space.
        """
        chosen = self.fields() if names is None else list(dict.fromkeys(names))
        self._check(chosen)
        there = local_server() if server is None else server
        key = (there.url, tuple(chosen), tuple((rename or {}).items()), title)
        if key not in self._opened:
            if there._root is not None:
                path = self._write(chosen, there._root, rename or {}, title)
                self._opened[key] = there.open(path)
            else:
                with tempfile.TemporaryDirectory(prefix="windsplat-") as folder:
                    path = self._write(chosen, pathlib.Path(folder), rename or {}, title)
                    self._opened[key] = there.upload(path)
        return self._opened[key]

    def refresh(self) -> None:
        """Hands the arrays over again when they are next needed; after they were changed in
        place."""
        for dataset in self._opened.values():
            dataset.close(forget=True)
            if dataset.server._root is not None:
                (dataset.server._root / f"{dataset.id}.nc").unlink(missing_ok=True)
        self._opened.clear()

    def view(
        self, u: str | None = None, v: str | None = None, w: str | None = None,
        scalar: str | Sequence[str] | None = None, *, server: Server | None = None,
        title: str | None = None, size: tuple[int, int] | None = None, step: int | None = None,
        **keys: Any,
    ) -> View:
        """A view of lines of the vector (u, v, w) and media of scalars. Without names: the default
        view of all variables with three dimensions in space.

        u, v, w: names of the components to the east, north and up (w may be left out).
        scalar: one name or several.
        title: of the pictures: see open().
        keys: parts of the view, as of Dataset.view.
        """
        components = [one for one in (u, v, w) if one is not None]
        if components and (u is None or v is None):
            raise ValueError("lines need the components u and v")
        scalars = [scalar] if isinstance(scalar, str) else list(scalar or [])
        if not components and not scalars:
            return self.open(server=server, title=title).view(size=size, step=step, **keys)
        names = [*components, *scalars]
        dataset = self.open(names, server=server, title=title)
        field = _vector_of(dataset, components) if components else None
        if components and field is None:
            # The server knows vectors by the usual names of their components.
            usual = {one: name for one, name in zip((u, v, w), "uvw") if one is not None}
            dataset = self.open(names, server=server, rename=usual, title=title)
            field = _vector_of(dataset, [usual[one] for one in components])
            if field is None:
                raise ValueError(f"{', '.join(components)} form no vector: "
                                 + "; ".join(map(str, dataset.description["notes"])))
        for one in scalars:
            if one not in dataset.fields:
                raise ValueError(f"'{one}' is not on the grid of the others: "
                                 + "; ".join(map(str, dataset.description["notes"])))
        return dataset.view(size=size, step=step).vector(field=field).scalars(*scalars).patch(keys)

    def _check(self, names: Sequence[str]) -> None:
        variables = [str(one) for one in self._dataset.data_vars]
        if not names:
            shapes = "; ".join(f"{one} ({', '.join(map(str, self._dataset[one].dims))})"
                               for one in variables)
            raise ValueError("no variable has three dimensions in space besides time: "
                             + (shapes or "the dataset has no variables"))
        for name in names:
            if name not in self._dataset.variables:
                raise ValueError(f"there is no variable '{name}': {suggestion(name, variables)}")
            space = space_dimensions(self._dataset, name)
            if len(space) < 3:
                raise ValueError(f"'{name}' has the dimensions ({', '.join(space)}) in space; "
                                 "windsplat draws fields of three")

    def _write(self, names: Sequence[str], folder: pathlib.Path,
               rename: Mapping[str, str], title: str | None) -> pathlib.Path:
        part = self._dataset[[*names, *_related(self._dataset, names)]].copy(deep=False)
        for name in part.variables:
            variable = part[name]
            kept = {key: value for key, value in variable.encoding.items()
                    if key in KEPT_ENCODING and key not in variable.attrs}
            if name in names and variable.dtype == "float64":
                kept["dtype"] = "float32"  # as the server keeps it
            part[name].encoding = kept
        if rename:
            taken = {new: f"{new}_" for old, new in rename.items()
                     if new in part.variables and new != old and new not in rename}
            part = part.rename({**taken, **rename})
        if title is not None:
            part.attrs["title"] = title
        elif not part.attrs.get("title"):
            # The server would take the name of the file.
            alone = self._dataset[names[0]].attrs.get("long_name", names[0])
            part.attrs["title"] = str(alone) if len(names) == 1 else "xarray"
        path = _new_file(folder)
        try:
            part.to_netcdf(path)
        except BaseException:
            path.unlink()
            raise
        return path


def _new_file(folder: pathlib.Path) -> pathlib.Path:
    """An empty file of a name that no other process uses."""
    while True:
        path = folder / f"xarray-{next(_numbers)}.nc"
        try:
            path.touch(exist_ok=False)
            return path
        except FileExistsError:
            continue


def _vector_of(dataset: Dataset, components: Sequence[str]) -> str | None:
    """The vector field of these components; the one in m/s if a vertical one was converted."""
    for name, field in dataset.fields.items():
        if field.kind == "vector" and list(field.components) == list(components):
            return f"{name}_m" if f"{name}_m" in dataset.fields else name
    return None


class ArrayAccessor:
    """`array.windsplat`: pictures of one DataArray."""

    def __init__(self, array: xarray.DataArray) -> None:
        name = str(array.name or "field")
        self._name = name
        self._accessor = Accessor(array.to_dataset(name=name))

    def view(self, *, server: Server | None = None, title: str | None = None,
             size: tuple[int, int] | None = None, step: int | None = None, **keys: Any) -> View:
        """A view of the array as a medium. title: of the pictures, by default its long name or
        name."""
        return self._accessor.view(scalar=self._name, server=server, title=title, size=size,
                                   step=step, **keys)

    def refresh(self) -> None:
        """See Accessor.refresh."""
        self._accessor.refresh()


xarray.register_dataset_accessor("windsplat")(Accessor)  # type: ignore[no-untyped-call]
xarray.register_dataarray_accessor("windsplat")(ArrayAccessor)  # type: ignore[no-untyped-call]
