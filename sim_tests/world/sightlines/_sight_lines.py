"""Lines of sight from an eye to points, and planes of scanners, met by the surfaces of a scene.

Surfaces are those of scenery, people, held things and the robot.
"""

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
    clusters_of,
    inverse_of,
    joined_sets,
    meet_boxes,
    meet_own_boxes,
    meet_triangles,
    parts_of,
)

# Added to the radii of bounding spheres, against rounding of lines that just touch one.
_MARGIN_M: Final = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class PlacedSurface:
    """A set of triangles at its present pose.

    Attributes:
        triangles: triangles in rigid pieces.
        T_odom_piece: (P, 4, 4) rigid, from each piece's frame, scaled by ``scale``, to odom.
        scale: size of the surface relative to its triangles.
    """

    triangles: TriangleSet
    T_odom_piece: FloatArray
    scale: float = 1.0

    def blocks(self, eye_odom_m: FloatArray, ends_odom_m: FloatArray) -> NDArray[np.bool_]:
        """Return (K,) whether it lies between the eye (3,) and each of the points (K, 3)."""
        every_line = np.ones((1, len(ends_odom_m)), dtype=bool)
        return _blocked_by((self,), eye_odom_m, ends_odom_m, every_line)


@runtime_checkable
class Occluder(Protocol):
    """Something that moves and hides what is behind it."""

    def reach_odom_m(self) -> FloatArray:
        """Return the low and high corner (2, 3) of a box around it; cheaper than its surface."""
        ...

    def surface(self, detail: int) -> PlacedSurface | None:
        """Return its surface now at a level of detail (0: the finest); None if it has none."""
        ...


class SightLines:
    """Tests straight lines against the surfaces of one hall and of everything that moves in it.

    Args:
        layout: the hall.
        variant: number of the scenery's variant.
        actors: everything that moves in it; an actor that is no :class:`Occluder` hides nothing.
    """

    def __init__(
        self, layout: WarehouseLayout, variant: int = 0, actors: Iterable[object] = ()
    ) -> None:
        self._scenery = scenery_surface(layout, variant)
        self._occluders = [actor for actor in actors if isinstance(actor, Occluder)]

    def blocked(
        self, eye_odom_m: FloatArray, ends_odom_m: FloatArray, detail: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """Return (K,) whether anything lies between the eye and each of the points.

        Args:
            eye_odom_m: (3,).
            ends_odom_m: (K, 3).
            detail: (K,) level of detail of the bodies tested against each line: 0 is the finest,
                2 the coarsest.
        """
        surfaces = [self._scenery]
        tested: list[NDArray[np.bool_]] = [np.ones(len(ends_odom_m), dtype=bool)]
        boxes = np.array([occluder.reach_odom_m() for occluder in self._occluders])
        near = meet_boxes(eye_odom_m, ends_odom_m - eye_odom_m, boxes.reshape(-1, 2, 3))
        levels = [(level, detail == level) for level in sorted(set(detail.tolist()))]
        for number in np.flatnonzero(near.any(axis=1)).tolist():
            previous: TriangleSet | None = None
            for level, of_level in levels:
                lines = near[number] & of_level
                if not lines.any():
                    continue
                surface = self._occluders[number].surface(level)
                if surface is None:
                    break
                if surface.triangles is previous:
                    tested[-1] |= lines  # both levels have the same triangles
                    continue
                previous = surface.triangles
                surfaces.append(surface)
                tested.append(lines)
        return _blocked_by(surfaces, eye_odom_m, ends_odom_m, np.array(tested))


def _blocked_by(
    surfaces: Sequence[PlacedSurface],
    eye_odom_m: FloatArray,
    ends_odom_m: FloatArray,
    tested: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return (K,) whether any of S surfaces lies between the eye (3,) and each point (K, 3).

    ``tested`` (S, K) says which lines are tested against each surface. Several surfaces at once
    cost little more than one.
    """
    blocked = np.zeros(len(ends_odom_m), dtype=bool)
    sets = tuple(surface.triangles for surface in surfaces)
    joined = joined_sets(sets)
    poses = np.concatenate([surface.T_odom_piece for surface in surfaces])
    scales = np.repeat([surface.scale for surface in surfaces], joined.pieces)[:, None]
    # Most lines pass far from most pieces: only pairs that come near each other are tested.
    middles, radii = joined.middles_m * scales, joined.radii_m * scales[:, 0] + _MARGIN_M
    rotations, origins = poses[:, :3, :3], poses[:, :3, 3]
    offsets = (rotations @ middles[:, :, None])[..., 0] + (origins - eye_odom_m)
    near = _near(offsets, radii, ends_odom_m - eye_odom_m)
    near &= np.repeat(tested, joined.pieces, axis=0)
    piece, line = near.nonzero()
    if not piece.size:
        return blocked
    segments = np.empty((len(piece), 2, 3))
    segments[:, 0], segments[:, 1] = eye_odom_m, ends_odom_m[line]
    segments = (segments - origins[piece][:, None]) @ (rotations / scales[..., None])[piece]
    eye, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    eyes, inverse = np.ascontiguousarray(eye.T), inverse_of(along.T)
    pairs = np.flatnonzero(meet_own_boxes(eyes, inverse, joined.piece_boxes_m[..., piece]))
    piece = piece[pairs]
    # Each pair is combined with every cluster of triangles of its piece.
    counts = joined.counts[piece]
    pair, cluster = np.repeat(pairs, counts), clusters_of(joined.starts[piece], counts)
    boxes = joined.boxes_m[..., cluster]
    met = np.flatnonzero(meet_own_boxes(eyes[:, pair], inverse[:, pair], boxes))
    pair, cluster = pair[met], cluster[met]
    if not cluster.size:
        return blocked
    edges, planes = np.empty((len(cluster), 6, SIDES)), np.empty((len(cluster), 4, CLUSTER))
    for triangles, part, rows in parts_of(sets, cluster):
        triangles.edges.take(rows, axis=0, out=edges[part], mode="clip")
        triangles.planes.take(rows, axis=0, out=planes[part], mode="clip")
    blocked[line[pair[meet_triangles(edges, planes, eye[pair], along[pair])]]] = True
    return blocked


def _near(points_m: FloatArray, radii_m: FloatArray, along_m: FloatArray) -> NDArray[np.bool_]:
    """Return (P, K) whether segments from 0 along (K, 3) come within radii (P,) of points (P, 3).

    Squared distances are compared.
    """
    squares = (along_m * along_m).sum(axis=1)
    forward = points_m @ along_m.T
    share = np.minimum(np.maximum(forward / np.maximum(squares, 1e-12), 0.0), 1.0)
    distances2 = (points_m * points_m).sum(axis=1)[:, None]
    distances2 = distances2 - share * (2.0 * forward - share * squares)
    return np.asarray(distances2 <= (radii_m * radii_m)[:, None])


@lru_cache(maxsize=8)  # many episodes use the same hall
def scenery_surface(layout: WarehouseLayout, variant: int) -> PlacedSurface:
    """Return the triangles of a hall's scenery in odom, one piece a chunk."""
    meshes = [chunk.mesh for chunk in scenery(layout, variant)]
    triangles = TriangleSet([(mesh.vertices_m, mesh.indices.reshape(-1, 3)) for mesh in meshes])
    return PlacedSurface(triangles, np.broadcast_to(np.eye(4), (triangles.pieces, 4, 4)))


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
