"""Analytic scans of circles (legs, posts) in a rectangular room."""

from __future__ import annotations

import math

import numpy as np

from perception.laser import LaserScan, RobotMotion, Scanner, ScanPoints, scan_points

RAYS, STEP = 721, math.radians(0.375)
ROOM = (-6.0, -5.0, 6.0, 5.0)


def pose(x: float, y: float, yaw: float) -> np.ndarray:
    T = np.eye(4)
    T[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    T[:2, 3] = x, y
    return T


def two_legs(x: float, y: float, heading: float = 0.0, apart: float = 0.22) -> list:
    """Return two legs, one on either side of a person's centre line."""
    dx, dy = -0.5 * apart * math.sin(heading), 0.5 * apart * math.cos(heading)
    return [(x + dx, y + dy, 0.06), (x - dx, y - dy, 0.06)]


def ranges_of(circles, angles, origin=(0.0, 0.0), room=ROOM) -> np.ndarray:
    """Return the exact range of rays at angles from a place in a room with circles."""
    d = np.column_stack((np.cos(angles), np.sin(angles)))
    d[d == 0.0] = 1e-12
    walls = np.where(d > 0.0, room[2:], room[:2]) - origin
    ranges = (walls / d).min(axis=1)
    for x, y, radius in circles:
        to = np.array([x - origin[0], y - origin[1]])
        along, square = d @ to, to @ to - radius**2
        inside = along**2 - square
        hit = (inside >= 0.0) & (along > 0.0)
        ranges = np.where(hit, np.minimum(ranges, along - np.sqrt(np.maximum(inside, 0))), ranges)
    return ranges


def laser_scan(
    circles=(),
    *,
    low=-135.0,
    rays=RAYS,
    step=STEP,
    noise=0.0,
    seed=0,
    stamp_s=0.0,
    origin=(0.0, 0.0),
    room=ROOM,
) -> LaserScan:
    angles = math.radians(low) + step * np.arange(rays)
    ranges = ranges_of(circles, angles, origin, room)
    ranges = ranges + noise * np.random.default_rng(seed).normal(size=rays)
    return LaserScan(stamp_s, math.radians(low), step, ranges, 0.05, 20.0)


def points_of(scan: LaserScan, place=(0.0, 0.0, 0.0), scanner: Scanner | None = None) -> ScanPoints:
    mounted = Scanner.mounted(0.0, 0.0, 0.2) if scanner is None else scanner
    return scan_points(scan, mounted, RobotMotion(scan.stamp_s, pose(*place)))
