"""Fields on the average body along whose zero lines clothes are cut.

Every field is positive inside and roughly in metres of the average body (1.83 m tall), so that the
same numbers serve every worker.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ._body import Body
from ._piece import Array

_FAR = 1.0


class Places:
    """Fields over the vertices of the average body, or of cloth draped over it."""

    def __init__(self, average: Body, surface_m: Array | None = None) -> None:
        self.canon_m = average.vertices_m if surface_m is None else surface_m
        self._weights = average.weights
        self._joints = average.joints_m

    @cached_property
    def arm(self) -> Array:
        """1 on the arms, 0 elsewhere."""
        return np.maximum(self._weights[:, 4], self._weights[:, 7])

    @cached_property
    def along_arm_m(self) -> Array:
        """Distance from the shoulder along the arm; 0 elsewhere. The wrist lies at 0.54."""
        out = np.zeros(len(self.canon_m))
        for first in (4, 7):
            shoulder, elbow, wrist = self._joints[first : first + 3]
            upper, fore = np.linalg.norm(elbow - shoulder), np.linalg.norm(wrist - elbow)
            on_upper = (self.canon_m - shoulder) @ (elbow - shoulder) / upper
            on_fore = (self.canon_m - elbow) @ (wrist - elbow) / fore
            turned = self._weights[:, first + 1]
            along = (1.0 - turned) * np.minimum(on_upper, upper + 0.05) + turned * (upper + on_fore)
            out = np.where(self._weights[:, first] > 0.3, along, out)
        return out

    def above(self, z_m: float) -> Array:
        """Return the field of places higher than ``z_m``; arms count as high."""
        return np.where(self.arm > 0.3, _FAR, self.canon_m[:, 2] - z_m)

    def below(self, z_m: float) -> Array:
        """Return the field of places lower than ``z_m``; arms count as high."""
        return -self.above(z_m)

    def sleeve(self, length_m: float) -> Array:
        """Return the field of arms up to ``length_m`` from the shoulder, and everything else."""
        return np.where(self.arm > 0.3, length_m - self.along_arm_m, _FAR)

    def collar(self, z_m: float, slope: float = 0.42) -> Array:
        """Return the field below a ring about the neck, at ``z_m`` on the axis, lower in front."""
        x, _, z = self.canon_m.T
        return np.where(self.arm > 0.6, _FAR, (z_m - slope * (x - 0.01) - z) * 0.92)

    def neckline_v(self, z_m: float) -> Array:
        """Return the field outside a V that opens from ``z_m`` on the chest."""
        x, y, z = self.canon_m.T
        return np.where(x > 0.02, z_m + 2.1 * np.abs(y) - z, _FAR) * 0.45

    def armhole(self) -> Array:
        """Return the field of the trunk within the armholes of a sleeveless garment."""
        _, y, z = self.canon_m.T
        shoulder = np.where(z > 1.40, 0.172 - np.abs(y), _FAR)
        return np.minimum(shoulder, 0.16 * (0.35 - self.arm))

    def foot(self) -> Array:
        """Return the field above the ankle."""
        return self.canon_m[:, 2] - 0.105
