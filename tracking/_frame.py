"""One frame as the tracker remembers it: checked, and in the odom frame."""

from __future__ import annotations

from dataclasses import dataclass

from perception.arrays import FloatArray

from ._measurement import Measurements


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """What the camera saw at one instant, and from where.

    Attributes:
        stamp_s: time of the frame.
        T_odom_camera: (4, 4) where the camera was.
        measurements: of the people it shows.
    """

    stamp_s: float
    T_odom_camera: FloatArray
    measurements: Measurements
