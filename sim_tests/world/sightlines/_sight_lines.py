"""What stands between a camera and some points: scenery, people, what they hold, the robot."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..hall import WarehouseLayout, scenery
from ._triangles import (
    CLUSTER,
    SIDES,
    TriangleSet,
    inverse_of,
    meet_boxes,
    meet_own_boxes,
    meet_triangles,
)

# What rounding may leave of a line that just touches a sphere.
_MARGIN_M: Final = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class PlacedSurface:
    """A set of triangles where it is now.

    Attributes:
        triangles: in rigid pieces.
        T_odom_piece: (P, 4, 4) rigid, from each piece's frame, its metres times ``scale``, to odom.
        scale: size over that of the triangles.
    """

    triangles: TriangleSet
    T_odom_piece: FloatArray
    scale: float = 1.0

    def blocks(self, eye_odom_m: FloatArray, ends_odom_m: FloatArray) -> NDArray[np.bool_]:
        """(K,) whether it lies between the eye (3,) and each of the points (K, 3)."""
        asked = np.ones((1, len(ends_odom_m)), dtype=bool)
        return _blocked_by((self,), eye_odom_m, ends_odom_m, asked)


@runtime_checkable
class Occluder(Protocol):
    """Something that moves and hides what is behind it."""

    def reach_odom_m(self) -> FloatArray:
        """(2, 3) low and high corner of a generous box about it; cheaper than its surface."""
        ...

    def surface(self, detail: int) -> PlacedSurface | None:
        """Its surface now, at a level of detail (0 is the finest); None when there is nothing."""
        ...


class SightLines:
    """Holds straight lines against the surfaces of one hall and all that moves in it.

    Args:
        layout: the hall.
        variant: of its scenery.
        actors: whatever may move in it; those that are no :class:`Occluder` hide nothing.
    """

    def __init__(
        self, layout: WarehouseLayout, variant: int = 0, actors: Iterable[object] = ()
    ) -> None:
        self._scenery = _scenery_triangles(layout, variant)
        self._occluders = [actor for actor in actors if isinstance(actor, Occluder)]

    def blocked(
        self, eye_odom_m: FloatArray, ends_odom_m: FloatArray, detail: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """(K,) whether anything lies between the eye (3,) and each of the points (K, 3).

        Args:
            eye_odom_m: (3,).
            ends_odom_m: (K, 3).
            detail: (K,) of the bodies held against each line: 0 the finest, 2 the coarsest.
        """
        blocked = self._scenery.blocks(eye_odom_m[None], ends_odom_m[None])
        if not self._occluders:
            return blocked
        boxes = np.array([occluder.reach_odom_m() for occluder in self._occluders])
        eyes = np.broadcast_to(eye_odom_m, (len(boxes), 3))
        along = np.broadcast_to(ends_odom_m - eye_odom_m, (len(boxes), *ends_odom_m.shape))
        near = meet_boxes(eyes, along, boxes) & ~blocked
        levels = [(level, detail == level) for level in sorted(set(detail.tolist()))]
        surfaces: list[PlacedSurface] = []
        asked: list[NDArray[np.bool_]] = []
        for number in np.flatnonzero(near.any(axis=1)).tolist():
            last: TriangleSet | None = None
            for level, lines in levels:
                held = near[number] & lines
                if not held.any():
                    continue
                surface = self._occluders[number].surface(level)
                if surface is None:
                    break
                if surface.triangles is last:
                    asked[-1] |= held  # there is one level of detail
                    continue
                last = surface.triangles
                surfaces.append(surface)
                asked.append(held)
        if surfaces:
            blocked |= _blocked_by(surfaces, eye_odom_m, ends_odom_m, np.array(asked))
        return blocked


def _blocked_by(
    surfaces: Sequence[PlacedSurface],
    eye_odom_m: FloatArray,
    ends_odom_m: FloatArray,
    asked: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Whether any of S surfaces lies between the eye (3,) and each of the points (K, 3).

    ``asked`` (S, K) says which lines each surface is held against; several surfaces at once cost
    little more than one.
    """
    blocked = np.zeros(len(ends_odom_m), dtype=bool)
    sets = tuple(surface.triangles for surface in surfaces)
    joined = _joined(sets)
    places = np.concatenate([surface.T_odom_piece for surface in surfaces])
    scales = np.repeat([surface.scale for surface in surfaces], joined.pieces)[:, None]
    # Most lines pass most pieces by: only pairs of the two that come near each other are looked at.
    middles, radii = joined.middles_m * scales, joined.radii_m * scales[:, 0] + _MARGIN_M
    rotations, origins = places[:, :3, :3], places[:, :3, 3]
    away = (rotations @ middles[:, :, None])[..., 0] + (origins - eye_odom_m)
    near = _near(away, radii, ends_odom_m - eye_odom_m) & np.repeat(asked, joined.pieces, axis=0)
    piece, line = near.nonzero()
    if not piece.size:
        return blocked
    segments = np.empty((len(piece), 2, 3))
    segments[:, 0], segments[:, 1] = eye_odom_m, ends_odom_m[line]
    segments = (segments - origins[piece][:, None]) @ (rotations / scales[..., None])[piece]
    eye, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    eyes, inverse = np.ascontiguousarray(eye.T), inverse_of(along.T)
    held = np.flatnonzero(meet_own_boxes(eyes, inverse, joined.piece_boxes_m[..., piece]))
    piece = piece[held]
    # Each pair with every cluster of triangles of its piece.
    many = joined.counts[piece]
    pair = np.repeat(held, many)
    skipped = joined.starts[piece] - np.cumsum(many) + many
    cluster = np.arange(len(pair)) + np.repeat(skipped, many)
    boxes = joined.boxes_m[..., cluster]
    met = np.flatnonzero(meet_own_boxes(eyes[:, pair], inverse[:, pair], boxes))
    pair, cluster = pair[met], cluster[met]
    if not cluster.size:
        return blocked
    edges, planes = np.empty((len(cluster), 6, SIDES)), np.empty((len(cluster), 4, CLUSTER))
    # Pairs are in the order of the pieces, and so of the sets.
    begin, first = 0, 0
    for one in sets:
        end = int(np.searchsorted(cluster, first + one.clusters))
        if end > begin:
            rows = cluster[begin:end] - first
            one.edges.take(rows, axis=0, out=edges[begin:end], mode="clip")
            one.planes.take(rows, axis=0, out=planes[begin:end], mode="clip")
        begin, first = end, first + one.clusters
    blocked[line[pair[meet_triangles(edges, planes, eye[pair], along[pair])]]] = True
    return blocked


