"""Scalar look-up tables of one body's gait. NumPy is slow on two feet."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ._gait import Gait
from ._gait_pose import (
    BACKWARD_STRIDE_SHARE,
    MAX_CADENCE_HZ,
    SIDE_STRIDE_SHARE,
    TURN_PER_CYCLE_RAD,
    USED_REACH,
)
from ._skeleton import LEFT, RIGHT, SIDES, SIGNS

PlanarPose = tuple[float, float, float]  # x, y, yaw of a flat foot or of a body

_SPEED_STEP_MPS: Final = 0.05
_MAX_SPEED_MPS: Final = 3.5
_PITCH_STEP_RAD: Final = 0.005
_MAX_PITCH_RAD: Final = 0.9


class GaitTables:
    """The figures of a :class:`Gait` for one speed, pitch or pose at a time.

    Args:
        gait: the body's gait.

    Attributes:
        stature_m: height of the body.
        comfortable_stride_m: stride at 1.2 m/s.
        standing_height_m: height of the hips' midpoint when standing.
    """

    def __init__(self, gait: Gait) -> None:
        bones = gait.skeleton
        self.stature_m = bones.stature_m
        speeds = np.arange(0.0, _MAX_SPEED_MPS + _SPEED_STEP_MPS, _SPEED_STEP_MPS)
        self._strides: list[float] = gait.stride_m(speeds).tolist()
        self._stance_shares: list[float] = gait.stance_share(speeds).tolist()
        self._stride_ratios: list[float] = gait.stride_ratio(speeds).tolist()
        self.comfortable_stride_m = float(gait.stride_m(1.2))
        self.standing_height_m = gait.standing_height_m
        here, level = np.zeros((2, 2)), np.zeros(2)
        # Row 0: standing; row 1: a walk at 1.2 m/s.
        neutral = [gait.neutral(side, here, level, np.array([0.0, 1.0])) for side in (LEFT, RIGHT)]
        self._ahead_m = [float(rows[0, 0]) for rows in neutral]
        self._standing_half_widths_m = [abs(float(rows[0, 1])) for rows in neutral]
        self._walking_half_widths_m = [abs(float(rows[1, 1])) for rows in neutral]
        self._toe_out_rad = [float(rows[0, 2]) for rows in neutral]
        pitches = np.arange(-_MAX_PITCH_RAD, _MAX_PITCH_RAD + _PITCH_STEP_RAD, _PITCH_STEP_RAD)
        ankles = [sole.ankle(pitches) for sole in bones.soles]
        self._ankles: list[tuple[list[float], list[float]]] = [
            (ahead.tolist(), height.tolist()) for ahead, height in ankles
        ]
        hips = [np.subtract(bones.joint_m(f"{side}_hip"), bones.hips_m) for side in SIDES]
        self._hips_m: list[list[float]] = [hip.tolist() for hip in hips]
        self._reach_m = [USED_REACH * leg.reach_m for leg in bones.legs]

    def stance_share(self, speed_mps: float) -> float:
        """Return the share of the cycle for which a foot is on the floor."""
        return _interpolated(self._stance_shares, speed_mps / _SPEED_STEP_MPS)

    def stride_ratio(self, forward_mps: float) -> float:
        """Return the stride divided by the comfortable one, with the sign of the speed."""
        size = _interpolated(self._stride_ratios, abs(forward_mps) / _SPEED_STEP_MPS)
        return math.copysign(size, forward_mps)

    def cadence_hz(self, forward_mps: float, left_mps: float, turning_radps: float) -> float:
        """Return the cycles per second that walking and turning need together."""
        speed = math.hypot(forward_mps, left_mps)
        forward = max(_interpolated(self._strides, speed / _SPEED_STEP_MPS), 1e-6)
        if forward_mps < 0.0:
            forward *= BACKWARD_STRIDE_SHARE
        sideways = min(forward, SIDE_STRIDE_SHARE * self.stature_m)
        turn = turning_radps / TURN_PER_CYCLE_RAD
        return min(math.hypot(forward_mps / forward, left_mps / sideways, turn), MAX_CADENCE_HZ)

    def neutral(
        self, side: int, x: float, y: float, heading_rad: float, stride_ratio: float
    ) -> PlanarPose:
        """Return the place of a flat foot at midstance, when the body is over it."""
        width = self.half_width_m(side, stride_ratio)
        cos, sin = math.cos(heading_rad), math.sin(heading_rad)
        ahead, across = self._ahead_m[side], SIGNS[side] * width
        return (
            x + cos * ahead - sin * across,
            y + sin * ahead + cos * across,
            heading_rad + self._toe_out_rad[side],
        )

    def half_width_m(self, side: int, stride_ratio: float) -> float:
        """Return the distance of an ankle from the body's centre line."""
        standing, walking = self._standing_half_widths_m[side], self._walking_half_widths_m[side]
        return standing + min(abs(stride_ratio), 1.0) * (walking - standing)

    def ankle(self, side: int, pitch_rad: float) -> tuple[float, float]:
        """Return the ankle's distance ahead and its height for a rolling shoe."""
        row = (pitch_rad + _MAX_PITCH_RAD) / _PITCH_STEP_RAD
        ahead, height = (_interpolated(column, row) for column in self._ankles[side])
        return ahead, height

    def hip_limit_m(
        self,
        feet: tuple[tuple[float, ...], tuple[float, ...]],
        place: PlanarPose,
        sway: float,
        yaw: float,
        tilt: float,
    ) -> float:
        """Return the greatest hip height at which both ankles are in reach."""
        x, y, heading = place
        cos, sin = math.cos(heading + yaw), math.sin(heading + yaw)
        cos_tilt, sin_tilt = math.cos(tilt), math.sin(tilt)
        x, y = x - math.sin(heading) * sway, y + math.cos(heading) * sway
        lowest = math.inf
        for side in (LEFT, RIGHT):
            hip_x, hip_y, hip_z = self._hips_m[side]
            across = hip_y * cos_tilt - hip_z * sin_tilt
            dx = feet[side][0] - (x + cos * hip_x - sin * across)
            dy = feet[side][1] - (y + sin * hip_x + cos * across)
            reach = self._reach_m[side]
            up = math.sqrt(max(reach * reach - dx * dx - dy * dy, (0.5 * reach) ** 2))
            lowest = min(lowest, feet[side][2] + up - (hip_y * sin_tilt + hip_z * cos_tilt))
        return lowest


def _interpolated(table: list[float], row: float) -> float:
    """Return the table's value at a row between two others, clipped to its ends."""
    row = min(max(row, 0.0), len(table) - 1.001)
    below = int(row)
    return table[below] + (row - below) * (table[below + 1] - table[below])
