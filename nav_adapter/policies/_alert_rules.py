"""When to warn somebody."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from tracking.config import StrictConfig

from .._errors import NavError


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
