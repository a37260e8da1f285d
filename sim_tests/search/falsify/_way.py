"""Ways bent aside, within what the hall leaves free.

One thing that a falsification may change about a scenario.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from perception.arrays import FloatArray

from .._search import Range

#: Nobody's centre line is led nearer to a rack or wall than this, nor to a robot before it starts.
RACK_CLEARANCE_M = 0.35
ROBOT_CLEARANCE_M = 1.5


def bent(points_m: FloatArray, first_m: float, middle_m: float, last_m: float) -> FloatArray:
    """A way shifted to its left by so much at its ends and halfway, linearly in between.

    A way of two points gets a third halfway; of one point, ``first_m`` and ``last_m`` are x and y.

    Args:
        points_m: (N, 2).
        first_m: at the first point.
        middle_m: halfway along.
        last_m: at the last point.
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
    # Where a way turns back on itself there is no left: such a corner stays.
    ahead = ahead / np.maximum(norm, 1e-9)[:, None] * (norm > 0.1)[:, None]
    shift = np.interp(share, [0.0, 0.5, 1.0], [first_m, middle_m, last_m])
    return np.asarray(points_m + shift[:, None] * np.stack([-ahead[:, 1], ahead[:, 0]], axis=1))


def clearance_m(points_m: FloatArray, boxes_odom_m: FloatArray) -> float:
    """Smallest distance between a way and the boxes (N, 4) x_min, y_min, x_max, y_max."""
    line = shapely.Point(points_m[0]) if len(points_m) == 1 else shapely.LineString(points_m)
    boxes = shapely.box(*np.asarray(boxes_odom_m, dtype=np.float64).T)
    return float(np.min(shapely.distance(line, boxes), initial=np.inf))


@dataclass(frozen=True, slots=True)
class Lever:
    """One thing that may be changed.

    Attributes:
        range: within human limits.
        neutral: where the scenario is as it was written.
    """

    range: Range
    neutral: float

    @classmethod
    def of(cls, low: float, high: float, neutral: float) -> Lever:
        """A lever from ``low`` to ``high``, widened to hold ``neutral``."""
        return cls(Range(low=min(low, neutral), high=max(high, neutral)), neutral)
