"""People who see the robot's camera, and who hear it ask for attention."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ..actors.behaviour import Ears, Heard, PersonMotion, Request, RequestMeans
from ..actors.body import Worker
from ..actors.robot import Robot
from ..world import first_body_before

Point = tuple[float, float]

# The person nearest to the place of a request, and within this distance of it, is addressed.
_ADDRESSED_WITHIN_M: Final = 1.0

# Collision bodies farther than this from a line or from the robot's base never touch either.
_BESIDE_LINE_M: Final = 1.5
_BESIDE_ROBOT_M: Final = 4.5


class RobotSight:
    """Tests whether people see the robot's camera.

    Args:
        amr: the robot; it does not hide its own camera.
        workers: the people. Their collision bodies are brought up where they may hide it.
    """

    def __init__(self, amr: Robot, workers: Sequence[Worker]) -> None:
        self._amr = amr
        self._workers = workers
        self._through = frozenset({amr.body})

    def seen_by(self, worker: Worker) -> bool:
        """Return whether nothing stands between a person's eyes and the camera."""
        camera = self._amr.T_odom_camera[:3, 3]
        left_behind = [
            other for other in self._workers if other.collision_left_behind and other is not worker
        ]
        if left_behind:
            camera_x, camera_y, _ = camera.tolist()
            line = worker.place_odom_m, (camera_x, camera_y)
            for other in left_behind:
                if _near_line(other.collision_place_odom_m, *line) or _near_line(
                    other.place_odom_m, *line
                ):
                    other.place_collision_body()
        first = first_body_before(worker, camera)
        if first == -1 or first in self._through:
            return True
        if worker.collision_left_behind:
            # A line that meets the person's own body first counts as free.
            worker.place_collision_body()
            first = first_body_before(worker, camera)
        return first in (-1, worker.body) or first in self._through


def near_robot(worker: Worker, place_odom_m: Point, robot_odom_m: Point) -> bool:
    """Return whether a person, or the collision body left behind, may come near the robot."""
    return (
        math.dist(place_odom_m, robot_odom_m) <= _BESIDE_ROBOT_M
        or math.dist(worker.collision_place_odom_m, robot_odom_m) <= _BESIDE_ROBOT_M
    )


def _near_line(place: Point, start: Point, end: Point) -> bool:
    """Return whether somebody at a place may touch a line."""
    along_x, along_y = end[0] - start[0], end[1] - start[1]
    off_x, off_y = place[0] - start[0], place[1] - start[1]
    squared = max(along_x * along_x + along_y * along_y, 1e-12)
    share = min(max((off_x * along_x + off_y * along_y) / squared, 0.0), 1.0)
    return math.hypot(off_x - share * along_x, off_y - share * along_y) <= _BESIDE_LINE_M


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
