"""Settings besides radius and speed: safety margins, time behaviour and alerts."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from perception.anthropometry import BODY_RADIUS_M
from tracking.config import StrictConfig

from .._errors import NavError


class SafetyMargins(StrictConfig):
    """Margins that hold for every α.

    Attributes:
        minimum_clearance_m: body radius (0.30 m) plus this is the floor of every obstacle radius;
            at least 0.10 m.
        separation_clearance_m: C + Z of the protective separation distance: reach of a body part
            into the field and position uncertainty of the robot.
        uncertainty_sigmas: number of standard deviations of a person's position (along its most
            uncertain direction) that enlarge the obstacle and shorten the separation. 2 covers 98 %
            of a normal error towards the robot.
        unseen_sigmas: the number that shortens the separation of a person unseen for longer than
            ``fresh_within_s``; at least ``uncertainty_sigmas`` count. No measurement corrects the
            prediction of an unseen person, who may have begun to run.
        maximum_radius_m: ceiling of every obstacle radius, uncertainty included, or None. It keeps
            an uncertain track from filling an aisle; it does not affect the speed limit.
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
    def _check_ceiling(self) -> SafetyMargins:
        if self.maximum_radius_m is not None and self.maximum_radius_m < self.floor_m:
            raise ValueError(
                f"maximum_radius_m must be at least the floor of {self.floor_m:g} m (body radius "
                f"plus minimum_clearance_m), got {self.maximum_radius_m:g} m"
            )
        return self

    def bounded_m(self, radius_m: float) -> float:
        """Return the radius, limited to the range from floor to ceiling."""
        bounded = max(radius_m, self.floor_m)
        return bounded if self.maximum_radius_m is None else min(bounded, self.maximum_radius_m)


class TimeBehaviour(StrictConfig):
    """Time behaviour of the adapter. Growth needs no setting: obstacles grow at once.

    Attributes:
        shrink_rate_mps: largest rate at which an obstacle shrinks while the person is seen.
        shrink_after_s: an obstacle shrinks only to the largest size that awareness called for
            during this time. Only time in which frames show the person counts.
        fresh_within_s: a person unseen for longer counts as unaware. Must exceed the camera's
            period plus the delay of perception.
        hold_s: a confirmed person who disappears from the input is kept, as unaware and with
            constant velocity, until this time after the last sighting.
        lost_rise_mps2: when such a person is dropped, or one whom the tracker has given up out of
            sight, the limit that they set rises no faster than this. None: it rises at once.
        stale_after_s: if perception or the robot's state is older, everyone counts as unaware.
        stop_after_s: if either is older than this, the speed limit is 0.
        new_clock_after_s: when stamps that jump go on for this time, the clock has been set, and
            the adapter starts anew.
    """

    error: ClassVar[type[ValueError]] = NavError

    shrink_rate_mps: float = Field(default=0.5, gt=0.0, le=5.0)
    shrink_after_s: float = Field(default=0.2, ge=0.0, le=5.0)
    fresh_within_s: float = Field(default=0.25, gt=0.0, le=1.0)
    hold_s: float = Field(default=1.0, ge=0.0, le=10.0)
    lost_rise_mps2: float | None = Field(default=0.7, gt=0.0, le=10.0)
    stale_after_s: float = Field(default=0.5, gt=0.0, le=5.0)
    stop_after_s: float = Field(default=1.5, gt=0.0, le=10.0)
    new_clock_after_s: float = Field(default=1.0, ge=0.0, le=60.0)

    @model_validator(mode="after")
    def _check_order(self) -> TimeBehaviour:
        if not self.fresh_within_s <= self.stale_after_s <= self.stop_after_s:
            raise ValueError(
                "fresh_within_s <= stale_after_s <= stop_after_s must hold, got "
                f"{self.fresh_within_s:g} s, {self.stale_after_s:g} s, {self.stop_after_s:g} s"
            )
        return self


class AlertRules(StrictConfig):
    """Rules for alerts: whom to warn, how, and how often at most.

    A person is warned if the lower bound of α is below ``unaware_below`` and the moving robot
    passes within ``miss_within_m``. Of the alerts whose time is reached, the loudest is given: horn
    before voice before light.

    Attributes:
        unaware_below: α below which a person is warned.
        miss_within_m: a person is warned if the gap between robot and body at the closest approach,
            at constant velocities, is at most this.
        light_within_s: time to the closest approach below which light is given; 0 for never.
        voice_within_s: the same for a spoken warning.
        horn_within_s: the same for the horn.
        repeat_after_s: shortest time until the same person gets the same alert again.
        quiet_s: shortest time between two sounds, for any people.
    """

    error: ClassVar[type[ValueError]] = NavError

    unaware_below: float = Field(default=0.3, ge=0.0, le=1.0)
    miss_within_m: float = Field(default=0.5, ge=0.0, le=5.0)
    light_within_s: float = Field(default=5.0, ge=0.0, le=30.0)
    voice_within_s: float = Field(default=3.5, ge=0.0, le=30.0)
    horn_within_s: float = Field(default=2.0, ge=0.0, le=30.0)
    repeat_after_s: float = Field(default=3.0, ge=0.0, le=60.0)
    quiet_s: float = Field(default=1.0, ge=0.0, le=60.0)
