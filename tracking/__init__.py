"""Who over time: Kalman tracks in the odom frame with a smoothed awareness α(t)."""

from __future__ import annotations

from . import _clash  # noqa: F401 - first: refuses a foreign package of one of our names
from ._camera_view import CameraView
from ._config import AwarenessFilterConfig, TrackerConfig
from ._errors import TrackingError
from ._surround_view import SurroundView
from ._track import PersonTrack, TrackStatus
from ._tracker import PersonTracker
from ._view import View

__all__ = [
    "AwarenessFilterConfig",
    "CameraView",
    "PersonTrack",
    "PersonTracker",
    "SurroundView",
    "TrackStatus",
    "TrackerConfig",
    "TrackingError",
    "View",
]
