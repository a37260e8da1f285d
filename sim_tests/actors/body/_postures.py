"""What workers do with their arms: let them swing, carry a box, hold up a phone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, get_args

import numpy as np

from perception.arrays import FloatArray

from ...world.errors import SimError
from ._asset import JOINTS
from ._footing import Footing
from ._pose import (
    IDENTITY,
    Quaternion,
    Vector,
    about,
    about_x,
    about_y,
    inverse,
    matrix,
    product,
    quaternion,
    slerp,
    turned,
)
from ._skeleton import SIDES, SIGNS, Skeleton

ActivityName = Literal["none", "carry_box", "phone"]
#: What hands may be busy with.
ACTIVITIES: Final = get_args(ActivityName)
#: Depth, width and height of the box that is carried, along its x, y, z; metres.
BOX_SIZE_M: Final = (0.30, 0.40, 0.28)
#: Thickness, width and height of the phone; its screen looks along −x.
PHONE_SIZE_M: Final = (0.009, 0.072, 0.150)

# The box hangs this far before the belly, its middle this far below the elbows.
_BOX_GAP_M: Final = 0.025
_BOX_BELOW_ELBOWS_M: Final = 0.05
# From the wrist to the middle of the palm, and half of what a gloved hand is thick, of a body of
# 1.75 m.
_PALM_M: Final = 0.085
_HALF_HAND_M: Final = 0.022
_MEAN_STATURE_M: Final = 1.75
# The phone is held so far from the eyes, so far below the horizontal and to the right.
_PHONE_M: Final = 0.34
_PHONE_BELOW_RAD: Final = math.radians(46.0)
_PHONE_RIGHT_M: Final = 0.05
# Fingers on a box point out by this, and press into the cardboard by that.
_FINGERS_OUT_RAD: Final = math.radians(22.0)
_GRIP_M: Final = 0.012
# A forearm gives this part of the hand's twist; the wrist does the rest.
_FOREARM_TWIST: Final = 0.65
_ELBOW_BEND_RAD: Final = 0.16
_ELBOW_SWING: Final = 0.55
# Arms hang this far out from rest, and swing as much farther out in a brisk walk.
_ARMS_APART_RAD: Final = 0.025
_ARMS_SWING_APART_RAD: Final = 0.04
# A box is in the hands once they are where it is.
_HELD_SHARE: Final = 0.98

Arm = tuple[Quaternion, Quaternion, Quaternion]  # shoulder, elbow, wrist


@dataclass(frozen=True, slots=True)
class Activity:
    """What the hands do, or how far they are on the way to it.

    Attributes:
        name: one of :data:`ACTIVITIES`.
        before: what they did before.
        share: 0 still ``before`` to 1 fully ``name``.
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

    @property
    def held(self) -> Literal["box", "phone"] | None:
        """What is in the hands."""
        doing = self.name if self.share >= 0.5 else self.before
        if doing == "phone":
            return "phone"
        firmly = max(self.share, 1.0 - self.share) >= _HELD_SHARE
        return "box" if doing == "carry_box" and firmly else None

    @property
    def upright(self) -> float:
        """How far the trunk is held upright for the sake of what is carried, in [0, 1]."""
        return self.share * (self.name == "carry_box") + (1.0 - self.share) * (
            self.before == "carry_box"
        )


