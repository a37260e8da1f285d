"""Baseball caps, safety helmets and glasses, which follow the head rigidly."""

from __future__ import annotations

from typing import Final

import numpy as np

from ._body import Body
from ._head import loft
from ._person import Person
from ._piece import Array, Piece, smoothstep
from ._places import Places

#: Plane of a hat's edge on the average head: height above the ears, and slope.
_EDGE: Final = {"cap": (1.752, 0.20), "helmet": (1.757, 0.16)}
_EAR_X_M: Final = 0.035


def hat_line(person: Person, places: Places) -> Array | None:
    """Return heights (N,) above the hat's edge on the average body, m; None for a bare head."""
    kind = person.headwear[0]
    if kind == "none":
        return None
    height, slope = _EDGE[kind]
    x, _, z = places.canon_m.T
    above: Array = z - height - slope * (x - _EAR_X_M)
    return above


def hats(body: Body, person: Person, places: Places, hair_m: Array) -> list[Piece]:
    """Return the pieces of the hat and of the glasses."""
    made = []
    kind = person.headwear[0]
    line = hat_line(person, places)
    if line is not None:
        made.append(_dome(kind, body, places, hair_m[line > -0.005]))
        made.append(_brim(kind, body, places, hair_m[line > -0.005]))
    if person.glasses:
        made.append(_glasses(body, places))
    return made


def _ellipsoid(points: Array, clear_m: float) -> tuple[Array, Array]:
    """Return centre and semi-axes of an upright half-ellipsoid that contains the points."""
    low, high = points.min(axis=0), points.max(axis=0)
    center = np.array([0.5 * (low[0] + high[0]), 0.0, low[2]])
    axes = np.array([0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1]), high[2] - low[2]])
    axes = axes + clear_m
    outside = np.sqrt((((points - center) / axes) ** 2).sum(axis=1)).max()
    return center, axes * [1.0, 1.0, max(1.0, float(outside) ** 1.5)]


def _edge(kind: str, places: Places, body: Body) -> tuple[float, float]:
    """Return the height at the ears and the slope of a hat's edge on this body."""
    height, slope = _EDGE[kind]
    row = int(np.argmin(np.linalg.norm(places.canon_m - [_EAR_X_M, 0.075, height], axis=1)))
    return float(body.vertices_m[row, 2]), slope


def _dome(kind: str, body: Body, places: Places, under: Array) -> Piece:
    center, axes = _ellipsoid(under, 0.006 if kind == "cap" else 0.017)
    height, slope = _edge(kind, places, body)
    around = np.linspace(0.0, 2.0 * np.pi, 49)
    share = np.linspace(0.02, 1.0, 16)[:, None]
    polar = share * 0.5 * np.pi
    x = np.sin(polar) ** 0.85 * np.cos(around)
    y = np.sin(polar) ** 0.85 * np.sin(around)
    z = np.cos(polar) + 0.0 * around
    rings = center + axes * np.stack([x, y, z], axis=-1)
    edge = height + slope * (rings[..., 0] - _EAR_X_M)
    top = rings[0, :, 2].mean()
    # The dome's lowest ring lies in the tilted plane of the edge.
    fall = (rings[..., 2] - center[2]) / (top - center[2])
    rings[..., 2] = edge + fall * (top - edge)
    if kind == "helmet":
        ridge = smoothstep(np.abs(rings[..., 1]), 0.030, 0.018) * smoothstep(share, 1.0, 0.7)
        rings[..., 2] += 0.007 * ridge
        lip = rings[-1].copy()
        lip[:, :2] = (lip[:, :2] - center[:2]) * 1.07 + center[:2]
        lip[:, 2] -= 0.006
        under_lip = rings[-1].copy()
        under_lip[:, :2] = (under_lip[:, :2] - center[:2]) * 0.93 + center[:2]
        under_lip[:, 2] -= 0.004
        rings = np.concatenate([rings, lip[None], under_lip[None]])
    else:
        inner = rings[-1].copy()
        inner[:, :2] = (inner[:, :2] - center[:2]) * 0.95 + center[:2]
        rings = np.concatenate([rings, inner[None]])
    return _worn(kind, rings, center, body, (520, 160, 70))


