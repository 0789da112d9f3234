"""Where the eye is for a view from a side: the distance at which a box fits the picture."""
from __future__ import annotations

import math
from typing import Any, Mapping, Sequence

Vector = tuple[float, float, float]
ROOM = 1.04  # around the box, as a factor of the distance
GLOBE_RADIUS = 1.15  # of a sphere with a shell of usual thickness, world units
TURN_STEP = 5.0  # degrees between the cameras of a turn that are framed


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b))


def _cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _unit(a: Sequence[float]) -> Vector:
    length = math.hypot(*a)
    return (a[0] / length, a[1] / length, a[2] / length)


def orbit_frame(azimuth: float, elevation: float) -> tuple[Vector, Vector, Vector]:
    """Right, up and forward of an eye: azimuth 0 looks north (+y), 90 west, degrees."""
    a = math.radians(azimuth)
    e = math.radians(elevation)
    right = (math.cos(a), math.sin(a), 0.0)
    forward = (-math.sin(a) * math.cos(e), math.cos(a) * math.cos(e), -math.sin(e))
    up = (-math.sin(a) * math.sin(e), math.cos(a) * math.sin(e), math.cos(e))
    return right, up, forward


def turned(place: Sequence[float], centre: Sequence[float], angle: float) -> list[float]:
    """A place turned about the vertical axis through a centre, radians."""
    c, s = math.cos(angle), math.sin(angle)
    x, y = place[0] - centre[0], place[1] - centre[1]
    return [centre[0] + c * x - s * y, centre[1] + s * x + c * y, place[2]]


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
        r = GLOBE_RADIUS
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


def corners_of(
    dataset: Mapping[str, Any], view: Mapping[str, Any]
) -> tuple[list[list[float]], list[float]]:
    """The corners of the box that a view shows, from its centre; and the centre."""
    low, high = box_of(dataset, view)
    centre = [(a + b) / 2 for a, b in zip(low, high)]
    return [[(low, high)[corner >> k & 1][k] - centre[k] for k in range(3)]
            for corner in range(8)], centre


def _distance(points: Sequence[tuple[float, float]], tangent: float) -> float:
    """The least distance at which points (a, f), a along an axis of the picture and f forward, fit.

    A point is in the picture of a target shifted by c if |a - c| <= (distance + f) tangent. With p
    and q, the greatest values of a - f tangent and -a - f tangent, this is (p + q) / (2 tangent).
    """
    p = max(a - f * tangent for a, f in points)
    q = max(-a - f * tangent for a, f in points)
    return (p + q) / (2 * tangent)


def _middle(points: Sequence[tuple[float, float]], distance: float) -> float:
    """The shift of the target with which points are as far from both edges of the picture."""
    low, high = min(a for a, _ in points), max(a for a, _ in points)
    for _ in range(60):
        c = (low + high) / 2
        right = max((a - c) / (distance + f) for a, f in points)
        left = max((c - a) / (distance + f) for a, f in points)
        low, high = (c, high) if right > left else (low, c)
    return (low + high) / 2


def is_globe(view: Mapping[str, Any]) -> bool:
    return bool(view.get("geometry", {}).get("mapping") == "sphere")


def _tangents(dataset: Mapping[str, Any], view: Mapping[str, Any]) -> tuple[float, float]:
    """Of half the angles of the picture along its width and its height."""
    default = dataset["defaultView"]
    image = {**default["image"], **view.get("image", {})}
    fov_y = view.get("camera", {}).get("fovY") or default["camera"]["fovY"]
    tan_y = math.tan(math.radians(fov_y) / 2)
    return tan_y * image["width"] / image["height"], tan_y


def looking(
    dataset: Mapping[str, Any], view: Mapping[str, Any], azimuth: float, elevation: float,
    zoom: float,
) -> dict[str, Any]:
    """The keys eye, target, up and height of a camera. Raises ValueError."""
    if not -90 <= elevation <= 90:
        raise ValueError(f"elevation must be -90 to 90 degrees, not {elevation:g}")
    if not 1e-3 <= zoom <= 1e3:
        raise ValueError(f"zoom must be 0.001 to 1000, not {zoom:g}")
    tan_x, tan_y = _tangents(dataset, view)
    corners, target = corners_of(dataset, view)
    right, up, forward = orbit_frame(azimuth, elevation)
    if is_globe(view):
        # The cone of tangents of a sphere has the half angle asin(radius / distance).
        distance = GLOBE_RADIUS / math.sin(math.atan(min(tan_x, tan_y)))
        half = GLOBE_RADIUS * max(1.0, tan_y / tan_x)
    else:
        sides = [([(_dot(p, axis), _dot(p, forward)) for p in corners], tangent, axis)
                 for axis, tangent in ((right, tan_x), (up, tan_y))]
        distance = ROOM * max(_distance(points, tangent) for points, tangent, _ in sides)
        half = 0.0
        for points, tangent, axis in sides:
            shift = _middle(points, distance)
            half = max(half, max(abs(a - shift) for a, _ in points) * tan_y / tangent)
            target = [t + shift * one for t, one in zip(target, axis)]
    distance /= zoom
    steep = abs(elevation) > 89.9
    return {
        "eye": [t - distance * f for t, f in zip(target, forward)],
        "target": target,
        "up": list(up) if steep else [0.0, 0.0, 1.0],
        "height": 2 * half * ROOM / zoom,
    }


