"""Model -> the files of a dataset: netCDF through the C library, other formats byte by byte."""

import base64
import gzip
import json
import struct

import netCDF4
import numpy as np

import model as models
import model_grib
import seeds
import seeds_vtk
import zarr3_bytes

ORDERS = {"little": "<", "big": ">"}


# --- netCDF --------------------------------------------------------------------------------------

NETCDF_FORMATS = {"netcdf classic": "NETCDF3_CLASSIC", "netcdf 64-bit": "NETCDF3_64BIT_OFFSET",
                  "netcdf cdf5": "NETCDF3_64BIT_DATA", "netcdf-4": "NETCDF4"}


def add_variable(file, model, name, values, dims, attributes):
    options = {}
    if model.kind == "netcdf-4" and len(dims) == 4:
        options = dict(model.options.get("storage", {}))
        if "chunksizes" in options:
            order = model.options.get("dims", "tzyx")
            options["chunksizes"] = [options["chunksizes"]["tzyx".index(a)] for a in order]
    attributes = dict(attributes)
    dtype = values.dtype.newbyteorder(ORDERS[options["endian"]] if "endian" in options else "=")
    variable = file.createVariable(name, dtype, dims,
                                   fill_value=attributes.pop("_FillValue", None), **options)
    variable.set_auto_maskandscale(False)
    for key, value in attributes.items():
        variable.setncattr(key, value)
    return variable


def netcdf(model):
    file = netCDF4.Dataset("memory.nc", "w", format=NETCDF_FORMATS[model.kind], memory=65536)
    file.setncattr("Conventions", "CF-1.8")
    order = model.options.get("dims", "tzyx")
    for a in order:
        size = None if a == "t" and order[0] == "t" else len(model.axes[a].values)
        file.createDimension(model.axes[a].name, size)
    made = []
    for a in "tzyx":
        axis = model.axes[a]
        kind = model.options.get("axis type", "f8")
        variable = add_variable(file, model, axis.name, axis.values.astype(kind), (axis.name,),
                                axis.attributes)
        made.append((variable, axis.values.astype(kind)))
    for field in model.fields:
        dims = tuple(model.axes[a].name for a in order)
        made.append((add_variable(file, model, field.name, field.stored, dims, field.attributes),
                     field.written().transpose(["tzyx".index(a) for a in order])))
    for variable, values in made:
        variable[:] = values
    data = bytes(file.close())
    if "tables" in model.options:
        data, found = with_tables(data, list(np.ndindex(model.shape[:2])), model.options["tables"])
        if found != len(model.fields):
            raise AssertionError(f"{found} chunk tables of {len(model.fields)} variables")
    return {"x.nc": data}, "x.nc"


def layer_chunks(data, layers):
    """Version 1 B-trees that index chunks of one layer each, as (position of the node, its keys
    and children in order) (HDF5 file format specification, III.A.1)."""
    key = struct.Struct("<II5QQ")  # size, filter mask, offsets in 4 dimensions and the element
    at = data.find(b"TREE\1\0")
    while at >= 0:
        used = struct.unpack_from("<H", data, at + 6)[0]
        if used == len(layers) and at + 24 + used * key.size <= len(data):
            rows = [key.unpack_from(data, at + 24 + i * key.size) for i in range(used)]
            if [row[2:7] for row in rows] == [(*layer, 0, 0, 0) for layer in layers]:
                yield at, rows
        at = data.find(b"TREE\1\0", at + 4)


def with_tables(data, layers, tables):
    """The file with a modified chunk table of each variable: entries (size, filters, address)."""
    out = bytearray(data)
    found = 0
    for at, rows in layer_chunks(data, layers):
        found += 1
        table = {row[2:4]: (*row[:2], row[7]) for row in rows}
        for change in tables:
            change(table)
        struct.pack_into("<H", out, at + 6, len(table))
        # The last child is followed by a key beyond all chunks.
        bound = data[at + 24 + len(rows) * 56:at + 24 + len(rows) * 56 + 48]
        out[at + 24 + len(table) * 56:at + 24 + len(table) * 56 + 48] = bound
        for i, (layer, (size, filters, address)) in enumerate(sorted(table.items())):
            struct.pack_into("<II5QQ", out, at + 24 + i * 56, size, filters, *layer, 0, 0, 0,
                             address)
    return bytes(out), found


