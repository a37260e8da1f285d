"""The distances that no awareness can take away."""

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
