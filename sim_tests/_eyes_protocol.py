"""What every kind of eyes offers."""

from __future__ import annotations

from typing import Protocol

from perception import PersonObservation
from perception.arrays import FloatArray

from ._stage import TrueView


class Eyes(Protocol):
    """Makes the observations of one frame."""

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> tuple[tuple[PersonObservation, int], ...]:
        """Return each observation with the index of the worker that it shows, −1 for none."""
        ...
