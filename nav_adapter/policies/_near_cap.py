"""A top speed near people, whoever they are."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

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
