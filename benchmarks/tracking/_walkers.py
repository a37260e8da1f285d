"""Simulated people who walk to goals, avoid one another, turn and stand: the truth.

The model is a social force after Helbing and Molnár (Phys. Rev. E 51, 1995, 4282). Every person is
pulled towards their own desired velocity and pushed away by people nearby and by the walls. The
desired velocity turns smoothly, so nobody changes direction from one frame to the next.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Longest step of the integration; the motion is sampled at the frames.
_STEP_S = 0.025
# Push of a wall on a person who touches it, and the distance over which it falls by e.
_WALL_MPS2, _WALL_RANGE_M = 3.0, 0.3


@dataclass(frozen=True, slots=True)
class WalkerSettings:
    """Settings of the motion; the defaults are those of the benchmark.

    Attributes:
        area_per_person_m2: area of the square hall divided by the number of people.
        speed_mean_mps: mean over people of the preferred walking speed.
        speed_std_mps: standard deviation of that speed.
        relaxation_s: time constant with which a person reaches the desired velocity.
        turn_s: time constant with which the desired velocity follows a new goal.
        personal_space_m: centre distance at which the push of another person is strongest.
        push_mps2: acceleration of that push.
        push_range_m: distance over which the push falls by e.
        stand_probability: probability that a person who arrives stands for a while.
        stand_s: shortest and longest stay.
    """

    area_per_person_m2: float = 4.0
    speed_mean_mps: float = 1.2
    speed_std_mps: float = 0.2
    relaxation_s: float = 1.0
    turn_s: float = 1.5
    personal_space_m: float = 0.4
    push_mps2: float = 1.5
    push_range_m: float = 0.5
    stand_probability: float = 0.4
    stand_s: tuple[float, float] = (2.0, 6.0)

    def side_m(self, people: int) -> float:
        """Return the side of the square hall for a number of people."""
        return float(np.sqrt(self.area_per_person_m2 * people))


class Walkers:
    """A crowd in a square hall, advanced in steps of time.

    Attributes:
        positions_m: (N, 2) now, frame of the hall, origin in a corner.
        velocities_mps: (N, 2) now.
    """

    def __init__(self, people: int, settings: WalkerSettings, rng: np.random.Generator) -> None:
        self._settings, self._rng, self._people = settings, rng, people
        self._side_m = settings.side_m(people)
        self.positions_m = self._starting_places()
        self._speeds = np.clip(
            rng.normal(settings.speed_mean_mps, settings.speed_std_mps, people), 0.5, 2.0
        )
        self._goals_m = self._places(people)
        self._stands_s = np.where(
            rng.random(people) < 0.25, rng.uniform(*settings.stand_s, people), 0.0
        )
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
        settings, rng = self._settings, self._rng
        self._stands_s = np.maximum(self._stands_s - dt_s, 0.0)
        arrived = (np.hypot(*(self._goals_m - self.positions_m).T) < 0.5) & (self._stands_s == 0.0)
        count = int(arrived.sum())
        if count:
            stands = rng.random(count) < settings.stand_probability
            self._stands_s[arrived] = np.where(stands, rng.uniform(*settings.stand_s, count), 0.0)
            self._goals_m[arrived] = self._places(count)
        self._desired_mps += (self._velocity_to_goal() - self._desired_mps) * min(
            1.0, dt_s / settings.turn_s
        )
        pull = (self._desired_mps - self.velocities_mps) / settings.relaxation_s
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
        settings = self._settings
        offset = self.positions_m[:, None] - self.positions_m[None]
        distance = np.hypot(offset[..., 0], offset[..., 1])
        np.fill_diagonal(distance, np.inf)
        # A person ahead gets more distance than a person behind.
        heading = self.velocities_mps / np.maximum(np.hypot(*self.velocities_mps.T)[:, None], 1e-9)
        cosine = -(offset * heading[:, None]).sum(axis=-1) / distance
        strength = (
            settings.push_mps2
            * np.exp(-np.maximum(distance - settings.personal_space_m, 0.0) / settings.push_range_m)
            * (0.65 + 0.35 * cosine)
        )
        away = offset / distance[..., None]
        # The push points a little to the right, or people who meet head-on would stop.
        right = np.stack([away[..., 1], -away[..., 0]], axis=-1)
        push = (strength[..., None] * (0.85 * away - 0.5 * right)).sum(axis=1)
        low_m, high_m = self.positions_m, self._side_m - self.positions_m
        wall = _WALL_MPS2 * (np.exp(-low_m / _WALL_RANGE_M) - np.exp(-high_m / _WALL_RANGE_M))
        return np.asarray(push + wall)


def walk(
    people: int,
    stamps_s: FloatArray,
    rng: np.random.Generator,
    settings: WalkerSettings | None = None,
) -> FloatArray:
    """Return the truth (T, N, 4) as x, y (m) and vx, vy (m/s) at increasing stamps."""
    crowd = Walkers(people, settings or WalkerSettings(), rng)
    crowd.advance(2.0)  # past the start, where no person has been pushed yet
    truth = np.empty((len(stamps_s), people, 4))
    for frame, stamp_s in enumerate(stamps_s):
        if frame:
            crowd.advance(float(stamp_s - stamps_s[frame - 1]))
        truth[frame, :, :2], truth[frame, :, 2:] = crowd.positions_m, crowd.velocities_mps
    return truth
