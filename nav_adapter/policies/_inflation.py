"""Size and outline of a person as an obstacle, as functions of awareness."""

from __future__ import annotations

from typing import Protocol

from pydantic import Field, model_validator

from ._ramp import AwarenessRamp


class InflationPolicy(Protocol):
    """Radius of a person as an obstacle. A custom policy needs this one method.

    A policy with hysteresis has a second method, ``holds(awareness_lower, held) -> bool``: whether
    a person is held at the aware level now, given whether they were held at the last sighting.
    While it returns True, α counts as 1 for this policy. It must return False for α = 0.
    """

    def radius_m(self, awareness_lower: float) -> float:
        """Return the radius about the body's centre line for a lower bound of α in [0, 1].

        It must be finite and must not increase with α. The adapter raises a radius below the floor
        (body radius plus minimum clearance) to the floor.
        """
        ...


class InterpolatedInflation(AwarenessRamp):
    """Radius that falls from an unaware to an aware value.

    Attributes:
        unaware_radius_m: radius of a person who has not noticed the robot, > 0.
        aware_radius_m: radius of a person who has, > 0, at most ``unaware_radius_m``. A value below
            the floor (body radius plus minimum clearance) acts as the floor.
    """

    unaware_radius_m: float = Field(default=1.0, gt=0.0, le=10.0)
    aware_radius_m: float = Field(default=0.45, gt=0.0, le=10.0)

    @model_validator(mode="after")
    def _check_radii(self) -> InterpolatedInflation:
        if self.aware_radius_m > self.unaware_radius_m:
            raise ValueError(
                "aware_radius_m must be at most unaware_radius_m, got "
                f"{self.aware_radius_m:g} m and {self.unaware_radius_m:g} m"
            )
        return self

    def radius_m(self, awareness_lower: float) -> float:
        """Return the radius for a lower bound of α; it does not increase with α."""
        share = self.blend(awareness_lower)
        return (1.0 - share) * self.unaware_radius_m + share * self.aware_radius_m


class ObstacleOutline(AwarenessRamp):
    """The part of an obstacle's polygon beyond its circle; by default nothing.

    The circle (``center_odom_m``, ``radius_m``) does not change: planners that use velocities move
    it themselves. Only ``polygon`` grows, for planners without velocities.

    Attributes:
        unaware_ahead_s: the polygon of an unaware person reaches ahead as far as the person walks
            in this time.
        aware_ahead_s: the same for an aware person, at most ``unaware_ahead_s``.
        longest_ahead_m: upper limit of this elongation.
        sweep_s: horizon of the predicted motion that the polygon covers; 0 for none.
        acceleration_density_m2ps3: q of the tracker's white acceleration, for the predicted
            covariance.
        overconfidence_per_s: the predicted covariance is multiplied by 1 + this × prediction time.
            Prediction with constant velocity is overconfident: for simulated walkers the position
            NEES one second ahead is 3.4 to 3.6 where 2 is consistent (docs/tracking.md), hence
            0.75. Farther ahead this is an extrapolation.
    """

    unaware_ahead_s: float = Field(default=0.0, ge=0.0, le=5.0)
    aware_ahead_s: float = Field(default=0.0, ge=0.0, le=5.0)
    longest_ahead_m: float = Field(default=2.0, ge=0.0, le=10.0)
    sweep_s: float = Field(default=0.0, ge=0.0, le=5.0)
    acceleration_density_m2ps3: float = Field(default=0.05, ge=0.0, le=10.0)
    overconfidence_per_s: float = Field(default=0.75, ge=0.0, le=10.0)

    @model_validator(mode="after")
    def _check_times(self) -> ObstacleOutline:
        if self.aware_ahead_s > self.unaware_ahead_s:
            raise ValueError(
                "aware_ahead_s must be at most unaware_ahead_s, got "
                f"{self.aware_ahead_s:g} s and {self.unaware_ahead_s:g} s"
            )
        return self

    def ahead_s(self, awareness_lower: float) -> float:
        """Return the time of walking that the elongation covers; it does not increase with α."""
        share = self.blend(awareness_lower)
        return (1.0 - share) * self.unaware_ahead_s + share * self.aware_ahead_s
