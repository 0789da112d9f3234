"""Small files of every supported format as Seed objects: written in Python, and if the tools are
installed by nccopy and grib_filter or copied from build/test-data. VTK is in seeds_vtk.py; seeds
that try to lead a reader out of the data root are in seeds_escaping.py."""

import gzip
import itertools
import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys

import hdf5_bytes
import seeds_cases
import seeds_mesh
import seeds_vtk
import zarr3_bytes
from seed_numbers import DIMS, Seed, as_text, coded, floats, interleaved, numbers, winds

REAL_BYTES_MAX = 300_000


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
    listed = {"windsplat": "files", "title": "A storm", "files": ["a_0.nrrd", "a_[1-9].nrrd"]}
    yield Seed("raw+json", "list of files", {"s.json": json.dumps(listed).encode()} | {
        f"a_{i}.nrrd": nrrd_header("raw") + b"\n" + floats(interleaved(i)) for i in range(2)})


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

def zarr_array(name, shape, chunks, dtype, compressor, parts, dims, attributes):
    how = coded(b"0" * 16, compressor)[0]
    meta = {"zarr_format": 2, "shape": shape, "chunks": chunks, "dtype": dtype, "order": "C",
            "fill_value": "NaN", "filters": None, "compressor": how}
    files = {f"{name}/.zarray": json.dumps(meta).encode(),
             f"{name}/.zattrs": json.dumps({"_ARRAY_DIMENSIONS": dims} | attributes).encode()}
    for key, part in parts.items():
        files[f"{name}/{key}"] = coded(part, compressor)[1]
    return files


WINDS = (("u", "eastward_wind"), ("v", "northward_wind"), ("w", "upward_air_velocity"))
AXES = (("time", [0.0], "hours since 2001-01-01"), ("lev", [1000.0, 850.0, 500.0, 200.0], "hPa"),
        ("lat", [30.0 * i - 75 for i in range(DIMS[1])], "degrees_north"),
        ("lon", [45.0 * i for i in range(DIMS[0])], "degrees_east"))


def layer_pairs(component):
    return [floats(numbers(component)[k * 96:(k + 1) * 96]) for k in range(2)]


def zarr_files(compressor, consolidated=False):
    nx, ny, nz = DIMS
    files = {".zgroup": b'{"zarr_format": 2}', ".zattrs": b'{"title": "A storm"}'}
    for c, (name, long_name) in enumerate(WINDS):
        layers = layer_pairs(c)
        files |= zarr_array(name, [1, nz, ny, nx], [1, 2, ny, nx], "<f4", compressor,
                            {f"0.{k}.0.0": layer for k, layer in enumerate(layers)},
                            ["time", "lev", "lat", "lon"],
                            {"units": "m s-1", "standard_name": long_name})
    for name, values, units in AXES:
        data = struct.pack(f"<{len(values)}d", *values)
        files |= zarr_array(name, [len(values)], [len(values)], "<f8", compressor, {"0": data},
                            [name], {"units": units})
    if consolidated:
        meta = {key: json.loads(text) for key, text in files.items() if key.rpartition("/")[2]
                in (".zgroup", ".zattrs", ".zarray")}
        files[".zmetadata"] = json.dumps({"zarr_consolidated_format": 1,
                                          "metadata": meta}).encode()
    return {f"s.zarr/{name}": data for name, data in files.items()}


def zarr3_files(consolidated=False, **storage):
    nx, ny, nz = DIMS
    files = {}
    for c, (name, long_name) in enumerate(WINDS):
        parts = {(0, k, 0, 0): layers for k, layers in enumerate(layer_pairs(c))}
        files |= zarr3_bytes.array(name, [1, nz, ny, nx], [1, 2, ny, nx], "float32", parts,
                                   ["time", "lev", "lat", "lon"],
                                   {"units": "m s-1", "standard_name": long_name}, **storage)
    for name, values, units in AXES:
        files |= zarr3_bytes.array(name, [len(values)], [len(values)], "float64",
                                   {(0,): struct.pack(f"<{len(values)}d", *values)}, [name],
                                   {"units": units})
    members = {key.removesuffix("/zarr.json"): json.loads(text) for key, text in files.items()
               if key.endswith("zarr.json")}
    root = zarr3_bytes.group({"title": "A storm"}, members if consolidated else None)
    return {f"s.zarr/{name}": data for name, data in ({"zarr.json": root} | files).items()}


