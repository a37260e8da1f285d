"""Who over time: Kalman tracks in the odom frame with a smoothed awareness α(t)."""

from __future__ import annotations

from ._errors import TrackingError
from ._track import PersonTrack, TrackStatus

__all__ = ["PersonTrack", "TrackStatus", "TrackingError"]
