"""Small files with the headers of models on unstructured grids that must be refused: cells without
three corners, numbers of nodes beyond the last, and cells without outlines."""

import netCDF4
import numpy as np

from model_values import noise, put


def write_ugrid(path):
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    for name, size in {"nMesh2_node": 12, "nMesh2_face": 14, "Three": 3, "layer": 4}.items():
        file.createDimension(name, size)
    file.createVariable("Mesh2", "i4").setncatts(
        {"cf_role": "mesh_topology", "topology_dimension": np.int32(2),
         "node_coordinates": "Mesh2_node_x Mesh2_node_y",
         "face_node_connectivity": "Mesh2_face_nodes"})
    put(file, "Mesh2_face_nodes", ("nMesh2_face", "Three"), np.zeros((14, 3), np.int32),
        cf_role="face_node_connectivity", start_index=np.int32(0))
    put(file, "Mesh2_node_x", ("nMesh2_node",), noise(12), units="m")
    put(file, "Mesh2_node_y", ("nMesh2_node",), noise(12), units="m")
    for name in ("ucx", "ucy"):
        put(file, name, ("nMesh2_face", "layer"), noise(14, 4), units="m s-1", mesh="Mesh2",
            location="face")
    file.close()


def write_fvcom(path):
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    for name, size in {"node": 42, "nele": 50, "siglay": 5, "time": None, "three": 3}.items():
        file.createDimension(name, size)
    put(file, "time", ("time",), np.array([0.0]), units="days since 1858-11-17")
    for points, dim, count in (("", "node", 42), ("c", "nele", 50)):
        put(file, "lon" + points, (dim,), noise(count), units="degrees_east",
            standard_name="longitude")
        put(file, "lat" + points, (dim,), noise(count), units="degrees_north",
            standard_name="latitude")
    put(file, "nv", ("three", "nele"), np.tile(np.array([[1], [2], [43]], np.int32), (1, 50)))
    put(file, "u", ("time", "siglay", "nele"), noise(1, 5, 50), units="meters s-1")
    put(file, "v", ("time", "siglay", "nele"), noise(1, 5, 50), units="meters s-1")
    put(file, "temp", ("time", "siglay", "node"), noise(1, 5, 42), units="degrees_C")
    file.close()


def write_mpas(path):
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    for name, size in {"Time": None, "nCells": 40, "nVertLevels": 6}.items():
        file.createDimension(name, size)
    put(file, "lonCell", ("nCells",), noise(40, low=0, high=6).astype(float), units="rad")
    put(file, "latCell", ("nCells",), noise(40, low=-1, high=1).astype(float), units="rad")
    for name in ("uReconstructZonal", "uReconstructMeridional", "theta"):
        put(file, name, ("Time", "nCells", "nVertLevels"), noise(1, 40, 6), units="m s^{-1}")
    file.close()


def write_icon(path):
    file = netCDF4.Dataset(path, "w", format="NETCDF4")
    for name, size in {"time": None, "ncells": 40, "height": 6}.items():
        file.createDimension(name, size)
    put(file, "time", ("time",), np.array([0.0]), units="hours since 2020-01-01")
    put(file, "clon", ("ncells",), noise(40, low=-3, high=3).astype(float), units="radian",
        standard_name="longitude")
    put(file, "clat", ("ncells",), noise(40, low=-1, high=1).astype(float), units="radian",
        standard_name="latitude")
    put(file, "height", ("height",), np.arange(6.0), axis="Z")
    for name in ("u", "v"):
        put(file, name, ("time", "height", "ncells"), noise(1, 6, 40), units="m s-1",
            CDI_grid_type="unstructured", coordinates="clat clon")
    file.close()
