"""Round meshes: ellipsoids and tapered tubes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray
from sim_tests.world.hall import Mesh, Region, merge

_WHOLE: Final[Region] = (0.0, 0.0, 1.0, 1.0)


def ellipsoid(
    center_m: Sequence[float],
    semi_axes_m: Sequence[float],
    sides: int = 14,
    rings: int = 9,
    region: Region = _WHOLE,
) -> Mesh:
    """Return an ellipsoid with smooth normals; the top of the texture lies at its +z pole."""
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
    return Mesh(
        unit * axes + np.asarray(center_m),
        normals,
        _grid_indices(rings + 1, sides + 1),
        _in_region(_grid_uv(rings + 1, sides + 1), region),
    )


def tube(
    sections_m: Sequence[Sequence[float]],
    sides: int = 12,
    region: Region = _WHOLE,
    end_region: Region | None = None,
) -> Mesh:
    """Return a closed tube along −z through elliptic sections.

    Args:
        sections_m: (x, y, z, semi-axis x, semi-axis y) of each, from the highest z to the lowest.
        sides: number of flat sides.
        region: the part of a texture wrapped around the tube, its top at the first section.
        end_region: the part on both flat ends; None is the same as ``region``.
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
    parts = [
        Mesh(
            side.reshape(-1, 3),
            normals,
            _grid_indices(len(sections), sides + 1),
            _in_region(_grid_uv(len(sections), sides + 1), region),
        )
    ]
    flat = np.concatenate([np.zeros((1, 2)), ring[:-1]]) * 0.5 + 0.5
    end_uv = _in_region(flat, region if end_region is None else end_region)
    for row, up in ((0, 1.0), (-1, -1.0)):
        rim = side[row, :-1]
        fan = np.array([(0, k + 1, (k + 1) % sides + 1) for k in range(sides)])
        parts.append(
            Mesh(
                np.concatenate([rim.mean(axis=0, keepdims=True), rim]),
                np.tile((0.0, 0.0, up), (sides + 1, 1)),
                (fan if up > 0.0 else fan[:, ::-1]).ravel(),
                end_uv,
            )
        )
    return merge(parts)


def _grid_indices(rows: int, columns: int) -> NDArray[np.int64]:
    """Return two triangles per cell of a grid: rows run downwards, columns counter-clockwise."""
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    corner = (row * columns + column).ravel()
    below = corner + columns
    return np.stack([corner, below, below + 1, corner, below + 1, corner + 1], axis=-1).ravel()


def _grid_uv(rows: int, columns: int) -> FloatArray:
    """Return unit texture coordinates (rows · columns, 2) of a grid, its first row at the top."""
    v, u = np.meshgrid(np.linspace(1.0, 0.0, rows), np.linspace(0.0, 1.0, columns), indexing="ij")
    return np.stack([u, v], axis=-1).reshape(-1, 2)


def _in_region(uv: FloatArray, region: Region) -> FloatArray:
    """Return unit texture coordinates (N, 2) moved into a region of the texture."""
    u_min, v_min, u_max, v_max = region
    return np.asarray(np.array((u_min, v_min)) + uv * np.array((u_max - u_min, v_max - v_min)))
