#!/usr/bin/env python3
"""Writes the initial inputs of every fuzz target into seeds/TARGET and sizes/TARGET: protocol
vectors, small files of every format (seeds.py), mutated datasets (model_mutations.py), requests,
and inputs of boundary sizes (sizes.py).

    tests/fuzz/write_inputs.py build/fuzz-inputs [--program build/release/windsplat]

The program writes the netCDF files of seeds.py. Needs python3-netcdf4 for the mutated datasets.
"""

import argparse
import io
import json
import pathlib
import shutil
import struct
import sys
import tempfile
import zipfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "integration"))
import loader_inputs  # noqa: E402
import model_files  # noqa: E402
import model_mutations  # noqa: E402
import model_writers  # noqa: E402
import seeds  # noqa: E402
import seeds_levels  # noqa: E402
import seeds_vtk  # noqa: E402
import sizes  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
MARK = b"\n#!file "
INPUT_BYTES_MAX = 300_000
MUTANTS = 340  # number of mutated datasets, over all formats
READERS = {"nrrd": "nrrd", "raw+json": "raw", "grads": "grads", "opendx": "opendx", "zarr": "zarr",
           "vti": "vtk_xml", "vtr": "vtk_xml", "vts": "vtk_xml", "vtu": "vtk_xml", "pvd": "vtk_xml",
           "pvti": "vtk_xml", "pvtu": "vtk_xml", "vtm": "vtk_xml",
           "vtk ascii": "vtk_legacy", "vtk binary": "vtk_legacy", "hdf5": "hdf5",
           "netcdf-4": "hdf5", "netcdf classic": "netcdf", "netcdf 64-bit": "netcdf",
           "netcdf cdf5": "netcdf", "grib 1": "grib", "grib 2": "grib"}


def text_of(case):
    if "bytes" in case:
        return bytes.fromhex(case["bytes"])
    if "text" in case:
        return case["text"].encode()
    return json.dumps(case.get("document"), ensure_ascii=False).encode()


def vectors():
    """Reads all vectors, whether accepted or refused, of any kind."""
    for path in sorted((ROOT / "protocol/vectors").glob("*/*.json")):
        for i, case in enumerate(json.loads(path.read_text())):
            name = f"{path.parent.name}-{path.stem}-{i}"
            if case["kind"] == "view":
                text = text_of(case)
                yield "view", name, text
                yield "view", name + "-patch", b"{}\0" + text
                yield "saved_view", name, (b'{"id":"0123456789","created":"2001-01-01T03:00:00Z",'
                                           b'"view":' + text + b"}")
                yield "http", name, sizes.post(text, target=b"/v1/frames")
                yield "messages", name, (b'{"type":"open","id":1,"dataset":"a"}\n'
                                         b'{"type":"patch","rev":1,"patch":' + text + b"}")
            if case["kind"] == "clientMessage":
                text = text_of(case)
                opened = b'{"type":"open","id":9,"dataset":"climate"}\n'
                yield "messages", name, opened + text.replace(b"\n", b" ")
                yield "websocket", name, sizes.LINES + opened + text.replace(b"\n", b" ")


TARGETS = [
    "/", "/livez", "/readyz", "/metrics", "/view.schema.json", "/v1", "/v1/colormaps",
    "/v1/openapi.json", "/v1/openapi.html", "/v1/asyncapi.json", "/v1/asyncapi.html",
    "/v1/presets", "/v1/datasets", "/v1/datasets/climate", "/v1/jobs", "/v1/jobs/1",
    "/v1/files", "/v1/files?folder=runs&after=a.nc&limit=2", "/v1/files?folder=../..",
    "/v1/views/0123456789", "/v1/references/abc", "/v1/stream", "*", "http://localhost/v1",
    "/v1/animations/abc.mp4", "/v1/uploads/a.nc?keep=9",
    "/v1/datasets/climate/frame.jpeg?width=16&height=12&azimuth=30&elevation=20&zoom=1.5&quality=9",
    "/v1/datasets/climate/frame.png?step=1&width=8&height=8&preset=top",
    "/v1/datasets/climate/frame.npy?width=4&height=4",
    "/v1/datasets/climate/frame.png?datetime=2001-01-01T06:00:00.5Z&nearest=1&width=8&height=8",
    "/v1/datasets/climate/frame.svg?field=wind,cloud&colormap=magma&annotate=box,title&dpi=72",
    "/v1/views/0123456789/frame.png?step=1&annotate=true",
    "/v1/datasets/climate/probe?x=1&y=2&z=3&step=0",
    "/v1/datasets/climate/probe?lon=1&lat=2&level=500",
    "/v1/datasets/climate/probe?index=1,2,3&minus=tornado&minusStep=0&fields=wind,cloud",
    "/v1/datasets/climate/fields/wind/histogram?bins=8&range=0,1&log=true&clip=0.1&step=1",
    "/v1/datasets/climate/fields/wind/series?x=1&y=2&z=3",
    "/v1/datasets/climate/fields/wind/values.npy?bbox=-20,30,40,70&level=1000,500&stride=3,2,1",
    "/v1/datasets/climate/fields/cloud/values.json?level=500&step=1&minusStep=0",
    "/v1/datasets/climate/fields/wind/range?of=all", "/v1/datasets/climate?forget=true",
    "/%2e%2e/%2f?%00=%ff", "/v1//datasets/./climate/../climate"]


