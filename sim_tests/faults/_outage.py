"""Something that stops for a while, again and again."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from tracking.config import StrictConfig

from .._errors import SimError


class Outage(StrictConfig):
    """Something that stops for a while, again and again; the default never stops.

    Within an episode the first outage begins at a time drawn evenly from the first ``every_s``, so
    that over many episodes every instant of an encounter is hit.

    Attributes:
        for_s: how long each lasts; 0 for none.
        every_s: from the beginning of one to that of the next, longer than ``for_s``.
        fresh_stamps: what was last known is repeated as if it were new, which nobody downstream can
            tell; False repeats it with the stamp that it had.
    """

    error: ClassVar[type[ValueError]] = SimError

    for_s: float = Field(default=0.0, ge=0.0, le=600.0)
    every_s: float = Field(default=10.0, gt=0.0, le=3600.0)
    fresh_stamps: bool = True

    @model_validator(mode="after")
    def _ends_before_the_next(self) -> Outage:
        if self.for_s >= self.every_s:
            raise ValueError(
                f"for_s must be shorter than every_s, got {self.for_s:g} s of {self.every_s:g} s"
            )
        return self

    def holds(self, t_s: float, first_s: float) -> bool:
        """Whether it is down at ``t_s`` when the first outage begins at ``first_s``."""
        return t_s >= first_s and (t_s - first_s) % self.every_s < self.for_s
