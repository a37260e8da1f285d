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

from ._frame import Measurement, Spread, outer
from ._person import Track
from ._sensors import longest_period_s
from ._state import Step, absence_s, seen_within

#: A track keeps the range that was measured for this long.
RANGED_S: Final = 1.0
#: Price of a match by the ray alone, 2 ln(0.9 / 0.1): one person in ten has another size.
PRICE: Final = 2.0 * math.log(9.0)
# How much further away than measured a person may be put, and how much nearer: tall people.
_MOST_RATIO: Final = 1.8
_MOST_NEARER_SHARE: Final = 0.15
_SLACK_M: Final = 0.3
_SIGMAS: Final = 3.0
# Two tracks of one person: each unseen by the other's sensor for this long, and as near in bearing.
_APART_S: Final = 1.0
_SAME_RAY_M: Final = 0.3
_IN_VIEW: Final = 0.5
# Standard deviation, per axis and per share of the range, of the velocity that a wrong range gives.
_VELOCITY_MPS: Final = 1.6


class Ray:
    """The ray on which a sensor without measured ranges sees a track.

    Attributes:
        extra_m2: added to the covariance of the place, along the ray.
        velocity_variance: added to that of the velocity, which was scaled as well.
    """

    __slots__ = (
        "_at",
        "_range_m",
        "_track",
        "_x",
        "_y",
        "extra_m2",
        "measures",
        "velocity_variance",
    )

    def __init__(
        self, track: Track, origin_m: tuple[float, float], share: float, measures: bool
    ) -> None:
        east, north = track.x - origin_m[0], track.y - origin_m[1]
        self._range_m = math.hypot(east, north)
        self._x, self._y = east / max(self._range_m, 1e-9), north / max(self._range_m, 1e-9)
        self._track, self._at, self.measures = track, origin_m, measures
        std_m = share * (self._range_m / (1.0 + share) if measures else self._range_m)
        self.extra_m2 = outer(self._x, self._y, std_m * std_m)
        self.velocity_variance = (share * _VELOCITY_MPS) ** 2 if measures else 0.0

    def allows(self, measured: Measurement) -> bool:
        """Return whether a measurement may be the same person, whose range disagrees."""
        spread = self._track.spread_m2.plus(measured.noise_m2)
        along_m = (measured.x - self._at[0]) * self._x + (measured.y - self._at[1]) * self._y
        true_m, assumed_m = self._range_m, along_m
        if self.measures:
            true_m, assumed_m = along_m, self._range_m
        noise_m = _SIGMAS * math.sqrt(max(spread.along(self._x, self._y), 0.0))
        least_m = true_m - max(_SLACK_M, _MOST_NEARER_SHARE * true_m)
        return true_m > 0.0 and least_m - noise_m <= assumed_m <= _MOST_RATIO * true_m + noise_m

    def without_assumed_range(self, noise_m2: Spread) -> Spread:
        """Return the noise of a match, after the range of one of the two has left it to the other.

        Whichever of track and measurement has a range that follows from an assumed size yields.
        """
        if not self.measures:
            return noise_m2.plus(self.extra_m2)
        track, extra = self._track, self.extra_m2
        track.p00 += extra.xx
        track.p01 += extra.xy
        track.p11 += extra.yy
        track.p22 += self.velocity_variance
        track.p33 += self.velocity_variance
        return noise_m2


def rays(tracks: list[Track], step: Step) -> list[Ray | None]:
    """Return the ray by which each track, predicted to a frame, may match it; None for none.

    These are the tracks with a measured range for a sensor without one, and the tracks that only
    such a sensor has seen lately for a sensor that measures it.
    """
    sensors, origin, stamp = step.sensors, step.state.origin_m, step.frame.stamp_s
    share = sensors.config.size_error_share
    if not sensors.mixed or share <= 0.0 or origin is None:
        return [None] * len(tracks)
    measures = step.sensor.settings.measures_range
    within_s = absence_s(longest_period_s(step.state.clocks, sensors.sizing))

    def may_match(track: Track) -> bool:
        ranged = seen_within(track, sensors.ranging, stamp, RANGED_S)
        if not measures:
            return ranged
        return not ranged and seen_within(track, sensors.sizing, stamp, within_s)

    return [Ray(one, origin, share, measures) if may_match(one) else None for one in tracks]


def put_too_far(tracks: list[Track], step: Step) -> set[int]:
    """Return the ids of tracks with an assumed range whose person has another track.

    The frame shows them, and no scan has for a second. On their ray, nearer or as near, the scanner
    sees somebody whom no image has shown for a second, although they are in view. The camera would
    show the nearer one of two people. What is kept is the nearer place.

    Only a frame of a sensor without measured ranges finds any; ``tracks`` are those after it.
    """
    frame, sensor, sensors = step.frame, step.sensor, step.sensors
    stamp = frame.stamp_s
    if not sensors.mixed or sensor.settings.measures_range or step.config.size_error_share <= 0.0:
        return set()
    old = [track for track in tracks if track.born_s <= stamp - _APART_S]
    assumed = [
        track
        for track in old
        if track.seen_s[sensor.index] == stamp
        and not seen_within(track, sensors.ranging, stamp, _APART_S)
    ]
    if not assumed:
        return set()
    within_s = absence_s(longest_period_s(step.state.clocks, sensors.ranging))
    measured = [
        track
        for track in old
        if track.confirmed
        and track.seen_s[sensor.index] != stamp
        and not seen_within(track, sensors.sizing, stamp, _APART_S)
        and seen_within(track, sensors.ranging, stamp, within_s)
    ]
    if measured and sensor.view is not None:
        places = np.array([(track.x, track.y) for track in measured])
        shown = sensor.view.visibility(places, frame.T_odom_camera).tolist()
        measured = [track for track, sees in zip(measured, shown, strict=True) if sees >= _IN_VIEW]
    return {
        far.id
        for far in assumed
        if any(_on_one_ray(far, near, step.place_m[:2]) for near in measured)
    }


def _on_one_ray(far: Track, near: Track, origin_m: tuple[float, float]) -> bool:
    """Return whether two tracks may be one person, put further away in one of them."""
    far_x, far_y = far.x - origin_m[0], far.y - origin_m[1]
    near_x, near_y = near.x - origin_m[0], near.y - origin_m[1]
    far_m, near_m = math.hypot(far_x, far_y), math.hypot(near_x, near_y)
    if abs(far_x * near_y - far_y * near_x) > _SAME_RAY_M * far_m:
        return False
    ahead = far_x * near_x + far_y * near_y > 0.0
    return ahead and near_m <= far_m <= _MOST_RATIO * near_m + _SLACK_M
