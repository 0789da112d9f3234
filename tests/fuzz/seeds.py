"""Small files of every format that is read, as Seed objects: from plain python, and where the tools
are there from nccopy, grib_filter and the real files in build/test-data. And seeds that try to
lead a reader out of the data root."""

import base64
import gzip
import json
import math
import pathlib
import re
import shutil
import struct
import subprocess
import zlib

import hdf5_bytes

DIMS = (8, 6, 4)  # x, y, z
COUNT = math.prod(DIMS)
REAL_BYTES_MAX = 300_000
MARK_NUMBER = 31337.25  # what the files outside hold; exact in 32 bits
MARK_TEXT = "5ENTINEL"


class Seed:
    """Files by name, the first of them the one that is asked for; links by name. `sure`: as it is
    it must load. `escapes`: it asks for what lies outside."""

    def __init__(self, kind, name, files, links=None, path=None, escapes=False, sure=True):
        self.kind = kind
        self.name = name
        self.files = files
        self.links = links or {}
        self.path = path or next(iter(files))
        self.escapes = escapes
        self.sure = sure and not escapes


def numbers(component, step=0):
    nx, ny, nz = DIMS
    return [math.sin(0.7 * x + component) + 0.5 * math.cos(0.9 * y - step) + 0.25 * z
            for z in range(nz) for y in range(ny) for x in range(nx)]


def floats(values, big=False):
    return struct.pack(f"{'>' if big else '<'}{len(values)}f", *values)


def as_text(values):
    return " ".join(f"{v:.4f}" for v in values) + "\n"


def winds(big=False, step=0):
    """All u, all v, all w."""
    return b"".join(floats(numbers(c, step), big) for c in range(3))


def interleaved(step=0):
    return [v for triple in zip(*(numbers(c, step) for c in range(3))) for v in triple]


