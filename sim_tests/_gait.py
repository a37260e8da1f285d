"""How legs and arms move in walking, as a function of the distance walked.

The gait is periodic in the distance walked, not in time: whatever the speed, the foot that bears
the body stays where it is on the floor. A stance foot lands on the heel, lies flat and rolls off
over the toes; the leg above it follows by two-link inverse kinematics.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from perception.arrays import finite_number

from ._errors import SimError
from ._skeleton import Skeleton

#: Part of the gait cycle in which a foot is on the floor (normal walking: 60 %).
STANCE: Final = 0.60

# Phases and angles of the foot's roll: toes come down after the heel has landed, the heel lifts.
_LOADED: Final = 0.09
_HEEL_OFF: Final = 0.34
_LANDING_RAD: Final = math.radians(-20.0)
_TOE_OFF_RAD: Final = math.radians(42.0)
# Feet land a little less far ahead of the hips than they leave behind them.
_AHEAD: Final = 0.38
_LIFT_M: Final = 0.035
_ELBOW_RAD: Final = 0.25
_ARM_SWING_RAD: Final = 0.38
_BOB_M: Final = 0.012
# Below this speed walking fades into standing.
_WALKING_MPS: Final = 0.3


@dataclass(frozen=True, slots=True)
class Posture:
    """Joint angles of a body seen from its left side; radians, positive swings forwards or bends.

    Attributes:
        hip_height_m: floor to hips.
        hip_rad: thigh ahead of the vertical, left and right.
        knee_rad: bend, left and right.
        foot_rad: toes below the horizontal, left and right.
        shoulder_rad: upper arm ahead of the vertical, left and right.
        elbow_rad: bend, left and right.
    """

    hip_height_m: float
    hip_rad: tuple[float, float]
    knee_rad: tuple[float, float]
    foot_rad: tuple[float, float]
    shoulder_rad: tuple[float, float]
    elbow_rad: tuple[float, float]


class Gait:
    """Walking of one body with one stride.

    Args:
        skeleton: the body.
        stride_m: distance of a full cycle (two steps), in [0.4, 0.85] × stature. None takes 0.75 ×
            stature, that of a walk at about 1.2 m/s.

    Attributes:
        stride_m: as given.

    Raises:
        SimError: for a stride that is out of range.
    """

    def __init__(self, skeleton: Skeleton, stride_m: float | None = None) -> None:
        stature = skeleton.stature_m
        self.stride_m = finite_number(
            "stride_m",
            0.75 * stature if stride_m is None else stride_m,
            SimError,
            minimum=0.4 * stature,
            maximum=0.85 * stature,
        )
        self._skeleton = skeleton
        self._vigour = self.stride_m / (0.75 * stature)
        # As high as both legs allow all the time, less what the body's rise and fall takes.
        self._walking_hip_height_m = min(
            self._highest_hip_m(k / 256) - self._bob_m(k / 256) for k in range(256)
        )

    def posture(self, walked_m: float, speed_mps: float) -> Posture:
        """The posture after ``walked_m``; ``speed_mps`` ≥ 0 fades walking into standing at 0."""
        fade = min(speed_mps / _WALKING_MPS, 1.0)
        fade *= fade * (3.0 - 2.0 * fade)
        left = (walked_m / self.stride_m) % 1.0
        right = (left + 0.5) % 1.0
        standing = self._skeleton.standing_hip_height_m
        hip_height = standing + fade * (self._walking_hip_height_m + self._bob_m(left) - standing)
        left_leg = self._leg(left, fade, hip_height)
        right_leg = self._leg(right, fade, hip_height)
        # Each arm swings with the other side's leg.
        swing = fade * self._vigour * _ARM_SWING_RAD
        left_arm = -swing * math.cos(math.tau * left)
        bend = _ELBOW_RAD * (1.0 + 0.4 * fade)
        return Posture(
            hip_height_m=hip_height,
            hip_rad=(left_leg[0], right_leg[0]),
            knee_rad=(left_leg[1], right_leg[1]),
            foot_rad=(left_leg[2], right_leg[2]),
            shoulder_rad=(left_arm, -left_arm),
            elbow_rad=(bend + 0.35 * left_arm, bend - 0.35 * left_arm),
        )

    def _foot(self, phase: float) -> tuple[float, float, float]:
        """Ankle ahead of the hips, ankle above the floor (metres), toes down (radians)."""
        body = self._skeleton
        start = _AHEAD * STANCE * self.stride_m
        if phase < STANCE:
            x, lift = start - self.stride_m * phase, 0.0
            if phase < _LOADED:
                pitch = self._vigour * _LANDING_RAD * (1.0 - _smooth(phase / _LOADED))
            elif phase < _HEEL_OFF:
                pitch = 0.0
            else:
                roll = (phase - _HEEL_OFF) / (STANCE - _HEEL_OFF)
                pitch = self._vigour * _TOE_OFF_RAD * roll * roll
        else:
            # Forwards through the air; the foot leaves and lands at the floor's own speed.
            u = (phase - STANCE) / (1.0 - STANCE)
            slope = -self.stride_m * (1.0 - STANCE)
            end = start - self.stride_m * STANCE
            x = end + (start - end) * _smooth(u) + slope * u * (1.0 - u) * (1.0 - 2.0 * u)
            lift = self._vigour * _LIFT_M * math.sin(math.pi * u) ** 2
            pitch = self._vigour * (_TOE_OFF_RAD + (_LANDING_RAD - _TOE_OFF_RAD) * _smooth(u))
        # The sole turns about the point on which it rests: the toes or the heel.
        arm = body.toe_ahead_m if pitch > 0.0 else -body.heel_back_m
        cos, sin = math.cos(pitch), math.sin(pitch)
        ahead = x + arm * (1.0 - cos) + body.ankle_height_m * sin
        return ahead, body.ankle_height_m * cos + arm * sin + lift, pitch

    def _leg(self, phase: float, fade: float, hip_height_m: float) -> tuple[float, float, float]:
        """Hip, knee and foot angle that put the ankle where the foot wants it."""
        body = self._skeleton
        ahead, up, pitch = self._foot(phase)
        ahead *= fade
        up = body.ankle_height_m + fade * (up - body.ankle_height_m)
        drop = hip_height_m - up
        thigh, shank = body.thigh_m, body.shank_m
        reach = min(math.hypot(ahead, drop), thigh + shank)
        knee = math.pi - math.acos(
            _cosine((thigh * thigh + shank * shank - reach * reach) / (2.0 * thigh * shank))
        )
        inner = math.acos(
            _cosine((thigh * thigh + reach * reach - shank * shank) / (2.0 * thigh * reach))
        )
        return math.atan2(ahead, drop) + inner, knee, fade * pitch

    def _bob_m(self, left_phase: float) -> float:
        """Rise and fall of the hips: highest in the middle of each leg's stance."""
        return self._vigour * _BOB_M * math.cos(2.0 * math.tau * (left_phase - 0.5 * STANCE))

    def _highest_hip_m(self, left_phase: float) -> float:
        """The highest that the hips may be for both ankles to be in reach."""
        body = self._skeleton
        reach = 0.998 * (body.thigh_m + body.shank_m)
        heights = []
        for phase in (left_phase, (left_phase + 0.5) % 1.0):
            ahead, up, _ = self._foot(phase)
            heights.append(up + math.sqrt(reach * reach - ahead * ahead))
        return min(heights)


def _smooth(u: float) -> float:
    """From 0 at 0 to 1 at 1 with level ends."""
    return u * u * (3.0 - 2.0 * u)


def _cosine(value: float) -> float:
    """Rounding may carry a cosine past one."""
    return min(max(value, -1.0), 1.0)
