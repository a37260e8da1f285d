"""A worker's skeleton: joints of an asset scaled to a stature, leg and arm IK, rolling soles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from perception import layouts as kp
from perception.arrays import FloatArray, finite_number

from ...world.errors import SimError
from ._asset import JOINTS, WorkerAsset, load_worker, worker_names, worker_stature_m
from ._quaternions import (
    Quaternion,
    Vector,
    add,
    aligned,
    axis_angle,
    cross,
    dot,
    inverse,
    multiply,
    rotate,
    unit,
)

#: Range of statures that a body may be scaled to: a child of four years to a tall adult. A child is
#: an adult made smaller; its head is a sixth too small.
MIN_STATURE_M: Final = 1.0
MAX_STATURE_M: Final = 2.1
#: Sides of the body in the order of every pair, their names, and the sign of their y.
LEFT, RIGHT = 0, 1
SIDES: Final = ("left", "right")
SIGNS: Final = (1.0, -1.0)

_ROLL_MIN_RAD: Final = math.radians(-45.0)
_ROLL_MAX_RAD: Final = math.radians(75.0)
_ROLL_STEP_RAD: Final = math.radians(0.25)
# A limb is never quite straight: the joint would jerk over the last part of its reach.
_MAX_EXTENSION: Final = 0.9995
# Skin that follows the ankle by more than this is the shoe.
_SHOE_WEIGHT: Final = 0.98


class TwoBoneLimb:
    """Closed-form inverse kinematics of two bones joined by a hinge.

    The bones need not lie on a line at rest. Positive hinge angles turn the second bone about
    ``axis``.

    Args:
        first_m: (3,) from the root to the hinge at rest.
        second_m: (3,) from the hinge to the tip at rest.
        axis: (3,) unit vector of the hinge at rest.

    Attributes:
        reach_m: largest distance from root to tip.
    """

    def __init__(self, first_m: Vector, second_m: Vector, axis: Vector) -> None:
        self.first_m, self.second_m, self.axis = first_m, second_m, axis
        along = dot(first_m, axis) * dot(second_m, axis)
        # Squared reach at hinge angle a: squares + 2 (along + c cos(a - straight)).
        cos_part = dot(first_m, second_m) - along
        sin_part = dot(first_m, cross(axis, second_m))
        self._swing = math.hypot(cos_part, sin_part)
        self._straight_rad = math.atan2(sin_part, cos_part)
        self._constant = dot(first_m, first_m) + dot(second_m, second_m) + 2.0 * along
        self._shortest_m = math.sqrt(max(self._constant - 2.0 * self._swing, 0.0))
        self.reach_m = _MAX_EXTENSION * math.sqrt(self._constant + 2.0 * self._swing)

    def solve(self, target_m: Vector, lateral: Vector) -> tuple[Quaternion, float]:
        """Return the first bone's rotation and the hinge angle that bring the tip to a target.

        Args:
            target_m: (3,) from the root to the tip, in the axes of the root's link. If it is out of
                reach, the tip goes as far as it can in that direction.
            lateral: (3,) preferred direction of the hinge axis.
        """
        distance = math.sqrt(dot(target_m, target_m))
        reach = min(max(distance, self._shortest_m * 1.001), self.reach_m)
        cosine = (reach * reach - self._constant) / (2.0 * self._swing)
        angle = self._straight_rad + math.acos(min(max(cosine, -1.0), 1.0))
        tip = add(self.first_m, rotate(axis_angle(self.axis, angle), self.second_m))
        rest = aligned(unit(tip), self.axis)
        return multiply(aligned(unit(target_m), lateral), inverse(rest)), angle


@dataclass(frozen=True, eq=False)
class SoleRoll:
    """A rigid shoe that rolls on the floor from heel to toe without sliding.

    The shoe turns about the point where its sole touches. Per radian of pitch the ankle therefore
    moves forward by its height above the floor.

    Attributes:
        ahead_m: (N,) ankle ahead of its place with a flat sole, per step of pitch.
        height_m: (N,) ankle above the floor, per step of pitch.
    """

    ahead_m: FloatArray
    height_m: FloatArray

    @classmethod
    def from_surface(cls, points_m: FloatArray) -> SoleRoll:
        """Roll a shoe with this surface: (V, 3) relative to the ankle, sole flat."""
        count = round((_ROLL_MAX_RAD - _ROLL_MIN_RAD) / _ROLL_STEP_RAD) + 1
        pitch = _ROLL_MIN_RAD + _ROLL_STEP_RAD * np.arange(count)
        lowest = np.array(
            [(np.cos(a) * points_m[:, 2] - np.sin(a) * points_m[:, 0]).min() for a in pitch]
        )
        height = -lowest
        steps = 0.5 * (height[1:] + height[:-1]) * _ROLL_STEP_RAD
        ahead = np.concatenate([[0.0], np.cumsum(steps)])
        return cls(ahead - float(np.interp(0.0, pitch, ahead)), height)

    def ankle(self, pitch_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the ankle's distance ahead and its height at a pitch; toes down is positive."""
        end = len(self.ahead_m) - 1.001
        place = np.clip((pitch_rad - _ROLL_MIN_RAD) / _ROLL_STEP_RAD, 0.0, end)
        row = place.astype(np.int64)
        share = place - row
        ahead = self.ahead_m[row] + share * (self.ahead_m[row + 1] - self.ahead_m[row])
        height = self.height_m[row] + share * (self.height_m[row + 1] - self.height_m[row])
        return ahead, height


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The bones of one worker at one stature, in the body frame at rest (x forward, z up).

    Attributes:
        asset: the worker.
        stature_m: standing height with shoes.
        scale: ``stature_m`` divided by the asset's.
        joints_m: (16, 3) scaled joints in the order of :data:`JOINTS`.
        hips_m: midpoint of the hip joints.
        legs: left and right leg.
        arms: left and right arm.
        soles: left and right sole.
        eyes_m: midpoint of the eye keypoints.
        shoulders_m: midpoint of the shoulder keypoints.
        hip_keypoints_m: midpoint of the hip keypoints.
    """

    asset: WorkerAsset
    stature_m: float
    scale: float
    joints_m: FloatArray
    hips_m: Vector
    legs: tuple[TwoBoneLimb, TwoBoneLimb]
    arms: tuple[TwoBoneLimb, TwoBoneLimb]
    soles: tuple[SoleRoll, SoleRoll]
    eyes_m: Vector
    shoulders_m: Vector
    hip_keypoints_m: Vector

    def joint_m(self, name: str) -> Vector:
        """Return a joint's position at rest."""
        return _vector(self.joints_m[JOINTS.index(name)])


