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
from typing import Any, Callable, Iterable, Mapping, Sequence

import xarray

from ._documents import suggestion
from ._netcdf import file_name_of, write
from .dataset import Dataset
from .server import Server
from .view import View

TIME_NAMES = ("time", "t", "valid_time", "step", "forecast_reference_time")

KINDS = "fiub"  # of numbers that fields have

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


def _is_time(dataset: xarray.Dataset, dimension: Any) -> bool:
    if str(dimension).lower() in TIME_NAMES:
        return True
    coordinate = dataset.coords.get(dimension)
    return coordinate is not None and (
        coordinate.dtype.kind in "mM" or coordinate.attrs.get("axis") == "T"
        or (coordinate.dtype.kind == "O" and hasattr(next(iter(coordinate.values), None),
                                                     "calendar")))


def space_dimensions(dataset: xarray.Dataset, name: Any) -> list[str]:
    """The dimensions of a variable besides time."""
    return [str(one) for one in dataset[name].dims if not _is_time(dataset, one)]


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

    def fields(self) -> list[Any]:
        """Names of the variables with three dimensions in space."""
        return [one for one in self._dataset.data_vars
                if len(space_dimensions(self._dataset, one)) >= 3
                and self._dataset[one].dtype.kind in KINDS]

    def open(
        self, names: Sequence[Any] | None = None, *, server: Server | None = None,
        rename: Mapping[Any, str] | None = None, title: str | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> Dataset:
        """Hands variables over to a server and returns the dataset there. It is done once for each
        choice of variables: see refresh().

        names: variables; by default all with three dimensions in space.
        server: by default one that the first call starts on this machine. One of Server.start
            with a `data_root` reads the file there; others get an upload, if they take any.
        rename: names in the file. Without one a name keeps its letters and digits, and other
            characters become "_".
        title: of the pictures; by default the attribute `title` of the Dataset, without one the
            long name or name of a variable that is handed over alone, otherwise "xarray".
        progress: of an upload: progress(bytes sent, all bytes).

        Raises ValueError if a variable is not there, has no three dimensions in space, values
        beyond those of float32 or no room in the folder.
        """
        chosen = self.fields() if names is None else list(dict.fromkeys(names))
        self._check(chosen)
        there = local_server() if server is None else server
        key = (there.url, tuple(chosen), tuple((rename or {}).items()), title)
        if key not in self._opened:
            if there._root is not None:
                path = self._write(chosen, there._root, rename, title)
                self._opened[key] = there.open(path)
            else:
                with tempfile.TemporaryDirectory(prefix="windsplat-") as folder:
                    path = self._write(chosen, pathlib.Path(folder), rename, title)
                    self._opened[key] = there.upload(path, progress=progress)
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
        self, u: Any = None, v: Any = None, w: Any = None, scalar: Any = None,
        *, server: Server | None = None,
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
        many = isinstance(scalar, Iterable) and not isinstance(scalar, str)
        scalars: list[Any] = [] if scalar is None else list(scalar) if many else [scalar]
        if not components and not scalars:
            return self.open(server=server, title=title).view(size=size, step=step, **keys)
        names = list(dict.fromkeys([*components, *scalars]))
        dataset = self.open(names, server=server, title=title)
        new = _names_in_file(names, None)
        field = _vector_of(dataset, [new[one] for one in components]) if components else None
        if components and field is None:
            # The server knows vectors by the usual names of their components.
            usual = {one: name for one, name in zip((u, v, w), "uvw") if one is not None}
            dataset = self.open(names, server=server, rename=usual, title=title)
            new = _names_in_file(names, usual)
            field = _vector_of(dataset, [usual[one] for one in components])
            if field is None:
                raise ValueError(f"{', '.join(map(str, components))} form no vector: "
                                 + "; ".join(map(str, dataset.description["notes"])))
        for one in scalars:
            if new[one] not in dataset.fields:
                raise ValueError(f"'{one}' is not on the grid of the others: "
                                 + "; ".join(map(str, dataset.description["notes"])))
        media = [new[one] for one in scalars]
        return dataset.view(size=size, step=step).vector(field=field).scalars(*media).patch(keys)

    def _check(self, names: Sequence[Any]) -> None:
        variables = [str(one) for one in self._dataset.data_vars]
        if not names:
            shapes = "; ".join(f"{one} ({', '.join(map(str, self._dataset[one].dims))}) "
                               f"{self._dataset[one].dtype}" for one in self._dataset.data_vars)
            raise ValueError("no variable of numbers has three dimensions in space besides time: "
                             + (shapes or "the dataset has no variables"))
        for name in names:
            if name not in self._dataset.variables:
                raise ValueError(f"there is no variable '{name}': "
                                 + suggestion(str(name), variables))
            space = space_dimensions(self._dataset, name)
            if len(space) < 3:
                raise ValueError(f"'{name}' has the dimensions ({', '.join(space)}) in space; "
                                 "windsplat draws fields of three")
            if self._dataset[name].dtype.kind not in KINDS:
                raise ValueError(f"'{name}' has values of type {self._dataset[name].dtype}; "
                                 "windsplat draws real numbers")
            if 0 in self._dataset[name].shape:
                raise ValueError(f"'{name}' has no values: its shape is "
                                 f"{dict(self._dataset[name].sizes)}")

    def _write(self, names: Sequence[Any], folder: pathlib.Path,
               rename: Mapping[Any, str] | None, title: str | None) -> pathlib.Path:
        if title is None and not (title := self._dataset.attrs.get("title")):
            # The server would take the name of the file.
            alone = self._dataset[names[0]].attrs.get("long_name", names[0])
            title = str(alone) if len(names) == 1 else "xarray"
        others = [one for one in _related(self._dataset, names) if one not in names]
        path = _new_file(folder)
        try:
            write(path, self._dataset, _names_in_file(names, rename), others, str(title))
        except BaseException:
            path.unlink()
            raise
        return path


def _names_in_file(names: Sequence[Any], rename: Mapping[Any, str] | None) -> dict[Any, str]:
    out = dict(rename or {})
    for name in names:
        if name not in out:
            out[name] = file_name_of(name, list(out.values()))
    return out


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
        name = "field" if array.name is None else array.name
        self._name: Any = name
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