@dataclass(frozen=True, eq=False)
class ArmPostures:
    """Arms of one body for every activity, relative to its thorax at rest.

    Attributes:
        carrying: left and right arm with the box in the hands.
        reading: left and right arm, the phone in the right hand; the left one None: it swings.
        box_m: middle of the box, body frame at rest; it moves with the thorax.
        T_hand_phone: (4, 4) the phone in the right hand's link, both at rest.
    """

    carrying: tuple[Arm, Arm]
    reading: Arm
    box_m: Vector
    T_hand_phone: FloatArray

    def arms(self, footing: Footing, activity: Activity) -> tuple[Arm, Arm]:
        """Turns of shoulders, elbows and wrists, left and right."""
        if activity.name == activity.before or activity.share >= 1.0:
            return self._of(activity.name, footing)
        now, then = self._of(activity.name, footing), self._of(activity.before, footing)
        if activity.share <= 0.0:
            return then
        return (
            _between(then[0], now[0], activity.share),
            _between(then[1], now[1], activity.share),
        )

    def _of(self, name: str, footing: Footing) -> tuple[Arm, Arm]:
        if name == "carry_box":
            return self.carrying
        swing, vigour = footing.arm_swing_rad, abs(footing.vigour)
        left = _hanging(0, 0.6 * swing if name == "phone" else swing, vigour)
        return left, self.reading if name == "phone" else _hanging(1, -swing, vigour)


@lru_cache(maxsize=64)
def arm_postures(bones: Skeleton) -> ArmPostures:
    """Work out the arms of a body once."""
    box = _box_place(bones)
    carrying = (_carrying(bones, 0, box), _carrying(bones, 1, box))
    reading, T_hand_phone = _reading(bones)
    return ArmPostures(carrying, reading, box, T_hand_phone)


def _hanging(side: int, swing_rad: float, vigour: float) -> Arm:
    """An arm that swings forwards by ``swing_rad``, the elbow bending as it comes forward."""
    apart = about_x(SIGNS[side] * (_ARMS_APART_RAD + _ARMS_SWING_APART_RAD * vigour))
    bend = _ELBOW_BEND_RAD * vigour + _ELBOW_SWING * max(swing_rad, -0.1 * vigour)
    return product(apart, about_y(-swing_rad)), about_y(-max(bend, 0.0)), IDENTITY


def _between(first: Arm, second: Arm, share: float) -> Arm:
    shoulder, elbow, wrist = (slerp(a, b, share) for a, b in zip(first, second, strict=True))
    return shoulder, elbow, wrist


def _box_place(bones: Skeleton) -> Vector:
    """Before the belly, as high as elbows and arms like it."""
    skin = bones.asset.levels[-1]
    points = skin.vertices_m * bones.scale
    arms = [JOINTS.index(f"{side}_shoulder") for side in SIDES]
    elbow = bones.joint_m("left_elbow")[2]
    trunk = skin.weights[:, arms].max(axis=1) < 0.02
    near = (np.abs(points[:, 2] - elbow) < 0.25) & (np.abs(points[:, 1]) < 0.20)
    front = float(points[trunk & near, 0].max(initial=0.10))
    return (front + _BOX_GAP_M + 0.5 * BOX_SIZE_M[0], 0.0, elbow - _BOX_BELOW_ELBOWS_M)


def _carrying(bones: Skeleton, side: int, box_m: Vector) -> Arm:
    """Hand flat against the side of the box, fingers forward, elbow low and a little out."""
    sign, size = SIGNS[side], bones.stature_m / _MEAN_STATURE_M
    # Half-curled fingers point outwards a little, so that their tips lie on the box, not in it.
    outward = sign * _FINGERS_OUT_RAD
    fingers = _unit((math.cos(outward), math.sin(outward), -0.36))
    palm = (math.sin(_FINGERS_OUT_RAD), -sign * math.cos(_FINGERS_OUT_RAD), 0.0)
    turn = _hand_turn(bones, side, (fingers, palm))
    wrist_joint = JOINTS.index(f"{SIDES[side]}_wrist")
    skin = bones.asset.levels[-1]
    hand = skin.vertices_m[skin.weights[:, wrist_joint] > 0.9] - bones.asset.joints_m[wrist_joint]
    inwards = -sign * (hand * bones.scale @ matrix(turn).T)[:, 1]
    wrist = (
        box_m[0] - 0.02 - _PALM_M * size * fingers[0],
        sign * (0.5 * BOX_SIZE_M[1] + max(float(inwards.max()) - _GRIP_M, _HALF_HAND_M * size)),
        box_m[2] - 0.02 - _PALM_M * size * fingers[2],
    )
    return _reach(bones, side, wrist, (0.0, -1.0, -0.35 * sign), turn)


