"""The policies that no other beats in both objectives, and which of them to look at.

What a policy came to over many episodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ...study.measures import EpisodeRecord, Interval, bootstrap_interval, paired_difference

Point = tuple[float, float]


def front(points: Sequence[Point]) -> list[int]:
    """Rows of the points that no other dominates, by the first objective; of equals the first."""
    order = sorted(range(len(points)), key=lambda row: (points[row], row))
    best, rows = float("inf"), []
    for row in order:
        if points[row][1] < best:
            best = points[row][1]
            rows.append(row)
    return rows


def knee(points: Sequence[Point]) -> int:
    """Row of the point of a front that lies farthest from the line between its ends.

    Both objectives are scaled to [0, 1] over the front (Das 1999). The first of a front of one or
    two points.
    """
    if len(points) < 3:
        return 0
    values = np.array(points)
    span = np.ptp(values, axis=0)
    scaled = (values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    # On the way from (0, 1) to (1, 0), how far towards (0, 0).
    return int((1.0 - scaled.sum(axis=1)).argmax())


#: What is made small, fields of :class:`EpisodeRecord`.
OBJECTIVES: Final = ("time_lost_s", "violation_time_s")


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """What a policy came to over many episodes.

    Attributes:
        records: of the episodes that have a result, by scenario and seed.
        errors: of those that have none.
    """

    records: tuple[EpisodeRecord, ...]
    errors: tuple[str, ...] = ()

    @classmethod
    def of(cls, records: Sequence[EpisodeRecord]) -> Evaluation:
        """From episodes."""
        good = [record for record in records if not record.error]
        good.sort(key=lambda record: (record.scenario, record.seed))
        return cls(tuple(good), tuple(record.error for record in records if record.error))

    @property
    def objectives(self) -> tuple[float, float]:
        """Mean time lost and mean time with a negative margin, seconds an episode."""
        time_s, violation_s = (float(np.mean(self._values(name))) for name in OBJECTIVES)
        return time_s, violation_s

    @property
    def deficit_m(self) -> float:
        """By how much the separation margin was negative at most, mean over episodes."""
        least = [record.min_margin_m for record in self.records]
        return float(np.mean([0.0 if value is None else max(0.0, -value) for value in least]))

    @property
    def robot_contacts(self) -> int:
        """Episodes in which the robot moved into a person."""
        return sum(record.robot_contacts > 0 for record in self.records)

    @property
    def reached(self) -> int:
        """Episodes that reached the goal."""
        return sum(record.time_to_goal_s is not None for record in self.records)

    def interval(self, objective: str) -> Interval:
        """Mean of an objective with its 95 % interval, drawn within scenarios."""
        return bootstrap_interval(
            self._values(objective),
            np.random.default_rng(0),
            strata=[record.scenario for record in self.records],
        )

    def minus(self, base: Evaluation, objective: str) -> Interval:
        """The mean less that of another policy on the same episodes, with its 95 % interval."""
        return paired_difference(base.records, self.records, objective)

    def _values(self, name: str) -> list[float]:
        values = [getattr(record, name) for record in self.records]
        return [0.0 if value is None else float(value) for value in values]
