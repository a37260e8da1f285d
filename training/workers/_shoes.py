"""Safety shoes: a lofted upper with a toe cap on a sole."""

from __future__ import annotations

from typing import Final

import numpy as np
import trimesh

from ._body import Body
from ._piece import Array, Piece, Triangles

#: Thickness of the sole under the foot, by which the body stands higher.
SOLE_M: Final = 0.026
_AROUND: Final = 16


def shoes(body: Body, average: Body) -> list[Piece]:
    """Return upper and sole of both feet; ``body`` already stands on top of the soles."""
    made: list[Piece] = []
    for ankle in (12, 15):
        axis, shape = _axis(body, ankle), _axis(average, ankle)
        for label, (points, rough) in (("shoe", _upper()), ("sole", _sole())):
            at, canon = _place(points, *axis), _place(points, *shape)
            triangles = _outwards(at, rough)
            weights = np.zeros((len(points), body.weights.shape[1]))
            weights[:, [ankle - 2, ankle - 1, ankle]] = 1.0
            budget = (300, 90, 34) if label == "shoe" else (90, 44, 16)
            made.append(Piece(label, at, triangles, weights, canon, budget))
    return made


def _axis(body: Body, ankle: int) -> tuple[Array, Array, float, float]:
    """Return heel on the floor, forward direction, length and half width of a foot's shoe."""
    foot = body.vertices_m[body.weights[:, ankle] > 0.9]
    foot = foot[foot[:, 2] < body.joints_m[ankle, 2]]
    low = foot - foot.mean(axis=0)
    _, _, principal = np.linalg.svd(low[:, :2], full_matrices=False)
    forward = principal[0] * np.sign(principal[0, 0])
    side = np.array([-forward[1], forward[0]])
    along, across = foot[:, :2] @ forward, foot[:, :2] @ side
    heel = (along.min() - 0.010) * forward + 0.5 * (across.min() + across.max()) * side
    length = float(np.ptp(along)) + 0.024
    return heel, forward, length, 0.5 * float(np.ptp(across)) + 0.006


def _place(points: Array, heel: Array, forward: Array, length: float, half: float) -> Array:
    """Map a unit shoe (length 1, half width 1, heights in metres) to the body frame."""
    side = np.array([-forward[1], forward[0]])
    flat = heel + points[:, :1] * length * forward + points[:, 1:2] * half * side
    return np.column_stack([flat, points[:, 2]])


def _half_width(x: Array) -> Array:
    """Return the half width of the last along its length, 1 at the ball of the foot."""
    return np.interp(
        x,
        [0.0, 0.03, 0.10, 0.22, 0.42, 0.56, 0.70, 0.82, 0.91, 0.97, 1.0],
        [0.20, 0.44, 0.62, 0.69, 0.74, 0.90, 1.0, 0.95, 0.76, 0.46, 0.12],
    )


def _height(x: Array) -> Array:
    """Return the height of the upper above the floor."""
    return SOLE_M + np.interp(
        x,
        [0.0, 0.04, 0.12, 0.30, 0.40, 0.52, 0.66, 0.80, 0.92, 0.98, 1.0],
        [0.060, 0.085, 0.092, 0.096, 0.090, 0.072, 0.058, 0.053, 0.046, 0.030, 0.012],
    )


def _upper() -> tuple[Array, Triangles]:
    x = np.array([0.0, 0.02, 0.06, 0.12, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.88, 0.94, 0.98, 1.0])
    angle = np.linspace(0.0, np.pi, _AROUND)
    across = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.75
    up = np.abs(np.sin(angle)) ** 0.62
    rings = np.empty((len(x), _AROUND, 3))
    rings[..., 0] = x[:, None]
    rings[..., 1] = _half_width(x)[:, None] * across * (1.0 - 0.12 * up)
    rings[..., 2] = (SOLE_M - 0.004) + (_height(x)[:, None] - SOLE_M + 0.004) * up
    return _grid(rings)


def _sole() -> tuple[Array, Triangles]:
    x = np.array([-0.012, 0.02, 0.08, 0.2, 0.42, 0.56, 0.7, 0.82, 0.92, 0.98, 1.012])
    half = _half_width(np.clip(x, 0.0, 1.0)) + 0.06
    profile = np.array(
        [(1.0, SOLE_M), (1.03, 0.012), (1.0, 0.0), (-1.0, 0.0), (-1.03, 0.012), (-1.0, SOLE_M)]
    )
    rings = np.empty((len(x), len(profile), 3))
    rings[..., 0] = x[:, None]
    rings[..., 1] = half[:, None] * profile[None, :, 0]
    lift = 0.014 * np.clip((x - 0.86) / 0.15, 0.0, 1.0) ** 1.5
    rings[..., 2] = np.maximum(profile[None, :, 1], 0.0) + lift[:, None] * (
        profile[None, :, 1] < 0.02
    )
    points, triangles = _grid(rings)
    count, sides = rings.shape[:2]
    top = [(k * sides, (k + 1) * sides, (k + 1) * sides + sides - 1) for k in range(count - 1)]
    top += [
        (k * sides, (k + 1) * sides + sides - 1, k * sides + sides - 1) for k in range(count - 1)
    ]
    ends = [(0, k, k + 1) for k in range(1, sides - 1)]
    last = (count - 1) * sides
    ends += [(last, last + k + 1, last + k) for k in range(1, sides - 1)]
    return points, np.concatenate([triangles, np.array(top), np.array(ends)])


def _grid(rings: Array) -> tuple[Array, Triangles]:
    """Return the triangles between neighbouring rings of points."""
    count, sides = rings.shape[:2]
    i, j = np.meshgrid(np.arange(count - 1), np.arange(sides - 1), indexing="ij")
    a = (i * sides + j).ravel()
    triangles = np.concatenate(
        [np.stack([a, a + 1, a + sides + 1], 1), np.stack([a, a + sides + 1, a + sides], 1)]
    )
    return rings.reshape(-1, 3), triangles


def _outwards(vertices: Array, triangles: Triangles) -> Triangles:
    """Return triangles wound the same way, those of an open shell facing away from the floor."""
    shell = trimesh.Trimesh(vertices, triangles, process=False)
    trimesh.repair.fix_normals(shell)
    wound = np.asarray(shell.faces, dtype=np.int64)
    a, b, c = (vertices[wound[:, k]] for k in range(3))
    inside_out = not shell.is_watertight and np.cross(b - a, c - a)[:, 2].sum() < 0.0
    return wound[:, ::-1] if inside_out else wound
