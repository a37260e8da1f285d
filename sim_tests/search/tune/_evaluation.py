"""The evaluation of a policy over many episodes, and the Pareto front of several policies."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ...study.measures import EpisodeRecord, Interval, bootstrap_interval, paired_difference

#: The objectives, which are minimised: fields of :class:`EpisodeRecord`.
OBJECTIVES: Final = ("time_lost_s", "violation_time_s")

Point = tuple[float, float]


def pareto_front(points: Sequence[Point]) -> list[int]:
    """Return the rows of the points that no other dominates, sorted by the first objective.

    Of equal points, only the first is returned.
    """
    order = sorted(range(len(points)), key=lambda row: (points[row], row))
    best, rows = float("inf"), []
    for row in order:
        if points[row][1] < best:
            best = points[row][1]
            rows.append(row)
    return rows


def knee(points: Sequence[Point]) -> int:
    """Return the row of the point of a front that is farthest from the line between its ends.

    Both objectives are scaled to [0, 1] over the front (Das 1999). A front of one or two points
    has its knee at the first.
    """
    if len(points) < 3:
        return 0
    values = np.array(points)
    span = np.ptp(values, axis=0)
    scaled = (values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    # Distance from the line between (0, 1) and (1, 0) towards (0, 0), times √2.
    return int((1.0 - scaled.sum(axis=1)).argmax())


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """The evaluation of a policy over many episodes.

    Attributes:
        records: records of the episodes with a result, sorted by scenario and seed.
        errors: errors of the others.
    """

    records: tuple[EpisodeRecord, ...]
    errors: tuple[str, ...] = ()

    @classmethod
    def of(cls, records: Sequence[EpisodeRecord]) -> Evaluation:
        """Return the evaluation of episodes."""
        completed = [record for record in records if not record.error]
        completed.sort(key=lambda record: (record.scenario, record.seed))
        return cls(tuple(completed), tuple(record.error for record in records if record.error))

    @classmethod
    def joined(cls, parts: Iterable[Evaluation]) -> Evaluation:
        """Return the evaluation of the episodes of several parts."""
        rows = list(parts)
        whole = cls.of([record for each in rows for record in each.records])
        return replace(whole, errors=tuple(error for each in rows for error in each.errors))

    def within(self, scenarios: Container[str]) -> Evaluation:
        """Return the episodes in some of the scenarios, by name."""
        return replace(self, records=tuple(r for r in self.records if r.scenario in scenarios))

    def same_episodes(self, other: Evaluation) -> Evaluation:
        """Return the episodes of which the other evaluation has the scenario and the seed too."""
        tasks = {(each.scenario, each.seed) for each in other.records}
        kept = tuple(each for each in self.records if (each.scenario, each.seed) in tasks)
        return replace(self, records=kept)

    def equals(self, other: Evaluation) -> bool:
        """Return whether every episode has the same metrics as the other policy's."""
        mine, others = (
            [replace(record, policy="") for record in each.records] for each in (self, other)
        )
        return mine == others

    def estimate(self, base: Evaluation) -> Point:
        """Return the objectives over all episodes of the base policy, from fewer episodes.

        They are the base policy's means over all of its episodes, plus the mean paired differences
        (a control variate). With all episodes they are :attr:`objectives`.
        """
        part = base.same_episodes(self).objectives
        time_s, violation_s = (
            mine + (whole - same)
            for mine, whole, same in zip(self.objectives, base.objectives, part, strict=True)
        )
        return time_s, violation_s

    @property
    def objectives(self) -> tuple[float, float]:
        """Mean time lost and mean violation time, seconds per episode."""
        time_s, violation_s = (float(np.mean(self._values(name))) for name in OBJECTIVES)
        return time_s, violation_s

    @property
    def deficit_m(self) -> float:
        """Mean over episodes of the deepest negative separation margin."""
        margins = [record.min_margin_m for record in self.records]
        return float(np.mean([0.0 if value is None else max(0.0, -value) for value in margins]))

    @property
    def robot_contacts(self) -> int:
        """Number of episodes in which the robot moved into a person."""
        return sum(record.robot_contacts > 0 for record in self.records)

    @property
    def reached(self) -> int:
        """Number of episodes that reached the goal."""
        return sum(record.time_to_goal_s is not None for record in self.records)

    def interval(self, objective: str) -> Interval:
        """Return the mean of an objective with its 95 % interval, resampled within scenarios."""
        return bootstrap_interval(
            self._values(objective),
            np.random.default_rng(0),
            strata=[record.scenario for record in self.records],
        )

    def minus(self, base: Evaluation, objective: str, level: float = 0.95) -> Interval:
        """Return the mean difference to another policy on the same episodes, with its interval."""
        return paired_difference(base.records, self.records, objective, level=level)

    def _values(self, name: str) -> list[float]:
        values = [getattr(record, name) for record in self.records]
        return [0.0 if value is None else float(value) for value in values]
