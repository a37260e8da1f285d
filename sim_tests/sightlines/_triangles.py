"""Which straight lines meet a surface made of triangles, in closed form on whole arrays.

A line through the eye o along d passes the edge from b to c on the side given by the sign of
d · ((b − o) × (c − o)) = [d, d × o] · [b × c, b − c], the product of the line's and the edge's
Plücker coordinates. It meets the triangle when it passes all three edges on the same side. The
edges' coordinates do not change while a rigid piece moves, so they are computed once; moving is
left to the lines, of which there are few. Neighbours share an edge with exactly opposite sign, so
nothing is seen through a seam.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

#: Vertices (V, 3) in metres and triangles (T, 3) of rows of them.
Surface = tuple[FloatArray, NDArray[np.int64]]

# Triangles are held against lines in clusters of so many, each with a box about it.
_CLUSTER: Final = 32
_TINY_M: Final = 1e-12


class TriangleSet:
    """Triangles in rigid pieces, prepared for lines of sight.

    Args:
        pieces: surface of each piece in a frame of its own, metres.
    """

    def __init__(self, pieces: Sequence[Surface]) -> None:
        corners = [vertices[triangles] for vertices, triangles in pieces]
        clusters = [
            (number, piece[rows])
            for number, piece in enumerate(corners)
            for rows in _clusters(piece.mean(axis=1))
        ]
        count = len(clusters)
        self.pieces = len(pieces)
        self._piece = np.array([number for number, _ in clusters], dtype=np.int64)
        self._boxes = np.array(
            [(part.min(axis=(0, 1)), part.max(axis=(0, 1))) for _, part in clusters]
        ).reshape(count, 2, 3)
        # What fills up a cluster is a triangle without area, which no line meets.
        packed = np.zeros((count, _CLUSTER, 3, 3))
        for row, (_, part) in enumerate(clusters):
            packed[row, : len(part)] = part
        first, second, third = packed[:, :, 0], packed[:, :, 1], packed[:, :, 2]
        # (C, 6, 3 · 32): the three edges of every triangle, one kind of edge after another.
        self._edges = np.ascontiguousarray(
            np.concatenate(
                [
                    np.concatenate([np.cross(b, c), b - c], axis=2)
                    for b, c in ((second, third), (third, first), (first, second))
                ],
                axis=1,
            ).transpose(0, 2, 1)
        )
        normals = np.cross(second - first, third - first)
        # (C, 4, 32) of each plane: n · p − n · first is how far p is before it.
        self._planes = np.ascontiguousarray(
            np.concatenate(
                [-normals, np.einsum("cti,cti->ct", first, normals)[..., None]], axis=2
            ).transpose(0, 2, 1)
        )

    @property
    def triangles(self) -> int:
        """How many triangles there are."""
        return int(np.count_nonzero(self._planes[:, :3].any(axis=1)))

    def blocks(self, eye_m: FloatArray, ends_m: FloatArray) -> NDArray[np.bool_]:
        """Whether a triangle lies between the eye and each of some points.

        Args:
            eye_m: (P, 3) the eye in the frame of every piece.
            ends_m: (P, K, 3) the points in the frame of every piece.

        Returns:
            (K,); a line that only ends on a triangle, or starts on it, is free.
        """
        free = np.zeros(ends_m.shape[1], dtype=bool)
        low = np.minimum(ends_m.min(axis=1), eye_m)
        high = np.maximum(ends_m.max(axis=1), eye_m)
        reached = np.flatnonzero(
            (
                (self._boxes[:, 0] <= high[self._piece]) & (self._boxes[:, 1] >= low[self._piece])
            ).all(axis=1)
        )
        if not reached.size:
            return free
        piece = self._piece[reached]
        eye, along = eye_m[piece], (ends_m - eye_m[:, None])[piece]
        passed = meet_boxes(eye, along, self._boxes[reached]).any(axis=1)
        if not passed.any():
            return free
        chosen, eye, along = reached[passed], eye[passed], along[passed]
        sides = _lines(eye, along) @ self._edges[chosen]
        one, two, three = (sides[..., k * _CLUSTER : (k + 1) * _CLUSTER] for k in range(3))
        rate = one + two + three
        # The plane is met at the share start / rate of the line.
        ahead = np.concatenate([eye, np.ones((len(eye), 1))], axis=1)[:, None]
        start = ahead @ self._planes[chosen]
        met = (start * rate > 0.0) & (np.abs(start) < np.abs(rate))
        met &= (np.minimum(np.minimum(one, two), three) >= 0.0) | (
            np.maximum(np.maximum(one, two), three) <= 0.0
        )
        return np.asarray(met.any(axis=(0, 2)))


def _lines(eye_m: FloatArray, along_m: FloatArray) -> FloatArray:
    """(C, K, 6) Plücker coordinates [d, d × o] of lines from eyes (C, 3) along (C, K, 3)."""
    out = np.empty((*along_m.shape[:2], 6))
    out[..., :3] = along_m
    x, y, z = along_m[..., 0], along_m[..., 1], along_m[..., 2]
    ox, oy, oz = eye_m[:, 0, None], eye_m[:, 1, None], eye_m[:, 2, None]
    out[..., 3] = y * oz - z * oy
    out[..., 4] = z * ox - x * oz
    out[..., 5] = x * oy - y * ox
    return out


def _clusters(centres_m: FloatArray) -> list[NDArray[np.int64]]:
    """Rows of triangles in groups that lie together: halved along their longest side."""
    waiting, done = [np.arange(len(centres_m))], []
    while waiting:
        rows = waiting.pop()
        if len(rows) <= _CLUSTER:
            if len(rows):
                done.append(rows)
            continue
        axis = int(np.ptp(centres_m[rows], axis=0).argmax())
        order = rows[np.argsort(centres_m[rows, axis], kind="stable")]
        waiting += [order[: len(order) // 2], order[len(order) // 2 :]]
    return done


def meet_boxes(eye_m: FloatArray, along_m: FloatArray, boxes_m: FloatArray) -> NDArray[np.bool_]:
    """(C, K) whether segments from eyes (C, 3) along (C, K, 3) meet boxes (C, 2, 3), by slabs."""
    share = 1.0 / np.where(np.abs(along_m) < _TINY_M, _TINY_M, along_m)
    first = (boxes_m[:, 0] - eye_m)[:, None] * share
    last = (boxes_m[:, 1] - eye_m)[:, None] * share
    low, high = np.minimum(first, last), np.maximum(first, last)
    enter = np.maximum(np.maximum(low[..., 0], low[..., 1]), low[..., 2])
    leave = np.minimum(np.minimum(high[..., 0], high[..., 1]), high[..., 2])
    return np.asarray((enter <= leave) & (leave >= 0.0) & (enter <= 1.0))
