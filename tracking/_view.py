"""What the tracker asks of whoever knows where the camera can see."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from perception.arrays import FloatArray


@runtime_checkable
class View(Protocol):
    """Where a frame would have shown a person, had one been there.

    People who hide others are not a view's business: the tracker knows where they are. Racks and
    walls may be. A view must not remember anything from call to call: frames that come late are
    asked about again.
    """

    def visibility(self, positions_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
        """Return (N,) in [0, 1]: the chance that a person at each position would be detected.

        Args:
            positions_odom_m: (N, 2) on the floor plane.
            T_odom_camera: (4, 4) where the camera was.
        """
        ...
