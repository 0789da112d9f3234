"""Meshes in netCDF classic files, byte by byte (NetCDF Classic Format Specification)."""

import struct

INT, DOUBLE = 4, 6


def padded(data):
    return data + b"\0" * (-len(data) % 4)


def name_of(text):
    return struct.pack(">i", len(text)) + padded(text.encode())


def listed(tag, items):
    return struct.pack(">ii", tag if items else 0, len(items)) + b"".join(items)


def attributes(values):
    def one(name, value):
        if isinstance(value, str):
            return name_of(name) + struct.pack(">ii", 2, len(value)) + padded(value.encode())
        return name_of(name) + struct.pack(">iii", INT, 1, value)
    return listed(12, [one(*item) for item in values.items()])


def classic(dims, variables):
    """dims: name -> length. variables: (name, names of dimensions, type, values, attributes)."""
    order = list(dims)
    data = [struct.pack(f">{len(values)}{'i' if kind == INT else 'd'}", *values)
            for _, _, kind, values, _ in variables]
    def header(begins):
        rows = [name_of(name) + struct.pack(f">{1 + len(on)}i", len(on), *map(order.index, on))
                + attributes(more) + struct.pack(">iii", kind, len(bytes_), begin)
                for (name, on, kind, _, more), bytes_, begin in zip(variables, data, begins)]
        return (b"CDF\1" + struct.pack(">i", 0)
                + listed(10, [name_of(n) + struct.pack(">i", size) for n, size in dims.items()])
                + attributes({}) + listed(11, rows))
    begins, at = [], len(header([0] * len(data)))
    for part in data:
        begins.append(at)
        at += len(part)
    return header(begins) + b"".join(data)


# A square of 3 x 3 nodes across the date line: two quadrilaterals, four triangles.
X, Y = [179.0, 180.0, -179.0] * 3, [10.0] * 3 + [11.0] * 3 + [12.0] * 3
CELLS = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, -1], [3, 7, 6, -1], [4, 5, 8, -1], [4, 8, 7, -1]]
EAST, NORTH = {"units": "degrees_east"}, {"units": "degrees_north"}


def ugrid():
    return classic({"node": 9, "face": 6, "most": 4, "layer": 2}, [
        ("mesh", [], INT, [0], {"cf_role": "mesh_topology", "topology_dimension": 2,
                                "node_coordinates": "x y", "face_node_connectivity": "corners"}),
        ("x", ["node"], DOUBLE, X, EAST), ("y", ["node"], DOUBLE, Y, NORTH),
        ("corners", ["face", "most"], INT, sum(CELLS, []), {"_FillValue": -1, "start_index": 0}),
        ("u", ["layer", "face"], DOUBLE, range(12), {"units": "m s-1"}),
        ("v", ["face", "layer"], DOUBLE, range(12), {"units": "m s-1"}),
        ("t", ["layer", "node"], DOUBLE, range(18), {"units": "K"})])


def fvcom():
    cells = [[4, 5, 8], [4, 8, 7], [5, 6, 9], [5, 9, 8]]
    return classic({"node": 9, "nele": 4, "three": 3, "siglay": 2, "time": 1}, [
        ("lon", ["node"], DOUBLE, X, EAST), ("lat", ["node"], DOUBLE, Y, NORTH),
        ("nv", ["three", "nele"], INT, sum(map(list, zip(*cells)), []), {}),
        ("siglay", ["siglay", "node"], DOUBLE, [-0.25] * 9 + [-0.75] * 9, {}),
        ("h", ["node"], DOUBLE, range(10, 19), {}),
        ("zeta", ["time", "node"], DOUBLE, [1.0] * 9, {}),
        ("u", ["time", "siglay", "nele"], DOUBLE, range(8), {"units": "m s-1"}),
        ("v", ["time", "siglay", "nele"], DOUBLE, range(8), {"units": "m s-1"})])


def mpas():
    degrees = [sum(node >= 0 for node in cell) for cell in CELLS]
    radians = lambda values: [value * 0.017453292519943295 for value in values]
    return classic({"nVertices": 9, "nCells": 6, "maxEdges": 4, "nVertLevels": 2}, [
        ("lonVertex", ["nVertices"], DOUBLE, radians(X), {}),
        ("latVertex", ["nVertices"], DOUBLE, radians(Y), {}),
        ("nEdgesOnCell", ["nCells"], INT, degrees, {}),
        ("verticesOnCell", ["nCells", "maxEdges"], INT, [n + 1 for cell in CELLS for n in cell],
         {}),
        ("theta", ["nCells", "nVertLevels"], DOUBLE, range(12), {"units": "K"})])


def bounds():
    """Triangles and quadrilaterals by their corners; one has a corner on the pole."""
    cells = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 9, 9]]
    at = lambda values, last: [(values + [last])[n] for cell in cells for n in cell]
    return classic({"ncells": 3, "nv": 4, "lev": 2}, [
        ("lon", ["ncells"], DOUBLE, [179.5, -179.5, 179.5], {**EAST, "bounds": "lon_b"}),
        ("lat", ["ncells"], DOUBLE, [10.5, 10.5, 60.0], {**NORTH, "bounds": "lat_b"}),
        ("lon_b", ["ncells", "nv"], DOUBLE, at(X, 77.0), {}),
        ("lat_b", ["ncells", "nv"], DOUBLE, at(Y, 90.0), {}),
        ("t", ["lev", "ncells"], DOUBLE, range(6), {"units": "K"})])


def scattered(count):
    """Longitudes and latitudes of positions across the date line, none in a row with others."""
    return ([170 + 20 * (n * 0.6180339887 % 1) for n in range(count)],
            [50 + 15 * (n * 0.7548776662 % 1) for n in range(count)])


def positions():
    x, y = scattered(110)
    return classic({"ncol": 110, "lev": 2}, [
        ("lon", ["ncol"], DOUBLE, x, EAST), ("lat", ["ncol"], DOUBLE, y, NORTH),
        ("t", ["lev", "ncol"], DOUBLE, range(220), {"units": "K"})])


def mesh_files():
    return {"UGRID": ugrid(), "FVCOM": fvcom(), "MPAS": mpas(), "bounds": bounds(),
            "positions": positions()}
