"""How fast confidence may be won, and how long data may be trusted."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from tracking.config import StrictConfig

from .._errors import NavError


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
