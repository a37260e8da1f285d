"""Where feet and hips are at one instant: what a gait hands to a body.

How far a foot may go round the standing one in the time that its swing has.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from perception.arrays import FloatArray

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


# A foot that has no time for the whole way round passes nearer.
_QUICKEST_FOOT_MPS: Final = 9.0


def unhurried(
    place_m: FloatArray,
    aside_m: FloatArray,
    direction: tuple[FloatArray, FloatArray],
    times_s: FloatArray,
) -> float:
    """Share of a way round, in [0, 1], that keeps a foot within its quickest.

    Args:
        place_m: (N, 2) of the foot without the way round.
        aside_m: (N,) how far the way round leads aside.
        direction: (N,) x and (N,) y of the unit vectors that lead there.
        times_s: (N,) increasing.
    """
    dt_s = np.diff(times_s)[:, None]
    straight = np.diff(place_m, axis=0) / dt_s
    way = np.diff(aside_m[:, None] * np.column_stack(direction), axis=0) / dt_s
    # The largest share s with |straight + s way| at most the quickest, in every interval.
    square, mixed = (way**2).sum(axis=1), (way * straight).sum(axis=1)
    spare = _QUICKEST_FOOT_MPS**2 - (straight**2).sum(axis=1)
    moves = square > 1e-12
    root = np.sqrt(np.maximum(mixed[moves] ** 2 + square[moves] * spare[moves], 0.0))
    return float(np.clip(((root - mixed[moves]) / square[moves]).min(initial=1.0), 0.0, 1.0))
