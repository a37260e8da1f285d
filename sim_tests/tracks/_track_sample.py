"""One track at one instant, for drawing and for tables."""

from __future__ import annotations

from dataclasses import dataclass

from perception.arrays import FloatArray


@dataclass(slots=True, eq=False)
class TrackSample:
    """What was believed of a person at ``stamp_s``.

    Attributes:
        stamp_s: the instant.
        status: ``"tentative"``, ``"confirmed"``, ``"coasting"``; ``"given"`` without a tracker.
        is_frame: False for a prediction between two frames.
        seen: whether the frame at this instant shows the person.
        position_odom_m: (2,).
        velocity_odom_mps: (2,), or None where it is not known.
        position_covariance_m2: (2, 2), or None where it is not known.
        awareness: smoothed α; NaN where there is none, as are the two below.
        awareness_std: its standard deviation.
        awareness_lower: its lower bound, the line that counts.
        measured_awareness: α of the frame's own observation, or None without evidence.
        measured_awareness_std: its standard deviation.
    """

    stamp_s: float
    status: str
    is_frame: bool
    seen: bool
    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray | None
    position_covariance_m2: FloatArray | None
    awareness: float
    awareness_std: float
    awareness_lower: float
    measured_awareness: float | None = None
    measured_awareness_std: float | None = None
