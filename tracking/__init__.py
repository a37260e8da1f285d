"""Person tracking: Kalman tracks in the odom frame, each with a filtered awareness α(t)."""

from __future__ import annotations

from pathlib import Path
from runpy import run_path

# Run by path: an import by name could load another package that is called perception.
_CLASH = Path(__file__).parents[1] / "perception" / "_clash.py"
run_path(str(_CLASH))["require_sole_owner"](__name__)

from ._config import AwarenessFilterConfig, TrackerConfig
from ._errors import TrackingError
from ._sensors import SensorConfig
from ._snapshot import PersonTrack, TrackStatus
from ._tracker import PersonTracker
from ._views import CameraView, RangedView, ScannerView, SurroundView, View

__all__ = [
    "AwarenessFilterConfig",
    "CameraView",
    "PersonTrack",
    "PersonTracker",
    "RangedView",
    "ScannerView",
    "SensorConfig",
    "SurroundView",
    "TrackStatus",
    "TrackerConfig",
    "TrackingError",
    "View",
]