def lz4_block(data):
    """Literals alone."""
    if len(data) < 15:
        return bytes([len(data) << 4]) + data
    rest = len(data) - 15
    return b"\xf0" + b"\xff" * (rest // 255) + bytes([rest % 255]) + data


# --- NRRD, raw, GrADS, OpenDX --------------------------------------------------------------------

def nrrd_header(encoding, more=""):
    return ("NRRD0004\n# a comment\ntype: float\ndimension: 4\nsizes: 3 8 6 4\n"
            f"encoding: {encoding}\nendian: little\nkinds: vector domain domain domain\n"
            "space dimension: 3\nspace directions: none (1,0,0) (0,2,0) (0,0,3)\n"
            f"space origin: (0,0,0)\nkey:=value\n{more}").encode()


def nrrd_seeds():
    data = floats(interleaved())
    yield Seed("nrrd", "raw", {"a.nrrd": nrrd_header("raw") + b"\n" + data})
    yield Seed("nrrd", "gzip", {"a.nrrd": nrrd_header("gzip") + b"\n" + gzip.compress(data,
                                                                                   mtime=0)})
    yield Seed("nrrd", "ascii", {"a.nrrd": nrrd_header("ascii") + b"\n"
                                + as_text(interleaved()).encode()})
    yield Seed("nrrd", "hex", {"a.nrrd": nrrd_header("hex") + b"\n" + data.hex().encode()})
    yield Seed("nrrd", "detached", {"a.nhdr": nrrd_header("raw", "data file: a.raw\n"),
                                    "a.raw": data})
    listed = nrrd_header("raw", "data file: LIST 3\na0.raw\na1.raw\na2.raw\na3.raw\n")
    quarter = len(data) // 4
    yield Seed("nrrd", "list", {"a.nhdr": listed} | {
        f"a{i}.raw": data[i * quarter:(i + 1) * quarter] for i in range(4)})


def raw_document(**more):
    return json.dumps({
        "windsplat": "raw", "title": "A storm", "file": "s_%02d.raw",
        "dims": {"x": 8, "y": 6, "z": 4}, "type": "float32", "endian": "little",
        "steps": {"count": 2, "start": 0, "step": 1, "units": "hours since 1992-07-01"},
        "axes": {"x": {"units": "degrees_east", "first": 0, "spacing": 45},
                 "y": {"units": "degrees_north", "first": 75, "spacing": -30},
                 "z": {"units": "m", "positive": "up", "coordinates": [10, 250, 900, 2000]}},
        "fields": [{"name": "wind", "components": ["u", "v", "w"], "units": "m s-1",
                    "missing": -999}, {"name": "cloud", "units": "kg kg-1"}]} | more, indent=1)


def raw_step(step):
    return floats(interleaved(step)) + floats(numbers(3, step))


def raw_seeds():
    yield Seed("raw+json", "pattern", {"s.json": raw_document().encode(), "s_00.raw": raw_step(0),
                                       "s_01.raw": raw_step(1)})
    yield Seed("raw+json", "one file", {"s.json": raw_document(file="s.raw").encode(),
                                        "s.raw": raw_step(0) + raw_step(1)})


GRADS = """dset ^{file}
title A storm
undef -999
options {options}
xdef 8 linear 0 45
ydef 6 linear -75 30
zdef 4 levels 1000 850 500 200
tdef 2 linear 00Z01jan2001 6hr
vars 3
u 4 99 eastward wind [m/s]
v 4 99 northward wind [m/s]
w 4 99 upward wind [m/s]
endvars
"""


def grads_seeds():
    def descriptor(file, options):
        return GRADS.format(file=file, options=options).encode()
    yield Seed("grads", "big", {"g.ctl": descriptor("g.dat", "big_endian"),
                                "g.dat": winds(True) + winds(True, 1)})
    yield Seed("grads", "template", {"g.ctl": descriptor("g%h2.dat", "template little_endian"),
                                     "g00.dat": winds(), "g06.dat": winds(step=1)})
    records = b"".join(struct.pack("<i", 192) + winds()[i:i + 192] + struct.pack("<i", 192)
                       for i in range(0, len(winds()), 192))
    yield Seed("grads", "sequential", {"g.ctl": descriptor("g.dat", "sequential little_endian"),
                                       "g.dat": records * 2})


DX_GRID = ("object 1 class gridpositions counts 8 6 4\norigin 0 0 0\ndelta 1 0 0\ndelta 0 1 0\n"
           "delta 0 0 1\nobject 2 class gridconnections counts 8 6 4\n")
DX_ARRAY = "object 3 class array type float rank 1 shape 3 items 192 "
DX_FIELD = ('attribute "dep" string "positions"\nobject "wind" class field\n'
            'component "positions" value 1\ncomponent "connections" value 2\n'
            'component "data" value 3\nend\n')


def dx_seeds():
    head = DX_GRID + DX_ARRAY
    yield Seed("opendx", "text", {"d.dx": (head + "data follows\n" + as_text(interleaved())
                                          + DX_FIELD).encode()})
    yield Seed("opendx", "behind", {"d.dx": (head + "lsb ieee data 0\n" + DX_FIELD).encode()
                                    + floats(interleaved())})
    yield Seed("opendx", "beside", {
        "d.dx": (head + 'lsb ieee data file "d.bin",0\n' + DX_FIELD).encode(),
        "d.bin": floats(interleaved())})


# --- Zarr ----------------------------------------------------------------------------------------

def coded(data, compressor):
    if compressor == "zlib":
        return {"id": "zlib", "level": 1}, zlib.compress(data)
    if compressor == "gzip":
        return {"id": "gzip", "level": 1}, gzip.compress(data, mtime=0)
    if compressor == "lz4":
        return {"id": "lz4", "acceleration": 1}, struct.pack("<I", len(data)) + lz4_block(data)
    if compressor == "zstd":
        frame = struct.pack("<IBI", 0xFD2FB528, 0xA0, len(data))
        return {"id": "zstd", "level": 1}, frame + struct.pack("<I", 1 | len(data) << 3)[:3] + data
    if compressor == "blosc":
        head = struct.pack("<BBBBIII", 2, 1, 2, 4, len(data), len(data), len(data) + 16)
        return {"id": "blosc", "cname": "lz4", "clevel": 5, "shuffle": 1, "blocksize": 0}, \
            head + data
    return None, data


def zarr_array(name, shape, chunks, dtype, compressor, parts, dims, attributes):
    how = coded(b"0" * 16, compressor)[0]
    meta = {"zarr_format": 2, "shape": shape, "chunks": chunks, "dtype": dtype, "order": "C",
            "fill_value": "NaN", "filters": None, "compressor": how}
    files = {f"{name}/.zarray": json.dumps(meta).encode(),
             f"{name}/.zattrs": json.dumps({"_ARRAY_DIMENSIONS": dims} | attributes).encode()}
    for key, part in parts.items():
        files[f"{name}/{key}"] = coded(part, compressor)[1]
    return files


def zarr_files(compressor, consolidated=False):
    nx, ny, nz = DIMS
    files = {".zgroup": b'{"zarr_format": 2}', ".zattrs": b'{"title": "A storm"}'}
    for c, (name, long_name) in enumerate((("u", "eastward_wind"), ("v", "northward_wind"),
                                           ("w", "upward_air_velocity"))):
        layers = [floats(numbers(c)[k * 96:(k + 1) * 96]) for k in range(2)]
        files |= zarr_array(name, [1, nz, ny, nx], [1, 2, ny, nx], "<f4", compressor,
                            {f"0.{k}.0.0": layer for k, layer in enumerate(layers)},
                            ["time", "lev", "lat", "lon"],
                            {"units": "m s-1", "standard_name": long_name})
    for name, values, units in (("time", [0.0], "hours since 2001-01-01"),
                                ("lev", [1000.0, 850.0, 500.0, 200.0], "hPa"),
                                ("lat", [30.0 * i - 75 for i in range(ny)], "degrees_north"),
                                ("lon", [45.0 * i for i in range(nx)], "degrees_east")):
        data = struct.pack(f"<{len(values)}d", *values)
        files |= zarr_array(name, [len(values)], [len(values)], "<f8", compressor, {"0": data},
                            [name], {"units": units})
    if consolidated:
        meta = {key: json.loads(text) for key, text in files.items() if key.rpartition("/")[2]
                in (".zgroup", ".zattrs", ".zarray")}
        files[".zmetadata"] = json.dumps({"zarr_consolidated_format": 1,
                                          "metadata": meta}).encode()
    return {f"s.zarr/{name}": data for name, data in files.items()}


def zarr_seeds():
    for compressor in ("none", "zlib", "gzip", "lz4", "zstd", "blosc"):
        yield Seed("zarr", compressor, zarr_files(compressor, compressor == "zlib"), path="s.zarr")


# --- VTK -----------------------------------------------------------------------------------------

class VtkXml:
    """Arrays of one file in one way of coding them."""

    def __init__(self, coding, compressor=""):
        self.coding = coding
        self.compressor = compressor
        self.appended = b""

    def encoded(self, data, text):
        code = base64.b64encode if text else bytes
        if not self.compressor:
            head = struct.pack("<I", len(data))
            return code(head + data)
        block = zlib.compress(data) if self.compressor == "ZLib" else lz4_block(data)
        return code(struct.pack("<4I", 1, len(data), len(data), len(block))) + code(block)

    def array(self, name, values, components=1, kind="Float32"):
        tag = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" '
        if self.coding == "ascii":
            text = as_text(values) if kind == "Float32" else " ".join(map(str, values))
            return tag + f'format="ascii">\n{text}</DataArray>\n'
        letter = {"Float32": "f", "Int32": "i", "UInt8": "B"}[kind]
        data = struct.pack(f"<{len(values)}{letter}", *values)
        if self.coding == "base64":
            return tag + f'format="binary">\n{self.encoded(data, True).decode()}\n</DataArray>\n'
        tag += f'format="appended" offset="{len(self.appended)}"/>\n'
        self.appended += self.encoded(data, self.coding == "appended-base64")
        return tag

    def file(self, kind, attributes, inner):
        compressor = f' compressor="vtk{self.compressor}DataCompressor"' if self.compressor else ""
        out = (f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="0.1" '
               f'byte_order="LittleEndian" header_type="UInt32"{compressor}>\n'
               f"<{kind} {attributes}>\n{inner}</{kind}>\n").encode()
        if self.appended:
            coding = "base64" if self.coding == "appended-base64" else "raw"
            out += f'<AppendedData encoding="{coding}">\n_'.encode() + self.appended
            out += b"\n</AppendedData>\n"
        return out + b"</VTKFile>\n"


def points_of_grid():
    nx, ny, nz = DIMS
    return [c for z in range(nz) for y in range(ny) for x in range(nx)
            for c in (float(x), y + 0.1 * z, float(z))]


def hexahedra():
    nx, ny, nz = DIMS
    out = []
    for z in range(nz - 1):
        for y in range(ny - 1):
            for x in range(nx - 1):
                a = x + nx * (y + ny * z)
                b = a + nx * ny
                out.append([a, a + 1, a + 1 + nx, a + nx, b, b + 1, b + 1 + nx, b + nx])
    return out


def vtk_xml(ending, coding, compressor="", extra=""):
    xml = VtkXml(coding, compressor)
    data = '<PointData Vectors="wind">\n' + xml.array("wind", interleaved(), 3)
    data += extra + xml.array("heat", numbers(3)) + "</PointData>\n"
    extent = "0 7 0 5 0 3"
    if ending == "vti":
        return xml.file("ImageData", f'WholeExtent="{extent}" Origin="0 0 0" Spacing="1 1 2"',
                        f'<Piece Extent="{extent}">\n{data}</Piece>\n')
    if ending == "vtr":
        axes = "".join(xml.array(n, [float(i) ** 1.1 for i in range(c)])
                       for n, c in zip("xyz", DIMS))
        inner = f'<Piece Extent="{extent}">\n{data}<Coordinates>\n{axes}</Coordinates>\n</Piece>\n'
        return xml.file("RectilinearGrid", f'WholeExtent="{extent}"', inner)
    places = f"<Points>\n{xml.array('Points', points_of_grid(), 3)}</Points>\n"
    if ending == "vts":
        inner = f'<Piece Extent="{extent}">\n{data}{places}</Piece>\n'
        return xml.file("StructuredGrid", f'WholeExtent="{extent}"', inner)
    cells = hexahedra()
    inner = (f'<Piece NumberOfPoints="{COUNT}" NumberOfCells="{len(cells)}">\n{data}{places}'
             "<Cells>\n"
             + xml.array("connectivity", [p for cell in cells for p in cell], 1, "Int32")
             + xml.array("offsets", [8 * i + 8 for i in range(len(cells))], 1, "Int32")
             + xml.array("types", [12] * len(cells), 1, "UInt8") + "</Cells>\n</Piece>\n")
    return xml.file("UnstructuredGrid", "", inner)


def pvd(names):
    sets = "".join(f'<DataSet timestep="{i}" group="" part="0" file="{name}"/>\n'
                   for i, name in enumerate(names))
    return ('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n'
            f"{sets}</Collection>\n</VTKFile>\n").encode()


LEGACY = "# vtk DataFile Version 3.0\nA storm\n{coding}\nDATASET {kind}\n"


def vtk_legacy(kind, binary):
    def arrays(values, letter="f"):
        if not binary:
            return as_text(values) if letter == "f" else " ".join(map(str, values)) + "\n"
        return struct.pack(f">{len(values)}{letter}", *values).decode("latin-1") + "\n"
    out = LEGACY.format(coding="BINARY" if binary else "ASCII", kind=kind)
    if kind == "STRUCTURED_POINTS":
        out += "DIMENSIONS 8 6 4\nORIGIN 0 0 0\nSPACING 1 1 2\n"
    elif kind == "RECTILINEAR_GRID":
        out += "DIMENSIONS 8 6 4\n"
        for name, count in zip("XYZ", DIMS):
            out += f"{name}_COORDINATES {count} float\n"
            out += arrays([float(i) ** 1.1 for i in range(count)])
    else:
        if kind == "STRUCTURED_GRID":
            out += "DIMENSIONS 8 6 4\n"
        out += f"POINTS {COUNT} float\n" + arrays(points_of_grid())
    if kind == "UNSTRUCTURED_GRID":
        cells = hexahedra()
        out += f"CELLS {len(cells)} {9 * len(cells)}\n"
        out += arrays([v for cell in cells for v in [8, *cell]], "i")
        out += f"CELL_TYPES {len(cells)}\n" + arrays([12] * len(cells), "i")
    out += f"POINT_DATA {COUNT}\nVECTORS wind float\n" + arrays(interleaved())
    out += "SCALARS heat float 1\nLOOKUP_TABLE default\n" + arrays(numbers(3))
    return out.encode("latin-1")


def vtk_seeds():
    codings = (("ascii", ""), ("base64", ""), ("base64", "ZLib"), ("appended", ""),
               ("appended", "ZLib"), ("appended", "LZ4"), ("appended-base64", "ZLib"))
    for ending in ("vti", "vtr", "vts", "vtu"):
        for coding, compressor in codings:
            yield Seed(ending, f"{coding} {compressor}".rstrip(),
                       {f"f.{ending}": vtk_xml(ending, coding, compressor)})
    for ending in ("vti", "vtu"):
        members = {f"m{i}.{ending}": vtk_xml(ending, "appended", "ZLib") for i in range(2)}
        yield Seed("pvd", ending, {"s.pvd": pvd(members)} | members)
    for kind in ("STRUCTURED_POINTS", "RECTILINEAR_GRID", "STRUCTURED_GRID", "UNSTRUCTURED_GRID"):
        for binary in (False, True):
            yield Seed("vtk binary" if binary else "vtk ascii", kind.lower(),
                       {"f.vtk": vtk_legacy(kind, binary)})


# --- HDF5, netCDF, GRIB, real files --------------------------------------------------------------

def hdf5_seeds():
    file = hdf5_bytes.File()
    for c, name in enumerate("uvw"):
        file.add(name, DIMS[::-1], floats(numbers(c)))
    yield Seed("hdf5", "contiguous", {"h.h5": file.bytes()})


def netcdf_seeds(program, folder):
    nc4 = folder / "x.nc"
    subprocess.run([program, "synth", "climate", "--dims", "8x6x4", "--steps", "2", "-o", nc4],
                   check=True, capture_output=True)
    yield Seed("netcdf-4", "synth", {"x.nc": nc4.read_bytes()})
    if not shutil.which("nccopy"):
        return
    for kind, code, more in (("netcdf classic", "1", []), ("netcdf 64-bit", "2", []),
                             ("netcdf cdf5", "5", []), ("netcdf-4", "3", ["-d", "3", "-s"]),
                             ("netcdf-4", "4", [])):
        copy = folder / "copy.nc"
        subprocess.run(["nccopy", "-k", code, *more, nc4, copy], check=True)
        yield Seed(kind, f"nccopy -k {code}", {"x.nc": copy.read_bytes()})


GRIB_RULES = """set Ni = 8; set Nj = 6;
set latitudeOfFirstGridPointInDegrees = 75; set latitudeOfLastGridPointInDegrees = -75;
set longitudeOfFirstGridPointInDegrees = 0; set longitudeOfLastGridPointInDegrees = 315;
set iDirectionIncrementInDegrees = 45; set jDirectionIncrementInDegrees = 30;
set shortName = "%s"; set level = %d; set bitsPerValue = 12;
set values = {%s};
%s
write;
"""


def grib_seeds(folder):
    samples = pathlib.Path("/usr/share/eccodes/samples")
    tool = shutil.which("grib_filter")
    for edition in (1, 2):
        sample = samples / f"regular_ll_pl_grib{edition}.tmpl"
        packings = ["grid_simple"] + (["grid_ccsds", "grid_jpeg", "grid_ieee"] if edition == 2
                                      else ["grid_second_order"])
        for packing in packings if tool and sample.exists() else []:
            data = b""
            for c, name in enumerate("uvw"):
                for k, level in enumerate((1000, 850, 500, 200)):
                    values = ",".join(f"{v:.4f}" for v in numbers(c)[48 * k:48 * k + 48])
                    more = f'set packingType = "{packing}";'
                    (folder / "rules").write_text(GRIB_RULES % (name, level, values, more))
                    made = folder / "made.grib"
                    made.unlink(missing_ok=True)
                    done = subprocess.run([tool, "-o", made, folder / "rules", sample],
                                          capture_output=True)
                    data += made.read_bytes() if done.returncode == 0 and made.exists() else b""
            if data:
                yield Seed(f"grib {edition}", packing, {"g.grib": data})
        for path in sorted(samples.glob(f"*_grib{edition}.tmpl")):
            # Each may be refused, for its grid for example; one of a kind, not every resolution.
            if path.stat().st_size < 8000 and not re.search(r"_\d+_grib|rotated_gg", path.name):
                yield Seed(f"grib {edition}", path.name, {"g.grib": path.read_bytes()},
                           sure=False)


REAL_KINDS = {".nc": "netcdf-4", ".cdf": "netcdf classic", ".vtk": "vtk ascii", ".vti": "vti",
              ".vtu": "vtu", ".dx": "opendx"}


def real_seeds(folder):
    for path in sorted(folder.glob("*")) if folder.is_dir() else []:
        if path.suffix in REAL_KINDS and path.stat().st_size < REAL_BYTES_MAX:
            yield Seed(REAL_KINDS[path.suffix], path.name, {path.name: path.read_bytes()})


# --- seeds that try to get out -------------------------------------------------------------------

def write_outside(folder):
    """Files that must not be opened, each valid for the reference of a seed below."""
    folder.mkdir()
    mark = [MARK_NUMBER] * (3 * COUNT)
    (folder / "mark.raw").write_bytes(floats(mark) * 2)
    (folder / "mark.txt").write_text(MARK_TEXT + "\n")
    (folder / "mark.vti").write_bytes(VtkXmlMark().file_of_marks())
    (folder / "mark.dx").write_text(DX_GRID + DX_ARRAY + "data follows\n" + as_text(mark)
                                    + DX_FIELD)
    file = hdf5_bytes.File()
    for name in "uvw":
        file.add(name, DIMS[::-1], floats(mark[:COUNT]))
    (folder / "mark.h5").write_bytes(file.bytes())
    chunk = zlib.compress(floats(mark[:96]))
    (folder / "0.0.0.0").write_bytes(chunk)


class VtkXmlMark(VtkXml):
    def __init__(self):
        super().__init__("ascii")

    def file_of_marks(self):
        data = self.array("wind", [MARK_NUMBER] * (3 * COUNT), 3)
        return self.file("ImageData",
                         'WholeExtent="0 7 0 5 0 3" Origin="0 0 0" Spacing="1 1 2"',
                         f'<Piece Extent="0 7 0 5 0 3">\n<PointData>\n{data}</PointData></Piece>\n')


def escape_seeds(outside):
    """Each by a path relative to its folder, by an absolute one, and by a link."""
    vti = vtk_xml("vti", "ascii")
    for how, away in (("relative", "../../" + outside.name), ("absolute", str(outside)),
                      ("doubled", "./..//../" + outside.name), ("link", None)):
        def to(name, away=away):
            return f"{away}/{name}" if away else f"link_{name}"

        def seed(kind, name, files, target, how=how, away=away):
            links = {} if away else {f"link_{target}": f"../../{outside.name}/{target}"}
            return Seed(kind, f"{name}, {how}", files, links, escapes=True)
        yield seed("nrrd", "data file", {"a.nhdr": nrrd_header(
            "raw", f"data file: {to('mark.raw')}\n")}, "mark.raw")
        yield seed("nrrd", "not detached", {"a.nrrd": nrrd_header(
            "raw", f"data file: {to('mark.raw')}\n")}, "mark.raw")
        yield seed("raw+json", "file", {"s.json": raw_document(
            file=to("mark.raw"), steps={"count": 1}).encode()}, "mark.raw")
        yield seed("grads", "dset", {"g.ctl": GRADS.replace("^", "").format(
            file=to("mark.raw"), options="little_endian").encode()}, "mark.raw")
        yield seed("opendx", "data file", {"d.dx": (
            DX_GRID + DX_ARRAY + f'lsb ieee data file "{to("mark.raw")}",0\n'
            + DX_FIELD).encode()}, "mark.raw")
        yield seed("opendx", "object", {"d.dx": (
            DX_GRID + 'object "wind" class field\ncomponent "positions" value 1\ncomponent '
            f'"connections" value 2\ncomponent "data" file "{to("mark.dx")}",3\nend\n'
            ).encode()}, "mark.dx")
        yield seed("pvd", "member", {"s.pvd": pvd(["m0.vti", to("mark.vti")]), "m0.vti": vti},
                   "mark.vti")
        yield from hdf5_escapes(seed, to)
    entity = f'<!DOCTYPE VTKFile [<!ENTITY x SYSTEM "file://{outside}/mark.txt">]>\n<VTKFile'
    text = vti.replace(b"<VTKFile", entity.encode(), 1).replace(b'"heat"', b'"&x;"')
    yield Seed("vti", "entity", {"f.vti": text}, escapes=True)
    yield from link_seeds(outside)


def hdf5_escapes(seed, to):
    for name in ("external link", "external storage", "virtual dataset", "all three"):
        file = hdf5_bytes.File()
        file.add("u", DIMS[::-1], floats(numbers(0)))
        if name in ("external link", "all three"):
            file.add_linked("v", to("mark.h5"), "/v")
        if name in ("external storage", "all three"):
            file.add_stored_elsewhere("w", DIMS[::-1], to("mark.raw"), 4 * COUNT)
        if name in ("virtual dataset", "all three"):
            file.add_virtual("t", DIMS[::-1], to("mark.h5"), "u")
        target = "mark.raw" if name == "external storage" else "mark.h5"
        yield seed("hdf5", name, {"h.h5": file.bytes()}, target)


def link_seeds(outside):
    """What is asked for, its folder, or a part of it is a link."""
    away = f"../../{outside.name}"
    yield Seed("vti", "file is a link", {"other": b"x"}, {"f.vti": f"{away}/mark.vti"}, "f.vti",
               True)
    yield Seed("hdf5", "file is an absolute link", {"other": b"x"},
               {"h.h5": str(outside / "mark.h5")}, "h.h5", True)
    yield Seed("vti", "folder is a link", {"other": b"x"}, {"deep": away}, "deep/mark.vti", True)
    yield Seed("hdf5", "group behind a link", {"other": b"x"}, {"h.h5": f"{away}/mark.h5"},
               "h.h5#/u", True)
    yield Seed("vti", "pattern meets links", {"f0.txt": b"x"},
               {"f1.vti": f"{away}/mark.vti", "f2.vti": str(outside / "mark.vti")}, "f*.vti", True)
    yield Seed("vti", "dots", {"f.vti": vtk_xml("vti", "ascii")}, path=f"{away}/mark.vti",
               escapes=True)
    for kind in ("mark.raw", "mark.h5"):
        inside = zarr_files("zlib")
        del inside["s.zarr/u/0.1.0.0"]
        yield Seed("zarr", f"chunk is a link to {kind}", inside,
                   {"s.zarr/u/0.1.0.0": f"../../{away}/{kind}"}, "s.zarr", True)
    whole = {name: data for name, data in zarr_files("zlib").items() if "/u/0." not in name}
    yield Seed("zarr", "chunks are links", whole, {
        "s.zarr/u/0.0.0.0": f"../../{away}/0.0.0.0",
        "s.zarr/u/0.1.0.0": str(outside / "0.0.0.0")}, "s.zarr", True)


def all_seeds(program, folder, real, outside):
    plain = [*nrrd_seeds(), *raw_seeds(), *grads_seeds(), *dx_seeds(), *zarr_seeds(), *vtk_seeds(),
             *hdf5_seeds(), *netcdf_seeds(program, folder), *grib_seeds(folder),
             *real_seeds(real)]
    return plain + list(escape_seeds(outside))
