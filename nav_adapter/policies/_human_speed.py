"""Assumed speed of a person towards the robot, as a function of awareness."""

from __future__ import annotations

from typing import Protocol

from pydantic import Field, model_validator

from ._ramp import AwarenessRamp, smoothstep


class SpeedPolicy(Protocol):
    """Assumed speed of a person towards the robot. A custom policy needs this one method.

    A policy with hysteresis has a second method, ``holds(awareness_lower, held) -> bool``: whether
    a person is held at the aware level now, given whether they were held at the last sighting.
    While it returns True, α counts as 1 for this policy. It must return False for α = 0.

    A policy gives the assumption, not the limit. The adapter turns it into a speed limit by
    speed-and-separation monitoring, so no policy can allow more than that.
    """

    def human_speed_mps(self, awareness_lower: float) -> float:
        """Return the speed assumed straight at the robot for a lower bound of α in [0, 1].

        It must be finite and at least 0, and must not increase with α.
        """
        ...


class InterpolatedHumanSpeed(AwarenessRamp):
    """Assumed speed that falls from an unaware to an aware value.

    Attributes:
        unaware_human_speed_mps: for a person who has not noticed the robot; 1.6 m/s is the walking
            speed of ISO 13855.
        aware_human_speed_mps: for a person who has, at most the unaware value. A person who sees
            the robot may still set off: 0.7 m/s covers 99 % of the displacements over 1.5 s of 229
            recorded people who stood near a robot (docs/people.md).
        watching_above: α from which a person counts as looking straight at the robot, in
            (``aware_above``, 1]. With the default attention cone, the robot is 19° off the gaze at
            α = 0.8. None, the default, makes no difference between watching and aware people.
        watching_human_speed_mps: for such a person, at most the aware value. Between
            ``aware_above`` and ``watching_above`` the speed follows a smoothstep. A person with the
            robot in the corner of the eye may not have noticed it; one who looks straight at it
            has.
    """

    unaware_human_speed_mps: float = Field(default=1.6, ge=0.0, le=10.0)
    aware_human_speed_mps: float = Field(default=0.7, ge=0.0, le=10.0)
    watching_above: float | None = Field(default=None, gt=0.0, le=1.0)
    watching_human_speed_mps: float | None = Field(default=None, ge=0.0, le=10.0)

    @model_validator(mode="after")
    def _check_watching(self) -> InterpolatedHumanSpeed:
        above, speed_mps = self.watching_above, self.watching_human_speed_mps
        if (above is None) != (speed_mps is None):
            raise ValueError(
                "watching_above and watching_human_speed_mps belong together, got "
                f"{above} and {speed_mps}"
            )
        if above is None or speed_mps is None:
            return self
        if above <= self.aware_above:
            raise ValueError(
                f"watching_above must exceed aware_above, got {above:g} and {self.aware_above:g}"
            )
        if speed_mps > self.aware_human_speed_mps:
            raise ValueError(
                "watching_human_speed_mps must be at most aware_human_speed_mps, got "
                f"{speed_mps:g} m/s and {self.aware_human_speed_mps:g} m/s"
            )
        if self.shape == "two_level":
            raise ValueError("shape two_level has no watching level: leave out watching_above")
        return self

    @model_validator(mode="after")
    def _check_speeds(self) -> InterpolatedHumanSpeed:
        if self.aware_human_speed_mps > self.unaware_human_speed_mps:
            raise ValueError(
                "aware_human_speed_mps must be at most unaware_human_speed_mps, got "
                f"{self.aware_human_speed_mps:g} m/s and {self.unaware_human_speed_mps:g} m/s"
            )
        return self

    def human_speed_mps(self, awareness_lower: float) -> float:
        """Return the assumed speed for a lower bound of α; it does not increase with α."""
        share = self.blend(awareness_lower)
        above, watching_mps = self.watching_above, self.watching_human_speed_mps
        if share < 1.0 or above is None or watching_mps is None:
            return (1.0 - share) * self.unaware_human_speed_mps + share * self.aware_human_speed_mps
        position = min((awareness_lower - self.aware_above) / (above - self.aware_above), 1.0)
        share = smoothstep(position)
        return (1.0 - share) * self.aware_human_speed_mps + share * watching_mps
