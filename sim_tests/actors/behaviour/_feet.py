"""The feet of a person, which follow the body step by step."""

from __future__ import annotations

import math

from ..body import Gait, GaitPose, OnlineFootsteps, skeleton
from ._spec import PersonSpec


class Feet:
    """The feet of one person, who stands at the first place.

    Args:
        spec: the person.
    """

    def __init__(self, spec: PersonSpec) -> None:
        self._spec = spec
        self._steps: OnlineFootsteps | None = None
        self._now_s = 0.0
        self._place = self._place_before = (0.0, 0.0, 0.0)

    def follow(
        self,
        t_s: float,
        place: tuple[float, float, float],
        velocity_mps: tuple[float, float],
        acceleration_mps2: tuple[float, float],
        *,
        turning_radps: float | None = None,
        slide: bool = False,
    ) -> GaitPose:
        """Return the pose of the feet under a body that has moved on.

        Args:
            t_s: now.
            place: x, y and heading of the body.
            velocity_mps: of the body.
            acceleration_mps2: of the body.
            turning_radps: of the body; None is that since the last call.
            slide: the body was bumped, and the feet are shifted with it.
        """
        dt_s, before = t_s - self._now_s, self._place
        self._now_s, self._place, self._place_before = t_s, place, before
        x, y, heading = place
        if self._steps is None:
            gait = Gait(skeleton(self._spec.look, self._spec.stature_m))
            self._steps, before = OnlineFootsteps(gait, x, y, heading), place
        if slide:
            pose = self._steps.translate(x - before[0], y - before[1])
            if pose is not None:
                return pose
        if turning_radps is None:
            turned = math.remainder(heading - before[2], math.tau)
            turning_radps = turned / dt_s if dt_s > 0.0 else 0.0
        return self._steps.step(dt_s, place, (*velocity_mps, turning_radps), acceleration_mps2)

    def undo(self) -> None:
        """Take the last pose back, because the body did not move."""
        self._place = self._place_before
        if self._steps is not None:
            self._steps.undo()
