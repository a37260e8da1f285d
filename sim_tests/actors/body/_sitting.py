"""Postures low down: seated on a stool or box, and on both knees."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, get_args

import numpy as np

from perception.arrays import FloatArray

from ...world.errors import SimError
from ._gait_pose import GaitPose
from ._quaternions import Vector
from ._skeleton import SIDES, SIGNS, Skeleton

SeatKind = Literal["stool", "box"]
#: Height of the eyes of a seated person as a share of the standing stature.
SEATED_EYE_HEIGHT_SHARE: Final = 0.71
#: The same of a person on both knees.
KNEELING_EYE_HEIGHT_SHARE: Final = 0.67

_MEAN_STATURE_M: Final = 1.75
# The seat for a body of 1.75 m: depth and width, and its middle ahead of the hips.
_SEAT_DEPTH_M: Final = 0.34
_SEAT_WIDTH_M: Final = 0.42
_SEAT_AHEAD_M: Final = 0.03
# From the hip joints down to the seat, at 1.75 m.
_HIPS_ABOVE_SEAT_M: Final = 0.115
# Seated feet stand wider apart than the hips, and the toes point outwards.
_FEET_APART: Final = 1.35
_TOE_OUT_RAD: Final = math.radians(8.0)
# Knees and stretched feet on the floor, at 1.75 m: height of the knees' and the ankles' joints, and
# the pitch of the feet.
_KNEE_HEIGHT_M: Final = 0.070
_ANKLE_HEIGHT_M: Final = 0.075
_FOOT_PITCH_RAD: Final = math.radians(155.0)


@dataclass(frozen=True, slots=True)
class Seat:
    """A seat, which stands on the floor.

    Attributes:
        kind: a stool with four legs, or a closed box, which hides the legs behind it.
        size_m: depth, width and height.
    """

    kind: SeatKind
    size_m: Vector


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


def fitting_seat(bones: Skeleton, kind: SeatKind) -> Seat:
    """Return the seat that fits a body.

    Raises:
        SimError: for another kind.
    """
    if kind not in get_args(SeatKind):
        valid = ", ".join(map(repr, get_args(SeatKind)))
        raise SimError(f"seat must be one of {valid}, got {kind!r}")
    size = bones.stature_m / _MEAN_STATURE_M
    height = seated_pose(bones).hip_height_m - _HIPS_ABOVE_SEAT_M * size
    return Seat(kind, (_SEAT_DEPTH_M * size, _SEAT_WIDTH_M * size, height))


def seat_pose(seat: Seat, x_m: float, y_m: float, heading_rad: float) -> FloatArray:
    """Return (4, 4) the pose in odom of a seat's middle under a body at this place."""
    depth, _, height = seat.size_m
    ahead = _SEAT_AHEAD_M / _SEAT_DEPTH_M * depth
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    T_odom_seat = np.eye(4)
    T_odom_seat[:2, :2] = [[cos, -sin], [sin, cos]]
    T_odom_seat[:3, 3] = x_m + cos * ahead, y_m + sin * ahead, 0.5 * height
    return T_odom_seat
