"""People on a path of their own who answer a request: they look at the robot, or startle."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

import numpy as np

from ..body import STAYING
from ._head import ON_TARGET_RAD, AnsweringLook, HeadAndEyes, angles_to, twisted
from ._hearing import Heard
from ._obstacles import Obstacles
from ._person import PersonMotion, PersonPath, Surroundings, eye_height_m
from ._social_force import RELAXATION_S
from ._startle import Startle
from ._trajectory import MAX_ACCELERATION_MPS2, limited

# The clock of the path stops, and runs again, within this time.
_CLOCK_CHANGE_S: Final = 0.5
# It runs again once the step beside the path is slower than this.
_STEPPED_MPS: Final = 0.2
# A body that has stepped aside nears its path at this speed at most, in about this time.
_RETURN_MPS: Final = 0.15
_RETURN_S: Final = 1.0
_BACK_WITHIN_M: Final = 0.005
# A step ends within this time constant.
_BRAKING_S: Final = 0.1
# Head and trunk are the path's own again this near to it.
_SETTLED_RAD: Final = math.radians(1.0)


class Answering:
    """A person on a path of their own, who follows it unchanged without a request.

    A person who answers turns eyes, head and, as far as needed, the trunk to the robot, and back to
    where the path has them look. A person who startles holds the clock of the path, and may step
    beside it; the body then returns to the path slowly. People who sit or kneel turn the head
    alone.

    Args:
        path: the person as scripted or recorded.
        boxes_odom_m: (N, 4) racks and walls, x_min, y_min, x_max, y_max.
    """

    def __init__(self, path: PersonPath, boxes_odom_m: Any) -> None:
        self._path = path
        self._obstacles = Obstacles(boxes_odom_m)
        self._now_s = 0.0
        self._look: AnsweringLook | None = None
        self._posture: HeadAndEyes | None = None
        self._startle: Startle | None = None
        self._clock = 1.0  # share of its speed at which the path's time passes
        self._late_s = 0.0
        self._beside = self._beside_before = (0.0, 0.0)  # offset from the path
        self._step = (0.0, 0.0)  # velocity of the offset
        self._place: tuple[float, float] | None = None
        self._place_before: tuple[float, float] | None = None

    @property
    def stature_m(self) -> float:
        """Height of the body."""
        return self._path.stature_m

    @property
    def look(self) -> str | None:
        """Name of a shipped worker."""
        return self._path.look

    @property
    def stride_m(self) -> float | None:
        """Distance of a full gait cycle."""
        return self._path.stride_m

    def hear(self, heard: Heard) -> None:
        """Turn to the robot that has asked for attention, or startle, as :class:`Heard` says."""
        if heard.looks:
            self._look = AnsweringLook.after(self._look, heard.from_s, heard.looks_for_s)
        if heard.startle:
            self._startle = Startle(heard.startle, heard.from_s)

    def hold(self) -> None:
        """Take the last motion back: it would have led into the robot, and the body stayed."""
        self._beside, self._step = self._beside_before, (0.0, 0.0)
        self._place = self._place_before
        self._path.hold()

    def touch(self, towards_x: float, towards_y: float) -> None:
        """Note a contact with the robot, which lies in this direction (a unit vector in odom)."""
        self._path.touch(towards_x, towards_y)

    def motion(self, t_s: float, around: Surroundings) -> PersonMotion:
        """Return the motion at ``t_s``, which never decreases."""
        dt_s, self._now_s = t_s - self._now_s, t_s
        if self._startle is not None:
            self._hold_clock(t_s, dt_s, around)
        motion = self._path.motion(t_s - self._late_s, around)
        if motion.away:
            self._look = self._posture = self._startle = None
            self._beside, self._step, self._place = (0.0, 0.0), (0.0, 0.0), None
            return motion
        if self._startle is not None:
            if motion.activity.name in STAYING:
                self._startle = None
            else:
                motion = self._stepped(motion)
        x, y = motion.position_odom_m.tolist()
        self._place_before, self._place = self._place, (x, y)
        if self._look is not None:
            motion = self._turned(motion, t_s, dt_s, around)
        return motion

    def _hold_clock(self, t_s: float, dt_s: float, around: Surroundings) -> None:
        """Let the path's time pass, and the offset from it change, by ``dt_s``."""
        wanted = None
        if self._startle is not None and self._place is not None and around.robot is not None:
            wanted = self._startle.velocity(t_s, self._place, around.robot)
        vx, vy = self._step
        runs = wanted is None and math.hypot(vx, vy) < _STEPPED_MPS
        change = dt_s / _CLOCK_CHANGE_S
        self._clock = min(max(self._clock + (change if runs else -change), 0.0), 1.0)
        self._late_s += (1.0 - self._clock) * dt_s
        if wanted is not None:
            wish = wanted.speed_mps * wanted.ux, wanted.speed_mps * wanted.uy
        else:
            wish = limited(-self._beside[0] / _RETURN_S, -self._beside[1] / _RETURN_S, _RETURN_MPS)
        slower = math.hypot(*wish) < math.hypot(vx, vy)
        within_s = max(_BRAKING_S if slower else RELAXATION_S, dt_s)
        ax, ay = limited(
            (wish[0] - vx) / within_s, (wish[1] - vy) / within_s, MAX_ACCELERATION_MPS2
        )
        self._step = vx + ax * dt_s, vy + ay * dt_s
        self._beside_before = self._beside
        self._beside = (
            self._beside[0] + 0.5 * (vx + self._step[0]) * dt_s,
            self._beside[1] + 0.5 * (vy + self._step[1]) * dt_s,
        )
        back = math.hypot(*self._beside) < _BACK_WITHIN_M and self._clock == 1.0
        if self._startle is not None and self._startle.is_over(t_s) and back:
            self._startle, self._beside, self._step = None, (0.0, 0.0), (0.0, 0.0)

    def _stepped(self, motion: PersonMotion) -> PersonMotion:
        """Return the motion beside the path, and out of racks; end the startle on the path."""
        path_x, path_y = motion.position_odom_m.tolist()
        goal = path_x + self._beside[0], path_y + self._beside[1]
        x, y = goal if self._place is None else self._obstacles.end_of_step(self._place, goal)
        if (x, y) != goal:
            self._beside, self._step = (x - path_x, y - path_y), (0.0, 0.0)
        vx, vy = (self._clock * motion.velocity_odom_mps).tolist()
        return replace(
            motion,
            position_odom_m=np.array([x, y]),
            velocity_odom_mps=np.array([vx + self._step[0], vy + self._step[1]]),
            feet=motion.feet.moved(*self._beside),
        )

    def _turned(
        self, motion: PersonMotion, t_s: float, dt_s: float, around: Surroundings
    ) -> PersonMotion:
        """Return the motion with the gaze on its way to the robot, on it, or on its way back."""
        look, robot = self._look, around.robot
        if look is None or (self._posture is None and not look.lasts(t_s)):
            return motion
        eyes = (motion.eye_yaw_rad, motion.eye_pitch_rad)
        head = (motion.head_yaw_rad, motion.head_pitch_rad)
        activity = motion.activity.name
        if self._posture is None:
            self._posture = HeadAndEyes(head, eyes, twists=activity not in STAYING)
        posture = self._posture
        x, y = motion.position_odom_m.tolist()
        answers = robot is not None and look.lasts(t_s) and around.sees_robot()
        target, rest = (head[0] + eyes[0], head[1] + eyes[1]), eyes
        if answers and robot is not None:
            place = (x, y, motion.heading_odom_rad)
            to_robot = angles_to(robot.camera_m, place, eye_height_m(self.stature_m, activity))
            target, rest = posture.unwrapped(to_robot), (0.0, 0.0)
        if dt_s > 0.0:
            posture.turn(target, rest, dt_s, back=answers)
            posture.advance(dt_s)
        if answers and posture.off_rad(target) < ON_TARGET_RAD:
            look.meet(t_s)
        head_yaw, head_pitch, eye_yaw, eye_pitch = posture.angles(0.0)
        twist = posture.twist_rad(0.0)
        off = (head_yaw - head[0], head_pitch - head[1], twist)
        if not look.lasts(t_s) and max(map(abs, off)) < _SETTLED_RAD:
            self._posture = None
            return motion
        return replace(
            motion,
            heading_odom_rad=motion.heading_odom_rad + twist,
            feet=twisted(motion.feet, twist),
            head_yaw_rad=head_yaw,
            head_pitch_rad=head_pitch,
            eye_yaw_rad=eye_yaw,
            eye_pitch_rad=eye_pitch,
        )
