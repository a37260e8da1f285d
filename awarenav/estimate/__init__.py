"""Estimates of people in images, videos, cameras and recordings: ``awarenav estimate``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._bag import BagMessages
    from ._camera import CameraChoice, fixed_camera_pose
    from ._estimator import (
        FrameEstimate,
        PeopleEstimator,
        ids_of_tracks,
    )
    from ._networks import admit_options, choice_of_options, running_options
    from ._open_source import is_recording, open_source
    from ._overlay import OverlayWriter
    from ._sources import ImageSource, SourceFrame

__all__ = [
    "BagMessages",
    "CameraChoice",
    "FrameEstimate",
    "ImageSource",
    "OverlayWriter",
    "PeopleEstimator",
    "SourceFrame",
    "admit_options",
    "choice_of_options",
    "fixed_camera_pose",
    "ids_of_tracks",
    "is_recording",
    "open_source",
    "running_options",
]

__getattr__ = lazy_page(__name__, __file__)
