"""Small files with the headers of models on unstructured meshes -> what a reader must find in them.
The lattice is the program's; everything on it is computed by brute force (mesh_values.py)."""

import netCDF4
import numpy as np

from mesh_values import Polygons, check_lattice
from model_values import as_masked, between, noise, put
from real_files import Independent


def triangles(nx, ny):
    """Two triangles for each cell of an index grid, without those of a hole."""
    out = []
    for j in range(ny - 1):
        for i in range(nx - 1):
            a = j * nx + i
            if not (nx // 3 <= i <= nx // 3 + 1 and ny // 3 <= j <= ny // 3 + 1):
                out += [[a, a + 1, a + nx + 1], [a, a + nx + 1, a + nx]]
    return out


def scattered(nx, ny, x, y, moved):
    """Positions of an index grid over [x0, x1], [y0, y1], each moved by a share of a cell."""
    i, j = np.meshgrid(np.arange(nx) / (nx - 1), np.arange(ny) / (ny - 1))
    i = i + noise(ny, nx, low=-moved, high=moved) / (nx - 1)
    j = j + noise(ny, nx, low=-moved, high=moved) / (ny - 1)
    return ((x[0] + (x[1] - x[0]) * i).ravel().astype(float),
            (y[0] + (y[1] - y[0]) * j).ravel().astype(float))


def turned(longitudes):
    return (np.asarray(longitudes) + 180) % 360 - 180


def on_mesh(polygons, z, cells=None, nodes=None, vectors=None, units=None):
    """A reader's result for fields (step, level, cell or node)."""
    def read(_, inspected):
        xs, ys = (np.array(inspected["axes"][a]["coordinates"]) for a in "xy")
        check_lattice(xs, ys, polygons)
        fields = {n: polygons.on_lattice(xs, ys, cells=v) for n, v in (cells or {}).items()}
        fields |= {n: polygons.on_lattice(xs, ys, nodes=v) for n, v in (nodes or {}).items()}
        axes = {"x": xs, "y": ys,
                "z": np.nanmean(fields["height"][0], axis=(1, 2)) if z is None else z}
        return Independent(axes, as_masked(fields), vectors or {}, units)
    return read


def write_ugrid(path):
    """D-Flow FM: triangles, quadrilaterals and a hexagon with padding, numbers from 1, layers last;
    across the date line."""
    nx, ny, nz = 12, 10, 4
    x, y = scattered(nx, ny, (174, 186), (-45, -35), 0.15)
    cells = triangles(nx, ny)
    cells[0:2] = [[0, 1, nx + 1, nx]]
    a = (ny - 2) * nx + nx - 3
    cells[-4:] = [[a, a + 1, a + 2, a + nx + 2, a + nx + 1, a + nx]]
    table = np.full((len(cells), 6), -1, np.int32)
    for n, cell in enumerate(cells):
        table[n, :len(cell)] = np.array(cell) + 1
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    sizes = {"time": None, "mesh2d_nNodes": nx * ny, "mesh2d_nFaces": len(cells),
             "mesh2d_nMax_face_nodes": 6, "mesh2d_nEdges": 30, "mesh2d_nLayers": nz, "Two": 2}
    for name, size in sizes.items():
        file.createDimension(name, size)
    put(file, "time", ("time",), np.array([0.0, 600.0]), units="seconds since 2001-01-01")
    file.createVariable("mesh2d", "i4").setncatts(
        {"cf_role": "mesh_topology", "topology_dimension": np.int32(2),
         "node_coordinates": "mesh2d_node_x mesh2d_node_y",
         "face_node_connectivity": "mesh2d_face_nodes", "face_dimension": "mesh2d_nFaces",
         "edge_node_connectivity": "mesh2d_edge_nodes", "edge_dimension": "mesh2d_nEdges"})
    put(file, "mesh2d_face_nodes", ("mesh2d_nFaces", "mesh2d_nMax_face_nodes"), table,
        fill=np.int32(-1), cf_role="face_node_connectivity", start_index=np.int32(1))
    put(file, "mesh2d_edge_nodes", ("mesh2d_nEdges", "Two"), np.ones((30, 2), np.int32),
        cf_role="edge_node_connectivity", start_index=np.int32(1))
    put(file, "mesh2d_node_x", ("mesh2d_nNodes",), turned(x), units="degrees_east",
        standard_name="longitude")
    put(file, "mesh2d_node_y", ("mesh2d_nNodes",), y, units="degrees_north",
        standard_name="latitude")
    z = put(file, "mesh2d_nLayers", ("mesh2d_nLayers",), np.array([-40.0, -20.0, -10.0, -2.0]),
            units="m", positive="up", standard_name="altitude")
    at_faces = ("time", "mesh2d_nFaces", "mesh2d_nLayers")
    beside = dict(units="m s-1", mesh="mesh2d", location="face")
    u = put(file, "mesh2d_ucx", at_faces, noise(2, len(cells), nz), fill=np.float32(-999),
            standard_name="sea_water_x_velocity", **beside)
    v = put(file, "mesh2d_ucy", at_faces, noise(2, len(cells), nz), fill=np.float32(-999),
            standard_name="sea_water_y_velocity", **beside)
    salt = noise(2, len(cells), nz, low=0, high=35)
    salt[1, 20:30, 0] = -999
    put(file, "mesh2d_sa1", at_faces, salt, fill=np.float32(-999), units="1e-3", mesh="mesh2d",
        location="face")
    put(file, "mesh2d_u1", ("time", "mesh2d_nEdges", "mesh2d_nLayers"), noise(2, 30, nz),
        units="m s-1", mesh="mesh2d", location="edge")
    k = put(file, "turkin", ("time", "mesh2d_nLayers", "mesh2d_nNodes"), noise(2, nz, nx * ny),
            units="m2 s-2", mesh="mesh2d", location="node")
    file.close()
    layered = lambda values: np.moveaxis(np.where(values == -999, np.nan, values), 2, 1)
    return on_mesh(Polygons(cells, x, y), z,
                   {"mesh2d_ucx": layered(u), "mesh2d_ucy": layered(v),
                    "mesh2d_sa1": layered(salt)}, {"turkin": k},
                   {"current": ["mesh2d_ucx", "mesh2d_ucy"]},
                   {"mesh2d_ucx": "m s-1", "mesh2d_ucy": "m s-1", "mesh2d_sa1": "1e-3",
                    "turkin": "m2 s-2", "x": "degrees_east", "y": "degrees_north", "z": "m"})


def write_ugrid_plane(path):
    """Nodes in metres, table of corners turned, numbers from 0, packed values."""
    nx, ny = 9, 8
    x, y = scattered(nx, ny, (5e5, 5.4e5), (4e6, 4.02e6), 0.2)
    cells = triangles(nx, ny)
    file = netCDF4.Dataset(path, "w", format="NETCDF3_CLASSIC")
    for name, size in {"node": nx * ny, "face": len(cells), "Three": 3, "layer": 3}.items():
        file.createDimension(name, size)
    file.createVariable("Mesh2", "i4").setncatts(
        {"cf_role": "mesh_topology", "topology_dimension": np.int32(2),
         "node_coordinates": "node_x node_y", "face_node_connectivity": "corners",
         "face_dimension": "face"})
    put(file, "corners", ("Three", "face"), np.array(cells, np.int32).T,
        cf_role="face_node_connectivity")
    put(file, "node_x", ("node",), x, units="m", standard_name="projection_x_coordinate")
    put(file, "node_y", ("node",), y, units="m", standard_name="projection_y_coordinate")
    z = put(file, "layer", ("layer",), np.array([1.0, 2.0, 4.0]), units="m", positive="up")
    stored = np.round(noise(3, nx * ny, low=-3000, high=3000)).astype(np.int16)
    stored[1, 11] = -32768
    variable = file.createVariable("t", "i2", ("layer", "node"), fill_value=np.int16(-32768))
    variable.setncatts({"scale_factor": 0.01, "add_offset": 280.0, "units": "K", "mesh": "Mesh2",
                        "location": "node"})
    variable.set_auto_maskandscale(False)
    variable[:] = stored
    file.close()
    t = np.where(stored == -32768, np.nan, stored * 0.01 + 280)[None]
    return on_mesh(Polygons(cells, x, y, wraps=False), z, None, {"t": t}, None,
                   {"t": "K", "x": "m", "y": "m", "z": "m"})


def write_fvcom(path):
    nx, ny, nz, nt = 10, 9, 5, 2
    x, y = scattered(nx, ny, (-70, -68), (42, 43.5), 0.2)
    cells = triangles(nx, ny)
    file = netCDF4.Dataset(path, "w", format="NETCDF3_64BIT_OFFSET")
    for name, size in {"node": nx * ny, "nele": len(cells), "siglay": nz, "siglev": nz + 1,
                       "three": 3, "four": 4, "time": None}.items():
        file.createDimension(name, size)
    put(file, "time", ("time",), 58849 + np.arange(nt) / 24, units="days since 1858-11-17 00:00:00",
        time_zone="UTC")
    polygons = Polygons(cells, x, y)
    centers = np.array([polygons.centroid(c) for c in range(len(cells))]).T
    for points, dim, (lon, lat) in (("", "node", (x, y)), ("c", "nele", centers)):
        put(file, "lon" + points, (dim,), lon, units="degrees_east", standard_name="longitude")
        put(file, "lat" + points, (dim,), lat, units="degrees_north", standard_name="latitude")
        put(file, "x" + points, (dim,), 0 * lon, units="meters")
        put(file, "y" + points, (dim,), 0 * lat, units="meters")
    put(file, "nv", ("three", "nele"), np.array(cells, np.int32).T[::-1] + 1)  # clockwise
    put(file, "nbe", ("three", "nele"), np.zeros((3, len(cells)), np.int32))
    put(file, "a1u", ("four", "nele"), noise(4, len(cells)))
    sigma = -(np.arange(nz)[:, None] + 0.5) / nz * (1 + 0 * x) + 0.02 * np.sin(x)
    put(file, "siglay", ("siglay", "node"), sigma, standard_name="ocean_sigma_coordinate",
        positive="up", valid_min=-1.0, valid_max=0.0,
        formula_terms="sigma: siglay eta: zeta depth: h")
    put(file, "siglev", ("siglev", "node"), -np.arange(nz + 1)[:, None] / nz * (1 + 0 * x),
        standard_name="ocean_sigma_coordinate", positive="up")
    h = put(file, "h", ("node",), noise(nx * ny, low=20, high=90), units="m", positive="down")
    zeta = put(file, "zeta", ("time", "node"), noise(nt, nx * ny, low=-1, high=1), units="meters")
    at_cells = ("time", "siglay", "nele")
    parts = {n: put(file, n, at_cells, noise(nt, nz, len(cells)), units="meters s-1", **names)
             for n, names in (("u", {"standard_name": "eastward_sea_water_velocity"}),
                              ("v", {"standard_name": "Northward_sea_water_velocity"}),
                              ("ww", {}))}
    temp = put(file, "temp", ("time", "siglay", "node"), noise(nt, nz, nx * ny), units="degrees_C",
               standard_name="sea_water_temperature")
    file.close()
    height = zeta[:, None] + sigma.astype(np.float32) * (h + zeta[:, None])
    read = on_mesh(polygons, None, parts, {"temp": temp, "height": height},
                   {"current": ["u", "v", "ww"]},
                   {"u": "meters s-1", "v": "meters s-1", "ww": "meters s-1",
                    "temp": "degrees_C", "height": "m", "x": "degrees_east",
                    "y": "degrees_north", "z": "m"})
    return read


def hexagons(nx, ny, x, y):
    """The dual of an even triangulation: hexagons, and pentagons at the rim of every other row."""
    at = {}
    def node(i, j):
        return at.setdefault((i, j), len(at))
    cells = []
    for j in range(ny):
        for i in range(nx):
            left = 2 * i + j % 2
            cells.append([node(left, j), node(left + 1, j), node(left + 2, j),
                          node(left + 2, j + 1), node(left + 1, j + 1), node(left, j + 1)])
    i, j = np.array(list(at)).T
    raised = np.where((i + j) % 2 == 0, 0.17, -0.17)
    return (cells, x[0] + (x[1] - x[0]) * i / (2 * nx + 1),
            y[0] + (y[1] - y[0]) * (j + raised + 0.2) / (ny + 0.4))


def write_mpas(path):
    """Hexagons on a part of the globe; radians without units; padding of numbers beyond the count;
    faces of layers in nVertLevelsP1."""
    nz = 6
    cells, x, y = hexagons(9, 8, (350, 380), (30, 55))
    cells[4] = cells[4][:5]  # a pentagon
    file = netCDF4.Dataset(path, "w", format="NETCDF3_64BIT_OFFSET")
    for name, size in {"Time": None, "nCells": len(cells), "nVertices": len(x), "nVertLevels": nz,
                       "nVertLevelsP1": nz + 1, "maxEdges": 7, "nEdges": 77}.items():
        file.createDimension(name, size)
    table = np.full((len(cells), 7), 10 ** 6, np.int32)  # MPAS leaves anything beyond the count
    for n, cell in enumerate(cells):
        table[n, :len(cell)] = np.array(cell) + 1
    polygons = Polygons(cells, x, y)
    centers = np.array([polygons.centroid(c) for c in range(len(cells))]).T
    put(file, "nEdgesOnCell", ("nCells",), np.array([len(c) for c in cells], np.int32))
    put(file, "verticesOnCell", ("nCells", "maxEdges"), table)
    put(file, "cellsOnCell", ("nCells", "maxEdges"), 0 * table)
    for name, (lon, lat), dim in (("Vertex", (x, y), "nVertices"), ("Cell", centers, "nCells")):
        put(file, "lon" + name, (dim,), np.radians(lon % 360))
        put(file, "lat" + name, (dim,), np.radians(lat))
    levels = np.arange(nz + 1) * 1000 + noise(len(cells), 1, low=0, high=300)
    zgrid = put(file, "zgrid", ("nCells", "nVertLevelsP1"), levels.astype(float), units="m")
    at_cells = ("Time", "nCells", "nVertLevels")
    u = put(file, "uReconstructZonal", at_cells, noise(2, len(cells), nz), units="m s^{-1}")
    v = put(file, "uReconstructMeridional", at_cells, noise(2, len(cells), nz), units="m s^{-1}")
    w = put(file, "w", ("Time", "nCells", "nVertLevelsP1"), noise(2, len(cells), nz + 1),
            units="m s^{-1}")
    put(file, "u", ("Time", "nEdges", "nVertLevels"), noise(2, 77, nz), units="m s^{-1}")
    theta = put(file, "theta", at_cells, noise(2, len(cells), nz, low=280, high=400), units="K")
    vorticity = put(file, "vorticity", ("Time", "nVertices", "nVertLevels"),
                    noise(2, len(x), nz), units="s^{-1}")
    file.close()
    layered = lambda values: np.moveaxis(np.asarray(values, float), -1, -2)
    height = layered(between(zgrid, 1))[None]
    fields = {"uReconstructZonal": layered(u), "uReconstructMeridional": layered(v),
              "w": layered(between(w, 2)), "theta": layered(theta),
              "zgrid": np.repeat(height, 2, 0)}
    def read(path, inspected):
        fields_on = on_mesh(polygons, np.zeros(nz), fields, {"vorticity": layered(vorticity)},
                            {"wind": ["uReconstructZonal", "uReconstructMeridional", "w"]},
                            {"uReconstructZonal": "m s-1", "uReconstructMeridional": "m s-1",
                             "w": "m s-1", "theta": "K", "vorticity": "s^{-1}", "zgrid": "m",
                             "x": "degrees_east", "y": "degrees_north", "z": "m"})(path, inspected)
        means = fields_on.scalars["zgrid"][0].mean(axis=(1, 2))
        return Independent(fields_on.axes | {"z": np.asarray(means)}, fields_on.scalars,
                           fields_on.vectors, fields_on.units)
    return read


def in_space(lon, lat):
    """Unit vectors of a position, of east and of north there."""
    lon, lat = np.radians(lon), np.radians(lat)
    return (np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]),
            np.array([-np.sin(lon), np.cos(lon), 0 * lon]),
            np.array([-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)]))


