"""A worker's bones: joints of an asset scaled to a stature, and how legs, arms and soles move."""

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
from ._asset import JOINTS, WorkerAsset, load_worker, worker_names
from ._pose import Quaternion, Vector, about, inverse, product, quaternion, turned

#: Statures that a body may be scaled to.
MIN_STATURE_M: Final = 1.4
MAX_STATURE_M: Final = 2.1
#: Sides of the body in the order of every pair: left, right; and the sign of their y.
SIDES: Final = ("left", "right")
SIGNS: Final = (1.0, -1.0)

_ROLL_MIN_RAD: Final = math.radians(-45.0)
_ROLL_MAX_RAD: Final = math.radians(75.0)
_ROLL_STEP_RAD: Final = math.radians(0.25)
# A limb is never quite straight: the last per mille of reach costs a jerk of the joint.
_STRAIGHTEST: Final = 0.9995
# Skin that follows the ankle by more than this is the shoe.
_SHOE_WEIGHT: Final = 0.98


class TwoBones:
    """Closed-form inverse kinematics of two bones joined by a hinge.

    At rest the first bone goes from its root to the hinge by ``first_m``, the second from there to
    the tip by ``second_m``; the three need not lie on a line. Positive angles turn the second bone
    about ``axis``.

    Args:
        first_m: (3,) of the first bone at rest.
        second_m: (3,) of the second.
        axis: (3,) unit vector of the hinge at rest.
    """

    def __init__(self, first_m: Vector, second_m: Vector, axis: Vector) -> None:
        self.first_m, self.second_m, self.axis = first_m, second_m, axis
        along = _dot(first_m, axis) * _dot(second_m, axis)
        # Squared reach at hinge angle a: squares + 2 (along + c cos(a - straight)).
        cos_part = _dot(first_m, second_m) - along
        sin_part = _dot(first_m, _cross(axis, second_m))
        self._swing = math.hypot(cos_part, sin_part)
        self._straight_rad = math.atan2(sin_part, cos_part)
        self._constant = _dot(first_m, first_m) + _dot(second_m, second_m) + 2.0 * along
        self._shortest_m = math.sqrt(max(self._constant - 2.0 * self._swing, 0.0))
        self.reach_m = _STRAIGHTEST * math.sqrt(self._constant + 2.0 * self._swing)

    def solve(self, target_m: Vector, lateral: Vector) -> tuple[Quaternion, float]:
        """Turn of the first bone and hinge angle that bring the tip to ``target_m``.

        Args:
            target_m: (3,) of the tip from the root, in the axes of the root's link. One that is out
                of reach is approached as far as the bones allow, in its direction.
            lateral: (3,) where the hinge's axis shall point, as far as the target leaves it free.
        """
        distance = math.sqrt(_dot(target_m, target_m))
        reach = min(max(distance, self._shortest_m * 1.001), self.reach_m)
        cosine = (reach * reach - self._constant) / (2.0 * self._swing)
        angle = self._straight_rad + math.acos(min(max(cosine, -1.0), 1.0))
        bent = turned(about(self.axis, angle), self.second_m)
        tip = tuple(a + b for a, b in zip(self.first_m, bent, strict=True))
        rest = _frame((tip[0], tip[1], tip[2]), self.axis)
        return product(_frame(target_m, lateral), inverse(rest)), angle


