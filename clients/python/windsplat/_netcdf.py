"""Writes arrays of xarray to a netCDF file, one entry or chunk of their first dimension at a time:
no second copy of an array that is large, lazy or in chunks is in memory."""
from __future__ import annotations

import pathlib
import re
import shutil
from typing import Any, Hashable, Iterator, Mapping, Sequence

import numpy as np
import xarray

# Of the encoding of a variable; the rest, such as sizes of chunks, belongs to its file.
KEPT_ENCODING = ("units", "calendar", "_FillValue", "missing_value", "grid_mapping", "coordinates")
# Attributes that a netCDF file can have.
PLAIN = (str, int, float, np.ndarray, np.number, list, tuple)
MARKS = ("_FillValue", "missing_value")
READ_BYTES = 256_000_000  # at most of an array in chunks at once, if an entry has no more


def file_name_of(name: Any, taken: Sequence[str]) -> str:
    """A name that netCDF and the server take, of a name of xarray, which may be anything."""
    out = re.sub(r"[^A-Za-z0-9_.+@-]+", "_", str(name)).strip("_") or "field"
    if not re.match(r"[A-Za-z_]", out):
        out = f"v{out}"
    while out in taken:
        out += "_"
    return out


def plain_attributes(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Those attributes that a netCDF file can have."""
    out = {}
    for key, value in attributes.items():
        if isinstance(value, (bool, np.bool_)):
            value = int(value)
        if isinstance(value, (list, tuple)):
            kinds = {isinstance(one, str) for one in value}
            numbers = all(isinstance(one, (int, float, np.number)) for one in value)
            if not value or len(kinds) > 1 or not (kinds == {True} or numbers):
                continue
        if isinstance(value, np.ndarray) and value.dtype.kind not in "iufSU":
            continue
        if isinstance(value, PLAIN):
            out[str(key)] = value
    return out


def _type_of(dtype: np.dtype[Any]) -> str:
    """The type in the file: float32 as the server keeps it, of integers their own."""
    if dtype.kind == "f":
        return "f4"
    return "u1" if dtype.kind == "b" else f"{dtype.kind}{dtype.itemsize}"


def _samples(name: str, values: Any, kind: str) -> Any:
    """Samples as the file has them. Raises ValueError for what float32 cannot hold."""
    out = np.asarray(values)
    if kind == "f4" and out.dtype != np.float32:
        with np.errstate(over="ignore", invalid="ignore"):
            single = out.astype(np.float32)
        if (np.isinf(single) & np.isfinite(out)).any():
            most = np.nanmax(np.abs(np.where(np.isfinite(out), out, 0)))
            raise ValueError(f"'{name}' has values up to {most:g}; the server keeps float32, at "
                             f"most {np.finfo(np.float32).max:g}")
        out = single
    return out.astype(kind, copy=False)


def _marks_of(variable: xarray.DataArray) -> Any:
    """The numbers that mark missing values, in the type of the array: shape (n). Those of the
    encoding of floats are of packed numbers, and xarray has decoded them. A text, and a number that
    the type lacks, mark nothing."""
    dtype = variable.dtype
    given = variable.attrs if dtype.kind == "f" else {**variable.encoding, **variable.attrs}
    out = [np.empty(0, dtype)]
    for key in MARKS:
        marks = np.ravel(given.get(key, ()))
        if marks.dtype.kind not in "biuf":
            continue
        with np.errstate(over="ignore", invalid="ignore"):
            cast = marks.astype(dtype)
        # Floats are compared as they were rounded for the array.
        same = np.isfinite(cast) == np.isfinite(marks) if dtype.kind == "f" else cast == marks
        out.append(cast[same])
    return np.concatenate(out)


def _parts_of(variable: xarray.DataArray) -> Iterator[slice]:
    """The ranges of the first dimension that are read one after another: single entries; of dask,
    which computes a whole chunk for any entry of it, chunks of up to READ_BYTES."""
    lengths = variable.chunks[0] if variable.chunks else (1,) * variable.shape[0]
    most = max(1, READ_BYTES * variable.shape[0] // variable.nbytes)
    first = 0
    for length in lengths:
        last = first + length
        for start in range(first, last, most):
            yield slice(start, min(start + most, last))
        first = last


def _add(file: Any, dataset: xarray.Dataset, name: Any, new: str,
         new_of: Mapping[Any, str]) -> None:
    """Adds a field to an open file that has the coordinates."""
    variable = dataset[name]
    dims = [new_of.get(one, str(one)) for one in variable.dims]
    for dim, length in zip(dims, variable.shape):
        if dim not in file.dimensions:
            file.createDimension(dim, length)
    given = {**variable.encoding, **variable.attrs}
    attributes = plain_attributes({key: value for key, value in given.items()
                                   if key in variable.attrs or key in KEPT_ENCODING})
    beside = [str(new_of.get(one, one)) for one in variable.coords
              if one not in variable.dims and str(new_of.get(one, one)) in file.variables]
    if beside and "coordinates" not in attributes:
        attributes["coordinates"] = " ".join(beside)
    kind = _type_of(variable.dtype)
    for key in MARKS:
        attributes.pop(key, None)
    marks = _marks_of(variable)
    fill: Any = np.float32(np.nan)
    if kind != "f4":  # which has one mark: the first stands for the others
        fill = marks[0].astype(kind) if marks.size else None
        marks = marks[1:]
    if not {"scale_factor", "add_offset"}.isdisjoint(variable.encoding):
        for key in ("valid_range", "valid_min", "valid_max"):  # of values that were unpacked
            attributes.pop(key, None)
    out = file.createVariable(new, kind, dims, fill_value=fill)
    out.set_auto_maskandscale(False)
    out.setncatts(attributes)
    for part in _parts_of(variable):
        # A part of a lazy array is read, computed and forgotten.
        values = np.asarray(variable[{variable.dims[0]: part}].variable.data)
        if marks.size:
            values = np.where(np.isin(values, marks), fill, values)
        out[part] = _samples(str(name), values, kind)


def _check_room(folder: pathlib.Path, dataset: xarray.Dataset, fields: Sequence[Any]) -> None:
    sizes: dict[Any, int] = {
        name: dataset[name].size * np.dtype(_type_of(dataset[name].dtype)).itemsize
        for name in fields}
    free = shutil.disk_usage(folder).free
    if sum(sizes.values()) > free:
        most, _ = max(sizes.items(), key=lambda item: item[1])
        raise ValueError(f"the arrays take {sum(sizes.values()) / 1e6:.0f} MB, of which "
                         f"'{most}' {sizes[most] / 1e6:.0f} MB; the folder {folder} has "
                         f"{free / 1e6:.0f} MB left (TMPDIR names another)")


def write(path: pathlib.Path, dataset: xarray.Dataset, fields: Mapping[Any, str],
          others: Sequence[Hashable], title: str) -> None:
    """Writes variables with their coordinates.

    fields: names of fields and their names in the file. others: names of small variables that the
    attributes of fields name. Raises ValueError for values that float32 cannot hold, with the name
    of the variable.
    """
    import netCDF4

    _check_room(path.parent, dataset, list(fields))
    part = dataset[[*fields, *others]]
    small = part.drop_vars(list(fields)).copy(deep=False)
    for name in list(small.variables):
        variable = small[name]
        if variable.dtype.kind == "O" and name not in small.dims and variable.ndim == 0:
            small = small.drop_vars(name)
            continue
        variable.attrs = plain_attributes(variable.attrs)
        variable.encoding = {key: value for key, value in variable.encoding.items()
                             if key in KEPT_ENCODING and key not in variable.attrs}
    names: dict[Any, str] = {}
    for name in [*small.variables, *part.dims]:
        if name not in names:
            names[name] = file_name_of(name, [*names.values(), *fields.values()])
    small = small.rename({old: new for old, new in names.items()
                          if old in small.variables or old in small.dims if old != new})
    small.attrs = {**plain_attributes(dataset.attrs), "title": title}
    small.to_netcdf(path)
    with netCDF4.Dataset(path, "a") as file:
        if "coordinates" in file.ncattrs():  # of xarray, for coordinates of no variable
            file.delncattr("coordinates")
        for name, new in fields.items():
            _add(file, part, name, new, names)
