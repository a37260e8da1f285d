"""The basis of a speed limit: everything the adapter computed it from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tracking import PersonTrack
from tracking.prediction import PredictionModel

from ._people import People, Person
from ._policy import AwarenessPolicy


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpeedBasis:
    """The basis of one speed limit, for limits at other poses and times.

    It holds the adapter's own frozen objects, so that keeping it costs an update next to nothing.
    :func:`nav_adapter.exporters.speed_limit_at` reads it, and the robot of the constraints. Its
    attributes are private.

    Attributes:
        policy: the adapter's.
        rules: the adapter's rules for people.
        people: who count in full, by track id.
        lost: people who were dropped and still limit the speed, by track id.
        tracks: the input of the update; people of other tracks are missing.
        robot_age_s: age of the robot's state at the stamp.
        perception_age_s: age of the latest frame at the stamp.
        ceiling_mps: ceiling of the limit during the recovery after stale data, or None.
        prediction: of the adapter; None if places ahead are as certain as the present one.
    """

    policy: AwarenessPolicy
    rules: People
    people: Mapping[int, Person]
    lost: Mapping[int, Person]
    tracks: tuple[PersonTrack, ...]
    robot_age_s: float
    perception_age_s: float
    ceiling_mps: float | None
    prediction: PredictionModel | None = None

    @property
    def stopped(self) -> bool:
        """True if the data are so old that the limit is 0 everywhere."""
        oldest_s = max(self.robot_age_s, self.perception_age_s)
        return oldest_s > self.policy.timing.stop_after_s
