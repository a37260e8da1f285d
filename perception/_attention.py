"""The attention cone: a score of how centrally the robot lies in a person's field of view."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from .arrays import FloatArray, finite_number, set_fields
from .errors import PerceptionError

#: Half of θ_FOV = 120°, the horizontal field of view that head orientation alone supports.
DEFAULT_HALF_ANGLE_RAD: Final = math.radians(60.0)


@dataclass(frozen=True, slots=True)
class AttentionCone:
    """Awareness score of a target in a cone around the gaze (eqs. (1)–(3) of the paper).

    α = 1 − d⊥ / (d · tan half-angle) for a target ahead of the apex and inside the cone, else 0;
    d is the distance along the gaze and d⊥ the distance from its axis. The paper gives the cone's
    radius as d · tan θ_FOV but calls θ_FOV/2 its half-angle; here one half-angle replaces both.

    Attributes:
        half_angle_rad: half-angle of the cone, in (0, π/2).
    """

    half_angle_rad: float = DEFAULT_HALF_ANGLE_RAD

    def __post_init__(self) -> None:
        angle = finite_number(
            "half_angle_rad", self.half_angle_rad, minimum=0.0, exclusive_minimum=True
        )
        if angle >= 0.5 * math.pi:
            raise PerceptionError(f"half_angle_rad must lie in (0, pi/2), got {angle:g} rad")
        set_fields(self, half_angle_rad=angle)

    def score(self, apex_m: ArrayLike, gaze: ArrayLike, target_m: ArrayLike) -> Any:
        """Return α in [0, 1].

        Args:
            apex_m: (3,) or (N, 3) apex of the cone.
            gaze: (3,) or (N, 3) vectors along the gaze, of any length > 0.
            target_m: for one gaze (3,), or (M, 3) points of one target, of which the highest score
                counts: a person who sees any part of the robot sees the robot. For N gazes (3,), or
                (N, 3) with one target per gaze. All vectors are in the same frame.

        Returns:
            A float for one gaze, (N,) for N gazes.

        Raises:
            PerceptionError: for another shape, a non-finite number or a gaze of length 0.
        """
        apex, direction, target = (
            np.asarray(value, dtype=np.float64) for value in (apex_m, gaze, target_m)
        )
        for name, array in (("apex_m", apex), ("gaze", direction), ("target_m", target)):
            if array.ndim not in (1, 2) or array.shape[-1] != 3:
                raise PerceptionError(f"{name} must have shape (3,) or (N, 3), got {array.shape}")
            if not np.isfinite(array).all():
                raise PerceptionError(f"{name} must be finite, got {array.tolist()!r:.120}")
        one_gaze = apex.ndim == 1 and direction.ndim == 1
        try:
            scores = self.scores(apex, direction, target)
        except ValueError as cause:
            if isinstance(cause, PerceptionError):
                raise
            raise PerceptionError(
                "apex_m, gaze and target_m must have equal lengths N where they are (N, 3), got "
                f"{apex.shape}, {direction.shape} and {target.shape}"
            ) from cause
        return float(np.max(scores, initial=0.0)) if one_gaze else scores

    def scores(self, apex_m: FloatArray, gaze: FloatArray, target_m: FloatArray) -> FloatArray:
        """Return α (…,) of (…, 3) arrays under NumPy broadcasting, without checks of the input."""
        length = np.sqrt(_dot(gaze, gaze))
        if not np.all(length > 0.0):
            raise PerceptionError("gaze must have a direction, got a vector of length 0")
        unit = gaze / length[..., None]
        offset = target_m - apex_m
        axial = _dot(offset, unit)
        across = offset - axial[..., None] * unit
        perpendicular = np.sqrt(_dot(across, across))
        radius = axial * math.tan(self.half_angle_rad)
        ahead = axial > 0.0
        inside = ahead & (perpendicular <= radius)
        ratio = np.divide(perpendicular, radius, out=np.ones_like(radius), where=inside)
        return np.asarray(np.where(inside, 1.0 - ratio, 0.0), dtype=np.float64)


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return dot products of (…, 3) arrays under broadcasting."""
    return np.asarray(np.einsum("...i,...i->...", first, second))
