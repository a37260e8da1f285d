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

#: Triangles are held against lines in clusters of so many, each with a box about it, …
CLUSTER: Final = 16
#: … and of so many sides.
SIDES: Final = 3 * CLUSTER
_TINY_M: Final = 1e-12


class TriangleSet:
    """Triangles in rigid pieces, prepared for lines of sight.

    Args:
        pieces: surface of each piece in a frame of its own, metres.
        together: all pieces are in one frame instead, and count as one that does not bend.
    """

    def __init__(self, pieces: Sequence[Surface], *, together: bool = False) -> None:
        corners = [vertices[triangles] for vertices, triangles in pieces]
        clusters = [
            (0 if together else number, piece[rows])
            for number, piece in enumerate(corners)
            for rows in _clusters(piece.mean(axis=1))
        ]
        count = len(clusters)
        self.clusters = count
        self.pieces = 1 if together else len(pieces)
        self._piece = np.array([number for number, _ in clusters], dtype=np.int64)
        self._boxes = np.array(
            [(part.min(axis=(0, 1)), part.max(axis=(0, 1))) for _, part in clusters]
        ).reshape(count, 2, 3)
        #: (P,) first cluster of each piece, and how many it has
        self.starts = np.searchsorted(self._piece, np.arange(self.pieces))
        self.counts = np.bincount(self._piece, minlength=self.pieces)
        #: (2, 3, C) low and high corners about each cluster, and (2, 3, P) about each piece
        self.boxes_m = np.ascontiguousarray(self._boxes.transpose(1, 2, 0))
        self.piece_boxes_m = _about(self.boxes_m, self.starts, self.counts)
        # What fills up a cluster is a triangle without area, which no line meets.
        packed = np.zeros((count, CLUSTER, 3, 3))
        for row, (_, part) in enumerate(clusters):
            packed[row, : len(part)] = part
        first, second, third = packed[:, :, 0], packed[:, :, 1], packed[:, :, 2]
        # (C, 6, 3 · 32): the three edges of every triangle, one kind of edge after another.
        self.edges = np.ascontiguousarray(
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
        self.planes = np.ascontiguousarray(
            np.concatenate(
                [-normals, np.einsum("cti,cti->ct", first, normals)[..., None]], axis=2
            ).transpose(0, 2, 1)
        )

    @property
    def triangles(self) -> int:
        """How many triangles there are."""
        return int(np.count_nonzero(self.planes[:, :3].any(axis=1)))

    def blocks(self, eye_m: FloatArray, ends_m: FloatArray) -> NDArray[np.bool_]:
        """Whether a triangle lies between the eye and each of some points.

        Args:
            eye_m: (P, 3) the eye in the frame of every piece.
            ends_m: (P, K, 3) the points in the frame of every piece.

        Returns:
            (K,); a line that only ends on a triangle, or starts on it, is free.
        """
        blocked = np.zeros(ends_m.shape[1], dtype=bool)
        low = np.minimum(ends_m.min(axis=1), eye_m)
        high = np.maximum(ends_m.max(axis=1), eye_m)
        reached = np.flatnonzero(
            (
                (self._boxes[:, 0] <= high[self._piece]) & (self._boxes[:, 1] >= low[self._piece])
            ).all(axis=1)
        )
        if not reached.size:
            return blocked
        piece = self._piece[reached]
        along = ends_m - eye_m[:, None]
        eye = eye_m[piece]
        # Few lines come near any one cluster: each pair of the two is looked at by itself.
        near, line = _slabs(eye, _inverse(along)[:, piece], self._boxes[reached]).nonzero()
        if not near.size:
            return blocked
        cluster = reached[near]
        met = meet_triangles(
            self.edges[cluster], self.planes[cluster], eye[near], along[piece[near], line]
        )
        blocked[line[met]] = True
        return blocked


def meet_triangles(
    edges: FloatArray, planes: FloatArray, eye_m: FloatArray, along_m: FloatArray
) -> NDArray[np.bool_]:
    """(N,) whether each segment from eyes (N, 3) along (N, 3) meets a cluster of its own.

    ``edges`` (N, 6, 48) and ``planes`` (N, 4, 16) are rows of those of a :class:`TriangleSet`.
    """
    sides = (_lines(eye_m, along_m)[:, None] @ edges)[:, 0]
    one, two, three = (sides[:, k * CLUSTER : (k + 1) * CLUSTER] for k in range(3))
    rate = one + two + three
    # The plane is met at the share start / rate of the line.
    origin = np.ones((len(edges), 1, 4))
    origin[:, 0, :3] = eye_m
    start = (origin @ planes)[:, 0]
    met = (start * rate > 0.0) & (np.abs(start) < np.abs(rate))
    met &= (np.minimum(np.minimum(one, two), three) >= 0.0) | (
        np.maximum(np.maximum(one, two), three) <= 0.0
    )
    return np.asarray(np.logical_or.reduce(met, axis=1))


def _lines(eye_m: FloatArray, along_m: FloatArray) -> FloatArray:
    """(N, 6) Plücker coordinates [d, d × o] of lines from eyes (N, 3) along (N, 3)."""
    out = np.empty((len(along_m), 6))
    out[:, :3] = along_m
    (x, y, z), (ox, oy, oz) = along_m.T, eye_m.T
    out[:, 3] = y * oz - z * oy
    out[:, 4] = z * ox - x * oz
    out[:, 5] = x * oy - y * ox
    return out


def _about(boxes_m: FloatArray, starts: NDArray[np.int64], counts: NDArray[np.int64]) -> FloatArray:
    """(2, 3, P) about the boxes (2, 3, C) of each piece; a point at 0 about none."""
    out = np.zeros((2, 3, len(starts)))
    for piece, (start, count) in enumerate(zip(starts.tolist(), counts.tolist(), strict=True)):
        if count:
            own = boxes_m[..., start : start + count]
            out[0, :, piece], out[1, :, piece] = own[0].min(axis=1), own[1].max(axis=1)
    return out


def _clusters(centres_m: FloatArray) -> list[NDArray[np.int64]]:
    """Rows of triangles in groups that lie together: halved along their longest side."""
    waiting, done = [np.arange(len(centres_m))], []
    while waiting:
        rows = waiting.pop()
        if len(rows) <= CLUSTER:
            if len(rows):
                done.append(rows)
            continue
        axis = int(np.ptp(centres_m[rows], axis=0).argmax())
        order = rows[np.argsort(centres_m[rows, axis], kind="stable")]
        waiting += [order[: len(order) // 2], order[len(order) // 2 :]]
    return done


def meet_boxes(eye_m: FloatArray, along_m: FloatArray, boxes_m: FloatArray) -> NDArray[np.bool_]:
    """(C, K) whether segments from eyes (C, 3) along (C, K, 3) meet boxes (C, 2, 3), by slabs."""
    return _slabs(eye_m, _inverse(along_m), boxes_m)


def meet_own_boxes(
    eye_m: FloatArray, inverse: FloatArray, boxes_m: FloatArray
) -> NDArray[np.bool_]:
    """(N,) whether each segment meets a box of its own.

    Args:
        eye_m: (3, N) where the segments begin.
        inverse: (3, N) of :func:`inverse_of` of them.
        boxes_m: (2, 3, N) low and high corners.
    """
    first, last = boxes_m - eye_m
    first *= inverse
    last *= inverse
    enter, leave = np.minimum(first, last), np.maximum(first, last)
    entered = np.maximum(np.maximum(enter[0], enter[1]), np.maximum(enter[2], 0.0))
    left = np.minimum(np.minimum(leave[0], leave[1]), np.minimum(leave[2], 1.0))
    return np.asarray(entered <= left)


def inverse_of(along_m: FloatArray) -> FloatArray:
    """One over each component of directions (…), which may be 0."""
    return np.asarray(1.0 / np.where(np.abs(along_m) < _TINY_M, _TINY_M, along_m))


def _inverse(along_m: FloatArray) -> FloatArray:
    """(3, C, K) one over each component of directions (C, K, 3), axis by axis."""
    return inverse_of(np.ascontiguousarray(along_m.transpose(2, 0, 1)))


def _slabs(eye_m: FloatArray, inverse: FloatArray, boxes_m: FloatArray) -> NDArray[np.bool_]:
    """As :func:`meet_boxes`; a segment is in a box for a share of it between enter and leave."""
    enter: FloatArray | float = 0.0
    leave: FloatArray | float = 1.0
    for axis in range(3):
        first = (boxes_m[:, 0, axis] - eye_m[:, axis])[:, None] * inverse[axis]
        last = (boxes_m[:, 1, axis] - eye_m[:, axis])[:, None] * inverse[axis]
        enter = np.maximum(enter, np.minimum(first, last))
        leave = np.minimum(leave, np.maximum(first, last))
    return np.asarray(enter <= leave)
