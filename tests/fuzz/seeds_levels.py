"""Stores with levels (docs/design/bricks.md, "The store"), and such stores whose attribute, shapes,
shard indexes or shares lie."""
import json
import pathlib
import random
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "integration/levels"))
import stores  # noqa: E402

DIMS = (5, 6, 7)
CHAIN = [(0, 0, 0), (1, 1, 1), (1, 2, 2)]
MUTANTS = 150
LIES = (-1, 0, 1, 2, 3, 7, 8, 64, 1 << 20, 1 << 31, (1 << 32) + 1, 1 << 62, 1.5, 1e300, True, None,
        "", "0", "../0", "0/../1", "0/u", "statistics", "NaN", "two_values", "drawn", [], [1], {})


def level_store(folder):
    """The files of a store by name."""
    rng = np.random.default_rng(5)
    fields = {name: rng.normal(size=(2, *DIMS)).astype("f4") for name in ("cloud", "u", "v", "w")}
    fields["cloud"][1, 2:4, 1:3] = np.nan
    axes = [np.arange(n) + 0.03 * np.arange(n)**2 for n in DIMS]
    path = pathlib.Path(folder) / "levels.zarr"
    stores.write_store(path, fields, axes, 2, CHAIN, 1, uneven=True)
    return {f"s.zarr/{one.relative_to(path)}": one.read_bytes().replace(str(path).encode(), b"-")
            for one in sorted(path.rglob("*")) if one.is_file()}


def leaves(value, at=()):
    """Paths of all members without members."""
    inner = value.items() if isinstance(value, dict) else (
        enumerate(value) if isinstance(value, list) else ())
    found = [path for key, one in inner for path in leaves(one, (*at, key))]
    return found or [at]


def lied(document, dice, under):
    """The document with one of its members, below that path, replaced."""
    out = json.loads(json.dumps(document))
    part = out
    for key in under:
        part = part[key]
    path = dice.choice(leaves(part))
    path = path[:dice.randint(1, len(path))]
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] = dice.choice(LIES)
    return out


def mutant(files, number):
    dice = random.Random(number)
    out = dict(files)
    root = json.loads(files["s.zarr/zarr.json"])
    for _ in range(dice.randint(1, 2)):
        kind = dice.choice(("attribute", "attribute", "array", "bytes", "cut", "missing"))
        if kind in ("attribute", "array"):
            nodes = root["consolidated_metadata"]["metadata"]
            under = ("attributes", "windsplat") if kind == "attribute" else (
                "consolidated_metadata", "metadata", dice.choice(sorted(nodes)))
            try:
                root = lied(root, dice, under)
            except (KeyError, IndexError, TypeError):
                continue  # of what a lie has replaced
            out["s.zarr/zarr.json"] = json.dumps(root).encode()
            continue
        name = dice.choice([name for name in out if "/c/" in name])
        data = bytearray(out[name])
        if kind == "missing":
            del out[name]
        elif kind == "cut":
            out[name] = bytes(data[:dice.randrange(len(data) + 1)])
        elif data:  # the index is at the end
            for _ in range(dice.randint(1, 4)):
                data[-1 - dice.randrange(min(len(data), 24))] = dice.randrange(256)
            out[name] = bytes(data)
    return out


def level_seeds(folder):
    """Names and files of stores."""
    files = level_store(folder)
    yield "levels", files
    for number in range(MUTANTS):
        yield f"levels-{number}", mutant(files, number)
