"""Speed limits beside speed-and-separation monitoring, and who they are about."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from tracking.config import StrictConfig

from .._errors import NavError
from ._distance_zones import DistanceZones
from ._near_cap import NearCap


class SpeedRules(StrictConfig):
    """Rules that can only lower the limit of speed and separation, and whom the limit is about.

    Attributes:
        turn_within_stop_deg: how far the robot may turn off its direction of travel while it stops.
            Towards a person who lies farther off, it gets less far than its stopping distance, and
            towards one straight behind not at all: such people limit the speed less. 180 makes
            everybody count as if straight ahead; needed by robots that can drive sideways.
        people_turn_deg: how far a brisk walker may turn towards the robot while it stops: what
            they walk counts as if they did, however aware they are. Holds in full for whoever is
            as fast as an unaware person is assumed to be, not at all below three quarters of that,
            and in between in proportion; at 0 only the speed at which they come nearer now counts.
        zones: a limit over distance, or none.
        near_cap: a limit near anyone, or none.
    """

    error: ClassVar[type[ValueError]] = NavError

    turn_within_stop_deg: float = Field(default=90.0, ge=45.0, le=180.0)
    people_turn_deg: float = Field(default=45.0, ge=0.0, le=180.0)
    zones: DistanceZones | None = None
    near_cap: NearCap | None = None