@dataclass(frozen=True, slots=True, eq=False)
class _Joined:
    """What several sets of triangles have in common tables.

    ``pieces`` (S,) says how many each has; of every piece of all of them, ``middles_m`` (P, 3),
    ``radii_m`` (P,) and ``piece_boxes_m`` (2, 3, P) bound it, ``starts`` and ``counts`` (P,) are
    its clusters; ``boxes_m`` (2, 3, C) is about each cluster.
    """

    pieces: NDArray[np.int64]
    middles_m: FloatArray
    radii_m: FloatArray
    piece_boxes_m: FloatArray
    starts: NDArray[np.int64]
    counts: NDArray[np.int64]
    boxes_m: FloatArray


@lru_cache(maxsize=128)  # the same few bodies hide each other for many frames
def _joined(sets: tuple[TriangleSet, ...]) -> _Joined:
    piece_boxes = np.concatenate([one.piece_boxes_m for one in sets], axis=2)
    counts = np.concatenate([one.counts for one in sets])
    halves = 0.5 * (piece_boxes[1] - piece_boxes[0])
    return _Joined(
        np.array([one.pieces for one in sets]),
        (0.5 * (piece_boxes[0] + piece_boxes[1])).T,
        np.sqrt((halves * halves).sum(axis=0)),
        piece_boxes,
        np.cumsum(counts) - counts,
        counts,
        np.concatenate([one.boxes_m for one in sets], axis=2),
    )


def _near(away_m: FloatArray, radii_m: FloatArray, along_m: FloatArray) -> NDArray[np.bool_]:
    """(P, K) whether segments from 0 along (K, 3) come within radii (P,) of points (P, 3)."""
    squares = (along_m * along_m).sum(axis=1)
    forward = away_m @ along_m.T
    share = np.minimum(np.maximum(forward / np.maximum(squares, 1e-12), 0.0), 1.0)
    far = (away_m * away_m).sum(axis=1)[:, None] - share * (2.0 * forward - share * squares)
    return np.asarray(far <= (radii_m * radii_m)[:, None])


@lru_cache(maxsize=8)  # many episodes play in the same hall
def _scenery_triangles(layout: WarehouseLayout, variant: int) -> TriangleSet:
    meshes = [chunk.mesh for chunk in scenery(layout, variant)]
    surfaces = [(mesh.vertices_m, mesh.indices.reshape(-1, 3)) for mesh in meshes]
    return TriangleSet(surfaces, together=True)