def _brim(kind: str, body: Body, places: Places, under: Array) -> Piece:
    center, axes = _ellipsoid(under, 0.006 if kind == "cap" else 0.017)
    height, slope = _edge(kind, places, body)
    reach, wide = (0.072, 76.0) if kind == "cap" else (0.034, 70.0)
    angle = np.radians(np.linspace(-wide, wide, 21))
    rim = center[:2] + axes[:2] * 0.985 * np.column_stack([np.cos(angle), np.sin(angle)])
    level = height + slope * (rim[:, 0] - _EAR_X_M) + 0.004
    rows = []
    for share, lift in (
        (0.0, 0.0),
        (0.35, 0.002),
        (0.7, 0.001),
        (1.0, 0.0),
        (1.0, -0.003),
        (0.5, -0.003),
        (0.0, -0.004),
    ):
        out = share * reach * np.cos(angle / np.radians(wide) * 0.5 * np.pi) ** 0.8
        drop = (0.14 if kind == "cap" else 0.22) * out
        bow = (0.30 if kind == "cap" else 0.08) * share * (np.abs(rim[:, 1]) / axes[1]) ** 2 * reach
        rows.append(
            np.column_stack(
                [rim[:, 0] + out, rim[:, 1] * (1 + 0.05 * share), level - drop - bow + lift]
            )
        )
    rings = np.array(rows)[:, ::-1]
    return _worn(kind, rings[:, ::-1], center, body, (110, 60, 24), brim=True)


def _worn(
    kind: str,
    rings: Array,
    center: Array,
    body: Body,
    budget: tuple[int, int, int],
    brim: bool = False,
) -> Piece:
    points, triangles = loft(rings)
    weights = np.zeros((len(points), body.weights.shape[1]))
    weights[:, :2] = 1.0
    return Piece("brim" if brim else kind, points, triangles, weights, points - center, budget)


def _glasses(body: Body, places: Places) -> Piece:
    """Return a dark frame: two rims, a bridge, two temples."""
    parts: list[tuple[Array, Array]] = []
    bar = 0.0016
    eyes = body.joints_m[2:4]
    face = eyes[:, 0].mean() + 0.021
    for eye in eyes:
        angle = np.linspace(0.0, 2.0 * np.pi, 17)
        flat = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.7 * 0.0245
        high = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** 0.7 * 0.0185
        tube = []
        for turn in np.linspace(0.0, 2.0 * np.pi, 6):
            grow = 1.0 + np.cos(turn) * bar / 0.02
            tube.append(
                np.column_stack(
                    [
                        np.full_like(angle, face + np.sin(turn) * bar)
                        - 0.25 * np.abs(flat + eye[1] * 0.0) ** 1.2 * 0.1,
                        eye[1] * 1.03 + flat * grow,
                        eye[2] - 0.003 + high * grow,
                    ]
                )
            )
        parts.append(loft(np.array(tube)[::-1]))
    ear = places.canon_m
    row = int(np.argmin(np.linalg.norm(ear - [0.03, 0.079, 1.735], axis=1)))
    ear_x, ear_y, ear_z = body.vertices_m[row]
    for left in (1.0, -1.0):
        start = np.array(
            [face - 0.003, left * (abs(eyes[0, 1]) * 1.03 + 0.024), eyes[0, 2] + 0.004]
        )
        middle = np.array([0.5 * (face + ear_x), left * (abs(ear_y) + 0.0015), eyes[0, 2] + 0.006])
        end = np.array([ear_x, left * (abs(ear_y) + 0.001), ear_z])
        parts.append(_rod([start, middle, end], bar))
    bridge = [np.array([face + 0.001, y, eyes[0, 2] + 0.002]) for y in (0.009, 0.0, -0.009)]
    parts.append(_rod(bridge, bar))
    points = np.concatenate([part[0] for part in parts])
    shift = np.cumsum([0, *(len(part[0]) for part in parts[:-1])])
    triangles = np.concatenate([part[1] + at for part, at in zip(parts, shift, strict=True)])
    weights = np.zeros((len(points), body.weights.shape[1]))
    weights[:, :2] = 1.0
    return Piece("glasses", points, triangles, weights, points, (10_000, 0, 0))


def _rod(path: list[Array], radius_m: float) -> tuple[Array, Array]:
    """Return a thin four-sided rod along a mostly horizontal path."""
    rings = []
    for k, point in enumerate(path):
        along = path[min(k + 1, len(path) - 1)] - path[max(k - 1, 0)]
        side = np.cross([0.0, 0.0, 1.0], along)
        side /= np.linalg.norm(side)
        up = np.cross(along, side)
        up /= np.linalg.norm(up)
        angle = np.radians([45.0, 135.0, 225.0, 315.0, 405.0])[:, None]
        rings.append(point + 1.4 * radius_m * (np.cos(angle) * side + np.sin(angle) * up))
    points, triangles = loft(np.array(rings))
    return points, triangles[:, ::-1]
