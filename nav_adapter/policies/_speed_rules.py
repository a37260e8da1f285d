"""A top speed near people, whoever they are.

A speed limit that depends on distance alone.

Speed limits beside speed-and-separation monitoring, and who they are about.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from perception.arrays import FloatArray
from tracking.config import StrictConfig

from .._errors import NavError


class NearCap(StrictConfig):
    """At most this speed near anyone, in any direction and however aware.

    Attributes:
        within_m: where the cap holds: from the footprint to the body, less uncertainty.
        speed_mps: the cap. Beyond ``within_m`` the limit is what a braking robot may still have, so
            that it arrives at the cap's edge with the cap and not with a jump.
    """

    error: ClassVar[type[ValueError]] = NavError

    within_m: float = Field(default=1.5, gt=0.0, le=20.0)
    speed_mps: float = Field(default=0.8, gt=0.0, le=10.0)

    def limit_mps(self, separation_m: ArrayLike, deceleration_mps2: float) -> FloatArray:
        """Limit at each separation (m) of a robot that brakes so hard; NaN gives the cap."""
        beyond_m = np.asarray(separation_m, dtype=np.float64) - self.within_m
        beyond_m = np.where(beyond_m > 0.0, beyond_m, 0.0)
        return np.asarray(np.sqrt(self.speed_mps**2 + 2.0 * deceleration_mps2 * beyond_m))


class DistanceZones(StrictConfig):
    """Full speed beyond one distance, linearly down to a stop at another.

    Distances are those of speed and separation: from the footprint to the body, less uncertainty.

    Attributes:
        stop_within_m: the limit is 0 up to here.
        full_speed_beyond_m: the limit is the robot's maximum from here on.
    """

    error: ClassVar[type[ValueError]] = NavError

    stop_within_m: float = Field(default=0.3, ge=0.0, le=20.0)
    full_speed_beyond_m: float = Field(default=3.0, gt=0.0, le=50.0)

    @model_validator(mode="after")
    def _ordered(self) -> DistanceZones:
        if self.full_speed_beyond_m <= self.stop_within_m:
            raise ValueError(
                "full_speed_beyond_m must exceed stop_within_m, got "
                f"{self.full_speed_beyond_m:g} m and {self.stop_within_m:g} m"
            )
        return self

    def limit_mps(self, separation_m: ArrayLike, maximum_mps: float) -> FloatArray:
        """Limit at each separation (m), of a robot with this maximum; NaN gives 0."""
        span_m = self.full_speed_beyond_m - self.stop_within_m
        share = (np.asarray(separation_m, dtype=np.float64) - self.stop_within_m) / span_m
        share = np.where(share > 0.0, np.minimum(share, 1.0), 0.0)
        return np.asarray(maximum_mps * share)


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
