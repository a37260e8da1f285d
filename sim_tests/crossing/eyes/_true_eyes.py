"""Eyes that report the truth of the simulation."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from perception import PersonObservation
from perception.arrays import FloatArray
from tracking import View

from .._stage import TrueView
from ._eyes import WorkerObservations

# Standard deviations that are reported with the truth: small, but not zero.
_TRUE_POSITION_COVARIANCE_M2: Final = 0.01**2 * np.eye(3)
_TRUE_AWARENESS_STD: Final = 0.02
_TRUE_RANGE_M: Final = 20.0


class TrueEyes:
    """Eyes that report true position, gaze and awareness.

    Args:
        view: field of view; None for all directions and through walls.
    """

    def __init__(self, view: View | None = None) -> None:
        self._view = view

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> WorkerObservations:
        """Return the truth about every visible person within 20 m."""
        visible = self._visible(T_odom_camera, truth)
        return tuple(
            (
                PersonObservation(
                    stamp_s=stamp_s,
                    position_camera_m=view.position_camera_m,
                    position_covariance_m2=_TRUE_POSITION_COVARIANCE_M2,
                    gaze_camera=view.gaze_camera,
                    awareness=view.awareness,
                    awareness_std=_TRUE_AWARENESS_STD,
                    score=1.0,
                    box_xyxy_px=None,
                ),
                index,
            )
            for index, view in enumerate(truth)
            if visible[index] and math.hypot(*view.position_camera_m.tolist()) <= _TRUE_RANGE_M
        )

    def _visible(self, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]) -> list[bool]:
        if self._view is None or not truth:
            return [True] * len(truth)
        positions_camera = np.array([view.position_camera_m for view in truth])
        positions_odom = positions_camera @ T_odom_camera[:2, :3].T + T_odom_camera[:2, 3]
        visible: list[bool] = (self._view.visibility(positions_odom, T_odom_camera) > 0.0).tolist()
        return visible
