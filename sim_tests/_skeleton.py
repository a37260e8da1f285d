"""How a worker is proportioned: segment lengths and the places of keypoints, from a stature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from perception.anthropometry import (
    LIMBS,
    MEAN_STATURE_M,
    NECK_TO_NOSE_FORWARD_M,
    NECK_TO_NOSE_UP_M,
)
from perception.arrays import finite_number

from ._errors import SimError

#: Height of the ankle's centre above the floor as a fraction of stature (Drillis and Contini 1966).
_ANKLE_FRACTION: Final = 0.039
# A standing knee is not locked: 99.8 % of the leg's length is a bend of 7 degrees.
_STANDING_LEG_FRACTION: Final = 0.998
_LENGTH_M: Final = {limb.name: limb.length_m for limb in LIMBS}


@dataclass(frozen=True, slots=True)
class Skeleton:
    """Segment lengths of an upright body, metres.

    The limbs are those of :data:`perception.anthropometry.LIMBS`, scaled with stature; the head's
    own size is that of its template, since heads vary little with stature.

    Attributes:
        stature_m: height standing.
        thigh_m: hip to knee.
        shank_m: knee to ankle.
        ankle_height_m: sole to ankle.
        heel_back_m: ankle back to the point on which the heel rolls.
        toe_ahead_m: ankle ahead to the point over which the toes roll.
        hip_half_span_m: centre line to hip.
        torso_m: hip midpoint to shoulder midpoint, upright.
        shoulder_half_span_m: centre line to shoulder.
        upper_arm_m: shoulder to elbow.
        forearm_m: elbow to wrist.
        nose_ahead_m: neck (shoulder midpoint) ahead to the nose, head level.
        nose_up_m: neck up to the nose, head level.
        head_pivot_up_m: neck up to the axis about which the head nods.
    """

    stature_m: float
    thigh_m: float
    shank_m: float
    ankle_height_m: float
    heel_back_m: float
    toe_ahead_m: float
    hip_half_span_m: float
    torso_m: float
    shoulder_half_span_m: float
    upper_arm_m: float
    forearm_m: float
    nose_ahead_m: float
    nose_up_m: float
    head_pivot_up_m: float

    @classmethod
    def from_stature(cls, stature_m: float) -> Skeleton:
        """Proportions of an adult; ``stature_m`` in [1.4, 2.1], else :class:`SimError`."""
        stature = finite_number("stature_m", stature_m, SimError, minimum=1.4, maximum=2.1)
        scale = stature / MEAN_STATURE_M
        return cls(
            stature_m=stature,
            thigh_m=_LENGTH_M["left thigh"] * scale,
            shank_m=_LENGTH_M["left shank"] * scale,
            ankle_height_m=_ANKLE_FRACTION * stature,
            heel_back_m=0.030 * stature,
            toe_ahead_m=0.090 * stature,
            hip_half_span_m=0.5 * _LENGTH_M["hip span"] * scale,
            torso_m=_LENGTH_M["torso"] * scale,
            shoulder_half_span_m=0.5 * _LENGTH_M["shoulder span"] * scale,
            upper_arm_m=_LENGTH_M["left upper arm"] * scale,
            forearm_m=_LENGTH_M["left forearm"] * scale,
            nose_ahead_m=NECK_TO_NOSE_FORWARD_M * scale,
            nose_up_m=NECK_TO_NOSE_UP_M * scale,
            head_pivot_up_m=0.7 * NECK_TO_NOSE_UP_M * scale,
        )

    @property
    def standing_hip_height_m(self) -> float:
        """Floor to hips, standing."""
        return self.ankle_height_m + _STANDING_LEG_FRACTION * (self.thigh_m + self.shank_m)

    @property
    def neck_height_m(self) -> float:
        """Floor to shoulder midpoint, standing."""
        return self.standing_hip_height_m + self.torso_m
