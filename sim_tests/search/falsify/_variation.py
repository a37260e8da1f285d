"""The part that all variations share: limits, parameters, bent paths and their clearance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely

from perception.arrays import FloatArray

from .._study import Range

#: Smallest distance of a person's centre line from racks and walls in a variation.
RACK_CLEARANCE_M: Final = 0.35
#: Smallest distance of a person's start from that of the robot in a variation.
ROBOT_CLEARANCE_M: Final = 1.5
#: Speeds of people who walk; a person who is faster in the scenario keeps that speed as the limit.
SLOWEST_MPS: Final = 0.5
FASTEST_WALK_MPS: Final = 2.0
#: A shorter pause is none.
SHORTEST_PAUSE_S: Final = 0.15
#: A way on which a person sets off is none if it is shorter.
SHORTEST_WAY_M: Final = 0.3


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a variation.

    Attributes:
        range: range of its values, within human limits.
        neutral: its value in the scenario as written.
    """

    range: Range
    neutral: float

    @classmethod
    def of(cls, low: float, high: float, neutral: float) -> Parameter:
        """Return a parameter from ``low`` to ``high``, widened to include ``neutral``."""
        return cls(Range(low=min(low, neutral), high=max(high, neutral)), neutral)


#: Shifts of both ends of a path to its left.
ENDS: Final = {
    "aside_first_m": Parameter.of(-0.8, 0.8, 0.0),
    "aside_last_m": Parameter.of(-0.8, 0.8, 0.0),
}
#: The shift halfway, and a pause on the way.
ON_THE_WAY: Final = {
    "aside_middle_m": Parameter.of(-0.8, 0.8, 0.0),
    "pause_at": Parameter.of(0.05, 0.95, 0.5),
    "pause_s": Parameter.of(0.0, 3.0, 0.0),
}
#: Where somebody goes who sets off after standing.
SETS_OFF: Final = {
    "sets_off_x_m": Parameter.of(-3.0, 3.0, 0.0),
    "sets_off_y_m": Parameter.of(-3.0, 3.0, 0.0),
}


def shifted_path(points_m: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Return a path bent by the values of :data:`ENDS` and :data:`ON_THE_WAY`."""
    shifts = (values.get(f"aside_{place}_m", 0.0) for place in ("first", "middle", "last"))
    return bent_path(points_m, *shifts)


def bent_path(points_m: FloatArray, first_m: float, middle_m: float, last_m: float) -> FloatArray:
    """Return a path (N, 2) shifted to its left, linearly interpolated between three shifts.

    A path of two points gets a third one halfway. A path of one point is moved by ``first_m`` in x
    and ``last_m`` in y.
    """
    if len(points_m) == 1:
        return np.asarray(points_m + np.array([first_m, last_m]))
    if len(points_m) == 2 and middle_m != 0.0:
        points_m = np.array([points_m[0], points_m.mean(axis=0), points_m[1]])
    pieces = np.diff(points_m, axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    share = along / max(along[-1], 1e-9)
    units = pieces / np.maximum(lengths, 1e-9)[:, None]
    ahead = np.concatenate([units[:1], units[:-1] + units[1:], units[-1:]])
    norm = np.linalg.norm(ahead, axis=1)
    # A corner where the path turns back on itself has no left side and stays.
    ahead = ahead / np.maximum(norm, 1e-9)[:, None] * (norm > 0.1)[:, None]
    shift = np.interp(share, [0.0, 0.5, 1.0], [first_m, middle_m, last_m])
    return np.asarray(points_m + shift[:, None] * np.stack([-ahead[:, 1], ahead[:, 0]], axis=1))


def clearance_m(points_m: FloatArray, boxes_odom_m: FloatArray) -> float:
    """Return the smallest distance of a path from boxes (N, 4) x_min, y_min, x_max, y_max."""
    line = shapely.Point(points_m[0]) if len(points_m) == 1 else shapely.LineString(points_m)
    boxes = shapely.box(*np.asarray(boxes_odom_m, dtype=np.float64).T)
    return float(np.min(shapely.distance(line, boxes), initial=np.inf))
