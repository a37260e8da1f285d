"""A scripted worker on the stage."""

from __future__ import annotations

import math

from ..body import MAX_HEAD_PITCH_RAD, MAX_HEAD_YAW_RAD
from ._person import PersonMotion, Surroundings
from ._script import WorkerScript

# Eyes stand at about this part of the stature.
_EYE_SHARE = 0.94


class Scripted:
    """Does what a script says, whatever happens.

    Args:
        script: what to do.
        offset_s: how much later than it says.
    """

    def __init__(self, script: WorkerScript, offset_s: float) -> None:
        self.script = script
        self._walk = script.walk()
        self._offset_s = offset_s

    @property
    def stature_m(self) -> float:
        """Height of the body."""
        return self.script.stature_m

    @property
    def look(self) -> str | None:
        """Name of a shipped worker."""
        return self.script.look

    @property
    def stride_m(self) -> float | None:
        """Distance of a full gait cycle."""
        return self.script.stride_m

    def motion(self, t_s: float, around: Surroundings) -> PersonMotion:
        """What the script says for ``t_s``; of all around only the robot's camera counts."""
        t_s -= self._offset_s
        motion = self._walk.motion(t_s)
        heading = motion.heading_odom_rad
        x, y = motion.position_odom_m.tolist()
        to_robot = heading, 0.0
        if around.robot is not None:
            camera_x, camera_y, camera_z = around.robot.camera_m
            up = camera_z - _EYE_SHARE * self.stature_m
            to_robot = (
                math.atan2(camera_y - y, camera_x - x),
                math.atan2(up, math.hypot(camera_x - x, camera_y - y)),
            )
        azimuth, elevation = self.script.gaze_angles(t_s, heading, to_robot)
        eye_yaw, eye_pitch = self.script.eye_angles(t_s)
        yaw = math.remainder(azimuth - heading, 2.0 * math.pi)
        return PersonMotion(
            position_odom_m=motion.position_odom_m,
            velocity_odom_mps=motion.velocity_odom_mps,
            heading_odom_rad=heading,
            walked_m=motion.walked_m,
            feet=motion.feet,
            head_yaw_rad=min(max(yaw, -MAX_HEAD_YAW_RAD), MAX_HEAD_YAW_RAD),
            head_pitch_rad=min(max(elevation, -MAX_HEAD_PITCH_RAD), MAX_HEAD_PITCH_RAD),
            eye_yaw_rad=eye_yaw,
            eye_pitch_rad=eye_pitch,
            activity=self.script.activity(t_s),
        )

    def hold(self) -> None:
        """A script goes on regardless."""

    def touch(self, towards_x: float, towards_y: float) -> None:
        """A script takes no notice."""
