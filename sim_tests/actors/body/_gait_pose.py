"""The pose of the gait at one instant, and the figures that all kinds of footsteps share.

A stance begins with the loading response (the toes come down after the heel) and ends with the
roll-off (the heel lifts before the toes). Both take a share of the stance, up to a longest time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

LONGEST_SWING_S: Final = 0.65
LOADING_SHARE: Final = 0.15
LOADING_S: Final = 0.18
ROLL_OFF_SHARE: Final = 0.43
ROLL_OFF_S: Final = 0.45
#: The weight is over the left foot at this phase, counted from its landing.
MIDSTANCE_PHASE: Final = 0.30
#: The body is over its foot earlier than halfway through a stance by this share of it.
MIDSTANCE_SHIFT: Final = 0.12
#: Lift of a foot in a swing as long as the comfortable stride.
FOOT_LIFT_M: Final = 0.035
#: A swing foot stays this much farther from the body's centre line than a stance foot.
SWING_CLEARANCE_M: Final = 0.010
#: Part of a leg's reach that is used. Knees are never locked: this leaves a bend of 7 degrees.
USED_REACH: Final = 0.998

#: A cycle turns the body this far on the spot.
TURN_PER_CYCLE_RAD: Final = math.radians(60.0)
#: A sideways stride as a share of stature: the feet must not cross.
SIDE_STRIDE_SHARE: Final = 0.12
#: A backward stride as a share of a forward one.
BACKWARD_STRIDE_SHARE: Final = 0.75
#: Largest cadence of any motion.
MAX_CADENCE_HZ: Final = 1.8
#: A body that walks askew turns its feet towards the walk: at most by this angle, and less below
#: this speed.
TWIST_RAD: Final = math.radians(35.0)
TWIST_FROM_MPS: Final = 0.3

# Amplitudes at the stride of a walk at 1.2 m/s.
PELVIS_YAW_RAD: Final = 0.07
PELVIS_LIST_RAD: Final = 0.035
THORAX_YAW_RAD: Final = 0.06
SWAY_M: Final = 0.016
ARM_SWING_RAD: Final = 0.36
#: Share of the angle between feet and heading that the pelvis follows.
PELVIS_TWIST_SHARE: Final = 0.75

_LANDING_PITCH_RAD: Final = math.radians(-20.0)
_LIFT_OFF_PITCH_RAD: Final = math.radians(40.0)
# A backward step lands on the toes and lifts off from the heel.
_BACKWARD_LANDING_PITCH_RAD: Final = math.radians(16.0)
_BACKWARD_LIFT_OFF_PITCH_RAD: Final = math.radians(-12.0)
_MAX_PITCH_FACTOR: Final = 1.15


def landing_pitch_rad(stride_ratio: float) -> float:
    """Return the pitch of a landing foot; toes down is positive."""
    size = min(abs(stride_ratio), _MAX_PITCH_FACTOR)
    return size * (_LANDING_PITCH_RAD if stride_ratio >= 0.0 else _BACKWARD_LANDING_PITCH_RAD)


def lift_off_pitch_rad(stride_ratio: float) -> float:
    """Return the pitch of a foot that lifts off; toes down is positive."""
    size = min(abs(stride_ratio), _MAX_PITCH_FACTOR)
    return size * (_LIFT_OFF_PITCH_RAD if stride_ratio >= 0.0 else _BACKWARD_LIFT_OFF_PITCH_RAD)


#: Column of the hip height in a table of :meth:`Gait.table`, after five numbers per foot.
HIP_HEIGHT_COLUMN: Final = 10


@dataclass(frozen=True, slots=True)
class GaitPose:
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

    feet: tuple[tuple[float, float, float, float, float], tuple[float, float, float, float, float]]
    hip_height_m: float
    sway_m: float = 0.0
    pelvis_yaw_rad: float = 0.0
    pelvis_list_rad: float = 0.0
    thorax_yaw_rad: float = 0.0
    stride_ratio: float = 0.0
    arm_swing_rad: float = 0.0

    @classmethod
    def from_row(cls, row: list[float]) -> GaitPose:
        """Read a row of a table of :meth:`Gait.table`."""
        a, b, c, d, e, f, g, h, i, j = row[:10]
        return cls(((a, b, c, d, e), (f, g, h, i, j)), *row[10:17])

    def moved(self, dx_m: float, dy_m: float) -> GaitPose:
        """Return the same pose elsewhere in odom."""
        (ax, ay, az, ayaw, apitch), (bx, by, bz, byaw, bpitch) = self.feet
        left = ax + dx_m, ay + dy_m, az, ayaw, apitch
        return replace(self, feet=(left, (bx + dx_m, by + dy_m, bz, byaw, bpitch)))
