"""Wanderers in a hall, and trolleys that people push, as scanners meet them."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Final, Literal, get_args

import numpy as np

from perception.arrays import FloatArray
from sim_tests.world import crosses_boxes
from sim_tests.world.hall import box
from sim_tests.world.sightlines import PlacedSurface, TriangleSet

# Half the side of the square around a place in which new places are chosen.
_NEAR_M: Final = 6.0


class Wanderer:
    """Somebody or something that moves between random free places, and stands in between.

    Args:
        boxes: (N, 4) what it keeps clear of.
        rng: chooses the way.
        clearance_m: distance from the boxes.
        speeds_mps: lowest and highest speed.
        stands: share of stops; 1 never moves.
        near: returns a place; new places are chosen around it. None for the whole hall.
    """

    def __init__(
        self,
        boxes: FloatArray,
        rng: np.random.Generator,
        clearance_m: float,
        speeds_mps: tuple[float, float],
        stands: float,
        near: Callable[[], FloatArray] | None = None,
    ) -> None:
        self._near = near
        self._boxes, self._rng, self._clearance_m = boxes, rng, clearance_m
        self._speeds, self._stands = speeds_mps, stands
        self.place_m = self._free()
        self.heading_rad = float(rng.uniform(-math.pi, math.pi))
        self.speed_mps, self.yaw_rate_radps = 0.0, 0.0
        self._goal, self._until_s = self.place_m, float(rng.uniform(0.0, 4.0))

    def advance(self, t_s: float, dt_s: float) -> None:
        """Move on by one step of time."""
        to = self._goal - self.place_m
        distance = float(np.linalg.norm(to))
        if t_s < self._until_s or self._stands >= 1.0:
            self.speed_mps = self.yaw_rate_radps = 0.0
            return
        if distance < 0.1:
            self._goal = self._next()
            if self._rng.random() < self._stands:
                self._until_s = t_s + float(self._rng.uniform(1.0, 6.0))
            self._speed = float(self._rng.uniform(*self._speeds))
            return
        wanted = math.atan2(to[1], to[0])
        turn = math.remainder(wanted - self.heading_rad, math.tau)
        step = min(max(turn, -1.5 * dt_s), 1.5 * dt_s)
        self.yaw_rate_radps = step / dt_s
        self.heading_rad += step
        self.speed_mps = self._speed if abs(turn) < 0.3 else 0.0
        along = np.array([math.cos(self.heading_rad), math.sin(self.heading_rad)])
        self.place_m = self.place_m + self.speed_mps * dt_s * along

    def _next(self) -> FloatArray:
        for _ in range(200):
            place = self._free()
            offset = place - self.place_m
            sides = np.array([[0.0, 0.0], [-offset[1], offset[0]], [offset[1], -offset[0]]])
            sides *= self._clearance_m / max(float(np.linalg.norm(offset)), 1e-6)
            if np.linalg.norm(offset) < 8.0 and not any(
                crosses_boxes(self._boxes, self.place_m + side, [place + side])[0] for side in sides
            ):
                return place
        return self.place_m

    def _free(self) -> FloatArray:
        low, high = self._boxes[:, :2].min(axis=0), self._boxes[:, 2:].max(axis=0)
        if self._near is not None:
            place = self._near()
            low, high = np.maximum(low, place - _NEAR_M), np.minimum(high, place + _NEAR_M)
        while True:
            place = self._rng.uniform(low, high)
            away = np.maximum(self._boxes[:, :2] - place, place - self._boxes[:, 2:])
            if np.linalg.norm(np.maximum(away, 0.0), axis=1).min() > self._clearance_m:
                return np.asarray(place)


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
