"""The distances that no awareness can take away."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

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
    """

    error: ClassVar[type[ValueError]] = NavError

    minimum_clearance_m: float = Field(default=0.10, ge=0.10, le=2.0)
    separation_clearance_m: float = Field(default=0.10, ge=0.0, le=2.0)
    uncertainty_sigmas: float = Field(default=2.0, ge=0.0, le=5.0)
