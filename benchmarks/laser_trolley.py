"""Trolleys that people push, as laser scanners see them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Final, Literal, get_args

import numpy as np

from perception.arrays import FloatArray
from sim_tests.world.hall import box
from sim_tests.world.sightlines import PlacedSurface, TriangleSet

#: What scanners meet of a trolley: its base, or its castors below a higher platform.
TrolleyKind = Literal["base", "castors"]
TROLLEY_KINDS: Final[tuple[TrolleyKind, ...]] = get_args(TrolleyKind)
#: Length along the direction of travel, and width.
TROLLEY_SIZE_M: Final = (0.9, 0.6)
#: From the middle of the person who pushes it with outstretched arms to its middle.
TROLLEY_AHEAD_M: Final = 0.95

_BASE_Z_M: Final = (0.1, 0.3)
_PLATFORM_Z_M: Final = (0.24, 0.32)
# A castor's fork, and its middle from the edges.
_FORK_M: Final = (0.07, 0.05)
_INSET_M: Final = 0.06


class Trolley:
    """A trolley that hides what is behind it and that scanners see.

    Args:
        kind: what scanners meet of it.
        pose: returns its middle x, y and its heading in odom.
    """

    def __init__(self, kind: TrolleyKind, pose: Callable[[], tuple[float, float, float]]) -> None:
        self.kind: Final = kind
        self._pose = pose

    @property
    def middle_odom_m(self) -> FloatArray:
        """(2,) its middle."""
        return np.array(self._pose()[:2])

    def reach_odom_m(self) -> FloatArray:
        """Return (2, 3) the low and high corner of a box around it."""
        radius = 0.5 * float(np.hypot(*TROLLEY_SIZE_M))
        middle = self.middle_odom_m
        return np.array([(*(middle - radius), 0.0), (*(middle + radius), _PLATFORM_Z_M[1])])

    def surface(self, detail: int) -> PlacedSurface:
        """Return its surface now; all levels of detail are the same."""
        x, y, heading = self._pose()
        T = np.eye(4)
        cos, sin = np.cos(heading), np.sin(heading)
        T[:2, :2] = (cos, -sin), (sin, cos)
        T[:2, 3] = x, y
        triangles = _triangles(self.kind)
        return PlacedSurface(triangles, np.broadcast_to(T, (triangles.pieces, 4, 4)))


@lru_cache(maxsize=len(TROLLEY_KINDS))
def _triangles(kind: TrolleyKind) -> TriangleSet:
    length, width = TROLLEY_SIZE_M
    low, high = _BASE_Z_M if kind == "base" else _PLATFORM_Z_M
    parts = [box((0.0, 0.0, 0.5 * (low + high)), (length, width, high - low))]
    if kind == "castors":
        x, y = 0.5 * length - _INSET_M, 0.5 * width - _INSET_M
        parts += [
            box((side * x, end * y, 0.5 * low), (*_FORK_M, low))
            for side in (-1.0, 1.0)
            for end in (-1.0, 1.0)
        ]
    return TriangleSet([(part.vertices_m, part.indices.reshape(-1, 3)) for part in parts])