def requests():
    for i, target in enumerate(TARGETS):
        for method in ("GET", "HEAD", "OPTIONS", "POST", "PUT", "PATCH", "DELETE"):
            text = sizes.get(target.encode()).replace(b"GET", method.encode(), 1)
            yield "http", f"target-{i}-{method}", text
        yield "query", f"target-{i}", target.encode() + b"\0image/png;q=0.5, */*;q=0.1"
    fields = [b"Expect: 100-continue", b"Origin: https://evil.example", b"If-None-Match: \"a\", *",
              b"Accept-Encoding: gzip;q=0, *", b"Transfer-Encoding: chunked", b"Host: again",
              b"Content-Length: 0", b"Content-Length: 2, 2", b" folded", b"X-Request-Id: an-id",
              b"Connection: close", b"Upgrade: h2c", b"Range: bytes=0-1", b"X:\x80\xff"]
    view = json.dumps(sizes.VIEW).encode()
    for i, field in enumerate(fields):
        yield "http", f"field-{i}", sizes.get(fields=[field])
        yield "http", f"posted-field-{i}", sizes.post(view, fields=[field])
    for target in (b"/v1/frames", b"/v1/forecasts", b"/v1/picks?x=9&y=8", b"/v1/views",
                   b"/v1/datasets"):
        body = b'{"path":"a.nc"}' if target.endswith(b"datasets") else view
        name = target.partition(b"?")[0].decode().replace("/", "-")
        yield "http", "post-" + name, sizes.post(body, target=target)
    for name, body in (("entries", b'{"from":"a","selection":{"number":3,"run":"b"}}'),
                       ("list", b'{"files":["a_*.nc","b.nc"],"title":"A","group":"/g"}')):
        yield "http", "post-datasets-" + name, sizes.post(body, target=b"/v1/datasets")
    stream = [b"Connection: Upgrade", b"Upgrade: websocket", b"Sec-WebSocket-Version: 13",
              b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="]
    pause = sizes.frame(0x81, b'{"type":"pause"}')
    yield "http", "upgrade", sizes.get(b"/v1/stream", stream) + pause
    yield "http", "version", sizes.get(version=b"HTTP/1.0")
    yield "http", "two", sizes.get() + sizes.post(view) + sizes.get(b"/v1")


def configurations():
    whole = {"listen": "127.0.0.1:8080", "log-json": True, "sessions": 64, "memory-limit": "4G",
             "allow-origin": ["https://a.example", "https://b.example"], "idle-timeout": 1.5e2}
    for key, value in whole.items():
        yield "config", key, json.dumps({key: value}).encode()
    yield "config", "whole", json.dumps(whole, indent=1).encode()
    for i, value in enumerate((None, {}, [1], [[]], "a\nb", "\u00e9", -0.0, 1e300, 2**64, "")):
        yield "config", f"value-{i}", json.dumps({"a": value}).encode()
    yield "config", "twice", b'{"a":1,"a":2}'


def descriptions():
    """Texts of an OPeNDAP service."""
    yield "dap", "dds", (
        b"Dataset {\n    Float64 lat[lat = 2];\n    Grid {\n     ARRAY:\n"
        b"        Int16 t[lev = 2][lat = 2];\n     MAPS:\n        Float32 lev[lev = 2];\n"
        b"        Float64 lat[lat = 2];\n    } t;\n    Structure { Byte a; } other[2];\n"
        b"    String title;\n    Sequence { Int32 n; } rows;\n} air.nc;\n")
    yield "dap", "sent", (b"Dataset {\n    Structure {\n        UInt32 lon[lon = 3];\n    } t;\n"
                          b"} air.nc;\n")
    yield "dap", "das", (
        b'Attributes {\n    t {\n        String units "K";\n        String name "a \\"b\\"";\n'
        b"        Float32 scale_factor 0.5;\n        Int16 valid_range -100, 100;\n"
        b'        Float64 odd NaN;\n        lat { Url u "x"; }\n    }\n    # comment\n'
        b'    NC_GLOBAL { String title "Air"; Alias same .t; }\n}\n')


def archives():
    """ZIP archives, and of one of them every cut and every changed byte of its records."""
    for method in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w", method) as archive:
            archive.writestr("a/b", bytes(range(100)) * 3)
            archive.writestr("c/", b"")
            archive.comment = b"made"
        yield "zip", f"method-{method}", out.getvalue()
    whole = out.getvalue()
    end, directory = whole.rindex(b"PK\5\6"), whole.index(b"PK\1\2")
    record = struct.pack("<IQHHIIQQQQ", 0x06064b50, 44, 45, 45, 0, 0, 2, 2, end - directory,
                         directory)
    locator = struct.pack("<IIQI", 0x07064b50, 0, end, 1)
    yield "zip", "zip64", (whole[:end] + record + locator + whole[end:end + 8] + b"\xff" * 12 +
                           whole[end + 20:])
    for at in range(directory, len(whole)):
        yield "zip", f"changed-{at}", whole[:at] + bytes([whole[at] ^ 0xff]) + whole[at + 1:]
        yield "zip", f"cut-{at}", whole[:at]


def files(program):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "made").mkdir()
        every = [*seeds.nrrd_seeds(), *seeds.raw_seeds(), *seeds.grads_seeds(), *seeds.dx_seeds(),
                 *seeds.zarr_seeds(), *seeds_vtk.vtk_seeds(), *seeds.hdf5_seeds(),
                 *seeds.mesh_seeds(), *seeds_vtk.vtkhdf_seeds(folder / "made"),
                 *seeds.grib_seeds(folder / "made")]
        if program:
            every += seeds.netcdf_seeds(program, folder)
    for i, seed in enumerate(every):
        yield from reader_input(f"seed-{i}", seed.kind, seed.files, seed.path)
    with tempfile.TemporaryDirectory() as folder:
        for name, members in seeds_levels.level_seeds(folder):
            yield from reader_input(name, "zarr", members, "s.zarr")
    for number in range(MUTANTS):
        model = model_mutations.mutant(0, number)
        yield from reader_input(f"mutant-{number}", model.kind, *model_writers.written(model))