# --- Zarr ----------------------------------------------------------------------------------------

def zarr(model):
    options = model.options
    version = options.get("version", 2)
    title = {"title": "A storm"}
    files = {"zarr.json": zarr3_bytes.group(title)} if version == 3 else {
        ".zgroup": b'{"zarr_format": 2}', ".zattrs": json.dumps(title).encode()}
    write = zarr3_array if version == 3 else zarr_array
    for a in "tzyx":
        axis = model.axes[a]
        files |= write(axis.name, chunked(axis.values, axis.values.shape), [axis.name],
                       dict(axis.attributes), {})
    dims = [model.axes[a].name for a in "tzyx"]
    for field in model.fields:
        parts = chunked(field.written(), options.get("chunks", model.shape))
        if "tables" in options:
            table = {at[:2]: part for at, part in parts.items.items()}
            for change in options["tables"]:
                change(table)
            parts.items = {(*at, 0, 0): part for at, part in table.items()}
        files |= write(field.name, parts, dims, dict(field.attributes), options)
    return {f"s.zarr/{name}": data for name, data in files.items()}, "s.zarr"


class Chunks:
    """An array of a shape and type, as chunks by place; those at an edge are filled with zeros."""

    def __init__(self, values, chunks):
        self.shape = [int(n) for n in values.shape]
        self.chunks = [int(n) for n in chunks]
        self.dtype = values.dtype
        self.items = {}


