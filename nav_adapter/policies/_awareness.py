"""Size of a person and the speed that they may change to, as functions of awareness."""

from __future__ import annotations

from typing import Protocol

from pydantic import Field, model_validator

from .._config import NavConfig


class InflationPolicy(Protocol):
    """Radius of a person as an obstacle. A custom policy needs this one method."""

    def radius_m(self, awareness_lower: float) -> float:
        """Return the radius about the body's centre line for a lower bound of α in [0, 1].

        It must be finite and must not increase with α. The adapter raises a radius that is too
        small for the limit beside it (:func:`nav_adapter.limit.passing_radius_m`).
        """
        ...


class SpeedPolicy(Protocol):
    """Speed that a person may change to. A custom policy needs this one method.

    A policy gives U of :mod:`nav_adapter.reach`, not the limit. The adapter turns it into a limit
    at which the robot stands before anybody can reach it, so no policy can allow more than that.
    """

    def human_speed_mps(self, awareness_lower: float) -> float:
        """Return the highest speed that a person may change to, for a lower bound of α in [0, 1].

        It must be finite and at least 0, and must not increase with α.
        """
        ...


class _AwarenessRamp(NavConfig):
    """A blend over the lower bound of α: 0 is "unaware", 1 is "aware", a smoothstep in between.

    Attributes:
        unaware_below: α up to which a person counts as fully unaware, in [0, 1).
        aware_above: α from which a person counts as fully aware, in (0, 1]. With the default
            attention cone of 60°, the robot is 35° off the gaze at α = 0.6.
    """

    unaware_below: float = Field(default=0.1, ge=0.0, lt=1.0)
    aware_above: float = Field(default=0.6, gt=0.0, le=1.0)

    @model_validator(mode="after")
    def _check_thresholds(self) -> _AwarenessRamp:
        if self.aware_above <= self.unaware_below:
            raise ValueError(
                f"aware_above must exceed unaware_below, got {self.aware_above:g} and "
                f"{self.unaware_below:g}"
            )
        return self

    def blended(self, unaware: float, aware: float, awareness_lower: float) -> float:
        """Return the value between the two, which does not grow with α; NaN gives ``unaware``."""
        below, above = self.unaware_below, self.aware_above
        # Written so that NaN counts as unaware.
        if not awareness_lower > below:
            return unaware
        if awareness_lower >= above:
            return aware
        position = (awareness_lower - below) / (above - below)
        share = min(position * position * (3.0 - 2.0 * position), 1.0)
        return (1.0 - share) * unaware + share * aware


class InterpolatedInflation(_AwarenessRamp):
    """Radius that falls from an unaware to an aware value.

    Attributes:
        unaware_radius_m: radius of a person who has not noticed the robot, > 0.
        aware_radius_m: radius of a person who has, > 0, at most ``unaware_radius_m``.
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
        return self.blended(self.unaware_radius_m, self.aware_radius_m, awareness_lower)


class InterpolatedHumanSpeed(_AwarenessRamp):
    """Speed U that a person may change to, falling from an unaware to an aware value.

    Attributes:
        unaware_human_speed_mps: for a person who has not noticed the robot. Recorded people who
            set off beside a robot reach 1.34 m/s (docs/people.md).
        aware_human_speed_mps: for a person who has, at most the unaware value. 0.23 m/s is a lean,
            an arm or a step back: 0.08 m in 0.6 s, 0.33 m in 1.8 s. At 0 they keep to their present
            motion or stop, as today's robots assume of everybody.
    """

    unaware_human_speed_mps: float = Field(default=1.5, ge=0.0, le=10.0)
    aware_human_speed_mps: float = Field(default=0.23, ge=0.0, le=10.0)

    @model_validator(mode="after")
    def _check_speeds(self) -> InterpolatedHumanSpeed:
        if self.aware_human_speed_mps > self.unaware_human_speed_mps:
            raise ValueError(
                "aware_human_speed_mps must be at most unaware_human_speed_mps, got "
                f"{self.aware_human_speed_mps:g} m/s and {self.unaware_human_speed_mps:g} m/s"
            )
        return self

    def human_speed_mps(self, awareness_lower: float) -> float:
        """Return U for a lower bound of α; it does not increase with α."""
        return self.blended(
            self.unaware_human_speed_mps, self.aware_human_speed_mps, awareness_lower
        )
