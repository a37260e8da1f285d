"""Smoothed paths of the tracks of a recording, the reference for what the tracker knew in time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from perception.arrays import FloatArray
from tracking import TrackerConfig
from tracking.smoothing import SmoothedPath, smooth

from ._history import TrackHistory, TrackSample


def smoothed_path(history: TrackHistory, config: TrackerConfig | None) -> SmoothedPath | None:
    """Return a track smoothed up to the last frame that shows the person.

    None for a track whose covariance is not known, or that only one frame shows.
    """
    last = max((row for row, each in enumerate(history.samples) if each.seen), default=-1)
    samples = history.samples[: last + 1]
    if len(samples) < 2 or any(each.covariance_odom is None for each in samples):
        return None
    return smooth(*arrays_of(samples), config)


def arrays_of(samples: Sequence[TrackSample]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stamps (N,), states (N, 4) and covariances (N, 4, 4) of samples of a tracker."""
    states = [
        [*each.position_odom_m, *(() if each.velocity_odom_mps is None else each.velocity_odom_mps)]
        for each in samples
    ]
    return (
        np.array([each.stamp_s for each in samples]),
        np.array(states).reshape(-1, 4),
        np.array([each.covariance_odom for each in samples]).reshape(-1, 4, 4),
    )


def distances_m(history: TrackHistory, path: SmoothedPath) -> FloatArray:
    """Return the distances (N,) between a track and its smoothed path at its frames."""
    count = len(path.stamps_s)
    offset = history.positions_odom_m[:count] - path.states[:, :2]
    return np.asarray(np.hypot(offset[:, 0], offset[:, 1]))