def write_mpas_edges(path):
    """MPAS with normal winds and a scalar on the edges, which have nodes and angles in any order,
    and without vectors at the cells."""
    nz = 4
    cells, x, y = hexagons(9, 8, (350, 380), (30, 55))
    polygons = Polygons(cells, x, y)
    sides = [list(zip(c, c[1:] + c[:1])) for c in cells]
    nodes = sorted({(min(s), max(s)) for cell in sides for s in cell}, key=lambda s: s[1] % 7)
    edge_of = {s: e for e, s in enumerate(nodes)}
    ends = np.array(nodes)
    middles = sum(in_space(x[n], y[n])[0] for n in ends.T)
    middles /= np.linalg.norm(middles, axis=0)
    lon = np.degrees(np.arctan2(middles[1], middles[0]))
    east, north = in_space(lon, np.degrees(np.arcsin(middles[2])))[1:]
    angle = noise(len(nodes), low=0, high=6.28).astype(float)  # the model's, whatever the outlines
    normals = east * np.cos(angle) + north * np.sin(angle)
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    for name, size in {"Time": None, "nCells": len(cells), "nVertices": len(x), "nVertLevels": nz,
                       "maxEdges": 6, "nEdges": len(nodes), "TWO": 2}.items():
        file.createDimension(name, size)
    put(file, "nEdgesOnCell", ("nCells",), np.full(len(cells), 6, np.int32))
    put(file, "verticesOnCell", ("nCells", "maxEdges"), np.array(cells, np.int32) + 1)
    put(file, "verticesOnEdge", ("nEdges", "TWO"), ends.astype(np.int32) + 1)
    put(file, "angleEdge", ("nEdges",), angle, long_name="angle of the normal from the east")
    put(file, "lonVertex", ("nVertices",), np.radians(x % 360))
    put(file, "latVertex", ("nVertices",), np.radians(y))
    dims = ("Time", "nEdges", "nVertLevels")
    u = put(file, "u", dims, noise(2, len(nodes), nz), units="m s^{-1}")
    rho = put(file, "rho_edge", dims, noise(2, len(nodes), nz), units="kg m^{-3}")
    file.close()
    vectors = np.zeros((2, 2, nz, len(cells)))  # component, step, level, cell
    means = np.zeros((2, nz, len(cells)))
    for cell, own in enumerate(sides):
        center = polygons.centroid(cell)
        edges = [edge_of[min(s), max(s)] for s in own]
        a = np.array([[polygons.near(x[i], center[0]) - center[0], y[i] - center[1]]
                      for i in cells[cell]])
        b = np.roll(a, -1, axis=0)
        weights = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        axes = np.array(in_space(*center)[1:])
        rows = np.sqrt(weights)[:, None] * (axes @ normals[:, edges]).T
        for t in range(2):
            right = np.sqrt(weights)[:, None] * u[t, edges]
            vectors[:, t, :, cell] = np.linalg.lstsq(rows, right, rcond=None)[0]
            means[t, :, cell] = weights @ rho[t, edges] / weights.sum()
    fields = {"u_eastward": vectors[0], "u_northward": vectors[1], "rho_edge": means}
    return on_mesh(polygons, np.arange(nz), fields, None, {"wind": ["u_eastward", "u_northward"]},
                   {"u_eastward": "m s-1", "u_northward": "m s-1", "rho_edge": "kg m^{-3}",
                    "x": "degrees_east", "y": "degrees_north"})


