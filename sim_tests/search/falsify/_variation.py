"""The parts of a variation: its parameters, bent paths and their clearance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from perception.arrays import FloatArray

from .._study import Range

#: Smallest distance of a person's centre line from racks and walls in a variation.
RACK_CLEARANCE_M = 0.35
#: Smallest distance of a person's start from that of the robot in a variation.
ROBOT_CLEARANCE_M = 1.5


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


def bent_path(points_m: FloatArray, first_m: float, middle_m: float, last_m: float) -> FloatArray:
    """Return a path shifted to its left, linearly interpolated between three shifts.

    A path of two points gets a third one halfway. A path of one point is moved by ``first_m`` in x
    and ``last_m`` in y.

    Args:
        points_m: (N, 2) points of the path.
        first_m: shift at the first point.
        middle_m: shift halfway along the path.
        last_m: shift at the last point.
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
