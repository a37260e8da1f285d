"""The distances that no awareness can take away.

How fast confidence may be won, and how long data may be trusted.

When to warn somebody.
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from perception.anthropometry import BODY_RADIUS_M
from tracking.config import StrictConfig

from .._errors import NavError


class SafetyMargins(StrictConfig):
    """Margins that hold whatever α says.

    Attributes:
        minimum_clearance_m: added to the body radius (0.30 m) it is the floor of every obstacle
            radius; at least 0.10 m.
        separation_clearance_m: C + Z of the protective separation distance: reach of a body part
            into the field and position uncertainty of the robot.
        uncertainty_sigmas: how many standard deviations of a person's position (along its most
            uncertain direction) enlarge the obstacle and shorten the separation. 2 holds 98 % of a
            normal error towards the robot.
        unseen_sigmas: how many shorten the separation of somebody unseen for ``fresh_within_s``; at
            least ``uncertainty_sigmas`` count. Nothing corrects a prediction out of sight, and who
            has left the view may have begun to run.
        maximum_radius_m: ceiling of every obstacle radius, uncertainty included, or none. It keeps
            an uncertain track from filling an aisle; the speed limit is not affected by it.
    """

    error: ClassVar[type[ValueError]] = NavError

    minimum_clearance_m: float = Field(default=0.10, ge=0.10, le=2.0)
    separation_clearance_m: float = Field(default=0.10, ge=0.0, le=2.0)
    uncertainty_sigmas: float = Field(default=2.0, ge=0.0, le=5.0)
    unseen_sigmas: float = Field(default=2.5, ge=0.0, le=5.0)
    maximum_radius_m: float | None = Field(default=None, gt=0.0, le=20.0)

    @property
    def floor_m(self) -> float:
        """Smallest radius of any obstacle: body radius plus minimum clearance."""
        return BODY_RADIUS_M + self.minimum_clearance_m

    @model_validator(mode="after")
    def _ceiling_above_floor(self) -> SafetyMargins:
        if self.maximum_radius_m is not None and self.maximum_radius_m < self.floor_m:
            raise ValueError(
                f"maximum_radius_m must be at least the floor of {self.floor_m:g} m (body radius "
                f"plus minimum_clearance_m), got {self.maximum_radius_m:g} m"
            )
        return self

    def bounded_m(self, radius_m: float) -> float:
        """The radius between floor and ceiling."""
        bounded = max(radius_m, self.floor_m)
        return bounded if self.maximum_radius_m is None else min(bounded, self.maximum_radius_m)


class TimeBehaviour(StrictConfig):
    """Time behaviour of the adapter. Growth needs no setting: it is instant.

    Attributes:
        shrink_rate_mps: how fast an obstacle may shrink while its person is being seen.
        shrink_after_s: an obstacle shrinks only to what awareness has allowed for this long; time
            in which frames show the person counts, other time does not.
        fresh_within_s: a person unseen for longer counts as unaware. Must exceed the camera's
            period plus the delay of perception.
        hold_s: a confirmed person who disappears from the input is kept, unaware and moving on,
            until this long after they were last seen.
        stale_after_s: when perception or the robot's state is older, everyone counts as unaware.
        stop_after_s: when it is older than this, the speed limit is 0.
    """

    error: ClassVar[type[ValueError]] = NavError

    shrink_rate_mps: float = Field(default=0.5, gt=0.0, le=5.0)
    shrink_after_s: float = Field(default=0.2, ge=0.0, le=5.0)
    fresh_within_s: float = Field(default=0.25, gt=0.0, le=1.0)
    hold_s: float = Field(default=1.0, ge=0.0, le=10.0)
    stale_after_s: float = Field(default=0.5, gt=0.0, le=5.0)
    stop_after_s: float = Field(default=1.5, gt=0.0, le=10.0)

    @model_validator(mode="after")
    def _ordered(self) -> TimeBehaviour:
        if not self.fresh_within_s <= self.stale_after_s <= self.stop_after_s:
            raise ValueError(
                "fresh_within_s <= stale_after_s <= stop_after_s must hold, got "
                f"{self.fresh_within_s:g} s, {self.stale_after_s:g} s, {self.stop_after_s:g} s"
            )
        return self


class AlertRules(StrictConfig):
    """Who is warned, how, and how often at most.

    Warned are people whose lower bound of α is under ``unaware_below``, on a course that passes the
    moving robot within ``miss_within_m``. Of the alerts whose time is reached the loudest is asked
    for: horn before voice before light.

    Attributes:
        unaware_below: α under which a person is worth a warning.
        miss_within_m: gap between robot and body at the closest approach, at constant velocities,
            that makes a course conflicting.
        light_within_s: time to the closest approach from which light is asked for; 0 is never.
        voice_within_s: the same for a spoken warning.
        horn_within_s: the same for the horn.
        repeat_after_s: the same person gets the same alert again no sooner.
        quiet_s: two sounds, to whomever, lie at least so far apart.
    """

    error: ClassVar[type[ValueError]] = NavError

    unaware_below: float = Field(default=0.3, ge=0.0, le=1.0)
    miss_within_m: float = Field(default=0.5, ge=0.0, le=5.0)
    light_within_s: float = Field(default=5.0, ge=0.0, le=30.0)
    voice_within_s: float = Field(default=3.5, ge=0.0, le=30.0)
    horn_within_s: float = Field(default=2.0, ge=0.0, le=30.0)
    repeat_after_s: float = Field(default=3.0, ge=0.0, le=60.0)
    quiet_s: float = Field(default=1.0, ge=0.0, le=60.0)