def chunked(values, chunks):
    out = Chunks(values, chunks)
    for at in np.ndindex(*(-(-n // c) for n, c in zip(values.shape, chunks))):
        part = values[tuple(slice(i * c, (i + 1) * c) for i, c in zip(at, chunks))]
        out.items[at] = np.zeros(chunks, values.dtype)
        out.items[at][tuple(slice(0, n) for n in part.shape)] = part
    return out


def zarr_array(name, parts, dims, attributes, options):
    order = ">" if options.get("endian") == "big" else "<"
    memory = options.get("memory", "C")
    compressor = options.get("compressor", "none")
    fill = attributes.pop("_FillValue", None)
    dtype = parts.dtype.newbyteorder(order) if parts.dtype.itemsize > 1 else parts.dtype
    meta = {"zarr_format": 2, "shape": parts.shape, "chunks": parts.chunks,
            "dtype": dtype.str, "order": memory, "filters": None,
            "fill_value": json_number(fill), "compressor": seeds.coded(b"0", compressor)[0]}
    plain = {key: json_number(value) for key, value in attributes.items()}
    files = {f"{name}/.zarray": json.dumps(meta).encode(),
             f"{name}/.zattrs": json.dumps({"_ARRAY_DIMENSIONS": dims} | plain).encode()}
    for at, part in parts.items.items():
        files[f"{name}/{'.'.join(map(str, at))}"] = seeds.coded(
            part.astype(dtype).tobytes(memory), compressor)[1]
    return files


def zarr3_array(name, parts, dims, attributes, options):
    """As xarray writes it: _FillValue is an attribute, of floats in base64."""
    endian = options.get("endian", "little")
    memory = options.get("memory", "C")
    dtype = parts.dtype.newbyteorder(ORDERS[endian])
    fill = attributes.get("_FillValue", 0)
    plain = {key: json_number(value) for key, value in attributes.items()}
    if "_FillValue" in plain and parts.dtype.kind == "f":
        plain["_FillValue"] = base64.b64encode(struct.pack("<d", fill)).decode()
    stored = {at: part.astype(dtype).tobytes(memory) for at, part in parts.items.items()}
    return zarr3_bytes.array(name, parts.shape, parts.chunks, parts.dtype.name, stored, dims, plain,
                             fill=json_number(fill), endian=endian, memory=memory,
                             compressor=options.get("compressor", "none"),
                             **options.get("shards", {}))


def json_number(value):
    if isinstance(value, (list, tuple, np.ndarray)):
        return [json_number(one) for one in value]
    if isinstance(value, (np.floating, float)):
        value = float(value)
        if not np.isfinite(value):
            return "NaN" if np.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    return value.item() if isinstance(value, np.integer) else value


# --- NRRD, raw, GrADS, OpenDX: plain numbers of one or several steps ----------------------------

def components(model, t):
    """(z, y, x, component) of the vector, and the scalar, at a step."""
    return np.stack([model.field(n).stored[t] for n in models.WIND], axis=-1), \
        model.field("heat").stored[t]


def typed(model, values):
    dtype = values.dtype.newbyteorder(ORDERS[model.options.get("endian", "little")])
    return values.astype(dtype).tobytes()


NRRD_TYPES = {"float32": "float", "float64": "double", "int8": "int8", "uint8": "uint8",
              "int16": "int16", "uint16": "uint16", "int32": "int32", "uint32": "uint32"}


def first_and_spacing(axis):
    values = axis.values
    return values[0], (values[1] - values[0] if len(values) > 1 else 1.0)


def nrrd(model):
    """The vector only."""
    values, _ = components(model, 0)
    model.fields = [field for field in model.fields if field.name != "heat"]
    ends = [first_and_spacing(model.axes[a]) for a in "xyz"]
    coding = model.options.get("coding", "raw")
    data = typed(model, values)
    if coding == "gzip":
        data = gzip.compress(data, mtime=0)
    elif coding == "ascii":
        data = text_of(values).encode()
    elif coding == "hex":
        data = data.hex().encode()
    head = (f"NRRD0004\ntype: {NRRD_TYPES[values.dtype.name]}\ndimension: 4\nsizes: 3 "
            f"{values.shape[2]} {values.shape[1]} {values.shape[0]}\nencoding: {coding}\n"
            f"endian: {model.options.get('endian', 'little')}\n"
            "kinds: vector domain domain domain\nspace dimension: 3\nspace directions: none "
            f"({ends[0][1]!r},0,0) (0,{ends[1][1]!r},0) (0,0,{ends[2][1]!r})\n"
            f"space origin: ({ends[0][0]!r},{ends[1][0]!r},{ends[2][0]!r})\n")
    if model.options.get("detached"):
        return {"wind.nhdr": (head + "data file: a.raw\n").encode(), "a.raw": data}, "wind.nhdr"
    return {"wind.nrrd": head.encode() + b"\n" + data}, "wind.nrrd"


def text_of(values):
    return " ".join(repr(v) for v in values.ravel().tolist()) + "\n"


def raw(model):
    steps = model.shape[0]
    dims = {a: len(model.axes[a].values) for a in "xyz"}
    times = model.axes["t"]
    missing = {"missing": json_numbers(model.fields[0].attributes["missing"])} if (
        "missing" in model.fields[0].attributes) else {}
    document = {
        "windsplat": "raw", "file": "s.raw", "dims": dims,
        "type": model.fields[0].stored.dtype.name, "order": model.options.get("order", "zyx"),
        "endian": model.options.get("endian", "little"),
        "steps": {"count": steps, "coordinates": times.values.tolist()}
        | {k: times.attributes[k] for k in ("units", "calendar") if k in times.attributes},
        "axes": {a: {"units": model.axes[a].attributes["units"],
                     "coordinates": model.axes[a].values.tolist()} for a in "xyz"},
        "fields": [{"name": "wind", "components": models.WIND,
                    "layout": model.options.get("layout", "interleaved")} | missing,
                   {"name": "heat"} | missing]}
    parts = []
    for t in range(steps):
        vector, scalar = components(model, t)
        order = ["zyx".index(a) for a in document["order"]]
        vector, scalar = vector.transpose(*order, 3), scalar.transpose(order)
        if model.options.get("layout") == "planar":
            vector = np.moveaxis(vector, -1, 0)
        parts += [typed(model, vector), typed(model, scalar)]
    return {"s.json": json.dumps(document).encode(), "s.raw": b"".join(parts)}, "s.json"


def json_numbers(value):
    return [float(one) for one in np.atleast_1d(value)]


GRADS_SETTINGS = """dset ^g.dat
title A storm
undef {undef!r}
options {endian}_endian{sequential}
xdef {nx} {x}
ydef {ny} {y}
zdef {nz} {z}
tdef {steps} linear 00Z01jan2001 6hr
vars {count}
{vars}endvars
"""


def grads_axis(axis):
    values = axis.values
    if len(values) == 1 or not np.allclose(np.diff(values), values[1] - values[0], rtol=1e-12):
        return "levels " + " ".join(repr(v) for v in values.tolist())
    return f"linear {values[0].item()!r} {(values[1] - values[0]).item()!r}"


def grads(model):
    steps, nz, ny, nx = model.shape
    names = [field.name for field in model.fields]
    sequential = model.options.get("sequential", False)
    text = GRADS_SETTINGS.format(
        undef=float(model.fields[0].attributes["missing"]), nx=nx, ny=ny, nz=nz, steps=steps,
        endian=model.options.get("endian", "little"), sequential=" sequential" * sequential,
        x=grads_axis(model.axes["x"]), y=grads_axis(model.axes["y"]),
        z=grads_axis(model.axes["z"]), count=len(names),
        vars="".join(f"{name} {nz} 99 of the storm\n" for name in names))
    mark = struct.pack(ORDERS[model.options.get("endian", "little")] + "i", 4 * nx * ny)
    data = b""
    for t in range(steps):
        for field in model.fields:
            for z in range(nz):
                record = typed(model, field.stored[t, z].astype(np.float32))
                data += mark + record + mark if sequential else record
    return {"g.ctl": text.encode(), "g.dat": data}, "g.ctl"


def opendx(model):
    """The vector only; in the grid of positions x varies slowest."""
    values, _ = components(model, 0)
    model.fields = [field for field in model.fields if field.name != "heat"]
    values = np.ascontiguousarray(values.transpose(2, 1, 0, 3))
    counts = " ".join(map(str, values.shape[:3]))
    ends = [first_and_spacing(model.axes[a]) for a in "xyz"]
    deltas = "".join("delta " + " ".join(repr(float(ends[i][1])) if i == j else "0"
                                         for j in range(3)) + "\n" for i in range(3))
    kind = {"float32": "float", "float64": "double", "int16": "short", "int32": "int",
            "uint8": "unsigned byte"}[values.dtype.name]
    head = (f"object 1 class gridpositions counts {counts}\norigin "
            + " ".join(repr(float(end[0])) for end in ends) + "\n" + deltas
            + f"object 2 class gridconnections counts {counts}\nobject 3 class array type {kind} "
            f"rank 1 shape 3 items {values.size // 3} ")
    if model.options.get("coding") == "text":
        return {"d.dx": (head + "data follows\n" + text_of(values) + seeds.DX_FIELD).encode()}, \
            "d.dx"
    order = "msb" if model.options.get("endian") == "big" else "lsb"
    return {"d.dx": (head + f"{order} ieee data 0\n" + seeds.DX_FIELD).encode()
            + typed(model, values)}, "d.dx"


# --- VTK -----------------------------------------------------------------------------------------

VTK_TYPES = {"float32": "Float32", "float64": "Float64", "int8": "Int8", "uint8": "UInt8",
             "int16": "Int16", "uint16": "UInt16", "int32": "Int32", "uint32": "UInt32"}


class VtkArrays(seeds_vtk.VtkXml):
    def array(self, name, values, components=1):
        tag = (f'<DataArray type="{VTK_TYPES[values.dtype.name]}" Name="{name}" '
               f'NumberOfComponents="{components}" ')
        if self.coding == "ascii":
            return tag + f'format="ascii">\n{text_of(values)}</DataArray>\n'
        data = values.astype(values.dtype.newbyteorder("<")).tobytes()
        if self.coding == "base64":
            return tag + f'format="binary">\n{self.encoded(data, True).decode()}\n</DataArray>\n'
        tag += f'format="appended" offset="{len(self.appended)}"/>\n'
        self.appended += self.encoded(data, self.coding == "appended-base64")
        return tag


def lattice_points(model):
    z, y, x = np.meshgrid(*(model.axes[a].values for a in "zyx"), indexing="ij")
    bent = model.options.get("warp", 0) * np.sin(np.stack([y, z, x], axis=-1))
    return np.stack([x, y, z], axis=-1) + bent


def cells_of(model):
    nx, ny, nz = (len(model.axes[a].values) for a in "xyz")
    z, y, x = np.meshgrid(*(np.arange(n - 1) for n in (nz, ny, nx)), indexing="ij")
    a = (x + nx * (y + ny * z)).ravel()
    b = a + nx * ny
    return np.stack([a, a + 1, a + 1 + nx, a + nx, b, b + 1, b + 1 + nx, b + nx], axis=1)


def vtk_xml(model):
    vector, scalar = components(model, 0)
    xml = VtkArrays(model.options.get("coding", "appended"), model.options.get("compressor", ""))
    data = '<PointData Vectors="wind">\n' + xml.array("wind", vector, 3)
    data += xml.array("heat", scalar) + "</PointData>\n"
    nz, ny, nx = scalar.shape
    extent = f"0 {nx - 1} 0 {ny - 1} 0 {nz - 1}"
    ends = [first_and_spacing(model.axes[a]) for a in "xyz"]
    if model.kind == "vti":
        origin, spacing = (" ".join(repr(float(end[i])) for end in ends) for i in (0, 1))
        attributes = f'WholeExtent="{extent}" Origin="{origin}" Spacing="{spacing}"'
        return xml.file("ImageData", attributes, f'<Piece Extent="{extent}">\n{data}</Piece>\n')
    if model.kind == "vtr":
        axes = "".join(xml.array(a, model.axes[a].values) for a in "xyz")
        return xml.file("RectilinearGrid", f'WholeExtent="{extent}"', f'<Piece Extent="{extent}">'
                        f"\n{data}<Coordinates>\n{axes}</Coordinates>\n</Piece>\n")
    points = f"<Points>\n{xml.array('Points', lattice_points(model), 3)}</Points>\n"
    if model.kind == "vts":
        return xml.file("StructuredGrid", f'WholeExtent="{extent}"',
                        f'<Piece Extent="{extent}">\n{data}{points}</Piece>\n')
    cells = cells_of(model).astype(np.int32)
    inner = (f'<Piece NumberOfPoints="{scalar.size}" NumberOfCells="{len(cells)}">\n{data}{points}'
             "<Cells>\n" + xml.array("connectivity", cells)
             + xml.array("offsets", np.arange(8, 8 * len(cells) + 8, 8, np.int32))
             + xml.array("types", np.full(len(cells), 12, np.uint8)) + "</Cells>\n</Piece>\n")
    return xml.file("UnstructuredGrid", "", inner)


LEGACY_TYPES = {"float32": "float", "float64": "double", "int16": "short", "int32": "int",
                "uint8": "unsigned_char"}


def vtk_legacy(model):
    vector, scalar = components(model, 0)
    binary = model.kind == "vtk binary"
    kind = LEGACY_TYPES[scalar.dtype.name]

    def block(values):
        if not binary:
            return text_of(values).encode()
        return values.astype(values.dtype.newbyteorder(">")).tobytes() + b"\n"

    nz, ny, nx = scalar.shape
    grid = model.options.get("grid", "STRUCTURED_POINTS")
    out = seeds_vtk.LEGACY.format(coding="BINARY" if binary else "ASCII", kind=grid).encode()
    out += f"DIMENSIONS {nx} {ny} {nz}\n".encode()
    if grid == "STRUCTURED_POINTS":
        ends = [first_and_spacing(model.axes[a]) for a in "xyz"]
        out += "".join(name + " " + " ".join(repr(float(end[i])) for end in ends) + "\n"
                       for i, name in enumerate(("ORIGIN", "SPACING"))).encode()
    else:
        for a in "xyz":
            values = model.axes[a].values
            out += f"{a.upper()}_COORDINATES {len(values)} double\n".encode() + block(values)
    out += f"POINT_DATA {scalar.size}\nVECTORS wind {kind}\n".encode() + block(vector)
    out += f"SCALARS heat {kind} 1\nLOOKUP_TABLE default\n".encode() + block(scalar)
    return out


def written(model):
    """The files by name, and the path to open."""
    kind = model.kind
    if kind in NETCDF_FORMATS:
        return netcdf(model)
    if kind.startswith("grib"):
        return model_grib.written(model)
    if kind in ("vti", "vtr", "vts", "vtu"):
        return {f"f.{kind}": vtk_xml(model)}, f"f.{kind}"
    if kind.startswith("vtk"):
        return {"f.vtk": vtk_legacy(model)}, "f.vtk"
    return {"zarr": zarr, "nrrd": nrrd, "raw+json": raw, "grads": grads, "opendx": opendx}[kind](
        model)
