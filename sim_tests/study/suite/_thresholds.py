"""What an episode, and all of them together, must hold to pass."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from statistics import fmean
from typing import ClassVar

from pydantic import Field

from tracking.config import StrictConfig

from ...world.errors import SimError
from ..measures import EpisodeRecord


class EpisodeThresholds(StrictConfig):
    """What every single episode must hold; None asks for nothing.

    Attributes:
        max_robot_contacts: contacts of a robot that moved into a person.
        max_contacts: contacts of any kind.
        min_separation_m: least distance between the surfaces of robot and person.
        max_violation_time_s: how long the separation margin may be negative at a moving robot.
        max_time_lost_s: over the same task without people.
        reaches_goal: within the scenario's duration.
    """

    error: ClassVar[type[ValueError]] = SimError

    max_robot_contacts: int | None = Field(default=0, ge=0)
    max_contacts: int | None = Field(default=None, ge=0)
    min_separation_m: float | None = Field(default=None, ge=0.0)
    max_violation_time_s: float | None = Field(default=None, ge=0.0)
    max_time_lost_s: float | None = None
    reaches_goal: bool = False

    def failures(self, record: EpisodeRecord) -> Iterator[str]:
        """What an episode does not hold: name of the check, what was found and what is allowed."""
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
        least = record.min_separation_m
        wanted = self.min_separation_m
        if wanted is not None and least is not None and least < wanted:
            yield f"min_separation_m: {least:g}, asked for {wanted:g}"
        if self.reaches_goal and record.time_to_goal_s is None:
            yield f"reaches_goal: not within {record.duration_s:g} s"


class Thresholds(StrictConfig):
    """What must hold for the suite to pass.

    The default allows no contact that the robot causes in any episode, and asks for nine successes
    in ten episodes.

    Attributes:
        episode: of every episode.
        scenarios: of the episodes of a scenario, by its name, instead of that.
        min_success_rate: share of all episodes that reach the goal and touch nobody by the robot's
            own motion.
        max_mean_violation_time_s: of all episodes.
        max_mean_time_lost_s: of all episodes.
    """

    error: ClassVar[type[ValueError]] = SimError

    episode: EpisodeThresholds = EpisodeThresholds()
    scenarios: dict[str, EpisodeThresholds] = Field(default_factory=dict)
    min_success_rate: float | None = Field(default=0.9, ge=0.0, le=1.0)
    max_mean_violation_time_s: float | None = Field(default=None, ge=0.0)
    max_mean_time_lost_s: float | None = None

    def of(self, scenario: str) -> EpisodeThresholds:
        """What an episode of a scenario must hold."""
        return self.scenarios.get(scenario, self.episode)

    def failures(self, records: Sequence[EpisodeRecord]) -> Iterator[str]:
        """What all episodes together do not hold; one that broke off is no success."""
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
