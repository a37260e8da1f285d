"""Eyes all around: several views of one camera, and everybody once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from perception import PersonObservation
from perception.arrays import FloatArray
from perception.surround import FlatView, merge_views

from ._eyes_protocol import Eyes
from ._stage import TrueView


class SurroundEyes:
    """What several views of one wide camera see, merged as on a robot.

    Args:
        views: of the camera, the first one straight ahead.
        eyes: of each view.
    """

    def __init__(self, views: Sequence[FlatView], eyes: Sequence[Eyes]) -> None:
        self._views = tuple(views)
        self._eyes = tuple(eyes)

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> tuple[tuple[PersonObservation, int], ...]:
        """Look into every view; boxes are those of the first view, None for people in others."""
        seen = [
            eyes.observe(
                stamp_s,
                T_odom_camera @ view.T_camera_view,
                tuple(_in_view(each, view) for each in truth),
            )
            for view, eyes in zip(self._views, self._eyes, strict=True)
        ]
        merged = merge_views(self._views, [[found for found, _ in rows] for rows in seen])
        return tuple(
            (
                each.observation if each.view == 0 else replace(each.observation, box_xyxy_px=None),
                seen[each.view][each.row][1],
            )
            for each in merged
        )


def _in_view(truth: TrueView, view: FlatView) -> TrueView:
    """The truth about a person in the view's frame."""
    rotation = view.rotation_camera_view
    return replace(
        truth,
        position_camera_m=truth.position_camera_m @ rotation,
        gaze_camera=truth.gaze_camera @ rotation,
    )
