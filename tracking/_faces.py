"""The time between images of a person's face, where several sensors see faces.

Two cameras whose frames come a millisecond apart must neither count as one fast camera, whose
frames are worth little, nor as two, whose frames are worth twice as much. So a frame stands for the
time since the last evidence about the same person, at most for the interval of its own sensor.
"""

from __future__ import annotations

import numpy as np

from perception.arrays import FloatArray

from ._clocks import FrameClock
from ._sensors import Sensors
from ._table import TrackTable


def evidence_interval_s(
    tracks: TrackTable, stamp_s: float, clock: FrameClock, sensors: Sensors
) -> float | FloatArray:
    """Return the time that a face at ``stamp_s`` stands for: (N,), or one number for all.

    Args:
        tracks: N tracks before the evidence of the frame.
        stamp_s: of the frame.
        clock: of its sensor, this frame included.
        sensors: all sensors.
    """
    if not sensors.several_faces:
        return clock.interval_s
    since_s = stamp_s - tracks.evidence_stamps_s
    # A second face at one stamp may only lower the bound, and counts in full for that.
    since_s = np.where(since_s > 0.0, since_s, np.inf)
    return np.minimum(since_s, clock.interval_s)


def face_period_s(
    tracks: TrackTable, faces: FrameClock, clocks: tuple[FrameClock, ...], sensors: Sensors
) -> float | FloatArray:
    """Return the usual time between images of a face: (N,), or one number for all.

    For each person it is that of the sensor that gave the latest evidence, and the shortest of all
    where another frame has shown the person since.

    Args:
        tracks: N tracks.
        faces: clock of the frames of all sensors that see faces.
        clocks: of each sensor.
        sensors: all sensors.
    """
    if not sensors.several_faces:
        return faces.period_s
    columns = np.flatnonzero(sensors.faces)
    periods_s = np.array([clocks[column].period_s for column in columns.tolist()])
    gave = tracks.seen_stamps_s[:, columns] == tracks.evidence_stamps_s[:, None]
    own_s = np.where(gave, periods_s, np.inf).min(axis=1)
    return np.asarray(np.where(gave.any(axis=1), own_s, periods_s.min()))
