"""What stands between a camera and some points: scenery, people, what they hold, the robot."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..hall._layout import WarehouseLayout
from ..hall._scenery import scenery
from ._triangles import Surface, TriangleSet, meet_boxes

_AT_HOME: Final = np.eye(4)[None]


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
        points = np.concatenate([eye_odom_m[None], ends_odom_m])
        rotation, origin = self.T_odom_piece[:, :3, :3], self.T_odom_piece[:, :3, 3]
        local = (points - origin[:, None]) @ (rotation / self.scale)
        return self.triangles.blocks(local[:, 0], local[:, 1:])


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
        self._scenery = PlacedSurface(_scenery_triangles(layout, variant), _AT_HOME)
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
        blocked = self._scenery.blocks(eye_odom_m, ends_odom_m)
        if not self._occluders:
            return blocked
        boxes = np.array([occluder.reach_odom_m() for occluder in self._occluders])
        eyes = np.broadcast_to(eye_odom_m, (len(boxes), 3))
        along = np.broadcast_to(ends_odom_m - eye_odom_m, (len(boxes), *ends_odom_m.shape))
        near = meet_boxes(eyes, along, boxes)
        for number in np.flatnonzero(near.any(axis=1)).tolist():
            open_lines = near[number] & ~blocked
            for level in sorted(set(detail[open_lines].tolist())):
                surface = self._occluders[number].surface(level)
                if surface is None:
                    break
                asked = open_lines & (detail == level)
                blocked[asked] = surface.blocks(eye_odom_m, ends_odom_m[asked])
        return blocked


@lru_cache(maxsize=8)  # many episodes play in the same hall
def _scenery_triangles(layout: WarehouseLayout, variant: int) -> TriangleSet:
    surfaces: list[Surface] = []
    for chunk in scenery(layout, variant):
        surfaces.append((chunk.mesh.vertices_m, chunk.mesh.indices.reshape(-1, 3)))
    return TriangleSet([_joined(surfaces)])


def _joined(surfaces: list[Surface]) -> Surface:
    """All in one piece, since none of it moves."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in surfaces[:-1])])
    return (
        np.concatenate([vertices for vertices, _ in surfaces]),
        np.concatenate([rows + start for (_, rows), start in zip(surfaces, starts, strict=True)]),
    )
