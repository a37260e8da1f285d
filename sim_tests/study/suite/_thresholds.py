"""The thresholds of one episode, and of all episodes together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from statistics import fmean
from typing import ClassVar

from pydantic import Field

from tracking.config import StrictConfig

from ...world.errors import SimError
from ..measures import EpisodeRecord


class EpisodeThresholds(StrictConfig):
    """The thresholds of a single episode; None sets no threshold.

    Attributes:
        max_robot_contacts: most contacts of a robot that moved into a person.
        max_contacts: most contacts of any kind.
        min_separation_m: smallest distance between the surfaces of robot and person.
        max_violation_time_s: longest time with a negative separation margin at a moving robot.
        max_time_lost_s: most time lost over the same task without people.
        reaches_goal: the goal must be reached within the scenario's duration.
    """

    error: ClassVar[type[ValueError]] = SimError

    max_robot_contacts: int | None = Field(default=0, ge=0)
    max_contacts: int | None = Field(default=None, ge=0)
    min_separation_m: float | None = Field(default=None, ge=0.0)
    max_violation_time_s: float | None = Field(default=None, ge=0.0)
    max_time_lost_s: float | None = None
    reaches_goal: bool = False

    def failures(self, record: EpisodeRecord) -> Iterator[str]:
        """Yield the failed checks of an episode: name, value found and threshold."""
        if record.error:
            yield f"runs to its end: {record.error}"
            return
        for name, value, limit in (
            ("max_robot_contacts", record.robot_contacts, self.max_robot_contacts),
            ("max_contacts", record.contacts, self.max_contacts),
            ("max_violation_time_s", record.violation_time_s, self.max_violation_time_s),
            ("max_time_lost_s", record.time_lost_s, self.max_time_lost_s),
        ):
            if limit is not None and value is not None and value > limit:
                yield f"{name}: {value:g}, allowed {limit:g}"
        separation_m, limit_m = record.min_separation_m, self.min_separation_m
        if limit_m is not None and separation_m is not None and separation_m < limit_m:
            yield f"min_separation_m: {separation_m:g}, asked for {limit_m:g}"
        if self.reaches_goal and record.time_to_goal_s is None:
            yield f"reaches_goal: not within {record.duration_s:g} s"


class Thresholds(StrictConfig):
    """The thresholds of the test suite.

    By default, the robot may cause no contact, and 90 % of the episodes must succeed.

    Attributes:
        episode: thresholds of every episode.
        scenarios: thresholds that replace ``episode`` in some scenarios, by the scenario's name.
        min_success_rate: smallest share of episodes in which the robot reaches the goal and moves
            into nobody.
        max_mean_violation_time_s: largest mean violation time of all episodes.
        max_mean_time_lost_s: largest mean time lost of all episodes.
    """

    error: ClassVar[type[ValueError]] = SimError

    episode: EpisodeThresholds = EpisodeThresholds()
    scenarios: dict[str, EpisodeThresholds] = Field(default_factory=dict)
    min_success_rate: float | None = Field(default=0.9, ge=0.0, le=1.0)
    max_mean_violation_time_s: float | None = Field(default=None, ge=0.0)
    max_mean_time_lost_s: float | None = None

    def of(self, *names: str) -> EpisodeThresholds:
        """Return the thresholds of an episode of a scenario, by the first of its names."""
        found = (self.scenarios[name] for name in names if name in self.scenarios)
        return next(found, self.episode)

    def failures(self, records: Sequence[EpisodeRecord]) -> Iterator[str]:
        """Yield the failed checks of all episodes together; a failed episode is no success."""
        rate = fmean(record.success for record in records)
        if self.min_success_rate is not None and rate < self.min_success_rate:
            yield f"min_success_rate: {rate:.3f}, asked for {self.min_success_rate:g}"
        for name, limit, values in (
            (
                "max_mean_violation_time_s",
                self.max_mean_violation_time_s,
                [record.violation_time_s for record in records],
            ),
            (
                "max_mean_time_lost_s",
                self.max_mean_time_lost_s,
                [record.time_lost_s for record in records],
            ),
        ):
            known = [value for value in values if value is not None]
            if limit is not None and known and fmean(known) > limit:
                yield f"{name}: {fmean(known):.3f}, allowed {limit:g}"
