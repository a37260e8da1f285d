"""Cloth over a body: cut along a line, drape with slack, fold the edges in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ._piece import Array, Triangles, vertex_normals


@dataclass(frozen=True, eq=False)
class Cut:
    """The part of a mesh where a field is positive, its border cut exactly along the zero line.

    Row k of the result lies at ``(1 − share[k]) · first[k] + share[k] · second[k]``.
    """

    triangles: Triangles
    first: Triangles
    second: Triangles
    share: Array

    def __call__(self, values: Array) -> Array:
        """Return values at the part's vertices, given those at the mesh's."""
        share = self.share.reshape(-1, *([1] * (values.ndim - 1)))
        mixed: Array = (1.0 - share) * values[self.first] + share * values[self.second]
        return mixed


def cut(triangles: Triangles, field: Array) -> Cut:
    """Return the part of a mesh in which ``field`` (a value per vertex) is positive."""
    inside = field[triangles] > 0.0
    count = inside.sum(axis=1)
    kept: list[list[tuple[int, int]]] = [
        [(int(v), int(v)) for v in row] for row in triangles[count == 3]
    ]
    for row, within in zip(
        triangles[(count == 1) | (count == 2)], inside[(count == 1) | (count == 2)], strict=True
    ):
        odd = int(np.flatnonzero(within == (within.sum() == 1))[0])
        a, b, c = (int(row[(odd + k) % 3]) for k in range(3))
        ab, ca = (min(a, b), max(a, b)), (min(a, c), max(a, c))
        if within.sum() == 1:
            kept.append([(a, a), ab, ca])
        else:
            kept.extend([[ab, (b, b), (c, c)], [ab, (c, c), ca]])
    if not kept:
        raise ValueError("the field is positive nowhere on the mesh")
    corners = np.array(kept, dtype=np.int64).reshape(-1, 2)
    pairs, rows = np.unique(corners, axis=0, return_inverse=True)
    first, second = pairs[:, 0], pairs[:, 1]
    spread = field[first] - field[second]
    share = np.where(first == second, 0.0, field[first] / np.where(spread == 0.0, 1.0, spread))
    return Cut(rows.reshape(-1, 3), first, second, np.clip(share, 0.0, 1.0))


def drape(
    surface_m: Array,
    normals: Array,
    offset_m: Array,
    neighbours: csr_matrix,
    rounds: int = 40,
    slack: float = 0.5,
    reach_m: Array | float = 0.08,
) -> Array:
    """Return cloth over a surface: smoothed in rounds, but never nearer than its offset.

    Cloth bridges hollows (between the breasts, along the spine, behind the knee), and muscles
    disappear. In each round the cloth moves by the share ``slack`` towards the neighbours' mean.
    It may stand off by at most ``reach_m`` more than its offset.
    """
    cloth = surface_m + normals * offset_m[:, None]
    for _ in range(rounds):
        cloth = (1.0 - slack) * cloth + slack * (neighbours @ cloth)
        gap = ((cloth - surface_m) * normals).sum(axis=1)
        cloth = cloth + normals * np.maximum(offset_m - gap, 0.0)[:, None]
        cloth = cloth - normals * np.maximum(gap - offset_m - reach_m, 0.0)[:, None]
    smoothed: Array = 0.5 * cloth + 0.5 * (neighbours @ cloth)
    return smoothed


def smooth_normals(
    vertices_m: Array, triangles: Triangles, neighbours: csr_matrix, rounds: int = 8
) -> Array:
    """Return unit normals (N, 3), averaged with the neighbours'."""
    normals = vertex_normals(vertices_m, triangles)
    for _ in range(rounds):
        normals = 0.4 * normals + 0.6 * (neighbours @ normals)
    unit: Array = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return unit


def open_edges(triangles: Triangles) -> Triangles:
    """Return the border edges (E, 2), in the direction of their only triangle."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    _, rows, counts = np.unique(
        np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
    )
    return edges[rows[counts == 1]]


def signed_distance(polygon: Array, points: Array) -> Array:
    """Return the distance of 2-D points to a polygon's border, positive inside."""
    start, end = polygon, np.roll(polygon, -1, axis=0)
    along = end - start
    to_point = points[:, None] - start[None]
    share = np.clip((to_point * along).sum(-1) / (along * along).sum(-1), 0.0, 1.0)
    distance = np.linalg.norm(to_point - share[..., None] * along, axis=-1).min(axis=1)
    y, rising = points[:, None, 1], end[:, 1] > start[:, 1]
    crosses = (start[:, 1] > y) != (end[:, 1] > y)
    side = along[:, 0] * to_point[..., 1] - along[:, 1] * to_point[..., 0]
    inside = (crosses & ((side > 0.0) == rising)).sum(axis=1) % 2 == 1
    signed: Array = np.where(inside, distance, -distance)
    return signed
