"""Obstacles that are longer than a circle: ahead of who walks, and over where they may be soon."""

from __future__ import annotations

from pydantic import Field, model_validator

from ._ramp import AwarenessRamp


class ObstacleOutline(AwarenessRamp):
    """What the polygon of an obstacle adds to its circle; by default nothing.

    The circle (``center_odom_m``, ``radius_m``) stays what it is: planners that take velocities
    move it themselves. Only ``polygon`` grows, for planners that know no velocities.

    Attributes:
        unaware_ahead_s: the polygon of somebody who walks reaches as far ahead as an unaware person
            gets in this time.
        aware_ahead_s: the same for an aware person, at most ``unaware_ahead_s``.
        longest_ahead_m: the elongation is never longer.
        sweep_s: horizon of the predicted motion that the polygon covers; 0 is none.
        acceleration_density_m2ps3: q of the tracker's white acceleration, for the covariance ahead.
        overconfidence_per_s: the predicted covariance is multiplied by 1 + this × time ahead.
            Constant velocity is too sure ahead: on simulated walkers the position NEES one second
            ahead is 3.4 to 3.6 where 2 is consistent (docs/tracking.md), hence 0.75; farther ahead
            that is an extrapolation.
    """

    unaware_ahead_s: float = Field(default=0.0, ge=0.0, le=5.0)
    aware_ahead_s: float = Field(default=0.0, ge=0.0, le=5.0)
    longest_ahead_m: float = Field(default=2.0, ge=0.0, le=10.0)
    sweep_s: float = Field(default=0.0, ge=0.0, le=5.0)
    acceleration_density_m2ps3: float = Field(default=0.05, ge=0.0, le=10.0)
    overconfidence_per_s: float = Field(default=0.75, ge=0.0, le=10.0)

    @model_validator(mode="after")
    def _awareness_never_lengthens(self) -> ObstacleOutline:
        if self.aware_ahead_s > self.unaware_ahead_s:
            raise ValueError(
                "aware_ahead_s must be at most unaware_ahead_s, got "
                f"{self.aware_ahead_s:g} s and {self.unaware_ahead_s:g} s"
            )
        return self

    def ahead_s(self, awareness_lower: float) -> float:
        """Time of walking that the elongation covers; non-increasing in α."""
        share = self.blend(awareness_lower)
        return (1.0 - share) * self.unaware_ahead_s + share * self.aware_ahead_s
