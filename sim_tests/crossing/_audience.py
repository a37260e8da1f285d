"""Everybody who may hear the robot ask for attention."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ..actors.behaviour import Ears, Heard, PersonMotion, Request, RequestMeans
from ..actors.body import Worker
from ._robot_sight import RobotSight

# The person nearest to the place of a request, and within this distance of it, is addressed.
_ADDRESSED_WITHIN_M: Final = 1.0


class Audience:
    """The ears of all people on the stage.

    Args:
        ears: of each person.
        workers: their bodies.
        sight: tells whether they see the robot.
    """

    def __init__(self, ears: Sequence[Ears], workers: Sequence[Worker], sight: RobotSight) -> None:
        self._ears, self._workers, self._sight = ears, workers, sight

    def hear(
        self,
        t_s: float,
        means: RequestMeans,
        place_odom_m: FloatArray,
        robot_odom_m: FloatArray,
        motions: Sequence[PersonMotion],
    ) -> tuple[Heard | None, ...]:
        """Return what each person does who hears a request; None for nothing."""
        away_m = [math.dist(motion.position_odom_m, place_odom_m[:2]) for motion in motions]
        nearest = int(np.argmin(away_m)) if away_m else 0
        heard = []
        for index, (ears, motion) in enumerate(zip(self._ears, motions, strict=True)):
            x, y = (robot_odom_m - motion.position_odom_m).tolist()
            facing = motion.heading_odom_rad + motion.head_yaw_rad
            request = Request(
                t_s,
                means,
                distance_m=math.hypot(x, y),
                off_rad=math.remainder(math.atan2(y, x) - facing, math.tau),
                sighted=means == "light" and self._sight.seen_by(self._workers[index]),
                activity=motion.activity.name,
                addressed=index == nearest and away_m[index] <= _ADDRESSED_WITHIN_M,
            )
            heard.append(ears.hear(request))
        return tuple(heard)
