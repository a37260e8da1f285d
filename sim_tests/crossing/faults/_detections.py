"""Observations that are lost, added or changed between the eyes and the tracker."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from perception import Camera, PersonObservation
from perception.arrays import FloatArray

from ..eyes import NOBODY
from ._fault import Bursts, Fault, Ghosts

Seen = tuple[tuple[PersonObservation, int], ...]

_GHOST_RANGE_M: Final = (1.0, 8.0)
_GHOST_CHEST_M: Final = 1.3
_GHOST_NOISE_M: Final = 0.05
_GHOST_STD_M: Final = 0.1
_GHOST_AWARENESS_STD: Final = 0.1


class FaultyDetections:
    """Changes what the eyes saw in one frame after another.

    Args:
        fault: what is wrong.
        camera: in whose view ghosts appear.
        rng: of all that is drawn here.
    """

    def __init__(self, fault: Fault, camera: Camera, rng: np.random.Generator) -> None:
        self._fault = fault
        self._miss_rng, burst_rng, ghost_rng = rng.spawn(3)
        self._bursts = _BurstBook(fault.bursts, burst_rng)
        self._ghosts = _GhostBook(fault.ghosts, camera, ghost_rng)

    def of(self, seen: Seen, stamp_s: float, T_odom_camera: FloatArray) -> Seen:
        """What is left of a frame, and what was never there.

        Args:
            seen: each observation with the index of its worker.
            stamp_s: of the frame, later than those before.
            T_odom_camera: (4, 4) where the camera truly was.
        """
        draws = self._miss_rng.random(len(seen)).tolist()
        kept = [
            (self._biased(observation), index)
            for (observation, index), draw in zip(seen, draws, strict=True)
            if draw >= self._fault.miss_rate and not self._bursts.hides(index, stamp_s)
        ]
        ghosts = self._ghosts.seen(stamp_s, T_odom_camera)
        return (*kept, *((ghost, NOBODY) for ghost in ghosts))

    def _biased(self, observation: PersonObservation) -> PersonObservation:
        fault, alpha, std = self._fault, observation.awareness, observation.awareness_std
        if alpha is None or std is None:
            return observation
        if fault.awareness_bias == 0.0 and fault.awareness_std_factor == 1.0:
            return observation
        return replace(
            observation,
            awareness=min(max(alpha + fault.awareness_bias, 0.0), 1.0),
            awareness_std=std * fault.awareness_std_factor,
        )


class _BurstBook:
    """When each person is not seen: an alternating renewal process a person."""

    def __init__(self, bursts: Bursts, rng: np.random.Generator) -> None:
        self._bursts = bursts
        self._key = int(rng.integers(2**63))
        self._people: dict[int, _Stretch] = {}

    def hides(self, index: int, stamp_s: float) -> bool:
        if self._bursts.for_s == 0.0:
            return False
        stretch = self._people.get(index)
        if stretch is None:
            # By index: whoever else is seen, a person's fate is the same.
            rng = np.random.default_rng([self._key, index + 1])
            stretch = _Stretch(rng, self._bursts)
            self._people[index] = stretch
        return stretch.hidden(stamp_s)


class _Stretch:
    def __init__(self, rng: np.random.Generator, bursts: Bursts) -> None:
        self._rng = rng
        self._mean_s = {True: bursts.for_s, False: bursts.every_s}
        # In the long run's mix from the start; lengths without a memory need no first drawn apart.
        self._hidden = bool(rng.random() < bursts.for_s / (bursts.for_s + bursts.every_s))
        self._until_s = float(rng.exponential(self._mean_s[self._hidden]))

    def hidden(self, stamp_s: float) -> bool:
        while self._until_s <= stamp_s:
            self._hidden = not self._hidden
            self._until_s += float(self._rng.exponential(self._mean_s[self._hidden]))
        return self._hidden


@dataclass(frozen=True, slots=True, eq=False)
class _Ghost:
    position_odom_m: FloatArray
    until_s: float
    awareness: float | None


class _GhostBook:
    """Who is seen and is not there."""

    def __init__(self, ghosts: Ghosts, camera: Camera, rng: np.random.Generator) -> None:
        self._ghosts = ghosts
        self._half_fov_rad = math.atan(0.5 * camera.width_px / camera.fx_px)
        self._rng = rng
        self._there: list[_Ghost] = []
        self._next_s = self._wait_s()

    def _wait_s(self) -> float:
        rate_hz = self._ghosts.rate_hz
        return math.inf if rate_hz == 0.0 else float(self._rng.exponential(1.0 / rate_hz))

    def seen(self, stamp_s: float, T_odom_camera: FloatArray) -> list[PersonObservation]:
        while self._next_s <= stamp_s:
            self._there.append(self._born(self._next_s, T_odom_camera))
            self._next_s += self._wait_s()
        self._there = [ghost for ghost in self._there if ghost.until_s > stamp_s]
        observations = (self._observed(ghost, stamp_s, T_odom_camera) for ghost in self._there)
        return [observation for observation in observations if observation is not None]

    def _born(self, t_s: float, T_odom_camera: FloatArray) -> _Ghost:
        range_m, bearing, life, alpha = self._rng.random(4).tolist()
        nearest, farthest = _GHOST_RANGE_M
        distance_m = nearest + range_m * (farthest - nearest)
        angle = (2.0 * bearing - 1.0) * self._half_fov_rad
        ahead, right = T_odom_camera[:2, 2], T_odom_camera[:2, 0]
        position = T_odom_camera[:3, 3].copy()
        position[:2] += distance_m * (math.cos(angle) * ahead + math.sin(angle) * right)
        position[2] = _GHOST_CHEST_M
        position.setflags(write=False)
        awareness = 2.0 * alpha if alpha < 0.5 else None
        return _Ghost(position, t_s - self._ghosts.for_s * math.log1p(-life), awareness)

    def _observed(
        self, ghost: _Ghost, stamp_s: float, T_odom_camera: FloatArray
    ) -> PersonObservation | None:
        noise = self._rng.normal(0.0, _GHOST_NOISE_M, 3)
        position = (ghost.position_odom_m - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3] + noise
        if position[2] <= 0.3 or abs(math.atan2(position[0], position[2])) > self._half_fov_rad:
            return None  # the camera has turned away from it, or driven past
        return PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=position,
            position_covariance_m2=_GHOST_STD_M**2 * np.eye(3),
            gaze_camera=None,
            awareness=ghost.awareness,
            awareness_std=None if ghost.awareness is None else _GHOST_AWARENESS_STD,
            score=0.5,
        )
