"""2-D laser scans: the message, the mounting, and points corrected for the robot's motion.

The order of use, for every scan of every scanner::

    scanner = Scanner.mounted(0.35, 0.25, 0.2, yaw_rad=math.radians(45))
    scan = LaserScan(stamp_s, angle_min_rad, angle_increment_rad, ranges_m, 0.05, 20.0)
    points = scan_points(scan, scanner, RobotMotion(stamp_s, T_odom_base))
"""

from __future__ import annotations

from ._points import RobotMotion, ScanPoints, scan_points
from ._scan import LaserScan
from ._scanner import Scanner

__all__ = [
    "LaserScan",
    "RobotMotion",
    "ScanPoints",
    "Scanner",
    "scan_points",
]
