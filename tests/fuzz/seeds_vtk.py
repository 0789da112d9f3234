"""Small VTK files: XML of every kind and coding, collections, and the legacy format."""

import base64
import struct
import zlib

from seed_numbers import COUNT, DIMS, Seed, as_text, interleaved, lz4_block, numbers


class VtkXml:
    """The arrays of one file in one encoding."""

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


def image_part(low, high, ghost=False):
    """A piece of an image: the indices from `low` to `high` along x."""
    xml = VtkXml("appended", "ZLib")
    extent = f"{low} {high} 0 5 0 3"
    columns = high - low + 1
    count = columns * 24
    # Pieces agree where they overlap.
    heat = [float((low + i % columns + i // columns) % 7) for i in range(count)]
    data = "<PointData>" + xml.array("heat", heat)
    if ghost:
        data += xml.array("vtkGhostType", [i % columns == 0 for i in range(count)], 1, "UInt8")
    return xml.file("ImageData", f'WholeExtent="{extent}" Spacing="1 1 2"',
                    f'<Piece Extent="{extent}">\n{data}</PointData></Piece>\n')


def parallel(kind, attributes, pieces):
    """The header of a parallel file; pieces: (name, extent or "")."""
    inner = "".join(f'<Piece Source="{name}"' + (f' Extent="{extent}"' if extent else "") + "/>\n"
                    for name, extent in pieces)
    declared = ('<PDataArray type="Float32" Name="heat" NumberOfComponents="1"/>'
                '<PDataArray type="Float32" Name="wind" NumberOfComponents="3"/>')
    return VtkXml("ascii").file("P" + kind, attributes,
                                f"<PPointData>{declared}</PPointData>\n{inner}")


def multi_block(inner):
    return VtkXml("ascii").file("vtkMultiBlockDataSet", "", inner)


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
    halves = {"m0.vti": image_part(0, 4), "m1.vti": image_part(3, 7, True)}
    header = parallel("ImageData", 'WholeExtent="0 7 0 5 0 3" GhostLevel="1" Spacing="1 1 2"',
                      [("m0.vti", "0 4 0 5 0 3"), ("m1.vti", "3 7 0 5 0 3")])
    yield Seed("pvti", "two pieces", {"s.pvti": header} | halves)
    meshes = {f"m{i}.vtu": vtk_xml("vtu", coding) for i, coding in enumerate(("ascii", "appended"))}
    header = parallel("UnstructuredGrid", 'GhostLevel="0"', [(name, "") for name in meshes])
    yield Seed("pvtu", "two pieces", {"s.pvtu": header} | meshes)
    inner = ('<Block index="0" name="fluid"><DataSet index="0" name="a" file="m0.vti"/></Block>'
             '<DataSet index="1" file="m1.vti"/><DataSet index="2" name="b" file="m0.vtu"/>')
    yield Seed("vtm", "image and mesh", {"s.vtm": multi_block(inner)} | halves | meshes)
    for kind in ("STRUCTURED_POINTS", "RECTILINEAR_GRID", "STRUCTURED_GRID", "UNSTRUCTURED_GRID"):
        for binary in (False, True):
            yield Seed("vtk binary" if binary else "vtk ascii", kind.lower(),
                       {"f.vtk": vtk_legacy(kind, binary)})


def vtkhdf_seeds(folder):
    """Images with steps, and a mesh of two parts, written by netCDF4, whose groups and attributes
    are those of HDF5."""
    import netCDF4
    import numpy
    for name in ("image", "mesh"):
        path = folder / f"{name}.vtkhdf"
        with netCDF4.Dataset(path, "w") as file:
            group = file.createGroup("VTKHDF")
            group.Version = [2, 0]

            def put(path, kind, values, shape, file=file):
                dims = [f"d{n}" for n in shape]
                for dim, n in zip(dims, shape):
                    if dim not in file.dimensions:
                        file.createDimension(dim, n)
                file.createVariable("/VTKHDF/" + path, kind, dims)[:] = numpy.reshape(values, shape)
            if name == "image":
                group.Type = "ImageData"
                group.WholeExtent = [0, 7, 0, 5, 0, 3]
                group.Origin = [0.0, 0.0, 0.0]
                group.Spacing = [1.0, 1.0, 2.0]
                group.Direction = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
                put("PointData/heat", "f4", numbers(3) + numbers(3, 1), (2, *DIMS[::-1]))
                put("Steps/Values", "f8", [0.0, 0.5], (2,))
                group["Steps"].NSteps = 2
                put("Steps/PointDataOffsets/heat", "i8", [1, 0], (2,))
            else:
                group.Type = "UnstructuredGrid"
                cells = [p for cell in hexahedra() for p in cell]
                many = len(cells) // 8
                put("NumberOfPoints", "i8", [COUNT] * 2, (2,))
                put("NumberOfCells", "i8", [many] * 2, (2,))
                put("NumberOfConnectivityIds", "i8", [8 * many] * 2, (2,))
                put("Points", "f4", points_of_grid() * 2, (2 * COUNT, 3))
                put("Connectivity", "i8", cells * 2, (16 * many,))
                put("Offsets", "i8", list(range(0, 8 * many + 1, 8)) * 2, (2 * many + 2,))
                put("Types", "u1", [12] * (2 * many), (2 * many,))
                put("PointData/heat", "f4", numbers(3) * 2, (2 * COUNT,))
        yield Seed("hdf5", f"vtkhdf {name}", {"h.h5": path.read_bytes()})
