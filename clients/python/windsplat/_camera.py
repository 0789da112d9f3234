"""Where the eye is for a view from a side: the distance at which a box fits the picture."""
from __future__ import annotations

import math
from typing import Any, Mapping, Sequence

Vector = tuple[float, float, float]
ROOM = 1.04  # around the box, as a factor of the distance
GLOBE_RADIUS = 1.15  # of a sphere with a shell of usual thickness, world units


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b))


def orbit_frame(azimuth: float, elevation: float) -> tuple[Vector, Vector, Vector]:
    """Right, up and forward of an eye: azimuth 0 looks north (+y), 90 west, degrees."""
    a = math.radians(azimuth)
    e = math.radians(elevation)
    right = (math.cos(a), math.sin(a), 0.0)
    forward = (-math.sin(a) * math.cos(e), math.cos(a) * math.cos(e), -math.sin(e))
    up = (-math.sin(a) * math.sin(e), math.cos(a) * math.sin(e), math.cos(e))
    return right, up, forward


def _ends(axis: Mapping[str, Any], low: float, high: float, kept: Any) -> tuple[float, float]:
    """World coordinates of an axis's ends, of the range `kept` of its coordinates if there is
    one."""
    world = axis.get("world") or []
    if kept is None or not world:
        return low, high
    places = axis["coordinates"]
    a, b = float(kept[0]), float(kept[1])
    if axis.get("kind") == "longitude":
        inside = [w for c, w in zip(places, world) if (c - a) % 360 <= (b - a) % 360]
    else:
        inside = [w for c, w in zip(places, world) if min(a, b) <= c <= max(a, b)]
    return (min(inside), max(inside)) if inside else (low, high)


def box_of(dataset: Mapping[str, Any], view: Mapping[str, Any]) -> tuple[Vector, Vector]:
    """Lowest and highest corner of what a view shows, world units."""
    geometry = view.get("geometry", {})
    if geometry.get("mapping") == "sphere":
        r = GLOBE_RADIUS / math.sqrt(3)
        return (-r, -r, -r), (r, r, r)
    region = view.get("region", {})
    scale = geometry.get("scale", (1, 1, 1))
    world = dataset["world"]
    low, high = [], []
    for k, name in enumerate("xyz"):
        a, b = _ends(dataset["axes"].get(name, {}), world["min"][k], world["max"][k],
                     region.get(name))
        low.append(min(a, b) * scale[k])
        high.append(max(a, b) * scale[k])
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def looking(
    dataset: Mapping[str, Any], view: Mapping[str, Any], azimuth: float, elevation: float,
    zoom: float,
) -> dict[str, Any]:
    """The keys eye, target, up and height of a camera. Raises ValueError."""
    if not -90 <= elevation <= 90:
        raise ValueError(f"elevation must be -90 to 90 degrees, not {elevation:g}")
    if not 1e-3 <= zoom <= 1e3:
        raise ValueError(f"zoom must be 0.001 to 1000, not {zoom:g}")
    default = dataset["defaultView"]
    image = {**default["image"], **view.get("image", {})}
    fov_y = view.get("camera", {}).get("fovY") or default["camera"]["fovY"]
    tan_y = math.tan(math.radians(fov_y) / 2)
    tan_x = tan_y * image["width"] / image["height"]
    low, high = box_of(dataset, view)
    target = [(a + b) / 2 for a, b in zip(low, high)]
    right, up, forward = orbit_frame(azimuth, elevation)
    distance, half = 1e-3, 1e-3
    for corner in range(8):
        p = [(low, high)[corner >> k & 1][k] - target[k] for k in range(3)]
        across, above, behind = abs(_dot(p, right)), abs(_dot(p, up)), _dot(p, forward)
        # A point is in the picture if across <= (distance + behind) tan_x, and so above.
        distance = max(distance, across / tan_x - behind, above / tan_y - behind)
        half = max(half, above, across * tan_y / tan_x)
    distance *= ROOM / zoom
    steep = abs(elevation) > 89.9
    return {
        "eye": [t - distance * f for t, f in zip(target, forward)],
        "target": target,
        "up": list(up) if steep else [0.0, 0.0, 1.0],
        "height": 2 * half * ROOM / zoom,
    }
