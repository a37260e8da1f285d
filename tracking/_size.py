"""The size of a person, which is wrong in the same way in every image of them.

A camera infers a range from the size that people are assumed to have. The error of a child is the
same in every frame, so that no number of frames averages it out: the filter has the other errors,
and each track has its lasting one beside it, as a share of the range (a consider parameter, as in
Schmidt's filter). It is added to what is reported.

What a scanner, a depth image or feet on the floor say of the size holds for the track. Later images
of the same person that show the size alone are placed with it.
"""

from __future__ import annotations

import math
from typing import Final

from ._frame import Measurement, Spread, outer
from ._person import Track

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
        range_m = max(math.hypot(east, north), 1e-9)
        own = track.spread_m2.along(east / range_m, north / range_m)
        other = noise_m2.along(east / range_m, north / range_m)
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
        length_m = max(math.hypot(east, north), 1e-9)
        range_m = max(length_m, _LEAST_RANGE_M)
        placed_m = max(math.hypot(given.x - origin_m[0], given.y - origin_m[1]), _LEAST_RANGE_M)
        value += math.log(placed_m / range_m)
        own += track.spread_m2.along(east / length_m, north / length_m) / range_m**2
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
