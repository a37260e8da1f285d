"""How a worker walks: steps that keep up with the speed, feet that roll and never slide.

The gait is periodic in the distance walked, not in time. A stance foot lands on the heel, lies flat
and rolls off over the toes, always turning about the point on which it rests; the legs follow by
inverse kinematics. Everything here is vectorised over instants.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, Final

import numpy as np
from scipy.ndimage import minimum_filter1d, uniform_filter1d

from perception.arrays import FloatArray, finite_number

from ...world.errors import SimError
from ._footing import Footing, unhurried
from ._skeleton import SIGNS, Skeleton

#: The foot that a step belongs to, in the order of every pair.
LEFT, RIGHT = 0, 1

# Stride of a walk at the speed of comfort, as a fraction of stature; step length grows with speed
# to about this power (Bertram and Ruina 2001, Journal of Theoretical Biology 209, 445-453).
_COMFORT_MPS: Final = 1.2
_STRIDE_FRACTION: Final = 0.75
_STRIDE_POWER: Final = 0.42
# Stance shortens with speed; a swing lasts this long at most, the rest is waiting on both feet.
_STANCE_SHARE: Final = 0.665
_STANCE_SHARE_PER_MPS: Final = -0.04
LONGEST_SWING_S: Final = 0.65
# Toes come down after the heel has landed; the heel lifts before the toes: parts of a stance, and
# the longest that either takes.
LOADING_SHARE: Final = 0.15
LOADING_S: Final = 0.18
ROLLING_SHARE: Final = 0.43
ROLLING_S: Final = 0.45
_LANDING_RAD: Final = math.radians(-20.0)
_TOE_OFF_RAD: Final = math.radians(40.0)
# Walking backwards lands on the toes and leaves on the heel.
_BACK_LANDING_RAD: Final = math.radians(16.0)
_BACK_OFF_RAD: Final = math.radians(-12.0)
# Feet land a little less far ahead of the hips than they leave behind them.
_OVER_SHARE: Final = 0.12
LIFT_M: Final = 0.035
_TOE_OUT_RAD: Final = math.radians(6.0)
# Walking brings the feet nearer to the line; the swinging foot makes way for the standing one.
_NARROWER: Final = 0.40
WAY_ROUND_M: Final = 0.010

PELVIS_YAW_RAD: Final = 0.07
PELVIS_LIST_RAD: Final = 0.035
THORAX_YAW_RAD: Final = 0.06
PELVIS_TWIST: Final = 0.75
SWAY_M: Final = 0.016
ARM_SWING_RAD: Final = 0.36
# The body is highest over the middle of a stance.
MID_STANCE: Final = 0.30
# Knees are never locked: this much of a leg's reach is used, which leaves a bend of 7 degrees.
USED_REACH: Final = 0.998
# The hips follow what the legs allow over this time, so that they neither jerk nor overstretch.
_SMOOTHING_S: Final = 0.14
_SAMPLES: Final = 96


class Gait:
    """Walking of one body.

    Args:
        skeleton: the body.
        stride_m: distance of a full cycle (two steps), in [0.2, 1] × stature. None follows the
            speed: 0.75 × stature × (v / 1.2 m/s)^0.42.

    Attributes:
        skeleton: as given.

    Raises:
        SimError: for a stride that is out of range.
    """

    def __init__(self, skeleton: Skeleton, stride_m: float | None = None) -> None:
        self.skeleton = skeleton
        stature = skeleton.stature_m
        self._usual_m = _STRIDE_FRACTION * stature
        self._stride_m = (
            None
            if stride_m is None
            else finite_number(
                "stride_m", stride_m, SimError, minimum=0.2 * stature, maximum=stature
            )
        )
        self._ankles = [np.array(skeleton.joint_m(f"{side}_ankle")) for side in ("left", "right")]
        self._hips = [
            np.array(skeleton.joint_m(f"{side}_hip")) - np.array(skeleton.hips_m)
            for side in ("left", "right")
        ]
        self._cycle = lru_cache(maxsize=32)(self._one_cycle)
        still = np.zeros(1)
        highest = self._hip_limits(self._standing_feet(), np.zeros((1, 2)), still, np.zeros((1, 3)))
        self.standing_height_m = min(float(highest[0]), skeleton.hips_m[2])

    def stride_m(self, speed_mps: Any) -> FloatArray:
        """Distance of a full cycle at a speed ≥ 0."""
        speed = np.asarray(speed_mps, dtype=np.float64)
        if self._stride_m is not None:
            return np.full_like(speed, self._stride_m)
        return np.asarray(self._usual_m * (speed / _COMFORT_MPS) ** _STRIDE_POWER)

    def stance_share(self, speed_mps: Any) -> FloatArray:
        """Part of the cycle for which a foot is on the floor."""
        speed = np.asarray(speed_mps, dtype=np.float64)
        stride = np.maximum(self.stride_m(speed), 1e-9)
        waiting = 1.0 - LONGEST_SWING_S * speed / stride
        return np.asarray(np.maximum(_STANCE_SHARE + _STANCE_SHARE_PER_MPS * speed, waiting))

    def vigour(self, forward_mps: FloatArray) -> FloatArray:
        """Stride at a speed over that of comfort, with the sign of the speed."""
        stride = self.stride_m(np.abs(forward_mps))
        if self._stride_m is not None:  # a fixed stride fades out as well
            stride = stride * np.minimum(np.abs(forward_mps) / 0.3, 1.0)
        return np.asarray(np.sign(forward_mps) * np.minimum(stride / self._usual_m, 1.3))

    @staticmethod
    def over_share(vigour: FloatArray) -> FloatArray:
        """Part of a stance after which the body is over the foot."""
        return np.asarray(0.5 - _OVER_SHARE * np.clip(2.0 * vigour, -1.0, 1.0))

    def neutral(
        self, side: int, position_m: FloatArray, heading_rad: FloatArray, vigour: FloatArray
    ) -> FloatArray:
        """(N, 3) x, y, yaw of a flat foot under the body: where a stance belongs."""
        ankle = self._ankles[side]
        across = SIGNS[side] * self._half_width_m(side, vigour)
        cos, sin = np.cos(heading_rad), np.sin(heading_rad)
        return np.column_stack(
            [
                position_m[:, 0] + cos * ankle[0] - sin * across,
                position_m[:, 1] + sin * ankle[0] + cos * across,
                heading_rad + SIGNS[side] * _TOE_OUT_RAD,
            ]
        )

    def _half_width_m(self, side: int, vigour: FloatArray) -> FloatArray:
        """Of an ankle from the body's centre line."""
        narrow = 1.0 - _NARROWER * np.minimum(np.abs(vigour), 1.0)
        return np.asarray(abs(float(self._ankles[side][1])) * narrow)

    def stance(
        self,
        side: int,
        place: FloatArray,
        since_s: FloatArray,
        until_s: FloatArray,
        vigour: tuple[float, float],
    ) -> FloatArray:
        """(N, 5) x, y, z, yaw, pitch of the ankle of a foot that stands and rolls.

        Args:
            side: left or right.
            place: (3,) x, y, yaw of the foot lying flat.
            since_s: (N,) ≥ 0 since it landed.
            until_s: (N,) ≥ 0 until it lifts off.
            vigour: of the steps with which it lands and leaves.
        """
        duration = since_s + until_s
        loading = np.minimum(LOADING_SHARE * duration, LOADING_S)
        rolling = np.minimum(ROLLING_SHARE * duration, ROLLING_S)
        landed = _smooth(np.clip(since_s / loading, 0.0, 1.0))
        rolled = np.clip(1.0 - until_s / rolling, 0.0, 1.0)
        pitch = landing_rad(vigour[0]) * (1.0 - landed) + off_rad(vigour[1]) * rolled**2
        return self._ankle(side, np.broadcast_to(place, (len(since_s), 3)), pitch, np.zeros(1))

    def swing(
        self,
        side: int,
        start: FloatArray,
        end: FloatArray,
        progress: FloatArray,
        swing_s: float,
        stance_s: float,
        vigour: tuple[float, float],
        body: FloatArray,
    ) -> FloatArray:
        """(N, 5) of the ankle of a foot on its way from one stance to the next.

        Args:
            side: left or right.
            start: (3,) x, y, yaw of the flat foot before.
            end: (3,) and after; yaws must differ by less than half a turn.
            progress: (N,) in [0, 1].
            swing_s: how long the swing lasts.
            stance_s: how long the stance before lasted.
            vigour: of the steps with which it lifts off and lands.
            body: (N, 3) x, y, heading of the body meanwhile: the foot keeps to its side of it.
        """
        u = progress
        off, land = off_rad(vigour[0]), landing_rad(vigour[1])
        # The foot leaves with the rate at which it rolled, and lands with none.
        rate = 2.0 * off * swing_s / min(ROLLING_SHARE * stance_s, ROLLING_S)
        smooth = _smooth(u)
        pitch = off + (land - off) * smooth + rate * u * (1.0 - u) ** 2
        place = start + smooth[:, None] * (end - start)
        bump = np.minimum(1.6 * np.sin(math.pi * u) ** 2, 1.0)
        sin, cos = np.sin(body[:, 2]), np.cos(body[:, 2])
        beside = cos * (place[:, 1] - body[:, 1]) - sin * (place[:, 0] - body[:, 0])
        clear = self._half_width_m(side, np.array(max(vigour, key=abs))) + WAY_ROUND_M
        aside = np.maximum(clear - SIGNS[side] * beside, 0.0) * bump
        aside *= unhurried(
            place[:, :2], aside, (-SIGNS[side] * sin, SIGNS[side] * cos), u * swing_s
        )
        reach = math.hypot(*(end - start)[:2]) + 0.25 * abs(float(end[2] - start[2]))
        reach += 4.0 * float(aside.max(initial=0.0))
        lift = LIFT_M * math.sqrt(min(reach / self._usual_m, 1.5)) * np.sin(math.pi * u)
        place[:, 0] -= SIGNS[side] * aside * sin
        place[:, 1] += SIGNS[side] * aside * cos
        return self._ankle(side, place, pitch, lift)

    def table(
        self,
        feet: FloatArray,
        position_m: FloatArray,
        heading_rad: FloatArray,
        phase: FloatArray,
        vigour: FloatArray,
        dt_s: float,
        *,
        twist_rad: FloatArray | None = None,
        periodic: bool = False,
    ) -> FloatArray:
        """(N, 17) rows of :class:`Footing` from where the feet are.

        Args:
            feet: (2, N, 5) as :meth:`stance` and :meth:`swing` give them.
            position_m: (N, 2) of the body's centre line.
            heading_rad: (N,) of the body.
            phase: (N,) cycles since the left foot landed.
            vigour: (N,) of the step.
            dt_s: time between rows.
            twist_rad: (N,) of the feet's direction to the left of the heading; None is none.
            periodic: the last row is followed by the first.
        """
        turn = np.cos(math.tau * phase)
        weight = np.cos(math.tau * (phase - MID_STANCE))
        size = np.abs(vigour)
        sway = SWAY_M * np.minimum(2.0 * size, 1.0) * weight
        pelvis = np.column_stack(
            [sway, -PELVIS_YAW_RAD * vigour * turn, PELVIS_LIST_RAD * size * weight]
        )
        if twist_rad is not None:
            pelvis[:, 1] += PELVIS_TWIST * twist_rad
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
                THORAX_YAW_RAD * vigour * turn,
                vigour,
                -ARM_SWING_RAD * vigour * turn,
            ]
        )

    def footing(self, walked_m: float, speed_mps: float) -> Footing:
        """A straight walk at constant speed, after ``walked_m``: in the body's frame.

        At standstill the feet stand side by side; towards it strides become ever shorter.
        """
        if speed_mps <= 0.0:
            return Footing.of_row(self._cycle(0.0)[0].tolist())
        rows = self._cycle(speed_mps)
        # Positions ahead are relative to the body: the walk goes on where the cycle ends.
        place = (walked_m / float(self.stride_m(speed_mps)) % 1.0) * _SAMPLES
        row = int(place) % _SAMPLES
        share = place - int(place)
        after = (row + 1) % _SAMPLES
        mixed = rows[row] + share * (rows[after] - rows[row])
        phase = np.array([place / _SAMPLES])
        mixed[:10] = self._feet(phase, speed_mps).reshape(10)
        return Footing.of_row(mixed.tolist())

    def _one_cycle(self, speed_mps: float) -> FloatArray:
        """(_SAMPLES, 17) rows of a cycle in the body's frame; one row when standing."""
        still = np.zeros(1)
        if speed_mps <= 0.0:
            return self.table(
                self._standing_feet(), np.zeros((1, 2)), still, still, still, dt_s=1.0
            )
        phase = np.arange(_SAMPLES) / _SAMPLES
        feet = self._feet(phase, speed_mps)
        vigour = np.full(_SAMPLES, self.vigour(np.array(speed_mps)))
        dt_s = float(self.stride_m(speed_mps)) / speed_mps / _SAMPLES
        return self.table(
            feet, np.zeros((_SAMPLES, 2)), np.zeros(_SAMPLES), phase, vigour, dt_s, periodic=True
        )

    def _standing_feet(self) -> FloatArray:
        """(2, 1, 5) in the body's frame."""
        still = np.zeros(1)
        return np.stack(
            [
                self._ankle(side, self.neutral(side, np.zeros((1, 2)), still, still), still, 0.0)
                for side in (LEFT, RIGHT)
            ]
        )

    def _feet(self, phase: FloatArray, speed_mps: float) -> FloatArray:
        """(2, N, 5) in the body's frame at phases since the left foot landed."""
        stride = float(self.stride_m(speed_mps))
        share = float(self.stance_share(speed_mps))
        vigour = self.vigour(np.array([speed_mps]))
        both = (float(vigour[0]), float(vigour[0]))
        ahead = float(self.over_share(vigour)[0]) * share * stride
        cycle_s = stride / speed_mps
        feet = np.empty((2, len(phase), 5))
        for side in (LEFT, RIGHT):
            (place,) = self.neutral(side, np.array([[ahead, 0.0]]), np.zeros(1), vigour)
            own = (phase + 0.5 * side) % 1.0
            down = own < share
            since = own[down] * cycle_s
            feet[side, down] = self.stance(side, place, since, share * cycle_s - since, both)
            feet[side, ~down] = self.swing(
                side,
                place,
                place + np.array([stride, 0.0, 0.0]),
                (own[~down] - share) / (1.0 - share),
                (1.0 - share) * cycle_s,
                share * cycle_s,
                both,
                np.column_stack([stride * own[~down], np.zeros((np.count_nonzero(~down), 2))]),
            )
            feet[side, :, 0] -= stride * own
        return feet

    def _ankle(self, side: int, place: FloatArray, pitch: FloatArray, lift: Any) -> FloatArray:
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
        """(N,) the highest that the hips' midpoint may be for both ankles to be in reach."""
        sway, yaw, tilt = pelvis.T
        limits = []
        for side in (LEFT, RIGHT):
            x, y, z = self._hips[side]
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


def landing_rad(vigour: float) -> float:
    size = min(abs(vigour), 1.15)
    return size * (_LANDING_RAD if vigour >= 0.0 else _BACK_LANDING_RAD)


def off_rad(vigour: float) -> float:
    size = min(abs(vigour), 1.15)
    return size * (_TOE_OFF_RAD if vigour >= 0.0 else _BACK_OFF_RAD)


def _smooth(u: FloatArray) -> FloatArray:
    """From 0 at 0 to 1 at 1 with level ends."""
    return np.asarray(u * u * (3.0 - 2.0 * u))
