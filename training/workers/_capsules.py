"""Collision capsules fitted to the clothed surface at rest."""

from __future__ import annotations

import numpy as np

from ._body import Body
from ._piece import Array, Piece

#: A row: joint, start, end, radius.
Row = tuple[int, Array, Array, float]


def capsules(body: Body, pieces: list[Piece]) -> list[Row]:
    """Return a capsule per rigid part: pelvis, torso, head, and the parts of each limb."""
    cloud = np.concatenate([piece.vertices_m for piece in pieces])
    follow = np.concatenate([piece.weights for piece in pieces])
    label = np.concatenate([np.full(len(piece.vertices_m), piece.label) for piece in pieces])
    joints = body.joints_m
    arms = follow[:, [4, 7]].max(axis=1)
    legs = follow[:, [10, 13]].max(axis=1)
    trunk = (arms < 0.4) & (legs < 0.5) & (follow[:, 1] < 0.5)
    made: list[Row] = []
    pelvis = cloud[trunk & (follow[:, 0] < 0.6)]
    made.append(_across(-1, pelvis))
    torso = cloud[trunk & (follow[:, 0] > 0.4)]
    made.append(_upright(0, torso))
    made.append(_upright(1, cloud[(follow[:, 1] > 0.9) & (label != "brim")]))
    for first, ends in ((4, "arm"), (7, "arm"), (10, "leg"), (13, "leg")):
        for joint in (first, first + 1):
            beyond = follow[:, joint] > 0.5
            before = follow[:, joint + 1] < 0.5
            made.append(_along(joint, joints[joint], joints[joint + 1], cloud[beyond & before]))
        last = cloud[follow[:, first + 2] > 0.5]
        made.append(_principal(first + 2, last, flat=ends == "leg"))
    return made


def _radius(points: Array, start: Array, end: Array) -> float:
    """Return the mean distance of a surface from an axis, with a small margin."""
    along = end - start
    share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
    away = np.linalg.norm(points - start - share[:, None] * along, axis=1)
    return float(0.5 * (away.mean() + np.percentile(away, 80)))


def _along(joint: int, start: Array, end: Array, points: Array) -> Row:
    """Return a capsule from joint to joint, shifted to the middle of the surface about them."""
    unit = (end - start) / np.linalg.norm(end - start)
    across = points - start - ((points - start) @ unit)[:, None] * unit
    shift = 0.5 * (np.percentile(across, 5, axis=0) + np.percentile(across, 95, axis=0))
    start, end = start + shift, end + shift
    return joint, start, end, _radius(points, start, end)


def _across(joint: int, points: Array) -> Row:
    """Return a capsule that lies from side to side."""
    low, high = np.percentile(points, [1, 99], axis=0)
    radius = 0.5 * float(high[0] - low[0])
    half = max(0.5 * float(high[1] - low[1]) - radius, 0.01)
    center = 0.5 * (low + high)
    center[1] = 0.0
    side = np.array([0.0, half, 0.0])
    return joint, center - side, center + side, radius


def _upright(joint: int, points: Array) -> Row:
    """Return an upright capsule."""
    low, high = np.percentile(points, [1, 99], axis=0)
    radius = 0.25 * float(high[0] - low[0] + high[1] - low[1])
    center = 0.5 * (low + high)
    center[1] = 0.0
    up = np.array([0.0, 0.0, max(0.5 * float(high[2] - low[2]) - radius, 0.01)])
    return joint, center - up, center + up, radius


def _principal(joint: int, points: Array, flat: bool) -> Row:
    """Return a capsule along the longest direction of a hand or foot."""
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    unit = axes[0]
    if flat:
        unit = np.array([unit[0], unit[1], 0.0]) / np.hypot(unit[0], unit[1])
    extent = (points - center) @ unit
    radius = _radius(points, center + extent.min() * 0.8 * unit, center + extent.max() * 0.8 * unit)
    start = center + (extent.min() + radius) * unit
    end = center + (extent.max() - radius) * unit
    if flat:
        radius = min(radius, 0.055)
        start[2] = end[2] = radius
    return joint, start, end, radius
