"""Ranges that follow from the size that people are assumed to have, beside measured ones.

A camera infers the range of a person from an assumed size. It puts a child or somebody seated up to
1.7 times too far away, along the ray on which it sees them. Three things follow.

**The error lasts.** It is the same in every frame, so that no number of frames averages it out: the
filter has the other errors, and each track has its lasting one beside it, as a share of the range
(a consider parameter, as in Schmidt's filter). It is added to what is reported.

**A size, once known, is kept.** What a scanner, a depth image or feet on the floor say of the size
holds for the track. Later images of the same person that show the size alone are placed with it.

**A measured range counts.** A scanner's measurement on the same ray is the same person, if it is no
further away. People of the assumed size are more frequent, so a match by the ray alone costs more
than a match by the place (a mixture of two Gaussians, of which the likelier counts). Two tracks
that a sensor each has for long, on one ray, are one person too: the one with the assumed range is
deleted.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ._frame import Measurement, Spread, outer
from ._person import Track
from ._sensors import longest_period_s
from ._state import Step, absence_s, seen_within

# Lasting error of a size against a measured range: a scanner sees legs, and limbs are not in
# proportion.
_RANGED_STD: Final = 0.03
# Added where the match is by the ray alone, which may be the image of somebody else: it takes half
# a dozen frames to be believed.
_BY_RAY_STD: Final = 0.2
# A track's size counts once its standard deviation is below this share of what the measurement has.
_KNOWN_SHARE: Final = 0.5
# The ray of somebody nearer than this is not well known.
_LEAST_RANGE_M: Final = 0.1
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
# Standard deviation of a range that follows from a size, as a share of the measured range: children
# and people who sit are put up to 1.7 times too far away.
_ERROR_SHARE: Final = 0.35
# Variance, per axis, of the velocity of somebody whose range was as wrong.
_VELOCITY_VARIANCE: Final = (_ERROR_SHARE * 1.6) ** 2

Place = tuple[float, float]


class Taken:
    """A measurement as one track takes it, with what is known of the person's size.

    Attributes:
        given: the measurement.
        x: in odom, with the range corrected by the size of the track.
        y: in odom.
        noise_m2: of x and y.
        lasting_variance: lasting relative variance of the range that remains.
        differing_m2: to be added to the covariance of the difference between track and
            measurement: the lasting errors of both are one error, as far as both have it.
    """

    __slots__ = ("differing_m2", "given", "lasting_variance", "noise_m2", "x", "y")

    def __init__(self, track: Track, given: Measurement, origin_m: Place | None) -> None:
        self.given, self.x, self.y, self.noise_m2 = given, given.x, given.y, given.noise_m2
        self.lasting_variance = given.lasting_std * given.lasting_std
        self.differing_m2: Spread | None = None
        if origin_m is None or not (given.lasting_std or track.lasting_std):
            return
        east, north = given.x - origin_m[0], given.y - origin_m[1]
        if knows_size(track, self.lasting_variance) and given.size_log is not None:
            scale = math.exp(given.size_log - track.size_log)
            self.lasting_variance = track.size_variance
            east, north = east * scale, north * scale
            self.x, self.y = origin_m[0] + east, origin_m[1] + north
            self.noise_m2 = given.noise_m2.times(scale * scale)
        # The lasting error of the better of the two is common to both.
        differing = abs(track.lasting_std * track.lasting_std - self.lasting_variance)
        self.differing_m2 = outer(east, north, differing)

    def spread_m2(self, track: Track) -> Spread:
        """Return the covariance of the difference between the track and this."""
        spread = track.spread_m2.plus(self.noise_m2)
        return spread if self.differing_m2 is None else spread.plus(self.differing_m2)

    def without_lasting(self, track: Track, origin_m: Place, velocity_mps: Place) -> None:
        """Let the track or this yield to the other: whichever has the larger lasting error."""
        if self.differing_m2 is None:
            return
        worse = track.lasting_std * track.lasting_std - self.lasting_variance
        if worse > 0.0:
            track.widen(lever(track, origin_m, velocity_mps), worse)
        elif worse < 0.0:
            self.noise_m2 = self.noise_m2.plus(self.differing_m2)

    def pass_lasting(self, track: Track, noise_m2: Spread, origin_m: Place) -> None:
        """Change the lasting error of a track that is about to be corrected with this.

        It goes over to that of the measurement by as much as the range does, given the noise with
        which the measurement counts.
        """
        if self.differing_m2 is None:
            return
        east, north = track.x - origin_m[0], track.y - origin_m[1]
        own, other = track.spread_m2.along(east, north), noise_m2.along(east, north)
        gain = own / (own + other)
        track.lasting_std += gain * (math.sqrt(self.lasting_variance) - track.lasting_std)


def knows_size(track: Track, lasting_variance: float) -> bool:
    """Return whether the size of a track is known better than a measurement has it."""
    return track.size_variance < _KNOWN_SHARE * _KNOWN_SHARE * lasting_variance


def lever(track: Track, origin_m: Place, velocity_mps: Place) -> tuple[float, float, float, float]:
    """Return by how much x, y, vx, vy move per share of the range.

    A range that is wrong by a share scales place and velocity relative to the sensor by it.
    """
    return (
        track.x - origin_m[0],
        track.y - origin_m[1],
        track.vx - velocity_mps[0],
        track.vy - velocity_mps[1],
    )


def learn_size(
    track: Track, given: Measurement, *, by_ray: bool, ranged: bool, origin_m: Place
) -> None:
    """Take what a frame of a sensor without measured ranges says of a person's size.

    A size counts by Kalman's equation, and never for more than its lasting error allows.

    Args:
        track: after the frame, which surely shows it.
        given: the measurement, as the sensor gives it.
        by_ray: whether the match is by the ray alone.
        ranged: whether the person's range was measured lately.
        origin_m: of the sensor.
    """
    if given.size_log is None:
        return
    value, lasting = given.size_log, given.lasting_std * given.lasting_std
    own = given.size_variance + (_BY_RAY_STD**2 if by_ray else 0.0)
    if ranged and lasting > _RANGED_STD**2:
        east, north = track.x - origin_m[0], track.y - origin_m[1]
        range_m = max(math.hypot(east, north), _LEAST_RANGE_M)
        placed_m = max(math.hypot(given.x - origin_m[0], given.y - origin_m[1]), _LEAST_RANGE_M)
        value += math.log(placed_m / range_m)
        own += track.spread_m2.along(east, north) / range_m**2
        lasting = _RANGED_STD**2
    before = track.size_variance
    if lasting >= before:
        return
    if before == math.inf:
        track.size_log, after = value, own + lasting
    else:
        gain = before / (before + own + lasting)
        track.size_log += gain * (value - track.size_log)
        after = (1.0 - gain) * before
    track.size_variance = max(after, lasting)


def forget_size(track: Track) -> None:
    """Forget the size of a track that may have become another person's."""
    track.size_log, track.size_variance = 0.0, math.inf


