"""Where feet and hips are at one instant: what a gait hands to a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

#: Column of the hips' height in a table of :meth:`Gait.table`, after five numbers for each foot.
HIP_HEIGHT_COLUMN: Final = 10


@dataclass(frozen=True, slots=True)
class Footing:
    """Where feet and hips are at one instant.

    Attributes:
        feet: left and right: x, y, z of the ankle in metres, yaw and pitch (toes down) in radians.
            In odom when given to :meth:`Worker.place`.
        hip_height_m: of the hips' midpoint above the floor.
        sway_m: hips left of the body's centre line.
        pelvis_yaw_rad: left of the heading.
        pelvis_list_rad: left side up.
        thorax_yaw_rad: left of the heading.
        vigour: stride over that of a walk at 1.2 m/s; 0 standing, negative backwards.
        arm_swing_rad: left arm ahead of hanging, and the right one behind.
    """

    feet: tuple[tuple[float, float, float, float, float], tuple[float, float, float, float, float]]
    hip_height_m: float
    sway_m: float = 0.0
    pelvis_yaw_rad: float = 0.0
    pelvis_list_rad: float = 0.0
    thorax_yaw_rad: float = 0.0
    vigour: float = 0.0
    arm_swing_rad: float = 0.0

    @classmethod
    def of_row(cls, row: list[float]) -> Footing:
        """From a row of a table of :meth:`Gait.table`."""
        a, b, c, d, e, f, g, h, i, j = row[:10]
        return cls(((a, b, c, d, e), (f, g, h, i, j)), *row[10:17])
