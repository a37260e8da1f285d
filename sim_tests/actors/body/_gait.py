"""The gait of a body: strides that follow the speed, and the pose of feet, hips and trunk."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from ._quaternions import subtract
from ._skeleton import SIDES, SIGNS, Skeleton

LONGEST_SWING_S: Final = 0.65
# Part of a leg's reach that is used. Knees are never locked: this leaves a bend of 7 degrees.
_USED_REACH: Final = 0.998

# A cycle turns the body this far on the spot.
_TURN_PER_CYCLE_RAD: Final = math.radians(60.0)
# A sideways stride as a share of stature: the feet must not cross.
_SIDE_STRIDE_SHARE: Final = 0.12
# A backward stride as a share of a forward one.
_BACKWARD_STRIDE_SHARE: Final = 0.75
#: Largest cadence of any motion.
MAX_CADENCE_HZ: Final = 1.8

# Stride at the comfortable speed as a share of stature. Step length grows with speed to about this
# power (Bertram and Ruina 2001, Journal of Theoretical Biology 209, 445-453).
_COMFORTABLE_MPS: Final = 1.2
_STRIDE_SHARE: Final = 0.75
_STRIDE_POWER: Final = 0.42
_MAX_STRIDE_RATIO: Final = 1.3
# The stance takes this share of a cycle, and less at speed. Where the longest swing leaves time
# over, the rest is double support.
_STANCE_SHARE: Final = 0.665
_STANCE_SHARE_PER_MPS: Final = -0.04
_TOE_OUT_RAD: Final = math.radians(6.0)
# A walk brings the feet this share nearer to the body's centre line than standing.
_NARROWING: Final = 0.40
# Steps and ends of the look-up tables.
_SPEED_STEP_MPS: Final = 0.05
_MAX_SPEED_MPS: Final = 3.5
_PITCH_STEP_RAD: Final = 0.005
_MAX_PITCH_RAD: Final = 0.9

#: x, y, z of an ankle in metres, yaw and pitch (toes down) of its foot in radians.
FootPose = tuple[float, float, float, float, float]
#: x, y, yaw of a flat foot or of a body.
PlanarPose = tuple[float, float, float]


class GaitPose(NamedTuple):
    """Feet, hips and trunk at one instant.

    Attributes:
        feet: left and right foot: x, y, z of the ankle in metres, yaw and pitch (toes down) in
            radians; in odom when given to :meth:`Worker.place`.
        hip_height_m: height of the hips' midpoint above the floor.
        sway_m: offset of the hips to the left of the body's centre line.
        pelvis_yaw_rad: yaw of the pelvis to the left of the heading.
        pelvis_list_rad: roll of the pelvis, left side up.
        thorax_yaw_rad: yaw of the thorax to the left of the heading.
        stride_ratio: stride divided by the stride at 1.2 m/s; 0 standing, negative backwards.
        arm_swing_rad: angle of the left arm ahead of hanging, and of the right arm behind it.
    """

    feet: tuple[FootPose, FootPose]
    hip_height_m: float
    sway_m: float = 0.0
    pelvis_yaw_rad: float = 0.0
    pelvis_list_rad: float = 0.0
    thorax_yaw_rad: float = 0.0
    stride_ratio: float = 0.0
    arm_swing_rad: float = 0.0

    def moved(self, dx_m: float, dy_m: float) -> GaitPose:
        """Return the same pose elsewhere in odom."""
        (ax, ay, az, ayaw, apitch), (bx, by, bz, byaw, bpitch) = self.feet
        left = ax + dx_m, ay + dy_m, az, ayaw, apitch
        return self._replace(feet=(left, (bx + dx_m, by + dy_m, bz, byaw, bpitch)))


class Gait:
    """The gait of one body: its figures for one speed, pitch or place at a time.

    NumPy is slow on two feet, so the figures come from look-up tables of plain numbers.

    Attributes:
        stature_m: height of the body.
        comfortable_stride_m: stride at 1.2 m/s.
        standing: the pose of standing at ease, in the body's frame.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        bones = skeleton
        self.stature_m = bones.stature_m
        speeds = np.arange(0.0, _MAX_SPEED_MPS + _SPEED_STEP_MPS, _SPEED_STEP_MPS)
        self.comfortable_stride_m = _STRIDE_SHARE * bones.stature_m
        strides = self.comfortable_stride_m * (speeds / _COMFORTABLE_MPS) ** _STRIDE_POWER
        shares = np.maximum(
            _STANCE_SHARE + _STANCE_SHARE_PER_MPS * speeds,
            1.0 - LONGEST_SWING_S * speeds / np.maximum(strides, 1e-9),
        )
        self._strides: list[float] = strides.tolist()
        self._stance_shares: list[float] = shares.tolist()
        ratios = np.minimum(strides / self.comfortable_stride_m, _MAX_STRIDE_RATIO)
        self._stride_ratios: list[float] = ratios.tolist()
        ankles = [bones.joint_m(f"{side}_ankle") for side in SIDES]
        self._ahead_m = [ankle[0] for ankle in ankles]
        self._half_widths_m = [abs(ankle[1]) for ankle in ankles]
        pitches = np.arange(-_MAX_PITCH_RAD, _MAX_PITCH_RAD + _PITCH_STEP_RAD, _PITCH_STEP_RAD)
        rolls = [sole.ankle(pitches) for sole in bones.soles]
        self._rolls = [(ahead.tolist(), height.tolist()) for ahead, height in rolls]
        self._hips_m = [subtract(bones.joint_m(f"{side}_hip"), bones.hips_m) for side in SIDES]
        self._reach_m = [_USED_REACH * leg.reach_m for leg in bones.legs]
        self.standing = self._standing_pose(bones)

    def _standing_pose(self, bones: Skeleton) -> GaitPose:
        feet: list[FootPose] = []
        hip_height = bones.hips_m[2]
        for side, (hip_x, hip_y, hip_z) in enumerate(self._hips_m):
            x, y, yaw = self.neutral(side, 0.0, 0.0, 0.0, 0.0)
            ahead, height = (float(value[0]) for value in bones.soles[side].ankle(np.zeros(1)))
            foot = x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), height, yaw, 0.0
            dx, dy, reach = foot[0] - hip_x, foot[1] - hip_y, self._reach_m[side]
            up = math.sqrt(reach * reach - (dx * dx + dy * dy))
            hip_height = min(hip_height, height + up - hip_z)
            feet.append(foot)
        return GaitPose((feet[0], feet[1]), hip_height)

    def stride_m(self, speed_mps: float) -> float:
        """Return the distance of a full cycle (two steps) at a speed ≥ 0."""
        return _interpolated(self._strides, speed_mps / _SPEED_STEP_MPS)

    def stance_share(self, speed_mps: float) -> float:
        """Return the share of the cycle for which a foot is on the floor."""
        return _interpolated(self._stance_shares, speed_mps / _SPEED_STEP_MPS)

    def stride_ratio(self, forward_mps: float) -> float:
        """Return the stride divided by the comfortable one, with the sign of the speed."""
        size = _interpolated(self._stride_ratios, abs(forward_mps) / _SPEED_STEP_MPS)
        return math.copysign(size, forward_mps)

    def cadence_hz(self, forward_mps: float, left_mps: float, turning_radps: float) -> float:
        """Return the cycles per second that walking and turning need together."""
        forward = max(self.stride_m(math.hypot(forward_mps, left_mps)), 1e-6)
        if forward_mps < 0.0:
            forward *= _BACKWARD_STRIDE_SHARE
        sideways = min(forward, _SIDE_STRIDE_SHARE * self.stature_m)
        turn = turning_radps / _TURN_PER_CYCLE_RAD
        return min(math.hypot(forward_mps / forward, left_mps / sideways, turn), MAX_CADENCE_HZ)

    def neutral(
        self, side: int, x: float, y: float, heading_rad: float, stride_ratio: float
    ) -> PlanarPose:
        """Return the place of a flat foot at midstance, when the body is over it."""
        cos, sin = math.cos(heading_rad), math.sin(heading_rad)
        ahead, sign = self._ahead_m[side], SIGNS[side]
        across = sign * self.half_width_m(side, stride_ratio)
        return (
            x + cos * ahead - sin * across,
            y + sin * ahead + cos * across,
            heading_rad + sign * _TOE_OUT_RAD,
        )

    def half_width_m(self, side: int, stride_ratio: float) -> float:
        """Return the distance of an ankle from the body's centre line."""
        standing = self._half_widths_m[side]
        walking = standing * (1.0 - _NARROWING)
        return standing + min(abs(stride_ratio), 1.0) * (walking - standing)

    def ankle(self, side: int, pitch_rad: float) -> tuple[float, float]:
        """Return the ankle's distance ahead and its height for a rolling shoe."""
        aheads, heights = self._rolls[side]
        row = min(max((pitch_rad + _MAX_PITCH_RAD) / _PITCH_STEP_RAD, 0.0), len(aheads) - 1.001)
        below = int(row)
        share, ahead, height = row - below, aheads[below], heights[below]
        return (
            ahead + share * (aheads[below + 1] - ahead),
            height + share * (heights[below + 1] - height),
        )

    def hip_limit_m(
        self,
        feet: tuple[FootPose, FootPose],
        place: PlanarPose,
        sway: float,
        yaw: float,
        tilt: float,
    ) -> float:
        """Return the greatest hip height at which both ankles are in reach.

        Args:
            feet: left and right foot.
            place: x, y and heading of the body.
            sway: offset of the hips to the left.
            yaw: of the pelvis from the heading.
            tilt: of the pelvis, left side up.
        """
        x, y, heading = place
        cos, sin = math.cos(heading + yaw), math.sin(heading + yaw)
        cos_tilt, sin_tilt = math.cos(tilt), math.sin(tilt)
        x, y = x - math.sin(heading) * sway, y + math.cos(heading) * sway
        lowest = math.inf
        for foot, (hip_x, hip_y, hip_z), reach in zip(
            feet, self._hips_m, self._reach_m, strict=True
        ):
            across = hip_y * cos_tilt - hip_z * sin_tilt
            dx = foot[0] - (x + cos * hip_x - sin * across)
            dy = foot[1] - (y + sin * hip_x + cos * across)
            up = math.sqrt(max(reach * reach - dx * dx - dy * dy, (0.5 * reach) ** 2))
            lowest = min(lowest, foot[2] + up - (hip_y * sin_tilt + hip_z * cos_tilt))
        return lowest


def _interpolated(table: list[float], row: float) -> float:
    """Return the table's value at a row between two others, clipped to its ends."""
    row = min(max(row, 0.0), len(table) - 1.001)
    below = int(row)
    return table[below] + (row - below) * (table[below + 1] - table[below])
