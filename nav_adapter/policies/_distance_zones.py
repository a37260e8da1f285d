"""A speed limit that depends on distance alone."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from perception.arrays import FloatArray
from tracking.config import StrictConfig

from .._errors import NavError


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