def write_icon(path):
    """Triangles by clon_vertices in radians, on pressure levels from the top."""
    nx, ny, nz = 11, 9, 4
    x, y = scattered(nx, ny, (-3, 12), (44, 52), 0.15)
    cells = triangles(nx, ny)
    polygons = Polygons(cells, x, y)
    centers = np.array([polygons.centroid(c) for c in range(len(cells))]).T
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    for name, size in {"time": None, "ncells": len(cells), "vertices": 3, "plev": nz}.items():
        file.createDimension(name, size)
    put(file, "time", ("time",), np.array([0.0]), units="hours since 2020-01-01")
    for name, at, values, standard in (("clon", x, centers[0], "longitude"),
                                       ("clat", y, centers[1], "latitude")):
        put(file, name, ("ncells",), np.radians(values), units="radian", standard_name=standard,
            bounds=name + "_vertices")
        put(file, name + "_vertices", ("ncells", "vertices"), np.radians(at)[np.array(cells)],
            units="radian")
    z = put(file, "plev", ("plev",), np.array([20000.0, 50000.0, 70000.0, 85000.0]), units="Pa",
            positive="down", standard_name="air_pressure", axis="Z")
    parts = {n: put(file, n, ("time", "plev", "ncells"), noise(1, nz, len(cells)),
                    units="m s-1", standard_name=s, CDI_grid_type="unstructured",
                    coordinates="clat clon")
             for n, s in (("u", "eastward_wind"), ("v", "northward_wind"))}
    file.close()
    return on_mesh(polygons, z, parts, None, {"wind": ["u", "v"]},
                   {"u": "m s-1", "v": "m s-1", "x": "degrees_east", "y": "degrees_north",
                    "z": "Pa"})


