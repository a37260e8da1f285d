"""Postures: what gait, activity, head and eyes ask of the trunk, the arms and the legs.

Arms swing, carry a box, read a phone or rest. People low down sit, or kneel on both knees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Final, Literal, get_args

import numpy as np

from perception.arrays import FloatArray

from ...world.errors import SimError
from ._asset import JOINTS
from ._gait import GaitPose
from ._quaternions import (
    IDENTITY,
    Quaternion,
    Vector,
    add,
    add_scaled,
    aligned,
    axis_angle,
    dot,
    inverse,
    multiply,
    rotate,
    rotation_matrix,
    rotation_x,
    rotation_y,
    rotation_z,
    rotation_zy,
    slerp,
    subtract,
    unit,
)
from ._skeleton import LEFT, RIGHT, SIDES, SIGNS, Skeleton

ActivityName = Literal["none", "carry_box", "phone", "sitting", "kneeling"]
#: Names of all activities. People sit and kneel with their whole body, and stay there.
ACTIVITIES: Final = get_args(ActivityName)
#: The activities of people who stay at their place.
STAYING: Final = ("sitting", "kneeling")
#: Height of the eyes of a seated person as a share of the standing stature.
SEATED_EYE_HEIGHT_SHARE: Final = 0.71
#: The same of a person on both knees.
KNEELING_EYE_HEIGHT_SHARE: Final = 0.67
#: Depth, width and height of the carried box along its x, y and z.
BOX_SIZE_M: Final = (0.30, 0.40, 0.28)
#: Thickness, width and height of the phone along its x, y and z; its screen faces −x.
PHONE_SIZE_M: Final = (0.009, 0.072, 0.150)

# Gap between belly and box, and the box's middle below the elbows.
_BOX_GAP_M: Final = 0.025
_BOX_BELOW_ELBOWS_M: Final = 0.05
# From the wrist to the middle of the palm, and half the thickness of a gloved hand, at 1.75 m.
_PALM_M: Final = 0.085
_HALF_HAND_M: Final = 0.022
_MEAN_STATURE_M: Final = 1.75
# Place of the phone: distance from the eyes, angle below the horizontal, offset to the right.
_PHONE_DISTANCE_M: Final = 0.34
_PHONE_BELOW_RAD: Final = math.radians(46.0)
_PHONE_RIGHT_M: Final = 0.05
# Fingers on a box point outwards by this angle and press into the cardboard by this depth.
_FINGERS_OUT_RAD: Final = math.radians(22.0)
_GRIP_DEPTH_M: Final = 0.012
# The forearm takes this share of the hand's twist, the wrist the rest.
_FOREARM_TWIST_SHARE: Final = 0.65
# Bend of the elbow in a walk at 1.2 m/s, and per radian of forward swing.
_ELBOW_BEND_RAD: Final = 0.16
_ELBOW_SWING: Final = 0.55
# Arms hang this far outwards from rest, and this much farther in a walk at 1.2 m/s.
_ARMS_APART_RAD: Final = 0.025
_ARMS_SWING_APART_RAD: Final = 0.04
# A box is in the hands from this share of the way to it.
_HELD_SHARE: Final = 0.98
# Wrists on the thighs of a seated person: share of the thigh from the hip, and how much higher than
# the radii of both: bones do not lie in the middle of a limb.
_RESTING_SHARE: Final = 0.70
_RESTING_ABOVE_M: Final = 0.066
# Seated feet stand wider apart than the hips, and the toes point outwards.
_FEET_APART: Final = 1.35
_TOE_OUT_RAD: Final = math.radians(8.0)
# Knees and stretched feet on the floor, at 1.75 m: height of the knees' and the ankles' joints, and
# the pitch of the feet.
_KNEE_HEIGHT_M: Final = 0.070
_ANKLE_HEIGHT_M: Final = 0.075
_FOOT_PITCH_RAD: Final = math.radians(155.0)
# The trunk leans forward in a walk at 1.2 m/s.
_LEAN_RAD: Final = math.radians(3.5)
# The knee follows this share of the foot's yaw from the pelvis, the ankle the rest.
_KNEE_YAW_SHARE: Final = 0.2

#: Ankle, yaw and pitch of a foot.
Foot = tuple[Vector, float, float]
#: Rotations of shoulder, elbow and wrist.
Arm = tuple[Quaternion, Quaternion, Quaternion]


@dataclass(frozen=True, slots=True)
class Activity:
    """The activity of the hands, or the change from one to the next; or sitting, or kneeling.

    People neither sit down nor kneel down nor stand up: ``"sitting"`` and ``"kneeling"`` have no
    other activity before them.

    Attributes:
        name: the activity, one of :data:`ACTIVITIES`.
        before: the activity before it.
        share: progress of the change in [0, 1], from ``before`` at 0 to ``name`` at 1.
    """

    name: str = "none"
    before: str = "none"
    share: float = 1.0

    def __post_init__(self) -> None:
        for name in (self.name, self.before):
            if name not in ACTIVITIES:
                valid = ", ".join(map(repr, ACTIVITIES))
                raise SimError(f"activity must be one of {valid}, got {name!r}")
        if not 0.0 <= self.share <= 1.0:
            raise SimError(f"share of an activity must lie in [0, 1], got {self.share!r}")
        for doing, stays in (("sitting", "sits stays seated"), ("kneeling", "kneels stays there")):
            if self.name != self.before and doing in (self.name, self.before):
                raise SimError(
                    f"a person who {stays}: the activity before {doing} must be {doing!r} as "
                    f"well, got {self.before!r} before {self.name!r}"
                )

    @classmethod
    @cache
    def of(cls, name: str) -> Activity:
        """Return the activity of this name, with no other before it."""
        return cls(name, name)

    @property
    def seated(self) -> bool:
        """True if the person sits."""
        return self.name == "sitting"

    @property
    def stays(self) -> bool:
        """True if the person sits or kneels."""
        return self.name in STAYING

    @property
    def held(self) -> Literal["box", "phone", "seat"] | None:
        """The object in the hands, or the seat under the body; None for neither."""
        if self.seated:
            return "seat"
        doing = self.name if self.share >= 0.5 else self.before
        if doing == "phone":
            return "phone"
        firmly = max(self.share, 1.0 - self.share) >= _HELD_SHARE
        return "box" if doing == "carry_box" and firmly else None

    @property
    def upright(self) -> float:
        """Uprightness of the trunk that a carried box demands, in [0, 1]."""
        return self.share * (self.name == "carry_box") + (1.0 - self.share) * (
            self.before == "carry_box"
        )


@dataclass(frozen=True, eq=False)
class ArmPostures:
    """The arms of one body for every activity, relative to its thorax at rest.

    Attributes:
        carrying: left and right arm with the box in the hands; also at work on the knees.
        reading: right arm with the phone in the hand; the left one swings.
        resting: left and right arm of a seated person, the hands on the thighs.
        box_m: middle of the box in the body frame at rest; it moves with the thorax.
        T_hand_phone: (4, 4) pose of the phone in the right hand's link, both at rest.
    """

    carrying: tuple[Arm, Arm]
    reading: Arm
    resting: tuple[Arm, Arm]
    box_m: Vector
    T_hand_phone: FloatArray

    def arms(self, gait_pose: GaitPose, activity: Activity) -> tuple[Arm, Arm]:
        """Return the rotations of shoulder, elbow and wrist of the left and of the right arm."""
        if activity.name == activity.before or activity.share >= 1.0:
            return self._arms_of(activity.name, gait_pose)
        after = self._arms_of(activity.name, gait_pose)
        before = self._arms_of(activity.before, gait_pose)
        if activity.share <= 0.0:
            return before
        return (
            _blended(before[LEFT], after[LEFT], activity.share),
            _blended(before[RIGHT], after[RIGHT], activity.share),
        )

    def _arms_of(self, name: str, gait_pose: GaitPose) -> tuple[Arm, Arm]:
        if name in ("carry_box", "kneeling"):  # both hands at something before the belly
            return self.carrying
        if name == "sitting":
            return self.resting
        swing, stride_ratio = gait_pose.arm_swing_rad, abs(gait_pose.stride_ratio)
        left = _swinging_arm(LEFT, 0.6 * swing if name == "phone" else swing, stride_ratio)
        return left, self.reading if name == "phone" else _swinging_arm(RIGHT, -swing, stride_ratio)


@lru_cache(maxsize=64)
def arm_postures(bones: Skeleton) -> ArmPostures:
    """Return the arm postures of a body."""
    box = _box_place(bones)
    carrying = (_carrying_arm(bones, LEFT, box), _carrying_arm(bones, RIGHT, box))
    reading, T_hand_phone = _reading_arm(bones)
    resting = (_resting_arm(bones, LEFT), _resting_arm(bones, RIGHT))
    return ArmPostures(carrying, reading, resting, box, T_hand_phone)


def _swinging_arm(side: int, swing_rad: float, stride_ratio: float) -> Arm:
    """Return an arm that swings forwards by ``swing_rad``; the elbow bends as it comes forward."""
    apart = rotation_x(SIGNS[side] * (_ARMS_APART_RAD + _ARMS_SWING_APART_RAD * stride_ratio))
    bend = _ELBOW_BEND_RAD * stride_ratio + _ELBOW_SWING * max(swing_rad, -0.1 * stride_ratio)
    return multiply(apart, rotation_y(-swing_rad)), rotation_y(-max(bend, 0.0)), IDENTITY


def _blended(first: Arm, second: Arm, share: float) -> Arm:
    """Return the posture between two arms: ``first`` at share 0, ``second`` at share 1."""
    shoulder, elbow, wrist = (slerp(a, b, share) for a, b in zip(first, second, strict=True))
    return shoulder, elbow, wrist


def _box_place(bones: Skeleton) -> Vector:
    """Return the middle of the box: before the belly, a little below the elbows."""
    skin = bones.asset.levels[-1]
    points = skin.vertices_m * bones.scale
    arms = [JOINTS.index(f"{side}_shoulder") for side in SIDES]
    elbow = bones.joint_m("left_elbow")[2]
    trunk = skin.weights[:, arms].max(axis=1) < 0.02
    near = (np.abs(points[:, 2] - elbow) < 0.25) & (np.abs(points[:, 1]) < 0.20)
    front = float(points[trunk & near, 0].max(initial=0.10))
    return (front + _BOX_GAP_M + 0.5 * BOX_SIZE_M[0], 0.0, elbow - _BOX_BELOW_ELBOWS_M)


def _carrying_arm(bones: Skeleton, side: int, box_m: Vector) -> Arm:
    """Return an arm with the hand flat against the box, fingers forward and a low elbow."""
    sign, size = SIGNS[side], bones.stature_m / _MEAN_STATURE_M
    # Half-curled fingers point outwards a little, so that their tips lie on the box and not in it.
    outward = sign * _FINGERS_OUT_RAD
    fingers = unit((math.cos(outward), math.sin(outward), -0.36))
    palm = (math.sin(_FINGERS_OUT_RAD), -sign * math.cos(_FINGERS_OUT_RAD), 0.0)
    turn = _hand_rotation(bones, side, (fingers, palm))
    wrist_joint = JOINTS.index(f"{SIDES[side]}_wrist")
    skin = bones.asset.levels[-1]
    hand = skin.vertices_m[skin.weights[:, wrist_joint] > 0.9] - bones.asset.joints_m[wrist_joint]
    inwards = -sign * (hand * bones.scale @ rotation_matrix(turn).T)[:, 1]
    wrist = (
        box_m[0] - 0.02 - _PALM_M * size * fingers[0],
        sign
        * (0.5 * BOX_SIZE_M[1] + max(float(inwards.max()) - _GRIP_DEPTH_M, _HALF_HAND_M * size)),
        box_m[2] - 0.02 - _PALM_M * size * fingers[2],
    )
    return _arm_to(bones, side, wrist, (0.0, -1.0, -0.35 * sign), turn)


def _resting_arm(bones: Skeleton, side: int) -> Arm:
    """Return an arm with the palm on the level thigh, the fingers forward and a little inwards."""
    sign, size = SIGNS[side], bones.stature_m / _MEAN_STATURE_M
    hip = bones.joint_m(f"{SIDES[side]}_hip")
    thigh = math.hypot(*bones.legs[side].first_m)
    radii = (
        max(c.radius_m for c in bones.asset.capsules if JOINTS[c.joint] == f"{SIDES[side]}_{part}")
        for part in ("hip", "wrist")
    )
    above = sum(radii) * bones.scale + _RESTING_ABOVE_M * size
    wrist = add_scaled(hip, (_RESTING_SHARE * thigh, 0.2 * hip[1], above), 1.0)
    fingers = unit((math.cos(0.3), -sign * math.sin(0.3), -0.1))
    palm = unit(add_scaled((0.0, 0.0, -1.0), fingers, fingers[2]))
    turn = _hand_rotation(bones, side, (fingers, palm))
    return _arm_to(bones, side, wrist, (0.0, -1.0, -0.5 * sign), turn)


def _reading_arm(bones: Skeleton) -> tuple[Arm, FloatArray]:
    """Return the right arm with the phone before the face, and the phone's pose in the hand."""
    size = bones.stature_m / _MEAN_STATURE_M
    cos, sin = math.cos(_PHONE_BELOW_RAD), math.sin(_PHONE_BELOW_RAD)
    x, y, z = bones.eyes_m
    phone = (x + _PHONE_DISTANCE_M * cos, y - _PHONE_RIGHT_M, z - _PHONE_DISTANCE_M * sin)
    # The palm faces the eyes; the fingers point up behind the phone and inwards.
    palm, up = (-cos, 0.0, sin), (sin, 0.0, cos)
    fingers = rotate(axis_angle(palm, math.radians(-25.0)), up)
    hand = add_scaled(phone, palm, -0.5 * PHONE_SIZE_M[0] - _HALF_HAND_M * size)
    wrist = add_scaled(hand, fingers, -_PALM_M * size)
    turn = _hand_rotation(bones, RIGHT, (fingers, palm))
    arm = _arm_to(bones, RIGHT, wrist, (0.0, -1.0, 0.55), turn)
    world = np.eye(4)
    world[:3, :3] = rotation_matrix(rotation_y(_PHONE_BELOW_RAD))
    world[:3, 3] = phone
    # Transform of the hand's link in this posture, from the body at rest.
    link = np.eye(4)
    for name, turn in zip(("shoulder", "elbow", "wrist"), arm, strict=True):
        centre, rotation = np.array(bones.joint_m(f"right_{name}")), rotation_matrix(turn)
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = rotation, centre - rotation @ centre
        link = link @ step
    return arm, np.linalg.inv(link) @ world


