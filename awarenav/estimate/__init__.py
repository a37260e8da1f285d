"""Estimates of people in images, videos, cameras and recordings: ``awarenav estimate``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._bag import BagMessages
    from ._camera import CameraChoice, fixed_camera_pose, scaled_camera
    from ._estimator import (
        FrameEstimate,
        Networks,
        PeopleEstimator,
        RecordingPoseEstimator,
        ids_of_tracks,
    )
    from ._images import as_rgb, read_image
    from ._networks import NetworkChoice, admit_networks, choose_networks
    from ._open_source import is_recording, open_source
    from ._overlay import draw_overlay
    from ._overlay_writer import OverlayWriter, fit_image
    from ._results import estimate_record, track_record
    from ._run import EstimateOptions, estimate_command
    from ._source import ImageSource, SourceFrame
    from ._source_images import ImageFiles
    from ._source_video import VideoSource
    from ._threads import BackgroundWorker, FramePrefetcher

__all__ = [
    "BackgroundWorker",
    "BagMessages",
    "CameraChoice",
    "EstimateOptions",
    "FrameEstimate",
    "FramePrefetcher",
    "ImageFiles",
    "ImageSource",
    "NetworkChoice",
    "Networks",
    "OverlayWriter",
    "PeopleEstimator",
    "RecordingPoseEstimator",
    "SourceFrame",
    "VideoSource",
    "admit_networks",
    "as_rgb",
    "choose_networks",
    "draw_overlay",
    "estimate_command",
    "estimate_record",
    "fit_image",
    "fixed_camera_pose",
    "ids_of_tracks",
    "is_recording",
    "open_source",
    "read_image",
    "scaled_camera",
    "track_record",
]

__getattr__ = lazy_page(__name__, __file__)
