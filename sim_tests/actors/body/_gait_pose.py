"""Feet, hips and trunk at one instant of the gait, from which a body takes its joint angles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

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
