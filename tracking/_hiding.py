"""How much of each person the people nearer to the camera hide."""

from __future__ import annotations

import numpy as np

from perception.arrays import FloatArray

from ._table import BoolArray


def open_share(
    places_m: FloatArray,
    people_m: FloatArray,
    eye_m: FloatArray,
    radius_m: float,
) -> FloatArray:
    """Return (N,) in [0, 1]: the share of a body at each place that nobody nearer covers.

    Bodies are upright cylinders, so on the floor plane each takes up an interval of bearings. The
    shares that several people cover are summed: two who stand side by side hide somebody whole.

    Args:
        places_m: (N, 2) where somebody may be.
        people_m: (M, 2) the others, who may stand in front.
        eye_m: (2,) the camera, in the same frame.
        radius_m: > 0, of every body.
    """
    if not len(places_m) or not len(people_m):
        return np.ones(len(places_m))
    bearing, distance, half = _seen_from(places_m, eye_m, radius_m)
    front_bearing, front_distance, front_half = _seen_from(people_m, eye_m, radius_m)
    apart = bearing[:, None] - front_bearing
    apart = np.abs(np.mod(apart + np.pi, 2.0 * np.pi) - np.pi)
    overlap = np.minimum(half[:, None], apart + front_half) - np.maximum(
        -half[:, None], apart - front_half
    )
    before: BoolArray = front_distance + radius_m <= distance[:, None]
    hidden = np.where(before, np.clip(overlap / (2.0 * half[:, None]), 0.0, 1.0), 0.0)
    return np.asarray(np.maximum(1.0 - hidden.sum(axis=1), 0.0))


def _seen_from(
    places_m: FloatArray, eye_m: FloatArray, radius_m: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return bearing, distance and half the angle of bodies at (N, 2), seen from (2,)."""
    offset = places_m - eye_m
    distance = np.hypot(offset[:, 0], offset[:, 1])
    half = np.arcsin(np.minimum(radius_m / np.maximum(distance, radius_m), 1.0))
    return np.arctan2(offset[:, 1], offset[:, 0]), distance, half