@dataclass(frozen=True, eq=False)
class SoleRoll:
    """A rigid shoe rolling on the floor without sliding, heel to toe, by its pitch.

    Wherever the sole touches, the shoe turns about that point, so the ankle moves forward by its
    height above the floor per radian.

    Attributes:
        ahead_m: (N,) of the ankle, relative to where it is when the sole lies flat.
        height_m: (N,) of the ankle above the floor.
    """

    ahead_m: FloatArray
    height_m: FloatArray

    @classmethod
    def of(cls, points_m: FloatArray) -> SoleRoll:
        """Of the shoe's surface, (V, 3) relative to the ankle with the sole flat."""
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
        """Ankle ahead of its flat place and above the floor; toes down is positive."""
        end = len(self.ahead_m) - 1.001
        place = np.clip((pitch_rad - _ROLL_MIN_RAD) / _ROLL_STEP_RAD, 0.0, end)
        row = place.astype(np.int64)
        share = place - row
        ahead = self.ahead_m[row] + share * (self.ahead_m[row + 1] - self.ahead_m[row])
        height = self.height_m[row] + share * (self.height_m[row + 1] - self.height_m[row])
        return ahead, height


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The bones of one worker at one stature; metres, body frame at rest (x forward, z up).

    Attributes:
        asset: whose bones.
        stature_m: height standing, with shoes.
        scale: ``stature_m`` over the asset's.
        joints_m: (16, 3) scaled.
        hips_m: midpoint of the hip joints.
        legs: left and right.
        arms: left and right.
        soles: left and right.
        nose_m: tip of the nose.
        eyes_m: midpoint of the eye keypoints.
        shoulders_m: midpoint of the shoulder keypoints.
        hip_keypoints_m: midpoint of the hip keypoints.
    """

    asset: WorkerAsset
    stature_m: float
    scale: float
    joints_m: FloatArray
    hips_m: Vector
    legs: tuple[TwoBones, TwoBones]
    arms: tuple[TwoBones, TwoBones]
    soles: tuple[SoleRoll, SoleRoll]
    nose_m: Vector
    eyes_m: Vector
    shoulders_m: Vector
    hip_keypoints_m: Vector

    @classmethod
    def of(cls, asset: WorkerAsset, stature_m: float | None = None) -> Skeleton:
        """Scale an asset to a stature in [1.4, 2.1] m, else :class:`SimError`; None: its own."""
        stature = finite_number(
            "stature_m",
            asset.stature_m if stature_m is None else stature_m,
            SimError,
            minimum=MIN_STATURE_M,
            maximum=MAX_STATURE_M,
        )
        scale = stature / asset.stature_m
        joints = np.array(asset.joints_m * scale)
        joints.setflags(write=False)
        keypoints = asset.keypoints_m * scale

        def between(rows: Sequence[int], points: FloatArray) -> Vector:
            return _vector(points[list(rows)].mean(axis=0))

        return cls(
            asset=asset,
            stature_m=stature,
            scale=scale,
            joints_m=joints,
            hips_m=between([JOINTS.index(f"{side}_hip") for side in SIDES], joints),
            legs=(_leg(joints, "left"), _leg(joints, "right")),
            arms=(_arm(joints, "left"), _arm(joints, "right")),
            soles=(_sole(asset, scale, "left"), _sole(asset, scale, "right")),
            nose_m=_vector(keypoints[kp.NOSE]),
            eyes_m=between((kp.LEFT_EYE, kp.RIGHT_EYE), keypoints),
            shoulders_m=between((kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER), keypoints),
            hip_keypoints_m=between((kp.LEFT_HIP, kp.RIGHT_HIP), keypoints),
        )

    def joint_m(self, name: str) -> Vector:
        """A joint's place at rest."""
        return _vector(self.joints_m[JOINTS.index(name)])


@lru_cache(maxsize=64)
def skeleton(look: str | None, stature_m: float) -> Skeleton:
    """The bones of the worker called ``look``; None: of the shipped worker of nearest stature.

    Raises:
        SimError: for a look that is not shipped, or a stature outside [1.4, 2.1] m.
    """
    stature = finite_number(
        "stature_m", stature_m, SimError, minimum=MIN_STATURE_M, maximum=MAX_STATURE_M
    )
    return Skeleton.of(load_worker(nearest_look(stature) if look is None else look), stature)


@lru_cache(maxsize=64)
def nearest_look(stature_m: float) -> str:
    """Name of the shipped worker whose stature is nearest; of equally near ones the first name."""

    def order(name: str) -> tuple[float, str]:
        # To the centimetre: a rounding must not choose between two looks.
        return round(abs(load_worker(name).stature_m - stature_m), 2), name

    return min(worker_names(), key=order)


def _leg(joints_m: FloatArray, side: str) -> TwoBones:
    hip, knee, ankle = (joints_m[JOINTS.index(f"{side}_{n}")] for n in ("hip", "knee", "ankle"))
    # About +y what hangs down swings backwards: a knee bends by positive angles.
    return TwoBones(_vector(knee - hip), _vector(ankle - knee), (0.0, 1.0, 0.0))


def _arm(joints_m: FloatArray, side: str) -> TwoBones:
    shoulder, elbow, wrist = (
        joints_m[JOINTS.index(f"{side}_{n}")] for n in ("shoulder", "elbow", "wrist")
    )
    upper, fore = elbow - shoulder, wrist - elbow
    # About -y what hangs down swings forwards. The hinge is square to the upper arm.
    axis = np.array([0.0, -1.0, 0.0])
    axis -= upper * (axis @ upper) / (upper @ upper)
    return TwoBones(_vector(upper), _vector(fore), _vector(axis / np.linalg.norm(axis)))


def _sole(asset: WorkerAsset, scale: float, side: str) -> SoleRoll:
    ankle = JOINTS.index(f"{side}_ankle")
    skin = asset.levels[0]
    shoe = skin.vertices_m[skin.weights[:, ankle] > _SHOE_WEIGHT] - asset.joints_m[ankle]
    return SoleRoll.of(shoe * scale)


def _frame(along: Vector, lateral: Vector) -> Quaternion:
    """Turn of axes whose first points along and whose second as near ``lateral`` as can be."""
    length = math.sqrt(_dot(along, along))
    first = (along[0] / length, along[1] / length, along[2] / length)
    overlap = _dot(first, lateral)
    second = tuple(b - overlap * a for a, b in zip(first, lateral, strict=True))
    size = math.sqrt(sum(part * part for part in second))
    second = (second[0] / size, second[1] / size, second[2] / size)
    return quaternion(first, second, _cross(first, second))


def _vector(values: FloatArray) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )
