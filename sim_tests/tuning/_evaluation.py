"""What a policy came to over many episodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from perception.arrays import FloatArray

from ..measures._episode_record import EpisodeRecord


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """What a policy came to over many episodes, one entry an episode.

    Attributes:
        time_lost_s: over the same task in the empty hall.
        violation_time_s: how long the separation margin was negative at a moving robot.
        deficit_m: by how much at most; 0 where it never was.
        robot_contacts: episodes in which the robot moved into a person.
        reached: episodes that reached the goal.
        errors: of episodes that have no result.
    """

    time_lost_s: FloatArray
    violation_time_s: FloatArray
    deficit_m: FloatArray
    robot_contacts: int
    reached: int
    errors: tuple[str, ...]

    @classmethod
    def of(cls, records: Sequence[EpisodeRecord]) -> Evaluation:
        """From episodes; those without a result count only in ``errors``."""
        good = [record for record in records if not record.error]
        return cls(
            np.array([_number(record.time_lost_s) for record in good]),
            np.array([_number(record.violation_time_s) for record in good]),
            np.array([max(0.0, -_number(record.min_margin_m)) for record in good]),
            sum(record.robot_contacts > 0 for record in good),
            sum(record.time_to_goal_s is not None for record in good),
            tuple(record.error for record in records if record.error),
        )

    @property
    def objectives(self) -> tuple[float, float]:
        """Mean time lost and mean violation time an episode, seconds."""
        return float(self.time_lost_s.mean()), float(self.violation_time_s.mean())


def _number(value: float | None) -> float:
    return 0.0 if value is None else value