class Ray:
    """The ray on which a sensor without measured ranges sees a track.

    Args:
        track: as predicted to the frame.
        origin_m: of that sensor.
        measures: whether the frame's own sensor measures ranges.

    Attributes:
        measures: as given.
        extra_m2: added to the covariance of the place, along the ray.
    """

    __slots__ = ("_east", "_north", "_origin_m", "_range_m", "_track", "extra_m2", "measures")

    def __init__(self, track: Track, origin_m: Place, measures: bool) -> None:
        self._track, self._origin_m, self.measures = track, origin_m, measures
        self._east, self._north = track.x - origin_m[0], track.y - origin_m[1]
        self._range_m = math.hypot(self._east, self._north)
        share = _ERROR_SHARE / (1.0 + _ERROR_SHARE) if measures else _ERROR_SHARE
        self.extra_m2 = outer(self._east, self._north, share * share)

    def allows(self, measured: Measurement) -> bool:
        """Return whether a measurement may be the same person, whose range disagrees."""
        x, y, range_m = self._east, self._north, self._range_m
        along_m = (measured.x - self._origin_m[0]) * x + (measured.y - self._origin_m[1]) * y
        if range_m == 0.0:
            return False
        true_m, assumed_m = range_m, along_m / range_m
        if self.measures:
            true_m, assumed_m = assumed_m, range_m
        variance_m2 = self._track.spread_m2.along(x, y) + measured.noise_m2.along(x, y)
        noise_m = _SIGMAS * math.sqrt(max(variance_m2, 0.0))
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
        track.p22 += _VELOCITY_VARIANCE
        track.p33 += _VELOCITY_VARIANCE
        return noise_m2


def rays(tracks: list[Track], step: Step) -> list[Ray | None]:
    """Return the ray by which each track, predicted to a frame, may match it; None for none.

    These are the tracks with a measured range for a sensor without one, and the tracks that only
    such a sensor has seen lately for a sensor that measures it.
    """
    sensors, origin, stamp = step.sensors, step.state.origin_m, step.frame.stamp_s
    if not sensors.mixed or origin is None:
        return [None] * len(tracks)
    measures = step.sensor.settings.measures_range
    within_s = absence_s(longest_period_s(step.state.clocks, sensors.sizing))

    def may_match(track: Track) -> bool:
        ranged = seen_within(track, sensors.ranging, stamp, RANGED_S)
        if not measures:
            return ranged
        return not ranged and seen_within(track, sensors.sizing, stamp, within_s)

    return [Ray(one, origin, measures) if may_match(one) else None for one in tracks]


def put_too_far(tracks: list[Track], step: Step) -> set[int]:
    """Return the ids of tracks with an assumed range whose person has another track.

    The frame shows them, and no scan has for a second. On their ray, nearer or as near, the scanner
    sees somebody whom no image has shown for a second, although they are in view. The camera would
    show the nearer one of two people. What is kept is the nearer place.

    Only a frame of a sensor without measured ranges finds any; ``tracks`` are those after it.
    """
    frame, sensor, sensors = step.frame, step.sensor, step.sensors
    stamp = frame.stamp_s
    if not sensors.mixed or sensor.settings.measures_range:
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


def _on_one_ray(far: Track, near: Track, origin_m: Place) -> bool:
    """Return whether two tracks may be one person, put further away in one of them."""
    far_x, far_y = far.x - origin_m[0], far.y - origin_m[1]
    near_x, near_y = near.x - origin_m[0], near.y - origin_m[1]
    far_m, near_m = math.hypot(far_x, far_y), math.hypot(near_x, near_y)
    if abs(far_x * near_y - far_y * near_x) > _SAME_RAY_M * far_m:
        return False
    ahead = far_x * near_x + far_y * near_y > 0.0
    return ahead and near_m <= far_m <= _MOST_RATIO * near_m + _SLACK_M