def write_cam(path):
    """CAM-SE: columns in the data, corners in a SCRIP file with a last corner repeated as padding.
    path: '{scrip,cam}.nc'."""
    nz = 3
    cells, x, y = hexagons(8, 7, (20, 50), (-20, 5))
    polygons = Polygons(cells, x, y)
    centers = np.array([polygons.centroid(c) for c in range(len(cells))]).T
    grid = netCDF4.Dataset(path.with_name("scrip.nc"), "w", format="NETCDF3_CLASSIC")
    for name, size in {"grid_size": len(cells), "grid_corners": 8, "grid_rank": 1}.items():
        grid.createDimension(name, size)
    padded = np.array([c + [c[-1]] * (8 - len(c)) for c in cells])
    put(grid, "grid_dims", ("grid_rank",), np.array([len(cells)], np.int32))
    for name, at, values in (("lon", x, centers[0]), ("lat", y, centers[1])):
        put(grid, "grid_center_" + name, ("grid_size",), values, units="degrees")
        put(grid, "grid_corner_" + name, ("grid_size", "grid_corners"), at[padded],
            units="degrees")
    grid.close()
    file = netCDF4.Dataset(path.with_name("cam.nc"), "w", format="NETCDF4")
    for name, size in {"time": None, "ncol": len(cells), "lev": nz}.items():
        file.createDimension(name, size)
    put(file, "time", ("time",), np.array([0.0, 1.0]), units="days since 2000-01-01")
    put(file, "lon", ("ncol",), centers[0], units="degrees_east")
    put(file, "lat", ("ncol",), centers[1], units="degrees_north")
    z = put(file, "lev", ("lev",), np.array([200.0, 500.0, 900.0]), units="hPa", positive="down",
            standard_name="air_pressure")
    t = put(file, "T", ("time", "lev", "ncol"), noise(2, nz, len(cells), low=200, high=300),
            units="K")
    file.close()
    return on_mesh(polygons, z, {"T": t}, None, None,
                   {"T": "K", "x": "degrees_east", "y": "degrees_north", "z": "hPa"})


