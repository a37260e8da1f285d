"""2-D laser scans: the message, the mounting, and the people in them.

The order of use, for every scan of every scanner::

    scanner = Scanner.mounted(0.375, 0.26, 0.2, yaw_rad=math.radians(45))
    detector = LegDetector()
    scan = LaserScan(stamp_s, angle_min_rad, angle_increment_rad, ranges_m, 0.05, 20.0)
    points = scan_points(scan, scanner, RobotMotion(stamp_s, T_odom_base))
    candidates = detector.detect(points)

With several scanners each scan is detected with its own number, ``detector.detect(points, 1)``, and
:func:`merge_candidates` reports every person once. :func:`observations_of` makes the observations
that ``tracking.PersonTracker`` takes.
"""

from __future__ import annotations

from ._candidates import CandidateKind, PersonCandidate, merge_candidates, observations_of
from ._carried import CarriedThings
from ._clusters import Clusters, clusters_of
from ._detector import LegDetector, LegDetectorConfig
from ._hypotheses import (
    CUTOUT,
    HYPOTHESIS_FEATURES,
    Hypotheses,
    LegClassifier,
    OnnxLegClassifier,
    hypotheses_of,
)
from ._memory import OccupancyMemory
from ._points import RobotMotion, ScanPoints, scan_points
from ._scan import LaserScan, Scanner
from ._sight import AHEAD_RAD, ScannerSight, SeenDirections, camera_field, sight_of
from ._static_map import MapCells, StaticMap

__all__ = [
    "AHEAD_RAD",
    "CUTOUT",
    "HYPOTHESIS_FEATURES",
    "CandidateKind",
    "CarriedThings",
    "Clusters",
    "Hypotheses",
    "LaserScan",
    "LegClassifier",
    "LegDetector",
    "LegDetectorConfig",
    "MapCells",
    "OccupancyMemory",
    "OnnxLegClassifier",
    "PersonCandidate",
    "RobotMotion",
    "ScanPoints",
    "Scanner",
    "ScannerSight",
    "SeenDirections",
    "StaticMap",
    "camera_field",
    "clusters_of",
    "hypotheses_of",
    "merge_candidates",
    "observations_of",
    "scan_points",
    "sight_of",
]
