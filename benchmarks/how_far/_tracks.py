"""Tracks of the same people while a scanner sees them, and after it is lost."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from perception import PersonObservation
from tracking import PersonTracker, ScannerView, SensorConfig

from ._people import T_ODOM_CAMERA, Case, HowFar, Result

_CAMERA_HZ: Final = 20.0
_LASER_STD_M: Final = 0.05
_RANGED_S, _LOST_S = 2.0, 3.0


@dataclass(frozen=True, slots=True)
class Tracked:
    """Errors of a track: while the scanner sees the person, and after it is lost.

    Attributes:
        ranged: from the second second on.
        lost: from one second after the last scan.
    """

    ranged: list[Result]
    lost: list[Result]


def tracked(far: HowFar, case: Case, scanner: bool = True) -> Tracked:
    """Track somebody who walks across before a camera and a scanner, and then before the camera."""
    rng = np.random.default_rng([case.seed, 23])
    tracker = PersonTracker(sensors={"laser": SensorConfig(view=ScannerView())})
    found = Tracked([], [])
    step = rng.choice([-1.0, 1.0]) * 0.4 / _CAMERA_HZ
    for tick in range(round((_RANGED_S + _LOST_S) * _CAMERA_HZ)):
        now_s = tick / _CAMERA_HZ
        x_m, y_m = case.place_m
        place = np.array([x_m, y_m + step * tick])
        moving = replace(case, place_m=(x_m, float(place[1])), seed=case.seed * 1000 + tick)
        one = far.observed(moving, "none")
        seen = [] if one is None else [replace(one[0], stamp_s=now_s)]
        tracks = tracker.update(seen, now_s, T_ODOM_CAMERA)
        if one is not None:
            place = (T_ODOM_CAMERA[:3, :3] @ one[1])[:2] + T_ODOM_CAMERA[:2, 3]
        if scanner and now_s < _RANGED_S:
            legs = PersonObservation(
                stamp_s=now_s,
                position_camera_m=[*(place + rng.normal(0.0, _LASER_STD_M, 2)), 0.2],
                position_covariance_m2=_LASER_STD_M**2 * np.eye(3),
                gaze_camera=None,
                awareness=None,
                awareness_std=None,
                score=0.9,
            )
            tracks = tracker.update([legs], now_s, np.eye(4), sensor="laser")
        kept = found.ranged if now_s < _RANGED_S else found.lost
        if now_s % _RANGED_S < 1.0 or not tracks:
            continue
        track = min(tracks, key=lambda each: float(np.hypot(*(each.position_odom_m - place))))
        error, spread = track.position_odom_m - place, track.covariance_odom[:2, :2]
        range_m = float(np.hypot(*track.position_odom_m))
        kept.append(
            Result(
                range_m / float(np.hypot(*place)) - 1.0,
                float(error @ np.linalg.solve(spread, error)),
                math.sqrt(track.position_odom_m @ spread @ track.position_odom_m) / range_m**2,
            )
        )
    return found
