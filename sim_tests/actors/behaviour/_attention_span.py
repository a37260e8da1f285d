"""A person's attention to the robot after the first look at it: it may lapse."""

from __future__ import annotations

from ._route import DesiredVelocity
from ._spec import Lapse


class AttentionSpan:
    """Whether a person stands and looks, or has forgotten the robot.

    Args:
        lapse: when and how the attention ends; None never.

    Attributes:
        halted: the person stands because of the robot, until the lapse.
        lapsed: the person walks as if no robot were there.
    """

    def __init__(self, lapse: Lapse | None) -> None:
        self._lapse = lapse
        self.halted = self.lapsed = False

    @property
    def looks_away(self) -> bool:
        """Whether the person does not look at the robot any more."""
        return self.lapsed and self._lapse is not None and self._lapse.looks_away

    @property
    def sets_off(self) -> bool:
        """Whether the person starts or goes on now, whatever start and pauses say."""
        return self.lapsed and self._lapse is not None and self._lapse.halts

    def update(self, t_s: float, noticed_s: float | None, touched: bool) -> None:
        """Update the attention.

        Args:
            t_s: now.
            noticed_s: time of the first look at the robot; None before.
            touched: whether the robot has touched the person, who then remembers it.
        """
        if self._lapse is None or noticed_s is None:
            return
        over = t_s - noticed_s >= self._lapse.after_look_s - 1e-9
        self.halted = self._lapse.halts and not over and not touched
        self.lapsed = over and not touched

    def held(self, wanted: DesiredVelocity) -> DesiredVelocity:
        """Return the velocity of a person who wants this one: 0 while halted."""
        return DesiredVelocity(wanted.ux, wanted.uy, 0.0) if self.halted else wanted
