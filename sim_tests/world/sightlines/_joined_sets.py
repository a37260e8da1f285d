"""The bounds of several sets of triangles in common tables, to test them all at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ._triangles import TriangleSet


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
