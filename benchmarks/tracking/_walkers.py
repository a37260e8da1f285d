"""Simulated people who walk to goals, avoid one another, turn and stand: the truth.

The model is a social force after Helbing and Molnár (Phys. Rev. E 51, 1995, 4282). Every person is
pulled towards their own desired velocity and pushed away by people nearby and by the walls. The
desired velocity turns smoothly, so nobody changes direction from one frame to the next.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Longest step of the integration; the motion is sampled at the frames.
_STEP_S = 0.025
# Push of a wall on a person who touches it, and the distance over which it falls by e.
_WALL_MPS2, _WALL_RANGE_M = 3.0, 0.3
# Area of the square hall divided by the number of people.
_AREA_PER_PERSON_M2 = 4.0
# Mean and standard deviation over people of the preferred speed.
_SPEED_MEAN_MPS, _SPEED_STD_MPS = 1.2, 0.2
# Time constants: a person reaches the desired velocity, which follows a new goal.
_RELAXATION_S, _TURN_S = 1.0, 1.5
# Push of another person, the centre distance where it is strongest, and where it falls by e.
_PUSH_MPS2, _PERSONAL_SPACE_M, _PUSH_RANGE_M = 1.5, 0.4, 0.5
# A person who arrives stands for a while with this probability; shortest and longest stay.
_STAND_PROBABILITY, _STAND_S = 0.4, (2.0, 6.0)


def side_m(people: int) -> float:
    """Return the side of the square hall for a number of people."""
    return float(np.sqrt(_AREA_PER_PERSON_M2 * people))


class Walkers:
    """A crowd in a square hall, advanced in steps of time.

    Attributes:
        positions_m: (N, 2) now, frame of the hall, origin in a corner.
        velocities_mps: (N, 2) now.
    """

    def __init__(self, people: int, rng: np.random.Generator) -> None:
        self._rng, self._people = rng, people
        self._side_m = side_m(people)
        self.positions_m = self._starting_places()
        self._speeds = np.clip(rng.normal(_SPEED_MEAN_MPS, _SPEED_STD_MPS, people), 0.5, 2.0)
        self._goals_m = self._places(people)
        self._stands_s = np.where(rng.random(people) < 0.25, rng.uniform(*_STAND_S, people), 0.0)
        self._desired_mps = self._velocity_to_goal()
        self.velocities_mps: FloatArray = self._desired_mps.copy()

    def advance(self, dt_s: float) -> None:
        """Move all people by ``dt_s``."""
        steps = max(1, int(np.ceil(dt_s / _STEP_S - 1e-9)))
        for _ in range(steps):
            self._step(dt_s / steps)

    def _places(self, count: int) -> FloatArray:
        margin = min(0.5, 0.1 * self._side_m)
        return self._rng.uniform(margin, self._side_m - margin, (count, 2))

    def _starting_places(self) -> FloatArray:
        """Draw starting places at least 0.6 m from one another."""
        places: list[Any] = []
        while len(places) < self._people:
            place = self._places(1)[0]
            if all(np.hypot(*(place - other)) > 0.6 for other in places):
                places.append(place)
        return np.array(places)

    def _velocity_to_goal(self) -> FloatArray:
        """Return the velocity towards the goal, slower near it and zero while standing."""
        way = self._goals_m - self.positions_m
        distance = np.hypot(way[:, 0], way[:, 1])
        speed = np.minimum(self._speeds, distance / 0.8)
        speed = np.where(self._stands_s > 0.0, 0.0, speed)
        return np.asarray(way * (speed / np.maximum(distance, 1e-9))[:, None])

    def _step(self, dt_s: float) -> None:
        rng = self._rng
        self._stands_s = np.maximum(self._stands_s - dt_s, 0.0)
        arrived = (np.hypot(*(self._goals_m - self.positions_m).T) < 0.5) & (self._stands_s == 0.0)
        count = int(arrived.sum())
        if count:
            stands = rng.random(count) < _STAND_PROBABILITY
            self._stands_s[arrived] = np.where(stands, rng.uniform(*_STAND_S, count), 0.0)
            self._goals_m[arrived] = self._places(count)
        self._desired_mps += (self._velocity_to_goal() - self._desired_mps) * min(
            1.0, dt_s / _TURN_S
        )
        pull = (self._desired_mps - self.velocities_mps) / _RELAXATION_S
        # A standing person gives way less than a walking one.
        push = self._push() * np.where(self._stands_s > 0.0, 0.25, 1.0)[:, None]
        velocities = self.velocities_mps + (pull + push) * dt_s
        speed = np.hypot(velocities[:, 0], velocities[:, 1])
        fastest = 1.3 * self._speeds
        velocities *= np.minimum(1.0, fastest / np.maximum(speed, 1e-9))[:, None]
        self.positions_m = self.positions_m + 0.5 * (self.velocities_mps + velocities) * dt_s
        self.velocities_mps = velocities

    def _push(self) -> FloatArray:
        """Return the acceleration (N, 2) of each person away from others and from the walls."""
        offset = self.positions_m[:, None] - self.positions_m[None]
        distance = np.hypot(offset[..., 0], offset[..., 1])
        np.fill_diagonal(distance, np.inf)
        # A person ahead gets more distance than a person behind.
        heading = self.velocities_mps / np.maximum(np.hypot(*self.velocities_mps.T)[:, None], 1e-9)
        cosine = -(offset * heading[:, None]).sum(axis=-1) / distance
        strength = (
            _PUSH_MPS2
            * np.exp(-np.maximum(distance - _PERSONAL_SPACE_M, 0.0) / _PUSH_RANGE_M)
            * (0.65 + 0.35 * cosine)
        )
        away = offset / distance[..., None]
        # The push points a little to the right, or people who meet head-on would stop.
        right = np.stack([away[..., 1], -away[..., 0]], axis=-1)
        push = (strength[..., None] * (0.85 * away - 0.5 * right)).sum(axis=1)
        low_m, high_m = self.positions_m, self._side_m - self.positions_m
        wall = _WALL_MPS2 * (np.exp(-low_m / _WALL_RANGE_M) - np.exp(-high_m / _WALL_RANGE_M))
        return np.asarray(push + wall)


def walk(people: int, stamps_s: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return the truth (T, N, 4) as x, y (m) and vx, vy (m/s) at increasing stamps."""
    crowd = Walkers(people, rng)
    crowd.advance(2.0)  # past the start, where no person has been pushed yet
    truth = np.empty((len(stamps_s), people, 4))
    for frame, stamp_s in enumerate(stamps_s):
        if frame:
            crowd.advance(float(stamp_s - stamps_s[frame - 1]))
        truth[frame, :, :2], truth[frame, :, 2:] = crowd.positions_m, crowd.velocities_mps
    return truth
