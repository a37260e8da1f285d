"""A range that is measured against a range that follows from an assumed size.

A camera infers the range of a person from the size that people are assumed to have. It puts a child
or somebody seated up to 1.7 times too far away, along the ray on which it sees them. A scanner
measures the range. Its measurement on the same ray is the same person, if it is no further away.

Two tracks that a sensor each has for long, on one ray, are one person too: the one with the assumed
range is deleted.

People of the assumed size are more frequent, so a match by the ray alone costs more than a match by
the place (a mixture of two Gaussians, of which the likelier counts).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ._association import Wide
from ._clocks import FrameClock
from ._exits import absence_s
from ._measurement import Frame, Measurements
from ._sensors import Sensor, Sensors, seen_lately
from ._table import BoolArray, TrackTable

#: A track keeps the range that was measured for this long.
RANGED_S: Final = 1.0
# How much further away than measured a person may be put, and how much nearer: tall people.
_MOST_RATIO: Final = 1.8
_MOST_NEARER_SHARE: Final = 0.15
_SLACK_M: Final = 0.3
_SIGMAS: Final = 3.0
# Price of a match by the ray alone, 2 ln(0.9 / 0.1): one person in ten has another size.
_PRICE: Final = 2.0 * math.log(9.0)
# Two tracks of one person: each unseen by the other's sensor for this long, and as near in bearing.
_APART_S: Final = 1.0
_SAME_RAY_M: Final = 0.3
_IN_VIEW: Final = 0.5
# Standard deviation, per axis and per share of the range, of the velocity that a wrong range gives.
_VELOCITY_MPS: Final = 1.6


def wide_match(
    tracks: TrackTable,
    measured: Measurements,
    origin_m: tuple[float, float] | None,
    sensor: Sensor,
    sensors: Sensors,
    clocks: tuple[FrameClock, ...],
    stamp_s: float,
) -> Wide | None:
    """Return which tracks a frame's measurements may match by the ray alone; None for none.

    These are the tracks with a measured range for a sensor without one, and the tracks that only
    such a sensor has seen lately for a sensor that measures it.

    Args:
        tracks: N tracks, predicted to the frame.
        measured: M measurements.
        origin_m: where the sensor without measured ranges stands, or stood last.
        sensor: of the frame.
        sensors: all of them.
        clocks: of all sensors, this frame included.
        stamp_s: of the frame.
    """
    share = sensors.config.size_error_share
    if not sensors.mixed or share <= 0.0 or origin_m is None:
        return None
    if not len(tracks) or not len(measured):
        return None
    rows = seen_lately(tracks, sensors.ranging, stamp_s, RANGED_S)
    measures = sensor.settings.measures_range
    if measures:
        within_s = max(absence_s(clock.period_s) for clock in _known(clocks, ~sensors.ranging))
        rows = ~rows & seen_lately(tracks, ~sensors.ranging, stamp_s, within_s)
    if not rows.any():
        return None
    offset = tracks.states[:, :2] - origin_m
    range_m = np.hypot(offset[:, 0], offset[:, 1])
    ray = offset / np.maximum(range_m, 1e-9)[:, None]
    std_m = share * (range_m / (1.0 + share) if measures else range_m)
    extra = np.zeros((len(tracks), 4, 4))
    along = ray[:, :, None] * ray[:, None, :]
    extra[:, :2, :2] = (std_m * std_m)[:, None, None] * along
    if measures:
        # The velocity was scaled as well.
        extra[:, 2, 2] = extra[:, 3, 3] = (share * _VELOCITY_MPS) ** 2
    extra[~rows] = 0.0
    spread = tracks.covariances[:, None, :2, :2] + measured.noises_m2[None]
    radial2 = (ray[:, None, None, :] @ spread @ ray[:, None, :, None])[:, :, 0, 0]
    along_m = ((measured.positions_odom_m - origin_m)[None] * ray[:, None]).sum(axis=-1)
    true_m, assumed_m = range_m[:, None], along_m
    if measures:
        true_m, assumed_m = along_m, range_m[:, None]
    least = true_m - np.maximum(_SLACK_M, _MOST_NEARER_SHARE * true_m)
    noise_m = _SIGMAS * np.sqrt(np.maximum(radial2, 0.0))
    near = (assumed_m >= least - noise_m) & (true_m > 0.0)
    near &= assumed_m <= _MOST_RATIO * true_m + noise_m
    return Wide(rows, extra, near & rows[:, None], _PRICE)


def duplicates(
    tracks: TrackTable,
    frame: Frame,
    clocks: tuple[FrameClock, ...],
    sensors: Sensors,
) -> BoolArray:
    """Return (N,) True for tracks with an assumed range whose person has another track.

    The frame shows them, and no scan has for a second. On their ray, nearer or as near, the scanner
    sees somebody whom no image has shown for a second, although they are in view. The camera would
    show the nearer one of two people. What is kept is the nearer place.

    Args:
        tracks: N tracks after the frame.
        frame: of any sensor; only one without measured ranges has duplicates.
        clocks: of all sensors, this frame included.
        sensors: all sensors.
    """
    none = np.zeros(len(tracks), dtype=np.bool_)
    sensor, stamp = sensors.all[frame.sensor], frame.stamp_s
    if not sensors.mixed or sensor.settings.measures_range:
        return none
    if sensors.config.size_error_share <= 0.0:
        return none
    seen = tracks.seen_stamps_s[:, sensor.index] == stamp
    old = tracks.birth_stamps_s <= stamp - _APART_S
    ranged = seen_lately(tracks, sensors.ranging, stamp, _APART_S)
    imaged = seen_lately(tracks, ~sensors.ranging, stamp, _APART_S)
    within_s = max(absence_s(clock.period_s) for clock in _known(clocks, sensors.ranging))
    assumed = np.flatnonzero(seen & old & ~ranged)
    measured = ~seen & old & ~imaged & tracks.confirmed
    measured &= seen_lately(tracks, sensors.ranging, stamp, within_s)
    others = np.flatnonzero(measured)
    if not assumed.size or not others.size:
        return none
    if sensor.view is not None:
        shown = sensor.view.visibility(tracks.states[others, :2], frame.T_odom_camera)
        others = others[shown >= _IN_VIEW]
    origin = frame.T_odom_camera[:2, 3]
    far, near = tracks.states[assumed, :2] - origin, tracks.states[others, :2] - origin
    far_m, near_m = np.hypot(*far.T)[:, None], np.hypot(*near.T)[None]
    apart = np.abs(far[:, None, 0] * near[None, :, 1] - far[:, None, 1] * near[None, :, 0])
    same = apart <= _SAME_RAY_M * far_m
    same &= far @ near.T > 0.0
    same &= (far_m >= near_m) & (far_m <= _MOST_RATIO * near_m + _SLACK_M)
    none[assumed[same.any(axis=1)]] = True
    return none


def _known(clocks: tuple[FrameClock, ...], which: BoolArray) -> list[FrameClock]:
    return [clock for clock, flag in zip(clocks, which.tolist(), strict=True) if flag]
