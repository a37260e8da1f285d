"""How large a person counts for a planner, given what they have noticed."""

from __future__ import annotations

from typing import Protocol

from pydantic import Field, model_validator

from ._ramp import AwarenessRamp


class InflationPolicy(Protocol):
    """Radius of a person as an obstacle; write your own with this one method.

    A policy with hysteresis has a second one, ``holds(awareness_lower, held) -> bool``: whether a
    person who was, or was not, held at the aware level at the last sighting is so now. While it
    says so, α counts as 1 for this policy. It must say False for α = 0.
    """

    def radius_m(self, awareness_lower: float) -> float:
        """Radius about the body's centre line for a lower bound of α in [0, 1].

        Must be finite and must not increase with α. The adapter raises what is smaller than the
        floor (body radius plus minimum clearance) to the floor.
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
    def _awareness_never_enlarges(self) -> InterpolatedInflation:
        if self.aware_radius_m > self.unaware_radius_m:
            raise ValueError(
                "aware_radius_m must be at most unaware_radius_m, got "
                f"{self.aware_radius_m:g} m and {self.unaware_radius_m:g} m"
            )
        return self

    def radius_m(self, awareness_lower: float) -> float:
        """Radius for a lower bound of α; non-increasing in it."""
        share = self.blend(awareness_lower)
        return (1.0 - share) * self.unaware_radius_m + share * self.aware_radius_m
