"""Joint angles of a posture: first the trunk, from which the head follows, then the limbs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from ._gait_pose import GaitPose
from ._postures import Activity, arm_postures
from ._quaternions import (
    Quaternion,
    Vector,
    add,
    axis_angle,
    inverse,
    multiply,
    rotate,
    rotation_x,
    rotation_y,
    rotation_z,
    subtract,
)
from ._skeleton import LEFT, RIGHT, SIDES, Skeleton

# The trunk leans forward in a walk at 1.2 m/s.
_LEAN_RAD: Final = math.radians(3.5)
# The knee follows this share of the foot's yaw from the pelvis, the ankle the rest.
_KNEE_YAW_SHARE: Final = 0.2

#: Ankle, yaw and pitch of a foot.
Foot = tuple[Vector, float, float]


@dataclass(frozen=True, slots=True)
class Trunk:
    """Hips, trunk and head in the heading frame: the body's position with x along its heading.

    Attributes:
        hips_m: midpoint of the hips.
        pelvis: rotation of the pelvis.
        thorax: rotation of the thorax.
        head: rotation of the head.
    """

    hips_m: Vector
    pelvis: Quaternion
    thorax: Quaternion
    head: Quaternion


class JointAngles:
    """The joint angles of one body.

    Args:
        bones: the bones.
    """

    def __init__(self, bones: Skeleton) -> None:
        self._legs = bones.legs
        self._arms = arm_postures(bones)
        self._hips = tuple(subtract(bones.joint_m(f"{side}_hip"), bones.hips_m) for side in SIDES)

    @staticmethod
    def trunk(gait_pose: GaitPose, upright: float, head_rad: tuple[float, float]) -> Trunk:
        """Return the trunk; it takes a fifth of the time of :meth:`joints`.

        Args:
            gait_pose: hips and trunk of the gait.
            upright: share in [0, 1] of the lean of a walk that is held back.
            head_rad: yaw and pitch of the head from the body.
        """
        pelvis = multiply(
            rotation_z(gait_pose.pelvis_yaw_rad), rotation_x(gait_pose.pelvis_list_rad)
        )
        lean = _LEAN_RAD * gait_pose.stride_ratio * (1.0 - upright)
        thorax = multiply(rotation_z(gait_pose.thorax_yaw_rad), rotation_y(lean))
        facing = multiply(rotation_z(head_rad[0]), rotation_y(-head_rad[1]))
        return Trunk((0.0, gait_pose.sway_m, gait_pose.hip_height_m), pelvis, thorax, facing)

    def joints(
        self,
        trunk: Trunk,
        gait_pose: GaitPose,
        feet: tuple[Foot, Foot],
        eyes_rad: tuple[float, float],
        activity: Activity,
    ) -> tuple[Quaternion, ...]:
        """Return the rotation of every joint in the order of :data:`JOINTS`.

        Args:
            trunk: of this posture.
            gait_pose: the gait.
            feet: left and right foot in the heading frame.
            eyes_rad: yaw and pitch of the eyes from the head.
            activity: of the hands.
        """
        pelvis = trunk.pelvis
        back = inverse(pelvis)
        legs: list[Quaternion] = []
        for side in (LEFT, RIGHT):
            ankle, yaw, pitch = feet[side]
            hip = add(trunk.hips_m, rotate(pelvis, self._hips[side]))
            knee_yaw = gait_pose.pelvis_yaw_rad + _KNEE_YAW_SHARE * (yaw - gait_pose.pelvis_yaw_rad)
            across = rotate(back, (-math.sin(knee_yaw), math.cos(knee_yaw), 0.0))
            leg = self._legs[side]
            thigh, bend = leg.solve(rotate(back, subtract(ankle, hip)), across)
            knee = axis_angle(leg.axis, bend)
            turned_foot = multiply(back, multiply(rotation_z(yaw), rotation_y(pitch)))
            legs += (thigh, knee, multiply(inverse(multiply(thigh, knee)), turned_foot))
        eye = multiply(rotation_z(eyes_rad[0]), rotation_y(-eyes_rad[1]))
        left, right = self._arms.arms(gait_pose, activity)
        return (
            multiply(back, trunk.thorax),
            multiply(inverse(trunk.thorax), trunk.head),
            eye,
            eye,
            *left,
            *right,
            *legs,
        )
