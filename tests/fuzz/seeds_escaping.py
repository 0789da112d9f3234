"""Seeds that try to lead a reader out of the data root, and the outside files that they name."""

import zlib

import hdf5_bytes
import seeds
import seeds_vtk
from seed_numbers import COUNT, DIMS, Seed, as_text, floats, numbers

MARK_NUMBER = 31337.25  # a value in the files outside; exactly representable in 32 bits
MARK_TEXT = "5ENTINEL"


def write_outside(folder):
    """Files that must not be opened, each in the format that the seeds below require."""
    folder.mkdir()
    mark = [MARK_NUMBER] * (3 * COUNT)
    (folder / "mark.raw").write_bytes(floats(mark) * 2)
    (folder / "mark.txt").write_text(MARK_TEXT + "\n")
    (folder / "mark.vti").write_bytes(VtkXmlMark().file_of_marks())
    (folder / "mark.dx").write_text(seeds.DX_GRID + seeds.DX_ARRAY + "data follows\n"
                                    + as_text(mark) + seeds.DX_FIELD)
    file = hdf5_bytes.File()
    for name in "uvw":
        file.add(name, DIMS[::-1], floats(mark[:COUNT]))
    (folder / "mark.h5").write_bytes(file.bytes())
    chunk = zlib.compress(floats(mark[:96]))
    (folder / "0.0.0.0").write_bytes(chunk)


class VtkXmlMark(seeds_vtk.VtkXml):
    def __init__(self):
        super().__init__("ascii")

    def file_of_marks(self):
        data = self.array("wind", [MARK_NUMBER] * (3 * COUNT), 3)
        return self.file("ImageData",
                         'WholeExtent="0 7 0 5 0 3" Origin="0 0 0" Spacing="1 1 2"',
                         f'<Piece Extent="0 7 0 5 0 3">\n<PointData>\n{data}</PointData></Piece>\n')


def escape_seeds(outside):
    """Each refers to its target by a relative path, an absolute path and a link."""
    vti = seeds_vtk.vtk_xml("vti", "ascii")
    for how, away in (("relative", "../../" + outside.name), ("absolute", str(outside)),
                      ("doubled", "./..//../" + outside.name), ("link", None)):
        def to(name, away=away):
            return f"{away}/{name}" if away else f"link_{name}"

        def seed(kind, name, files, target, how=how, away=away):
            links = {} if away else {f"link_{target}": f"../../{outside.name}/{target}"}
            return Seed(kind, f"{name}, {how}", files, links, escapes=True)
        yield seed("nrrd", "data file", {"a.nhdr": seeds.nrrd_header(
            "raw", f"data file: {to('mark.raw')}\n")}, "mark.raw")
        yield seed("nrrd", "not detached", {"a.nrrd": seeds.nrrd_header(
            "raw", f"data file: {to('mark.raw')}\n")}, "mark.raw")
        yield seed("raw+json", "file", {"s.json": seeds.raw_document(
            file=to("mark.raw"), steps={"count": 1}).encode()}, "mark.raw")
        yield seed("grads", "dset", {"g.ctl": seeds.GRADS.replace("^", "").format(
            file=to("mark.raw"), options="little_endian").encode()}, "mark.raw")
        yield seed("opendx", "data file", {"d.dx": (
            seeds.DX_GRID + seeds.DX_ARRAY + f'lsb ieee data file "{to("mark.raw")}",0\n'
            + seeds.DX_FIELD).encode()}, "mark.raw")
        yield seed("opendx", "object", {"d.dx": (
            seeds.DX_GRID + 'object "wind" class field\ncomponent "positions" value 1\ncomponent '
            f'"connections" value 2\ncomponent "data" file "{to("mark.dx")}",3\nend\n'
            ).encode()}, "mark.dx")
        members = seeds_vtk.pvd(["m0.vti", to("mark.vti")])
        yield seed("pvd", "member", {"s.pvd": members, "m0.vti": vti}, "mark.vti")
        header = seeds_vtk.parallel("ImageData", 'WholeExtent="0 7 0 5 0 3" Spacing="1 1 2"',
                                    [(to("mark.vti"), "0 7 0 5 0 3")])
        yield seed("pvti", "piece", {"s.pvti": header}, "mark.vti")
        block = seeds_vtk.multi_block(f'<DataSet index="0" name="a" file="{to("mark.vti")}"/>')
        yield seed("vtm", "block", {"s.vtm": block}, "mark.vti")
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
    """The file, its folder, or a part of it is a link."""
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
    yield Seed("vti", "dots", {"f.vti": seeds_vtk.vtk_xml("vti", "ascii")}, path=f"{away}/mark.vti",
               escapes=True)
    for kind in ("mark.raw", "mark.h5"):
        inside = seeds.zarr_files("zlib")
        del inside["s.zarr/u/0.1.0.0"]
        yield Seed("zarr", f"chunk is a link to {kind}", inside,
                   {"s.zarr/u/0.1.0.0": f"../../{away}/{kind}"}, "s.zarr", True)
    whole = {name: data for name, data in seeds.zarr_files("zlib").items() if "/u/0." not in name}
    yield Seed("zarr", "chunks are links", whole, {
        "s.zarr/u/0.0.0.0": f"../../{away}/0.0.0.0",
        "s.zarr/u/0.1.0.0": str(outside / "0.0.0.0")}, "s.zarr", True)
