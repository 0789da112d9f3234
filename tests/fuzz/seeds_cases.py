"""Small cases of OpenFOAM and EnSight Gold, which windsplat-vtk reads."""

import struct

from seed_numbers import COUNT, DIMS, Seed, numbers

NX, NY, NZ = DIMS


def point(x, y, z):
    return x + NX * (y + NY * z)


def cell(x, y, z):
    return x + (NX - 1) * (y + (NY - 1) * z)


POINTS = [(float(x), float(y), float(z)) for z in range(NZ) for y in range(NY) for x in range(NX)]
CELLS = [(x, y, z) for z in range(NZ - 1) for y in range(NY - 1) for x in range(NX - 1)]
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
# The upper face along each axis, counter-clockwise from outside; reversed, shifted it is the lower.
FACES = [(1, 2, 6, 5), (3, 7, 6, 2), (4, 5, 6, 7)]


def faces():
    """(points, owner, neighbour or None) of all faces, internal ones first."""
    inner, outer = [], []
    for at in CELLS:
        for axis, corners in enumerate(FACES):
            other = list(at)
            other[axis] += 1
            upper = [point(*(a + d for a, d in zip(at, CORNERS[c]))) for c in corners]
            has_other = other[axis] < DIMS[axis] - 1
            (inner if has_other else outer).append(
                (upper, cell(*at), cell(*other) if has_other else None))
            if at[axis] == 0:
                step = (1, NX, NX * NY)[axis]
                outer.append(([p - step for p in reversed(upper)], cell(*at), None))
    return inner + outer


def foam_file(name, kind, body, binary=False):
    head = (f"FoamFile\n{{\n version 2.0;\n format {'binary' if binary else 'ascii'};\n"
            f' arch "LSB;label=32;scalar=64";\n class {kind};\n object {name};\n}}\n')
    return head.encode() + body


def foam_list(values, form, binary, each=1):
    if binary:
        flat = [number for value in values for number in (value if each > 1 else [value])]
        return f"{len(values)}\n(".encode() + struct.pack(f"<{len(flat)}{form}", *flat) + b")\n"
    rows = [f"({' '.join(map(str, value))})" if each > 1 else str(value) for value in values]
    return f"{len(values)}\n(\n{chr(10).join(rows)}\n)\n".encode()


def foam_mesh(binary):
    all_faces = faces()
    inner = [face for face in all_faces if face[2] is not None]
    if binary:
        ends = [0]
        for corners, _, _ in all_faces:
            ends.append(ends[-1] + len(corners))
        listed = foam_list(ends, "i", True) + foam_list(
            [p for corners, _, _ in all_faces for p in corners], "i", True)
    else:
        rows = "\n".join(f"{len(c)}({' '.join(map(str, c))})" for c, _, _ in all_faces)
        listed = f"{len(all_faces)}\n(\n{rows}\n)\n".encode()
    walls = (f"1\n(\nwalls\n{{\n type wall;\n nFaces {len(all_faces) - len(inner)};\n"
             f" startFace {len(inner)};\n}}\n)\n").encode()
    parts = {
        "points": ("vectorField", foam_list(POINTS, "d", binary, 3)),
        "faces": ("faceCompactList" if binary else "faceList", listed),
        "owner": ("labelList", foam_list([face[1] for face in all_faces], "i", binary)),
        "neighbour": ("labelList", foam_list([face[2] for face in inner], "i", binary)),
        "boundary": ("polyBoundaryMesh", walls),
    }
    return {f"constant/polyMesh/{name}": foam_file(name, kind, body, binary)
            for name, (kind, body) in parts.items()}


def foam_field(name, components, binary):
    values = [numbers(c)[:len(CELLS)] for c in range(components)]
    kind = "scalar" if components == 1 else "vector"
    listed = foam_list(values[0] if components == 1 else list(zip(*values)), "d", binary,
                       components)
    body = (b"dimensions [0 1 -1 0 0 0 0];\ninternalField nonuniform List<" + kind.encode() +
            b"> \n" + listed + b";\nboundaryField\n{\nwalls { type zeroGradient; }\n}\n")
    return foam_file(name, f"vol{kind.capitalize()}Field", body, binary)


def foam_case(binary):
    control = foam_file("controlDict", "dictionary",
                        b"startTime 0;\nendTime 1;\ndeltaT 1;\nwriteInterval 1;\n")
    files = {"x.foam": b" ", "system/controlDict": control, **foam_mesh(binary)}
    for time in ("0", "0.5"):
        files[f"{time}/U"] = foam_field("U", 3, binary)
        files[f"{time}/p"] = foam_field("p", 1, binary)
    return files


def ensight_case(binary):
    def line(text):
        return text.encode().ljust(80) if binary else f"{text}\n".encode()

    def whole(*values):
        return (struct.pack(f"<{len(values)}i", *values) if binary
                else ("".join(f"{v:10d}" for v in values) + "\n").encode())

    def reals(values):
        return (struct.pack(f"<{len(values)}f", *values) if binary
                else "".join(f"{v:12.5e}\n" for v in values).encode())

    geometry = line("C Binary") if binary else b""
    geometry += line("one") + line("two") + line("node id off") + line("element id off")
    geometry += line("part") + whole(1) + line("all") + line("coordinates") + whole(COUNT)
    geometry += b"".join(reals([p[axis] for p in POINTS]) for axis in range(3))
    geometry += line("hexa8") + whole(len(CELLS))
    for at in CELLS:
        geometry += whole(*(1 + point(*(a + d for a, d in zip(at, corner))) for corner in CORNERS))

    def variable(components, place, count):
        return (line("text") + line("part") + whole(1) + line(place) +
                b"".join(reals(numbers(c)[:count]) for c in range(components)))

    text = ("FORMAT\ntype: ensight gold\n\nGEOMETRY\nmodel: x.geo\n\nVARIABLE\n"
            "scalar per element: h h.scl\nvector per node: v v.vec\n")
    return {"x.case": text.encode(), "x.geo": geometry,
            "h.scl": variable(1, "hexa8", len(CELLS)), "v.vec": variable(3, "coordinates", COUNT)}


def case_seeds():
    for binary in (False, True):
        coding = "binary" if binary else "ascii"
        yield Seed("openfoam", coding, foam_case(binary))
        yield Seed("ensight", coding, ensight_case(binary))
    for target in ("../../outside/secret.bin", "/etc/passwd"):
        files = foam_case(False)
        files["0/p"] = foam_file("p", "volScalarField", f'#include "{target}"\n'.encode())
        yield Seed("openfoam", f"include {target}", files, escapes=True)
        files = ensight_case(False)
        files["x.case"] = files["x.case"].replace(b"x.geo", target.encode())
        yield Seed("ensight", f"model {target}", files, escapes=True)
    linked = foam_case(False)
    del linked["0/p"]
    yield Seed("openfoam", "link", linked, links={"0/p": "/etc/passwd"}, escapes=True)