def _reading(bones: Skeleton) -> tuple[Arm, FloatArray]:
    """Right arm with the phone before the face, and where the phone is in its hand."""
    size = bones.stature_m / _MEAN_STATURE_M
    cos, sin = math.cos(_PHONE_BELOW_RAD), math.sin(_PHONE_BELOW_RAD)
    x, y, z = bones.eyes_m
    phone = (x + _PHONE_M * cos, y - _PHONE_RIGHT_M, z - _PHONE_M * sin)
    # The palm looks at the eyes; the fingers point up behind the phone and inwards.
    palm, up = (-cos, 0.0, sin), (sin, 0.0, cos)
    fingers = turned(about(palm, math.radians(-25.0)), up)
    hand = _sum(phone, palm, -0.5 * PHONE_SIZE_M[0] - _HALF_HAND_M * size)
    wrist = _sum(hand, fingers, -_PALM_M * size)
    turn = _hand_turn(bones, 1, (fingers, palm))
    arm = _reach(bones, 1, wrist, (0.0, -1.0, 0.55), turn)
    world = np.eye(4)
    world[:3, :3] = matrix(about_y(_PHONE_BELOW_RAD))
    world[:3, 3] = phone
    # The hand's link in that posture, from the body at rest.
    link = np.eye(4)
    for name, turn in zip(("shoulder", "elbow", "wrist"), arm, strict=True):
        centre, rotation = np.array(bones.joint_m(f"right_{name}")), matrix(turn)
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = rotation, centre - rotation @ centre
        link = link @ step
    return arm, np.linalg.inv(link) @ world


def _hand_turn(bones: Skeleton, side: int, hand: tuple[Vector, Vector]) -> Quaternion:
    """From rest, fingers down and palm to the thigh, to given fingers and palm."""
    along = _unit(bones.arms[side].second_m)
    return product(_frame(*hand), inverse(_frame(along, (0.0, -SIGNS[side], 0.0))))


def _reach(
    bones: Skeleton, side: int, wrist_m: Vector, hinge: Vector, hand_turn: Quaternion
) -> Arm:
    """An arm whose wrist is there, its elbow's hinge near ``hinge``, its hand turned so."""
    arm = bones.arms[side]
    target = _difference(wrist_m, bones.joint_m(f"{SIDES[side]}_shoulder"))
    shoulder, bend = arm.solve(target, hinge)
    elbow = about(arm.axis, bend)
    along = _unit(arm.second_m)
    wrist = product(inverse(product(shoulder, elbow)), hand_turn)
    # The part of the hand's turn about the forearm comes mostly from the forearm itself.
    twist = 2.0 * math.atan2(sum(a * b for a, b in zip(wrist, along, strict=False)), wrist[3])
    twist = _FOREARM_TWIST * math.remainder(twist, math.tau)
    return (
        shoulder,
        product(elbow, about(along, twist)),
        product(about(along, -twist), wrist),
    )


def _frame(along: Vector, palm: Vector) -> Quaternion:
    """Turn of axes whose first is ``along`` and whose second is nearest to ``palm``."""
    overlap = sum(a * b for a, b in zip(along, palm, strict=True))
    second = _unit(_sum(palm, along, -overlap))
    ax, ay, az = along
    bx, by, bz = second
    return quaternion(along, second, (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))


def _sum(start: Vector, direction: Vector, length: float) -> Vector:
    return (
        start[0] + length * direction[0],
        start[1] + length * direction[1],
        start[2] + length * direction[2],
    )


def _difference(first: Vector, second: Vector) -> Vector:
    return _sum(first, second, -1.0)


def _unit(vector: Vector) -> Vector:
    length = math.sqrt(sum(part * part for part in vector))
    return (vector[0] / length, vector[1] / length, vector[2] / length)