def write_fesom(path):
    """FESOM 2: triangles in the file of the mesh, temperature at nodes, velocity at cells.
    path: '{fesom.mesh.diag,uvt.fesom.1958}.nc'."""
    nx, ny, nz = 9, 10, 4
    x, y = scattered(nx, ny, (165, 195), (60, 75), 0.15)
    cells = triangles(nx, ny)
    grid = netCDF4.Dataset(path.with_name("fesom.mesh.diag.nc"), "w", format="NETCDF4")
    for name, size in {"nod2": nx * ny, "elem": len(cells), "n3": 3}.items():
        grid.createDimension(name, size)
    put(grid, "lon", ("nod2",), turned(x), units="degrees")
    put(grid, "lat", ("nod2",), y, units="degrees")
    put(grid, "elements", ("n3", "elem"), np.array(cells, np.int32).T + 1)
    grid.close()
    file = netCDF4.Dataset(path.with_name("uvt.fesom.1958.nc"), "w", format="NETCDF4")
    for name, size in {"time": None, "nod2": nx * ny, "elem": len(cells), "nz1": nz}.items():
        file.createDimension(name, size)
    put(file, "time", ("time",), np.array([0.0]), units="days since 1958-01-01")
    z = put(file, "nz1", ("nz1",), np.array([2.5, 7.5, 15.0, 30.0]), units="m", positive="down",
            standard_name="depth")
    parts = {n: put(file, n, ("time", "nz1", "elem"), noise(1, nz, len(cells)), units="m/s")
             for n in ("u", "v")}
    temp = put(file, "temp", ("time", "nz1", "nod2"), noise(1, nz, nx * ny), units="C")
    file.close()
    return on_mesh(Polygons(cells, x, y), z, parts, {"temp": temp}, {"current": ["u", "v"]},
                   {"u": "m/s", "v": "m/s", "temp": "C", "x": "degrees_east",
                    "y": "degrees_north", "z": "m"})
