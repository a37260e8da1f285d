"""Intersection of line segments with triangles, in closed form on whole arrays.

A line through the eye o along d passes the edge from b to c on the side given by the sign of
d · ((b − o) × (c − o)) = [d, d × o] · [b × c, b − c], the product of the line's and the edge's
Plücker coordinates. It meets the triangle if it passes all three edges on the same side. The edges'
coordinates are computed once, in the frame of their rigid piece; when a piece moves, the few lines
are transformed into its frame instead. Neighbouring triangles have exactly opposite coordinates of
their common edge, so no line passes through a seam.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

#: Vertices (V, 3) in metres and triangles (T, 3) of rows of them.
Surface = tuple[FloatArray, NDArray[np.int64]]

#: Number of triangles in a cluster; lines are tested against clusters, each with a bounding box.
CLUSTER: Final = 16
#: Number of edges in a cluster.
SIDES: Final = 3 * CLUSTER
# Smallest component of a direction, so that nothing is divided by 0.
_TINY_M: Final = 1e-12


class TriangleSet:
    """Triangles in P rigid pieces, divided into C clusters, prepared for lines of sight.

    Attributes:
        pieces: P.
        clusters: C.
        starts: (P,) first cluster of each piece.
        counts: (P,) number of its clusters.
        boxes_m: (2, 3, C) low and high corner of a box around each cluster.
        piece_boxes_m: (2, 3, P) low and high corner of a box around each piece.
        edges: (C, 6, 48) Plücker coordinates of the first, second and third edges.
        planes: (C, 4, 16) planes of the triangles: −n and n · first corner.
        corners_m: (C, 3, 3, 16) axis by axis and corner by corner, the corners of the triangles;
            unused ones are 0.
    """

    def __init__(self, pieces: Sequence[Surface]) -> None:
        corners = [vertices[triangles] for vertices, triangles in pieces]
        clusters = [
            (number, piece[rows])
            for number, piece in enumerate(corners)
            for rows in _clusters(piece.mean(axis=1))
        ]
        count = len(clusters)
        self.clusters = count
        self.pieces = len(pieces)
        piece_of = np.array([number for number, _ in clusters], dtype=np.int64)
        boxes = np.array(
            [(part.min(axis=(0, 1)), part.max(axis=(0, 1))) for _, part in clusters]
        ).reshape(count, 2, 3)
        self.starts = np.searchsorted(piece_of, np.arange(self.pieces))
        self.counts = np.bincount(piece_of, minlength=self.pieces)
        self.boxes_m = np.ascontiguousarray(boxes.transpose(1, 2, 0))
        self.piece_boxes_m = _boxes_of_pieces(self.boxes_m, self.starts, self.counts)
        # Unused rows of a cluster hold triangles without area, which no line meets.
        packed = np.zeros((count, CLUSTER, 3, 3))
        for row, (_, part) in enumerate(clusters):
            packed[row, : len(part)] = part
        self.corners_m = np.ascontiguousarray(packed.transpose(0, 3, 2, 1))
        first, second, third = packed[:, :, 0], packed[:, :, 1], packed[:, :, 2]
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
        self.planes = np.ascontiguousarray(
            np.concatenate(
                [-normals, np.einsum("cti,cti->ct", first, normals)[..., None]], axis=2
            ).transpose(0, 2, 1)
        )

    @property
    def triangles(self) -> int:
        """The number of triangles."""
        return int(np.count_nonzero(self.planes[:, :3].any(axis=1)))


def meet_triangles(
    edges: FloatArray, planes: FloatArray, eye_m: FloatArray, along_m: FloatArray
) -> NDArray[np.bool_]:
    """Return (N,) whether each segment from eyes (N, 3) along (N, 3) meets a cluster of its own.

    ``edges`` (N, 6, 48) and ``planes`` (N, 4, 16) are rows of those of a :class:`TriangleSet`.
    """
    sides = (_plucker(eye_m, along_m)[:, None] @ edges)[:, 0]
    one, two, three = (sides[:, k * CLUSTER : (k + 1) * CLUSTER] for k in range(3))
    rate = one + two + three
    # The line meets the plane at the share start / rate of its length.
    origin = np.ones((len(edges), 1, 4))
    origin[:, 0, :3] = eye_m
    start = (origin @ planes)[:, 0]
    met = (start * rate > 0.0) & (np.abs(start) < np.abs(rate))
    met &= (np.minimum(np.minimum(one, two), three) >= 0.0) | (
        np.maximum(np.maximum(one, two), three) <= 0.0
    )
    return np.asarray(np.logical_or.reduce(met, axis=1))


def _plucker(eye_m: FloatArray, along_m: FloatArray) -> FloatArray:
    """Return the Plücker coordinates (N, 6) [d, d × o] of lines from eyes (N, 3) along (N, 3)."""
    out = np.empty((len(along_m), 6))
    out[:, :3] = along_m
    (x, y, z), (ox, oy, oz) = along_m.T, eye_m.T
    out[:, 3] = y * oz - z * oy
    out[:, 4] = z * ox - x * oz
    out[:, 5] = x * oy - y * ox
    return out


def _boxes_of_pieces(
    boxes_m: FloatArray, starts: NDArray[np.int64], counts: NDArray[np.int64]
) -> FloatArray:
    """Return (2, 3, P) around the clusters' boxes (2, 3, C) of each piece; 0 for an empty piece."""
    out = np.zeros((2, 3, len(starts)))
    for piece, (start, count) in enumerate(zip(starts.tolist(), counts.tolist(), strict=True)):
        if count:
            own = boxes_m[..., start : start + count]
            out[0, :, piece], out[1, :, piece] = own[0].min(axis=1), own[1].max(axis=1)
    return out


