"""One policy over one part of the episodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ._interval import Interval


@dataclass(frozen=True, slots=True)
class SummaryRow:
    """One policy over one part of the episodes.

    Attributes:
        variant: the policy, and what else tells it from others.
        part: of the episodes: a scenario, an awareness class, an attention; empty for all.
        episodes: how many.
        errors: of them, those that broke off with an error: no success, and in no other figure.
        success: share of all episodes.
        robot_contact: share of the episodes that ran in which the robot moved into somebody.
        person_contact: share in which somebody walked into the robot.
        means: mean of each of :data:`METRICS` over the episodes to which it applies.
        worst: the worst value of each that occurred; without those that occurred nowhere, and
            those of which neither way is worse.
    """

    variant: str
    part: str
    episodes: int
    errors: int
    success: Interval
    robot_contact: Interval
    person_contact: Interval
    means: Mapping[str, Interval]
    worst: Mapping[str, float]
