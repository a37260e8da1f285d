"""Observations that are lost, added or changed by a fault."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from perception import Camera, PersonObservation
from perception.arrays import FloatArray

from ..eyes import NOBODY, WorkerObservations
from ._fault import Bursts, Fault, Ghosts

_GHOST_RANGE_M: Final = (1.0, 8.0)
_GHOST_CHEST_HEIGHT_M: Final = 1.3
_GHOST_NOISE_M: Final = 0.05
_GHOST_STD_M: Final = 0.1
_GHOST_AWARENESS_STD: Final = 0.1


class FaultyDetections:
    """Detections with a fault, frame after frame.

    Args:
        fault: the fault.
        camera: camera in whose view ghosts appear.
        rng: random generator of the fault.
    """

    def __init__(self, fault: Fault, camera: Camera, rng: np.random.Generator) -> None:
        self._fault = fault
        self._miss_rng, burst_rng, ghost_rng = rng.spawn(3)
        self._bursts = _PersonBursts(fault.bursts, burst_rng)
        self._ghosts = _GhostProcess(fault.ghosts, camera, ghost_rng)

    def apply(
        self, observations: WorkerObservations, stamp_s: float, T_odom_camera: FloatArray
    ) -> WorkerObservations:
        """Return the observations of one frame that remain, and the false ones.

        Args:
            observations: true observations, each with the index of its worker.
            stamp_s: time of the frame; grows from call to call.
            T_odom_camera: (4, 4) true pose of the camera.
        """
        draws = self._miss_rng.random(len(observations)).tolist()
        remaining = [
            (self._biased(observation), worker)
            for (observation, worker), draw in zip(observations, draws, strict=True)
            if draw >= self._fault.miss_rate and not self._bursts.hides(worker, stamp_s)
        ]
        ghosts = self._ghosts.observe(stamp_s, T_odom_camera)
        return (*remaining, *((ghost, NOBODY) for ghost in ghosts))

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


class _PersonBursts:
    """The bursts of each person: one alternating renewal process per person."""

    def __init__(self, bursts: Bursts, rng: np.random.Generator) -> None:
        self._bursts = bursts
        self._key = int(rng.integers(2**63))
        self._processes: dict[int, _BurstProcess] = {}

    def hides(self, worker: int, stamp_s: float) -> bool:
        """Return whether a person is in a burst; ``stamp_s`` grows from call to call."""
        if self._bursts.for_s == 0.0:
            return False
        process = self._processes.get(worker)
        if process is None:
            # Seeded by index, so that the bursts of a person do not depend on the others.
            rng = np.random.default_rng([self._key, worker + 1])
            process = _BurstProcess(rng, self._bursts)
            self._processes[worker] = process
        return process.hides(stamp_s)


class _BurstProcess:
    """Alternating times in and out of a burst, both exponentially distributed."""

    def __init__(self, rng: np.random.Generator, bursts: Bursts) -> None:
        self._rng = rng
        self._mean_s = {True: bursts.for_s, False: bursts.every_s}
        # Start in the stationary distribution; exponential times have no memory.
        self._hidden = bool(rng.random() < bursts.for_s / (bursts.for_s + bursts.every_s))
        self._until_s = float(rng.exponential(self._mean_s[self._hidden]))

    def hides(self, stamp_s: float) -> bool:
        while self._until_s <= stamp_s:
            self._hidden = not self._hidden
            self._until_s += float(self._rng.exponential(self._mean_s[self._hidden]))
        return self._hidden


@dataclass(frozen=True, slots=True, eq=False)
class _Ghost:
    position_odom_m: FloatArray
    until_s: float
    awareness: float | None


class _GhostProcess:
    """The ghosts of one episode: they appear as a Poisson process."""

    def __init__(self, ghosts: Ghosts, camera: Camera, rng: np.random.Generator) -> None:
        self._settings = ghosts
        self._half_fov_rad = math.atan(0.5 * camera.width_px / camera.fx_px)
        self._rng = rng
        self._alive: list[_Ghost] = []
        self._next_s = self._interval_s()

    def _interval_s(self) -> float:
        rate_hz = self._settings.rate_hz
        return math.inf if rate_hz == 0.0 else float(self._rng.exponential(1.0 / rate_hz))

    def observe(self, stamp_s: float, T_odom_camera: FloatArray) -> list[PersonObservation]:
        """Return the observations of the ghosts in view; ``stamp_s`` grows from call to call."""
        while self._next_s <= stamp_s:
            self._alive.append(self._new_ghost(self._next_s, T_odom_camera))
            self._next_s += self._interval_s()
        self._alive = [ghost for ghost in self._alive if ghost.until_s > stamp_s]
        observations = (self._observation(ghost, stamp_s, T_odom_camera) for ghost in self._alive)
        return [observation for observation in observations if observation is not None]

    def _new_ghost(self, t_s: float, T_odom_camera: FloatArray) -> _Ghost:
        distance, bearing, life, alpha = self._rng.random(4).tolist()
        nearest_m, farthest_m = _GHOST_RANGE_M
        distance_m = nearest_m + distance * (farthest_m - nearest_m)
        angle = (2.0 * bearing - 1.0) * self._half_fov_rad
        ahead, right = T_odom_camera[:2, 2], T_odom_camera[:2, 0]
        position = T_odom_camera[:3, 3].copy()
        position[:2] += distance_m * (math.cos(angle) * ahead + math.sin(angle) * right)
        position[2] = _GHOST_CHEST_HEIGHT_M
        position.setflags(write=False)
        awareness = 2.0 * alpha if alpha < 0.5 else None
        return _Ghost(position, t_s - self._settings.for_s * math.log1p(-life), awareness)

    def _observation(
        self, ghost: _Ghost, stamp_s: float, T_odom_camera: FloatArray
    ) -> PersonObservation | None:
        noise = self._rng.normal(0.0, _GHOST_NOISE_M, 3)
        position = (ghost.position_odom_m - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3] + noise
        if position[2] <= 0.3 or abs(math.atan2(position[0], position[2])) > self._half_fov_rad:
            return None  # outside the field of view
        return PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=position,
            position_covariance_m2=_GHOST_STD_M**2 * np.eye(3),
            gaze_camera=None,
            awareness=ghost.awareness,
            awareness_std=None if ghost.awareness is None else _GHOST_AWARENESS_STD,
            score=0.5,
        )
