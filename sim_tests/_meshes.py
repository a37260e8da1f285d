"""Small triangle meshes for what the camera sees: boxes, ellipsoids and tapered tubes.

Collision shapes are separate and simpler; these meshes are visual only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

_BOX_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
# Corners of the six faces, counter-clockwise as seen from outside.
_BOX_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_UNIT_BOX = _BOX_CORNERS[np.array(_BOX_FACES)].reshape(24, 3)
# The centre of a face of the unit box is its normal.
_BOX_NORMALS = np.repeat(_UNIT_BOX.reshape(6, 4, 3).mean(axis=1), 4, axis=0)
_BOX_INDICES = (np.array((0, 1, 2, 0, 2, 3)) + 4 * np.arange(6)[:, None]).ravel()


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a normal a vertex.

    Attributes:
        vertices_m: (N, 3).
        normals: (N, 3) unit vectors pointing outwards.
        indices: (3 T,) three vertex rows a triangle, counter-clockwise as seen from outside.
    """

    vertices_m: FloatArray
    normals: FloatArray
    indices: NDArray[np.int64]

    def transformed(
        self, rotation: FloatArray | None = None, translation_m: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Mesh:
        """Rotate (3, 3), then translate."""
        turn = np.eye(3) if rotation is None else rotation
        return Mesh(
            self.vertices_m @ turn.T + np.asarray(translation_m),
            self.normals @ turn.T,
            self.indices,
        )


def merge(meshes: Iterable[Mesh]) -> Mesh:
    """One mesh that draws all of ``meshes``: fewer bodies to keep in the simulator."""
    parts = list(meshes)
    offsets = np.cumsum([0, *(len(part.vertices_m) for part in parts[:-1])])
    return Mesh(
        np.concatenate([part.vertices_m for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.indices + at for part, at in zip(parts, offsets, strict=True)]),
    )


def box(center_m: Sequence[float], size_m: Sequence[float]) -> Mesh:
    """An axis-aligned box with flat faces."""
    vertices = _UNIT_BOX * (0.5 * np.asarray(size_m)) + np.asarray(center_m)
    return Mesh(vertices, _BOX_NORMALS, _BOX_INDICES)


def quad(corners_m: Sequence[Sequence[float]]) -> Mesh:
    """A flat four-cornered face, seen only from the side on which it runs counter-clockwise."""
    corners = np.asarray(corners_m, dtype=np.float64)
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    unit = normal / np.linalg.norm(normal)
    return Mesh(corners, np.tile(unit, (4, 1)), np.array((0, 1, 2, 0, 2, 3)))


def ellipsoid(
    center_m: Sequence[float], semi_axes_m: Sequence[float], sides: int = 14, rings: int = 9
) -> Mesh:
    """An ellipsoid with smooth normals; its poles lie on z."""
    polar = np.linspace(0.0, math.pi, rings + 1)[:, None]
    around = np.linspace(0.0, 2.0 * math.pi, sides + 1)[None, :]
    unit = np.stack(
        [
            np.sin(polar) * np.cos(around),
            np.sin(polar) * np.sin(around),
            np.cos(polar) * np.ones_like(around),
        ],
        axis=-1,
    ).reshape(-1, 3)
    axes = np.asarray(semi_axes_m)
    normals = unit / axes
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(unit * axes + np.asarray(center_m), normals, _grid_indices(rings + 1, sides + 1))


def tube(sections_m: Sequence[Sequence[float]], sides: int = 12) -> Mesh:
    """A closed tube along −z through elliptic sections (x, y, z, semi-axis x, semi-axis y).

    Sections run from the highest z to the lowest; the ends are closed by flat fans.
    """
    sections = np.asarray(sections_m, dtype=np.float64)
    around = np.linspace(0.0, 2.0 * math.pi, sides + 1)
    ring = np.stack([np.cos(around), np.sin(around)], axis=-1)
    side = np.empty((len(sections), sides + 1, 3))
    side[..., :2] = sections[:, None, :2] + ring[None] * sections[:, None, 3:5]
    side[..., 2] = sections[:, None, 2]
    along = np.gradient(side, axis=0)
    tangent = np.stack([-ring[:, 1], ring[:, 0], np.zeros(sides + 1)], axis=-1)
    tangent = tangent[None] * np.concatenate(
        [sections[:, None, 3:5], np.ones((len(sections), 1, 1))], axis=-1
    )
    normals = np.cross(along, tangent).reshape(-1, 3)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    parts = [Mesh(side.reshape(-1, 3), normals, _grid_indices(len(sections), sides + 1))]
    for row, up in ((0, 1.0), (-1, -1.0)):
        rim = side[row, :-1]
        fan = np.array([(0, k + 1, (k + 1) % sides + 1) for k in range(sides)])
        parts.append(
            Mesh(
                np.concatenate([rim.mean(axis=0, keepdims=True), rim]),
                np.tile((0.0, 0.0, up), (sides + 1, 1)),
                (fan if up > 0.0 else fan[:, ::-1]).ravel(),
            )
        )
    return merge(parts)


def _grid_indices(rows: int, columns: int) -> NDArray[np.int64]:
    """Two triangles a cell of a grid whose rows run downwards and columns counter-clockwise."""
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    corner = (row * columns + column).ravel()
    below = corner + columns
    return np.stack([corner, below, below + 1, corner, below + 1, corner + 1], axis=-1).ravel()
