"""Figures of one body's gait, looked up one at a time: NumPy is slow on two feet."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ._gait import LEFT, RIGHT, USED_REACH, Gait
from ._skeleton import SIGNS

Place = tuple[float, float, float]  # x, y, yaw of a flat foot or of a body

# Turning on the spot, so far in a cycle of two steps; sideways and backwards steps are short.
_TURN_PER_CYCLE_RAD: Final = math.radians(60.0)
_SIDE_STRIDE_SHARE: Final = 0.12
_BACK_STRIDE_SHARE: Final = 0.75
_QUICKEST_HZ: Final = 1.8
_TABLE_MPS: Final = 0.05
_FASTEST_MPS: Final = 3.5
_ROLL_RAD: Final = 0.005
_ROLL_MAX_RAD: Final = 0.9


class GaitFigures:
    """What :class:`Gait` says for a speed, a pitch or a pose, by tables and scalars.

    Args:
        gait: of the body.

    Attributes:
        stature_m: of the body.
        usual_m: stride at the speed of comfort.
        standing_m: height of the hips standing.
    """

    def __init__(self, gait: Gait) -> None:
        bones = gait.skeleton
        self.stature_m = bones.stature_m
        speeds = np.arange(0.0, _FASTEST_MPS + _TABLE_MPS, _TABLE_MPS)
        self._strides: list[float] = gait.stride_m(speeds).tolist()
        self._shares: list[float] = gait.stance_share(speeds).tolist()
        self._vigours: list[float] = gait.vigour(speeds).tolist()
        self.usual_m = float(gait.stride_m(1.2))
        self.standing_m = gait.standing_height_m
        here, level = np.zeros((2, 2)), np.zeros(2)
        # Ahead, and half the width standing and in a brisk walk.
        neutral = [gait.neutral(side, here, level, np.array([0.0, 1.0])) for side in (LEFT, RIGHT)]
        self._ahead = [float(rows[0, 0]) for rows in neutral]
        self._wide = [abs(float(rows[0, 1])) for rows in neutral]
        self._narrow = [abs(float(rows[1, 1])) for rows in neutral]
        self._out = [float(rows[0, 2]) for rows in neutral]
        pitches = np.arange(-_ROLL_MAX_RAD, _ROLL_MAX_RAD + _ROLL_RAD, _ROLL_RAD)
        rolls = [sole.ankle(pitches) for sole in bones.soles]
        self._rolls: list[tuple[list[float], list[float]]] = [
            (ahead.tolist(), height.tolist()) for ahead, height in rolls
        ]
        hips = [
            np.subtract(bones.joint_m(f"{side}_hip"), bones.hips_m) for side in ("left", "right")
        ]
        self._hips: list[list[float]] = [hip.tolist() for hip in hips]
        self._reach_m = [USED_REACH * leg.reach_m for leg in bones.legs]

    def stance_share(self, speed_mps: float) -> float:
        """Part of the cycle for which a foot is on the floor."""
        return _mixed(self._shares, speed_mps / _TABLE_MPS)

    def vigour(self, forward_mps: float) -> float:
        """Stride over that of comfort, with the sign of the speed."""
        size = _mixed(self._vigours, abs(forward_mps) / _TABLE_MPS)
        return math.copysign(size, forward_mps)

    def cadence_hz(self, ahead: float, aside: float, turning: float) -> float:
        """Cycles a second that speed and turning ask for together."""
        forward = max(_mixed(self._strides, math.hypot(ahead, aside) / _TABLE_MPS), 1e-6)
        if ahead < 0.0:
            forward *= _BACK_STRIDE_SHARE
        sideways = min(forward, _SIDE_STRIDE_SHARE * self.stature_m)
        turn = turning / _TURN_PER_CYCLE_RAD
        return min(math.hypot(ahead / forward, aside / sideways, turn), _QUICKEST_HZ)

    def neutral(self, side: int, x: float, y: float, facing: float, vigour: float) -> Place:
        """Where a flat foot belongs under a body."""
        width = self.half_width_m(side, vigour)
        cos, sin = math.cos(facing), math.sin(facing)
        ahead, across = self._ahead[side], SIGNS[side] * width
        return (
            x + cos * ahead - sin * across,
            y + sin * ahead + cos * across,
            facing + self._out[side],
        )

    def half_width_m(self, side: int, vigour: float) -> float:
        wide, narrow = self._wide[side], self._narrow[side]
        return wide + min(abs(vigour), 1.0) * (narrow - wide)

    def rolled(self, side: int, pitch_rad: float) -> tuple[float, float]:
        """How far a rolling shoe brings the ankle ahead, and how high it is then."""
        at = (pitch_rad + _ROLL_MAX_RAD) / _ROLL_RAD
        ahead, height = (_mixed(column, at) for column in self._rolls[side])
        return ahead, height

    def hip_limit_m(
        self,
        feet: tuple[tuple[float, ...], tuple[float, ...]],
        place: Place,
        sway: float,
        yaw: float,
        tilt: float,
    ) -> float:
        """The highest that the hips may be for both ankles to be in reach."""
        x, y, heading = place
        cos, sin = math.cos(heading + yaw), math.sin(heading + yaw)
        cos_tilt, sin_tilt = math.cos(tilt), math.sin(tilt)
        x, y = x - math.sin(heading) * sway, y + math.cos(heading) * sway
        lowest = math.inf
        for side in (LEFT, RIGHT):
            hip_x, hip_y, hip_z = self._hips[side]
            across = hip_y * cos_tilt - hip_z * sin_tilt
            dx = feet[side][0] - (x + cos * hip_x - sin * across)
            dy = feet[side][1] - (y + sin * hip_x + cos * across)
            reach = self._reach_m[side]
            up = math.sqrt(max(reach * reach - dx * dx - dy * dy, (0.5 * reach) ** 2))
            lowest = min(lowest, feet[side][2] + up - (hip_y * sin_tilt + hip_z * cos_tilt))
        return lowest


def _mixed(table: list[float], at: float) -> float:
    """The table at a row that need not be whole, within its ends."""
    at = min(max(at, 0.0), len(table) - 1.001)
    row = int(at)
    return table[row] + (at - row) * (table[row + 1] - table[row])