def sides_of(eye: Sequence[float], target: Sequence[float]) -> tuple[float, float]:
    """Azimuth and elevation of an eye, degrees, as orbit_frame() takes them."""
    x, y, z = _unit([b - a for a, b in zip(eye, target)])
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, -z))))
    return (math.degrees(math.atan2(-x, y)) if abs(elevation) < 89.9 else 0.0), elevation


def _needed(points: Sequence[tuple[float, float]], shift: float, tangent: float) -> float:
    """The least distance at which points fit a picture whose target is shifted: see _distance."""
    return max(abs(a - shift) / tangent - f for a, f in points)


def turning(
    dataset: Mapping[str, Any], view: Mapping[str, Any], camera: Mapping[str, Any], degrees: float
) -> dict[str, Any]:
    """The keys eye, target and height of the first camera of a turn about the vertical axis
    through the middle of the box: those of `camera`, moved away until every picture of the turn
    shows the whole box. They are unchanged if the first picture does not show it either, and of
    a globe, which looks alike from all sides.

    In the frame of the camera the box turns. So the corners of the box at all angles are points
    that have to fit one picture.
    """
    eye, target = camera["eye"], camera["target"]
    kept: dict[str, Any] = {"eye": list(eye), "target": list(target)}
    if camera.get("height") is not None:
        kept["height"] = camera["height"]
    if is_globe(view):
        return kept
    forward = _unit([b - a for a, b in zip(eye, target)])
    right = _unit(_cross(forward, camera["up"]))
    corners, centre = corners_of(dataset, view)
    place = [a - b for a, b in zip(target, centre)]
    depth = _dot(place, forward)
    end = math.radians(max(-360.0, min(360.0, degrees)))
    count = max(1, math.ceil(abs(math.degrees(end)) / TURN_STEP))
    turns = [turned(p, (0, 0, 0), -end * n / count) for n in range(count + 1) for p in corners]
    flat = camera.get("projection") == "orthographic"
    tan_x, tan_y = _tangents(dataset, view)
    axes = [(right, tan_x), (_cross(right, forward), tan_y)]
    first = [[(_dot(p, axis), _dot(p, forward) - depth) for p in corners] for axis, _ in axes]
    every = [[(_dot(p, axis), _dot(p, forward) - depth) for p in turns] for axis, _ in axes]
    shifts = [_dot(place, axis) for axis, _ in axes]
    if flat:
        # |a - shift| of a point is at most half the width or height of the picture.
        def extent(sides: Sequence[Sequence[tuple[float, float]]]) -> float:
            return 2 * max(abs(a - shift) * tan_y / tangent for points, shift, (_, tangent)
                           in zip(sides, shifts, axes) for a, _ in points)

        height = float(camera.get("height") or 0)  # 0: that of the default, which fits
        if height == 0 or height * (1 + 1e-9) >= extent(first):
            kept["height"] = max(height, ROOM * extent(every))
        return kept
    distance = math.dist(eye, target)
    if any(_needed(points, shift, tangent) > distance * (1 + 1e-9)
           for points, shift, (_, tangent) in zip(first, shifts, axes)):
        return kept
    for sides, sign in ((first, -1), (every, 1)):  # what looking() shifts the target by
        fit = ROOM * max(_distance(points, axis[1]) for points, axis in zip(sides, axes))
        shifts = [shift + sign * _middle(points, fit) for shift, points in zip(shifts, sides)]
    distance = max(distance, ROOM * max(_needed(points, shift, tangent) for points, shift,
                                        (_, tangent) in zip(every, shifts, axes)))
    target = [c + depth * f + sum(shift * axis[k] for shift, (axis, _) in zip(shifts, axes))
              for k, (c, f) in enumerate(zip(centre, forward))]
    return {**kept, "eye": [t - distance * f for t, f in zip(target, forward)], "target": target}
