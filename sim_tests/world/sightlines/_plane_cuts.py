"""The segments in which a plane cuts surfaces, for scanners."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ._sight_lines import PlacedSurface
from ._triangles import CLUSTER, clusters_of, joined_sets, parts_of


def cut_surfaces(
    surfaces: Sequence[PlacedSurface], normal_odom: FloatArray, offset_m: float
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return the segments (N, 2, 3) in odom in which a plane cuts surfaces, and their owners.

    Several surfaces at once cost little more than one.

    Args:
        surfaces: S surfaces.
        normal_odom: (3,) unit normal of the plane.
        offset_m: its distance from the origin: n · p = offset.

    Returns:
        The segments, and the row (N,) of the surface of each.
    """
    nothing = np.empty((0, 2, 3)), np.empty(0, dtype=np.int64)
    if not surfaces:
        return nothing
    sets = tuple(surface.triangles for surface in surfaces)
    joined = joined_sets(sets)
    poses = np.concatenate([surface.T_odom_piece for surface in surfaces])
    scales = np.repeat([surface.scale for surface in surfaces], joined.pieces)
    rotations, origins = poses[:, :3, :3], poses[:, :3, 3]
    normals = normal_odom @ rotations
    offsets = (offset_m - origins @ normal_odom) / scales
    # The plane meets few pieces, and few clusters of those.
    met = _meet(joined.piece_boxes_m, normals, offsets)
    counts = joined.counts[met]
    piece = np.repeat(met, counts)
    cluster = clusters_of(joined.starts[met], counts)
    near = _meet(joined.boxes_m[..., cluster], normals[piece], offsets[piece])
    if not near.size:
        return nothing
    piece, cluster = piece[near], cluster[near]
    rows = len(cluster)
    corners = np.empty((rows, 3, 3, CLUSTER))
    for triangles, part, own in parts_of(sets, cluster):
        triangles.corners_m.take(own, axis=0, out=corners[part], mode="clip")
    heights = normals[piece, None] @ corners.reshape(rows, 3, 3 * CLUSTER)
    heights = heights.reshape(rows, 3, CLUSTER) - offsets[piece, None, None]
    one, two, three = (heights > 0.0).transpose(1, 0, 2)
    row, triangle = np.nonzero((one | two | three) & ~(one & two & three))
    # One corner lies alone on its side of the plane; the plane cuts its two edges.
    one, two, three = one[row, triangle], two[row, triangle], three[row, triangle]
    alone = np.where(one == two, 2, np.where(one == three, 1, 0))
    segments = np.empty((len(row), 2, 3))
    top, apex = heights[row, alone, triangle], corners[row, :, alone, triangle]
    for end in (0, 1):
        other = (alone + 1 + end) % 3
        share = top / (top - heights[row, other, triangle])
        segments[:, end] = apex + share[:, None] * (corners[row, :, other, triangle] - apex)
    piece = piece[row]
    segments *= scales[piece, None, None]
    turned = segments @ rotations.transpose(0, 2, 1)[piece] + origins[piece, None]
    return turned, np.searchsorted(np.cumsum(joined.pieces), piece, side="right")


def _meet(boxes_m: FloatArray, normals: FloatArray, offsets_m: FloatArray) -> NDArray[np.int64]:
    """Return the rows of boxes (2, 3, N) that each meet a plane of their own."""
    low, high = boxes_m
    turned = normals.T
    away = (turned * (low + high)).sum(axis=0) - 2.0 * offsets_m
    half = (np.abs(turned) * (high - low)).sum(axis=0)
    return np.flatnonzero(np.abs(away) <= half)