def files_of_models():
    """Small files of models on staggered and unstructured grids."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name, write in (model_files.READ | model_files.REFUSED).items():
            write(folder / name)
        for path in sorted(folder.glob("*.nc")):
            members = {"x.nc": path.read_bytes()}
            yield from reader_input(f"model-{path.stem}", "netcdf-4", members, "x.nc")


def reader_input(name, kind, members, path):
    """The files of a dataset as one input; nothing if they are too large."""
    kind = "netcdf" if next(iter(members.values())).startswith(b"CDF") else READERS[kind]
    if kind == "zarr":
        data = b"".join(MARK[1 if not n else 0:] + member.removeprefix("s.zarr/").encode() + b"\n"
                        + part for n, (member, part) in enumerate(members.items()))
    else:
        data = members[path] + b"".join(MARK + member.encode() + b"\n" + part
                                        for member, part in members.items() if member != path)
    if len(data) <= INPUT_BYTES_MAX:
        yield f"reader_{kind}", name, data


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--program", help="path of windsplat, which writes netCDF files")
    options = parser.parse_args()
    shutil.rmtree(options.out, ignore_errors=True)
    for kind, inputs in (("seed", vectors()), ("seed", requests()),
                         ("seed", configurations()), ("seed", descriptions()), ("seed", archives()),
                         ("seed", files(options.program)), ("seed", files_of_models()),
                         ("seed", loader_inputs.loader_seeds()), ("size", sizes.sizes()),
                         ("size", loader_inputs.loader_sizes())):
        for target, name, data in inputs:
            folder = options.out / f"{kind}s" / target
            folder.mkdir(parents=True, exist_ok=True)
            (folder / name.replace("/", "_")[:200]).write_bytes(data)


if __name__ == "__main__":
    main()