def _clusters(centres_m: FloatArray) -> list[NDArray[np.int64]]:
    """Return the rows of triangles in compact groups, by halving along the longest extent."""
    stack, done = [np.arange(len(centres_m))], []
    while stack:
        rows = stack.pop()
        if len(rows) <= CLUSTER:
            if len(rows):
                done.append(rows)
            continue
        axis = int(np.ptp(centres_m[rows], axis=0).argmax())
        order = rows[np.argsort(centres_m[rows, axis], kind="stable")]
        stack += [order[: len(order) // 2], order[len(order) // 2 :]]
    return done


def meet_boxes(eye_m: FloatArray, along_m: FloatArray, boxes_m: FloatArray) -> NDArray[np.bool_]:
    """Return (N, K) whether segments from an eye (3,) along (K, 3) meet boxes (N, 2, 3)."""
    inverse = inverse_of(along_m)
    first = (boxes_m[:, None, 0] - eye_m) * inverse
    last = (boxes_m[:, None, 1] - eye_m) * inverse
    enter, leave = np.minimum(first, last).max(axis=2), np.maximum(first, last).min(axis=2)
    return np.asarray(np.maximum(enter, 0.0) <= np.minimum(leave, 1.0))


def meet_own_boxes(
    eye_m: FloatArray, inverse: FloatArray, boxes_m: FloatArray
) -> NDArray[np.bool_]:
    """Return (N,) whether each segment meets a box of its own.

    Args:
        eye_m: (3, N) starts of the segments.
        inverse: (3, N) :func:`inverse_of` their directions.
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
    """Return one over each component of directions; a component may be 0."""
    return np.asarray(1.0 / np.where(np.abs(along_m) < _TINY_M, _TINY_M, along_m))


@dataclass(frozen=True, slots=True, eq=False)
class JoinedSets:
    """The bounds of S sets of triangles, P pieces and C clusters, in common tables.

    Attributes:
        pieces: (S,) number of pieces of each set.
        middles_m: (P, 3) centre of each piece's bounding sphere, in the piece's frame.
        radii_m: (P,) its radius.
        piece_boxes_m: (2, 3, P) bounding box of each piece.
        starts: (P,) first cluster of each piece.
        counts: (P,) number of its clusters.
        boxes_m: (2, 3, C) bounding box of each cluster.
    """

    pieces: NDArray[np.int64]
    middles_m: FloatArray
    radii_m: FloatArray
    piece_boxes_m: FloatArray
    starts: NDArray[np.int64]
    counts: NDArray[np.int64]
    boxes_m: FloatArray


@lru_cache(maxsize=128)  # the same few bodies are near each other for many frames
def joined_sets(sets: tuple[TriangleSet, ...]) -> JoinedSets:
    """Return the bounds of several sets in common tables."""
    piece_boxes = np.concatenate([triangles.piece_boxes_m for triangles in sets], axis=2)
    counts = np.concatenate([triangles.counts for triangles in sets])
    halves = 0.5 * (piece_boxes[1] - piece_boxes[0])
    return JoinedSets(
        np.array([triangles.pieces for triangles in sets]),
        (0.5 * (piece_boxes[0] + piece_boxes[1])).T,
        np.sqrt((halves * halves).sum(axis=0)),
        piece_boxes,
        np.cumsum(counts) - counts,
        counts,
        np.concatenate([triangles.boxes_m for triangles in sets], axis=2),
    )


def clusters_of(starts: NDArray[np.int64], counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the clusters of pieces one after the other: from each start as many as its count."""
    return np.arange(int(counts.sum())) + np.repeat(starts - np.cumsum(counts) + counts, counts)


def parts_of(
    sets: Sequence[TriangleSet], clusters: NDArray[np.int64]
) -> Iterator[tuple[TriangleSet, slice, NDArray[np.int64]]]:
    """Yield each set that has some of the clusters, where these are, and their rows in the set.

    Args:
        sets: the sets.
        clusters: (N,) numbered through all sets, those of each set together and in their order.
    """
    begin, first = 0, 0
    for triangles in sets:
        end = int(np.searchsorted(clusters, first + triangles.clusters))
        if end > begin:
            yield triangles, slice(begin, end), clusters[begin:end] - first
        begin, first = end, first + triangles.clusters