def image_files():
    """OME-Zarr 0.5, two levels."""
    nx, ny, nz = DIMS
    axes = [{"name": "c", "type": "channel"}] + [
        {"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
    levels = [{"path": str(level), "coordinateTransformations": [
        {"type": "scale", "scale": [1, 0.5, scale, scale]}]} for level, scale in ((0, 1), (1, 2))]
    files = {"zarr.json": zarr3_bytes.group({"ome": {"version": "0.5", "multiscales": [
        {"axes": axes, "datasets": levels}]}})}
    for level, scale in (("0", 1), ("1", 2)):
        shape = [1, nz, ny // scale, nx // scale]
        parts = {(0, k, 0, 0): bytes(range(shape[2] * shape[3])) for k in range(nz - 1)}
        files |= zarr3_bytes.array(level, shape, [1, 1, *shape[2:]], "uint8", parts,
                                   ["c", "z", "y", "x"], {}, shards=[1, nz, 1, 1])
    return {f"s.zarr/{name}": data for name, data in files.items()}


def zarr_seeds():
    for compressor in ("none", "zlib", "gzip", "lz4", "zstd", "blosc"):
        yield Seed("zarr", compressor, zarr_files(compressor, compressor == "zlib"), path="s.zarr")
    for name, storage in (("plain", {}), ("blosc", {"compressor": "blosc", "summed": True}),
                          ("sharded", {"shards": [1, 2, 1, 1], "compressor": "zstd"}),
                          ("index first", {"shards": [1, 2, 1, 1], "at_start": True}),
                          ("consolidated", {"consolidated": True, "compressor": "gzip"})):
        yield Seed("zarr", f"3 {name}", zarr3_files(**storage), path="s.zarr")
    yield Seed("zarr", "3 image", image_files(), path="s.zarr")


# --- HDF5, netCDF, GRIB, real files --------------------------------------------------------------

def hdf5_seeds():
    file = hdf5_bytes.File()
    for c, name in enumerate("uvw"):
        file.add(name, DIMS[::-1], floats(numbers(c)))
    yield Seed("hdf5", "contiguous", {"h.h5": file.bytes()})


# Grids whose positions follow from a map projection: the attributes of `crs`, and the unit of x, y.
PROJECTED = (("lambert", """crs:grid_mapping_name = "lambert_conformal_conic";
crs:standard_parallel = 33., 45.; crs:latitude_of_projection_origin = 23.;
crs:longitude_of_central_meridian = -96.; crs:earth_radius = 6371229.;""", "m", 300000),
             ("satellite", """crs:grid_mapping_name = "geostationary";
crs:latitude_of_projection_origin = 0.; crs:longitude_of_projection_origin = -75.;
crs:perspective_point_height = 35786023.; crs:sweep_angle_axis = "x";
crs:semi_major_axis = 6378137.; crs:inverse_flattening = 298.257;""", "radian", 0.05),
             ("transverse", """crs:grid_mapping_name = "transverse_mercator";
crs:latitude_of_projection_origin = 0.; crs:longitude_of_central_meridian = 9.;
crs:scale_factor_at_central_meridian = 0.9996;""", "km", 300))


def projected_seeds(folder):
    def listed(values):
        return ", ".join(str(value) for value in values)

    for name, attributes, unit, step in PROJECTED:
        text = ["netcdf p { dimensions: y = 6; x = 8; variables: int crs; double x(x), y(y);",
                "float u(y, x), v(y, x);", attributes]
        for axis in "xy":
            text.append(f'{axis}:units = "{unit}"; '
                        f'{axis}:standard_name = "projection_{axis}_coordinate";')
        for c, direction in (("u", "east"), ("v", "north")):
            text.append(f'{c}:standard_name = "{direction}ward_wind"; {c}:units = "m s-1"; '
                        f'{c}:grid_mapping = "crs";')
        text.append("data:")
        for axis, count in (("x", 8), ("y", 6)):
            text.append(f"{axis} = {listed(step * (i - count // 2) for i in range(count))};")
        text += [f"{c} = {listed(range(48))};" for c in "uv"]
        source = folder / "p.cdl"
        source.write_text("\n".join(text) + "\n}\n")
        made = folder / "p.nc"
        subprocess.run(["ncgen", "-k", "1", "-o", made, source], check=True)
        yield Seed("netcdf classic", name, {"x.nc": made.read_bytes()})


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
    if shutil.which("ncgen"):
        yield from projected_seeds(folder)


GRIB_RULES = """set Ni = 8; set Nj = 6;
set latitudeOfFirstGridPointInDegrees = 75; set latitudeOfLastGridPointInDegrees = -75;
set longitudeOfFirstGridPointInDegrees = 0; set longitudeOfLastGridPointInDegrees = 315;
set iDirectionIncrementInDegrees = 45; set jDirectionIncrementInDegrees = 30;
set shortName = "%s"; set level = %d; set bitsPerValue = 12;
set values = {%s};
%s
write;
"""


# An octahedral grid of 208 points, and a grid about a rotated pole.
GRIB_GRIDS = {"reduced_gg_pl_32": (208, """set N = 4; set Nj = 8;
set pl = {20,24,28,32,32,28,24,20};
set latitudeOfFirstGridPointInDegrees = 73.799; set latitudeOfLastGridPointInDegrees = -73.799;
set longitudeOfLastGridPointInDegrees = 348.75;
"""), "rotated_ll_pl": (48, """set Ni = 8; set Nj = 6;
set latitudeOfFirstGridPointInDegrees = 5; set latitudeOfLastGridPointInDegrees = -5;
set longitudeOfFirstGridPointInDegrees = 0; set longitudeOfLastGridPointInDegrees = 14;
set iDirectionIncrementInDegrees = 2; set jDirectionIncrementInDegrees = 2;
set latitudeOfSouthernPoleInDegrees = -40; set longitudeOfSouthernPoleInDegrees = 10;
""")}


def grid_seeds(folder, tool, samples, edition):
    for grid, (points, rules) in GRIB_GRIDS.items():
        data = b""
        for c, name in enumerate("uv"):
            values = ",".join(f"{v:.4f}" for v in itertools.islice(itertools.cycle(numbers(c)),
                                                                   points))
            count = f"set numberOfDataPoints = {points};" if edition == 2 else ""
            (folder / "rules").write_text(f"""{rules}{count}
set shortName = "{name}"; set level = 500; set bitsPerValue = 12;
set values = {{{values}}};
write;
""")
            made = folder / "made.grib"
            made.unlink(missing_ok=True)
            subprocess.run([tool, "-o", made, folder / "rules",
                            samples / f"{grid}_grib{edition}.tmpl"], check=True,
                           capture_output=True)
            data += made.read_bytes()
        yield Seed(f"grib {edition}", grid, {"g.grib": data})


def list_seed(folder, tool, samples):
    """Cells in a list, whose positions are messages of the file."""
    x, y = seeds_mesh.scattered(110)
    data = b""
    for what, values in (("parameterCategory = 191; set parameterNumber = 2", x),
                         ("parameterCategory = 191; set parameterNumber = 1", y),
                         ("parameterCategory = 0; set parameterNumber = 0", range(110))):
        (folder / "rules").write_text(f"""set gridType = "unstructured_grid";
set numberOfGridInReference = 1; set discipline = 0; set {what}; set bitsPerValue = 16;
set values = {{{",".join(f"{float(v):.5f}" for v in values)}}};
write;
""")
        made = folder / "made.grib"
        made.unlink(missing_ok=True)
        subprocess.run([tool, "-o", made, folder / "rules", samples / "regular_ll_pl_grib2.tmpl"],
                       check=True, capture_output=True)
        data += made.read_bytes()
    return Seed("grib 2", "unstructured_grid", {"g.grib": data})


def grib_seeds(folder):
    samples = pathlib.Path("/usr/share/eccodes/samples")
    tool = shutil.which("grib_filter")
    for edition in (1, 2):
        if tool and samples.exists():
            yield from grid_seeds(folder, tool, samples, edition)
            if edition == 2:
                yield list_seed(folder, tool, samples)
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
            # Some may be refused, for example because of their grid; one of each kind, not every
            # resolution.
            if path.stat().st_size < 8000 and not re.search(r"_\d+_grib|rotated_gg", path.name):
                yield Seed(f"grib {edition}", path.name, {"g.grib": path.read_bytes()},
                           sure=False)


REAL_KINDS = {".nc": "netcdf-4", ".cdf": "netcdf classic", ".vtk": "vtk ascii", ".vti": "vti",
              ".vtu": "vtu", ".dx": "opendx"}


def real_seeds(folder):
    for path in sorted(folder.glob("*")) if folder.is_dir() else []:
        if path.suffix in REAL_KINDS and path.stat().st_size < REAL_BYTES_MAX:
            yield Seed(REAL_KINDS[path.suffix], path.name, {path.name: path.read_bytes()})


def mesh_seeds():
    for name, data in seeds_mesh.mesh_files().items():
        yield Seed("netcdf classic", f"mesh {name}", {"x.nc": data})


def cases_if_read(program):
    """Cases of OpenFOAM and EnSight, which other builds refuse."""
    if pathlib.Path(program).with_name("windsplat-vtk").exists():
        return seeds_cases.case_seeds()
    print("seeds: without windsplat-vtk there are no cases of OpenFOAM and EnSight",
          file=sys.stderr)
    return []


def plain_seeds(program, folder, real):
    return [*cases_if_read(program), *nrrd_seeds(), *raw_seeds(), *grads_seeds(), *dx_seeds(),
            *zarr_seeds(), *seeds_vtk.vtk_seeds(), *hdf5_seeds(), *netcdf_seeds(program, folder),
            *mesh_seeds(), *grib_seeds(folder), *real_seeds(real)]