@lru_cache(maxsize=64)
def skeleton(look: str | None, stature_m: float) -> Skeleton:
    """Return the bones of the worker called ``look``, scaled to a stature."""
    stature = finite_number(
        "stature_m", stature_m, SimError, minimum=MIN_STATURE_M, maximum=MAX_STATURE_M
    )
    asset = load_worker(_nearest_look(stature) if look is None else look)
    scale = stature / asset.stature_m
    joints = np.array(asset.joints_m * scale)
    joints.setflags(write=False)
    keypoints = asset.keypoints_m * scale

    def between(rows: Sequence[int], points: FloatArray) -> Vector:
        return _vector(points[list(rows)].mean(axis=0))

    return Skeleton(
        asset=asset,
        stature_m=stature,
        scale=scale,
        joints_m=joints,
        hips_m=between([JOINTS.index(f"{side}_hip") for side in SIDES], joints),
        legs=(_leg(joints, "left"), _leg(joints, "right")),
        arms=(_arm(joints, "left"), _arm(joints, "right")),
        soles=(_sole(asset, scale, "left"), _sole(asset, scale, "right")),
        eyes_m=between((kp.LEFT_EYE, kp.RIGHT_EYE), keypoints),
        shoulders_m=between((kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER), keypoints),
        hip_keypoints_m=between((kp.LEFT_HIP, kp.RIGHT_HIP), keypoints),
    )


@lru_cache(maxsize=64)
def _nearest_look(stature_m: float) -> str:
    """Return the shipped worker of nearest stature; of equally near ones the first by name."""

    def order(name: str) -> tuple[float, str]:
        # To the centimetre, so that rounding errors do not choose between two looks.
        return round(abs(worker_stature_m(name) - stature_m), 2), name

    return min(worker_names(), key=order)


def _leg(joints_m: FloatArray, side: str) -> TwoBoneLimb:
    hip, knee, ankle = (joints_m[JOINTS.index(f"{side}_{n}")] for n in ("hip", "knee", "ankle"))
    # A rotation about +y swings a hanging bone backwards, so a knee bends by positive angles.
    return TwoBoneLimb(_vector(knee - hip), _vector(ankle - knee), (0.0, 1.0, 0.0))


def _arm(joints_m: FloatArray, side: str) -> TwoBoneLimb:
    shoulder, elbow, wrist = (
        joints_m[JOINTS.index(f"{side}_{n}")] for n in ("shoulder", "elbow", "wrist")
    )
    upper, fore = elbow - shoulder, wrist - elbow
    # A rotation about -y swings a hanging bone forwards. The hinge is square to the upper arm.
    axis = np.array([0.0, -1.0, 0.0])
    axis -= upper * (axis @ upper) / (upper @ upper)
    return TwoBoneLimb(_vector(upper), _vector(fore), _vector(axis / np.linalg.norm(axis)))


def _sole(asset: WorkerAsset, scale: float, side: str) -> SoleRoll:
    ankle = JOINTS.index(f"{side}_ankle")
    skin = asset.levels[0]
    shoe = skin.vertices_m[skin.weights[:, ankle] > _SHOE_WEIGHT] - asset.joints_m[ankle]
    return SoleRoll.from_surface(shoe * scale)


def _vector(values: FloatArray) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)