def _hand_rotation(bones: Skeleton, side: int, hand: tuple[Vector, Vector]) -> Quaternion:
    """Return the hand's rotation from rest that gives its fingers and palm these directions.

    At rest the fingers point down and the palm faces the thigh.
    """
    along = unit(bones.arms[side].second_m)
    return multiply(aligned(*hand), inverse(aligned(along, (0.0, -SIGNS[side], 0.0))))


def _arm_to(
    bones: Skeleton, side: int, wrist_m: Vector, hinge: Vector, hand_rotation: Quaternion
) -> Arm:
    """Return the arm with this wrist and hand, its elbow's hinge as near ``hinge`` as it can."""
    arm = bones.arms[side]
    target = subtract(wrist_m, bones.joint_m(f"{SIDES[side]}_shoulder"))
    shoulder, bend = arm.solve(target, hinge)
    elbow = axis_angle(arm.axis, bend)
    along = unit(arm.second_m)
    wrist = multiply(inverse(multiply(shoulder, elbow)), hand_rotation)
    # Rotation of the hand about the forearm comes mostly from the forearm itself.
    twist = 2.0 * math.atan2(dot(wrist[:3], along), wrist[3])
    twist = _FOREARM_TWIST_SHARE * math.remainder(twist, math.tau)
    return (
        shoulder,
        multiply(elbow, axis_angle(along, twist)),
        multiply(axis_angle(along, -twist), wrist),
    )


