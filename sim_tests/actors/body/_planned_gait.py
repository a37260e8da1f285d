"""The gait of a planned walk: strides that follow the speed, feet that roll and never slide.

The gait is periodic in the distance walked, not in time. A stance foot lands on the heel, lies flat
and rolls off over the toes; it always turns about the point on which it rests. Inverse kinematics
gives the legs. All functions are vectorised over instants.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from scipy.ndimage import minimum_filter1d, uniform_filter1d

from perception.arrays import FloatArray, finite_number

from ...world.errors import SimError
from ._gait import (
    ARM_SWING_RAD,
    FOOT_LIFT_M,
    LOADING_S,
    LOADING_SHARE,
    LONGEST_SWING_S,
    MIDSTANCE_PHASE,
    MIDSTANCE_SHIFT,
    PELVIS_LIST_RAD,
    PELVIS_TWIST_SHARE,
    PELVIS_YAW_RAD,
    ROLL_OFF_S,
    ROLL_OFF_SHARE,
    SWAY_M,
    SWING_CLEARANCE_M,
    THORAX_YAW_RAD,
    USED_REACH,
    landing_pitch_rad,
    lift_off_pitch_rad,
)
from ._skeleton import LEFT, RIGHT, SIDES, SIGNS, Skeleton

# Stride at the comfortable speed as a share of stature. Step length grows with speed to about this
# power (Bertram and Ruina 2001, Journal of Theoretical Biology 209, 445-453).
_COMFORTABLE_MPS: Final = 1.2
_STRIDE_SHARE: Final = 0.75
_STRIDE_POWER: Final = 0.42
_MAX_STRIDE_RATIO: Final = 1.3
# A fixed stride shortens below this speed.
_FIXED_STRIDE_FROM_MPS: Final = 0.3
# The stance takes this share of a cycle, and less at speed. Where the longest swing leaves time
# over, the rest is double support.
_STANCE_SHARE: Final = 0.665
_STANCE_SHARE_PER_MPS: Final = -0.04
_TOE_OUT_RAD: Final = math.radians(6.0)
# A walk brings the feet this share nearer to the body's centre line than standing.
_NARROWING: Final = 0.40
_MAX_FOOT_SPEED_MPS: Final = 9.0
# The hip height follows the reach of the legs over this time, so that it does not jerk.
_SMOOTHING_S: Final = 0.14


class PlannedGait:
    """The gait of one body.

    Args:
        skeleton: the body.
        stride_m: distance of a full cycle (two steps), in [0.2, 1] × stature. None follows the
            speed: 0.75 × stature × (v / 1.2 m/s)^0.42.

    Attributes:
        skeleton: as given.
        standing_height_m: height of the hips' midpoint when standing.

    Raises:
        SimError: for a stride that is out of range.
    """

    def __init__(self, skeleton: Skeleton, stride_m: float | None = None) -> None:
        self.skeleton = skeleton
        stature = skeleton.stature_m
        self._comfortable_stride_m = _STRIDE_SHARE * stature
        if stride_m is not None:
            stride_m = finite_number(
                "stride_m", stride_m, SimError, minimum=0.2 * stature, maximum=stature
            )
        self._stride_m = stride_m
        self._ankles_m = [np.array(skeleton.joint_m(f"{side}_ankle")) for side in SIDES]
        self._hips_m = [
            np.array(skeleton.joint_m(f"{side}_hip")) - np.array(skeleton.hips_m) for side in SIDES
        ]
        zero = np.zeros(1)
        highest = self._hip_limits(self._standing_feet(), np.zeros((1, 2)), zero, np.zeros((1, 3)))
        self.standing_height_m = min(float(highest[0]), skeleton.hips_m[2])

    def stride_m(self, speed_mps: Any) -> FloatArray:
        """Return the distance of a full cycle at a speed ≥ 0."""
        speed = np.asarray(speed_mps, dtype=np.float64)
        if self._stride_m is not None:
            return np.full_like(speed, self._stride_m)
        return np.asarray(self._comfortable_stride_m * (speed / _COMFORTABLE_MPS) ** _STRIDE_POWER)

    def stance_share(self, speed_mps: Any) -> FloatArray:
        """Return the share of the cycle for which a foot is on the floor."""
        speed = np.asarray(speed_mps, dtype=np.float64)
        stride = np.maximum(self.stride_m(speed), 1e-9)
        share = _STANCE_SHARE + _STANCE_SHARE_PER_MPS * speed
        return np.asarray(np.maximum(share, 1.0 - LONGEST_SWING_S * speed / stride))

    def stride_ratio(self, forward_mps: FloatArray) -> FloatArray:
        """Return the stride divided by the comfortable one, with the sign of the speed."""
        speed = np.abs(forward_mps)
        stride = self.stride_m(speed)
        if self._stride_m is not None:
            stride = stride * np.minimum(speed / _FIXED_STRIDE_FROM_MPS, 1.0)
        ratio = np.minimum(stride / self._comfortable_stride_m, _MAX_STRIDE_RATIO)
        return np.asarray(np.sign(forward_mps) * ratio)

    @staticmethod
    def midstance_share(stride_ratio: FloatArray) -> FloatArray:
        """Return the share of a stance after which the body is over the foot."""
        return np.asarray(0.5 - MIDSTANCE_SHIFT * np.clip(2.0 * stride_ratio, -1.0, 1.0))

    def neutral(
        self, side: int, position_m: FloatArray, heading_rad: FloatArray, stride_ratio: FloatArray
    ) -> FloatArray:
        """Return (N, 3) x, y, yaw of a flat foot at midstance, when the body is over it."""
        ankle = self._ankles_m[side]
        across = SIGNS[side] * self._half_width_m(side, stride_ratio)
        cos, sin = np.cos(heading_rad), np.sin(heading_rad)
        return np.column_stack(
            [
                position_m[:, 0] + cos * ankle[0] - sin * across,
                position_m[:, 1] + sin * ankle[0] + cos * across,
                heading_rad + SIGNS[side] * _TOE_OUT_RAD,
            ]
        )

    def stance(
        self,
        side: int,
        place: FloatArray,
        since_landing_s: FloatArray,
        until_lift_off_s: FloatArray,
        ratios: tuple[float, float],
    ) -> FloatArray:
        """Return (N, 5) x, y, z, yaw, pitch of the ankle of a stance foot.

        Args:
            side: left or right.
            place: (3,) x, y, yaw of the flat foot.
            since_landing_s: (N,) ≥ 0.
            until_lift_off_s: (N,) ≥ 0.
            ratios: stride ratios of the steps with which it lands and lifts off.
        """
        duration = since_landing_s + until_lift_off_s
        loading = np.minimum(LOADING_SHARE * duration, LOADING_S)
        roll_off = np.minimum(ROLL_OFF_SHARE * duration, ROLL_OFF_S)
        landed = _smoothstep(np.clip(since_landing_s / loading, 0.0, 1.0))
        rolled = np.clip(1.0 - until_lift_off_s / roll_off, 0.0, 1.0)
        landing, lift_off = landing_pitch_rad(ratios[0]), lift_off_pitch_rad(ratios[1])
        pitch = landing * (1.0 - landed) + lift_off * rolled**2
        places = np.broadcast_to(place, (len(since_landing_s), 3))
        return self._ankle(side, places, pitch, np.zeros(1))

    def swing(
        self,
        side: int,
        start: FloatArray,
        end: FloatArray,
        progress: FloatArray,
        swing_s: float,
        stance_s: float,
        ratios: tuple[float, float],
        body: FloatArray,
    ) -> FloatArray:
        """Return (N, 5) x, y, z, yaw, pitch of the ankle of a swing foot.

        Args:
            side: left or right.
            start: (3,) x, y, yaw of the flat foot before the swing.
            end: (3,) the same after it; the yaws must differ by less than half a turn.
            progress: (N,) share of the swing, in [0, 1].
            swing_s: duration of the swing.
            stance_s: duration of the stance before.
            ratios: stride ratios of the steps with which it lifts off and lands.
            body: (N, 3) x, y, heading of the body meanwhile. The foot stays on its side of it.
        """
        u = progress
        lift_off, landing = lift_off_pitch_rad(ratios[0]), landing_pitch_rad(ratios[1])
        # The foot lifts off with the pitch rate of its roll-off, and lands with none.
        rate = 2.0 * lift_off * swing_s / min(ROLL_OFF_SHARE * stance_s, ROLL_OFF_S)
        smooth = _smoothstep(u)
        pitch = lift_off + (landing - lift_off) * smooth + rate * u * (1.0 - u) ** 2
        place = start + smooth[:, None] * (end - start)
        bump = np.minimum(1.6 * np.sin(math.pi * u) ** 2, 1.0)
        sin, cos = np.sin(body[:, 2]), np.cos(body[:, 2])
        beside = cos * (place[:, 1] - body[:, 1]) - sin * (place[:, 0] - body[:, 0])
        clear = self._half_width_m(side, np.array(max(ratios, key=abs))) + SWING_CLEARANCE_M
        aside = np.maximum(clear - SIGNS[side] * beside, 0.0) * bump
        aside *= _circumduction_share(
            place[:, :2], aside, (-SIGNS[side] * sin, SIGNS[side] * cos), u * swing_s
        )
        reach = math.hypot(*(end - start)[:2]) + 0.25 * abs(float(end[2] - start[2]))
        reach += 4.0 * float(aside.max(initial=0.0))
        strides = min(reach / self._comfortable_stride_m, 1.5)
        lift = FOOT_LIFT_M * math.sqrt(strides) * np.sin(math.pi * u)
        place[:, 0] -= SIGNS[side] * aside * sin
        place[:, 1] += SIGNS[side] * aside * cos
        return self._ankle(side, place, pitch, lift)

    def table(
        self,
        feet: FloatArray,
        position_m: FloatArray,
        heading_rad: FloatArray,
        phase: FloatArray,
        stride_ratio: FloatArray,
        dt_s: float,
        *,
        twist_rad: FloatArray | None = None,
        periodic: bool = False,
    ) -> FloatArray:
        """Return (N, 17) rows of :class:`GaitPose` for given feet.

        Args:
            feet: (2, N, 5) ankles, as :meth:`stance` and :meth:`swing` return them.
            position_m: (N, 2) the body's centre line.
            heading_rad: (N,) of the body.
            phase: (N,) cycles since the left foot landed.
            stride_ratio: (N,) of the step.
            dt_s: time between rows.
            twist_rad: (N,) yaw of the feet to the left of the heading; None is 0.
            periodic: the first row follows the last one.
        """
        turn = np.cos(math.tau * phase)
        weight = np.cos(math.tau * (phase - MIDSTANCE_PHASE))
        size = np.abs(stride_ratio)
        sway = SWAY_M * np.minimum(2.0 * size, 1.0) * weight
        pelvis = np.column_stack(
            [sway, -PELVIS_YAW_RAD * stride_ratio * turn, PELVIS_LIST_RAD * size * weight]
        )
        if twist_rad is not None:
            pelvis[:, 1] += PELVIS_TWIST_SHARE * twist_rad
        limit = np.minimum(
            self._hip_limits(feet, position_m, heading_rad, pelvis), self.standing_height_m
        )
        window = 2 * round(0.5 * _SMOOTHING_S / dt_s) + 1
        mode = "wrap" if periodic else "nearest"
        height = uniform_filter1d(minimum_filter1d(limit, window, mode=mode), window, mode=mode)
        return np.column_stack(
            [
                feet[LEFT],
                feet[RIGHT],
                height,
                pelvis,
                THORAX_YAW_RAD * stride_ratio * turn,
                stride_ratio,
                -ARM_SWING_RAD * stride_ratio * turn,
            ]
        )

    def _standing_feet(self) -> FloatArray:
        """Return (2, 1, 5) ankles in the body's frame."""
        zero = np.zeros(1)
        places = [self.neutral(side, np.zeros((1, 2)), zero, zero) for side in (LEFT, RIGHT)]
        return np.stack([self._ankle(side, place, zero, 0.0) for side, place in enumerate(places)])

    def _half_width_m(self, side: int, stride_ratio: FloatArray) -> FloatArray:
        """Return the distance of an ankle from the body's centre line."""
        narrow = 1.0 - _NARROWING * np.minimum(np.abs(stride_ratio), 1.0)
        return np.asarray(abs(float(self._ankles_m[side][1])) * narrow)

    def _ankle(self, side: int, place: FloatArray, pitch: FloatArray, lift: Any) -> FloatArray:
        """Return (N, 5) x, y, z, yaw, pitch of an ankle for flat feet that roll and lift."""
        ahead, height = self.skeleton.soles[side].ankle(pitch)
        yaw = place[:, 2]
        return np.column_stack(
            [
                place[:, 0] + ahead * np.cos(yaw),
                place[:, 1] + ahead * np.sin(yaw),
                height + lift,
                yaw,
                pitch,
            ]
        )

    def _hip_limits(
        self,
        feet: FloatArray,
        position_m: FloatArray,
        heading_rad: FloatArray,
        pelvis: FloatArray,
    ) -> FloatArray:
        """Return (N,) the greatest hip height at which both ankles are in reach."""
        sway, yaw, tilt = pelvis.T
        limits = []
        for side in (LEFT, RIGHT):
            x, y, z = self._hips_m[side]
            across = y * np.cos(tilt) - z * np.sin(tilt)
            cos, sin = np.cos(heading_rad + yaw), np.sin(heading_rad + yaw)
            hip_x = position_m[:, 0] - np.sin(heading_rad) * sway + cos * x - sin * across
            hip_y = position_m[:, 1] + np.cos(heading_rad) * sway + sin * x + cos * across
            foot = feet[side]
            flat = (foot[:, 0] - hip_x) ** 2 + (foot[:, 1] - hip_y) ** 2
            reach = USED_REACH * self.skeleton.legs[side].reach_m
            up = np.sqrt(np.maximum(reach * reach - flat, (0.5 * reach) ** 2))
            limits.append(foot[:, 2] + up - (y * np.sin(tilt) + z * np.cos(tilt)))
        return np.asarray(np.minimum(limits[0], limits[1]))


