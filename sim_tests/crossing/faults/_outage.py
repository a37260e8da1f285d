"""Outages of a sensor as data: repeated ones, and one without an end."""

from __future__ import annotations

from pydantic import Field, model_validator

from ...world.config import SimConfig


class Onset(SimConfig):
    """The time from which something holds until the end; the default is the start of the episode.

    Attributes:
        after_s: it begins then at the earliest.
        within_s: and at most this much later, evenly distributed over the episodes; 0 for exactly
            then.
    """

    after_s: float = Field(default=0.0, ge=0.0, le=600.0)
    within_s: float = Field(default=0.0, ge=0.0, le=600.0)

    def begins_s(self, draw: float) -> float:
        """Return the time for a number drawn evenly from 0 to 1."""
        return self.after_s + draw * self.within_s


class Outage(SimConfig):
    """A repeated outage; the default has none.

    In each episode the first outage begins at a random time within the first ``every_s``, uniformly
    distributed, so that over many episodes every instant of an encounter is hit.

    Attributes:
        for_s: duration of each outage; 0 for none.
        every_s: time from the beginning of one to that of the next, longer than ``for_s``.
        fresh_stamps: the last message is repeated as if it were new, which no receiver can tell;
            False repeats it with its old stamp.
    """

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
        """Return whether there is an outage at ``t_s`` if the first one begins at ``first_s``."""
        return t_s >= first_s and (t_s - first_s) % self.every_s < self.for_s