@lru_cache(maxsize=64)
def seated_pose(bones: Skeleton) -> GaitPose:
    """Return feet and hips of a person who sits, in the body's frame; the hips are above it."""
    feet = []
    hips = 0.0
    for number, name in enumerate(SIDES):
        ankle, hip = bones.joint_m(f"{name}_ankle"), bones.joint_m(f"{name}_hip")
        leg = bones.legs[number]
        thigh, shank = math.hypot(*leg.first_m), math.hypot(*leg.second_m)
        x = hip[0] - bones.hips_m[0] + thigh
        yaw = SIGNS[number] * _TOE_OUT_RAD
        feet.append((x, _FEET_APART * ankle[1], ankle[2], yaw, 0.0))
        hips += 0.5 * (ankle[2] + shank - (hip[2] - bones.hips_m[2]))
    return GaitPose((feet[0], feet[1]), hips)


@lru_cache(maxsize=64)
def kneeling_pose(bones: Skeleton) -> GaitPose:
    """Return feet and hips of a person on both knees, in the body's frame; thighs are upright."""
    size = bones.stature_m / _MEAN_STATURE_M
    feet = []
    hips = 0.0
    for number, name in enumerate(SIDES):
        hip = bones.joint_m(f"{name}_hip")
        leg = bones.legs[number]
        thigh, shank = math.hypot(*leg.first_m), math.hypot(*leg.second_m)
        down = (_ANKLE_HEIGHT_M - _KNEE_HEIGHT_M) * size
        x = hip[0] - bones.hips_m[0] - math.sqrt(shank**2 - down**2)
        feet.append((x, hip[1], _ANKLE_HEIGHT_M * size, 0.0, _FOOT_PITCH_RAD))
        hips += 0.5 * (_KNEE_HEIGHT_M * size + thigh - (hip[2] - bones.hips_m[2]))
    return GaitPose((feet[0], feet[1]), hips)


@dataclass(frozen=True, slots=True)
class Trunk:
    """Hips, trunk and head in the heading frame: the body's position with x along its heading."""

    hips_m: Vector
    pelvis: Quaternion
    thorax: Quaternion
    head: Quaternion


class JointAngles:
    """The joint angles of one body."""

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
        thorax = rotation_zy(gait_pose.thorax_yaw_rad, lean)
        facing = rotation_zy(head_rad[0], -head_rad[1])
        return Trunk((0.0, gait_pose.sway_m, gait_pose.hip_height_m), pelvis, thorax, facing)

    def joints(
        self,
        trunk: Trunk,
        gait_pose: GaitPose,
        feet: tuple[Foot, Foot],
        eyes_rad: tuple[float, float],
        activity: Activity,
    ) -> tuple[Quaternion, ...]:
        """Return the rotation of every joint in the order of :data:`JOINTS`."""
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
            turned_foot = multiply(back, rotation_zy(yaw, pitch))
            legs += (thigh, knee, multiply(inverse(multiply(thigh, knee)), turned_foot))
        eye = rotation_zy(eyes_rad[0], -eyes_rad[1])
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