def _circumduction_share(
    place_m: FloatArray,
    aside_m: FloatArray,
    direction: tuple[FloatArray, FloatArray],
    times_s: FloatArray,
) -> float:
    """Return the share, in [0, 1], of a swing's sideways arc that the foot has time for.

    Args:
        place_m: (N, 2) foot without the arc.
        aside_m: (N,) width of the arc.
        direction: (N,) x and (N,) y of the unit vectors to the side.
        times_s: (N,) increasing.
    """
    dt_s = np.diff(times_s)[:, None]
    straight = np.diff(place_m, axis=0) / dt_s
    arc = np.diff(aside_m[:, None] * np.column_stack(direction), axis=0) / dt_s
    # The largest share s with |straight + s arc| ≤ the greatest foot speed in every interval.
    square, mixed = (arc**2).sum(axis=1), (arc * straight).sum(axis=1)
    spare = _MAX_FOOT_SPEED_MPS**2 - (straight**2).sum(axis=1)
    moves = square > 1e-12
    root = np.sqrt(np.maximum(mixed[moves] ** 2 + square[moves] * spare[moves], 0.0))
    return float(np.clip(((root - mixed[moves]) / square[moves]).min(initial=1.0), 0.0, 1.0))


def _smoothstep(u: FloatArray) -> FloatArray:
    """Rise from 0 at 0 to 1 at 1 with zero slope at both ends."""
    return np.asarray(u * u * (3.0 - 2.0 * u))
