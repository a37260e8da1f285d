"""One line of an estimates file, checked and ready for the tracker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from perception import PersonObservation
from perception.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFrame:
    """A frame whose camera pose is known or assumed.

    Attributes:
        name: of the frame.
        stamp_s: when it was taken.
        T_odom_camera: (4, 4).
        observations: of the people that have a position.
        ids: of each observation what the file says it is; None where it does not say.
        tracks: the line's own tracks as ``awarenav estimate --tracks`` writes them, else None.
    """

    name: str
    stamp_s: float
    T_odom_camera: FloatArray
    observations: tuple[PersonObservation, ...]
    ids: tuple[int | None, ...]
    tracks: tuple[dict[str, Any], ...] | None

    def positions_odom_m(self) -> list[FloatArray]:
        """Where each observation is on the floor plane, (2,) each."""
        T = self.T_odom_camera
        return [T[:2, :3] @ each.position_camera_m + T[:2, 3] for each in self.observations]
