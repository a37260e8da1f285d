"""Predicted places of people, with a covariance that holds up to two seconds ahead.

The mean keeps the velocity of the track. The covariance has two parts. The first is the track's
own, predicted with that velocity. A filter that has to average over long times lags behind people
who turn, and does not know it: the part is multiplied by 1 + ``lag_per_s2`` M², where M² is the
ratio of its variances of position and velocity, and M the time over which the filter averages.

The second is motion that nobody can foresee. The velocity approaches another one with the time
constant τ, so that after t seconds the place has moved by the change of velocity times

    r(t) = t − τ (1 − exp(−t/τ)),   that is t²/2τ soon after, and t − τ later.

Slow people change more: they stop, turn round or set off. An envelope bounds this part: people
accelerate no harder and become no faster than the model says, so nothing is predicted beyond.

The numbers were fitted to recorded and simulated people; ``docs/tracking.md`` has the table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, cast

import numpy as np
from pydantic import Field, model_validator

from perception.arrays import FloatArray, finite_array

from ._errors import TrackingError
from ._snapshot import PersonTrack
from .config import StrictConfig
from .covariances import Upper, drifted

#: Regions are ellipses of this many standard deviations.
REGION_SIGMAS: Final = 2.0
#: Share of a normal distribution on the plane inside such a region: 1 − exp(−2).
REGION_SHARE: Final = 1.0 - math.exp(-0.5 * REGION_SIGMAS**2)
# A slower person has no walking direction.
_NO_DIRECTION_MPS: Final = 1e-6
# The track's own covariance grows by at most this share.
_MOST_LAG: Final = 1.0
# It has grown soon after the present, at which it is that of the track.
_LAG_SHOWS_S: Final = 0.05
# A velocity with a smaller variance is known, and does not lag.
_LEAST_VARIANCE: Final = 1e-9


class PredictionModel(StrictConfig):
    """Settings of the prediction; ``PredictionModel()`` is the fitted one.

    Attributes:
        lag_per_s2: growth of the track's own covariance with the square of the time over which its
            filter averages; the covariance is at most doubled.
        acceleration_density_m2ps3: q of the white acceleration in its prediction.
        response_s: τ, time constant with which people change their velocity.
        change_mps: standard deviation of that change, on each axis.
        slow_change_mps: the same of a person who stands, in addition; it falls with the speed v as
            exp(−(v/``slow_below_mps``)²).
        slow_below_mps: speed at which it has fallen by e.
        sway_s: bodies sway from side to side as they walk; the standard deviation across the
            walking direction is this times the speed.
        max_speed_mps: nobody becomes faster. People whose track is faster keep its speed at most.
        max_acceleration_mps2: nobody accelerates faster.
        horizons_s: of ``std_factors``, increasing, > 0.
        std_factors: factors on all standard deviations at these horizons, interpolated linearly in
            between and constant beyond, of ``awarenav tracks calibrate``. Empty: 1.
    """

    lag_per_s2: float = Field(default=1.5, ge=0.0, le=100.0)
    acceleration_density_m2ps3: float = Field(default=0.05, ge=0.0, le=10.0)
    response_s: float = Field(default=0.9, gt=0.0, le=10.0)
    change_mps: float = Field(default=0.02, ge=0.0, le=5.0)
    slow_change_mps: float = Field(default=0.57, ge=0.0, le=5.0)
    slow_below_mps: float = Field(default=1.3, gt=0.0, le=5.0)
    sway_s: float = Field(default=0.025, ge=0.0, le=1.0)
    max_speed_mps: float = Field(default=4.0, gt=0.0, le=15.0)
    max_acceleration_mps2: float = Field(default=4.5, gt=0.0, le=50.0)
    horizons_s: tuple[float, ...] = ()
    std_factors: tuple[float, ...] = ()

    @model_validator(mode="after")
    def _check_factors(self) -> PredictionModel:
        horizons, factors = self.horizons_s, self.std_factors
        if len(horizons) != len(factors):
            raise ValueError(
                f"horizons_s and std_factors must be equally long, got {len(horizons)} and "
                f"{len(factors)} values"
            )
        if any(b <= a for a, b in zip((0.0, *horizons), horizons, strict=False)):
            raise ValueError(f"horizons_s must increase from above 0 s, got {list(horizons)}")
        if not all(0.1 <= factor <= 10.0 for factor in factors):
            raise ValueError(f"std_factors must lie in [0.1, 10], got {list(factors)}")
        return self

    @classmethod
    def from_calibration(cls, path: str | Path) -> PredictionModel:
        """Read a whole file of ``awarenav tracks calibrate``, whose last keys are the factors.

        Raises:
            TrackingError: naming the file; it cannot be read, holds something else, or is not
                whole.
        """
        model = cls.from_yaml(path)
        missing = [
            key for key in ("horizons_s", "std_factors") if key not in model.model_fields_set
        ]
        if missing:
            raise TrackingError(
                f"{path} must be a whole file of `awarenav tracks calibrate`, but has no "
                f"{' and no '.join(missing)}"
            )
        return model

    def factors_at(self, times_s: FloatArray) -> FloatArray:
        """Return the factors (T,) on standard deviations at times (T,) in seconds."""
        if not self.horizons_s:
            return np.ones(len(times_s))
        return np.asarray(np.interp(times_s, self.horizons_s, self.std_factors))

    def responses_s(self, times_s: FloatArray) -> FloatArray:
        """Return r (T,): the place moved after (T,) seconds, over the change of velocity."""
        tau = self.response_s
        share = times_s / tau
        # For short times the closed form loses digits: use its series.
        return np.asarray(
            np.where(
                share < 1e-3,
                0.5 * tau * share**2 * (1.0 - share / 3.0),
                times_s + tau * np.expm1(-share),
            )
        )


#: The fitted model.
FITTED: Final = PredictionModel()


class PredictedPlaces(NamedTuple):
    """Predicted positions as normal distributions in the odom frame.

    Attributes:
        means_odom_m: (N, T, 2) of N people at T times.
        covariances_odom_m2: (N, T, 2, 2) of those positions.
    """

    means_odom_m: FloatArray
    covariances_odom_m2: FloatArray


class Envelope(NamedTuple):
    """Places that people can reach from a known place with a known velocity.

    A place at time t lies in two discs: around the place of constant velocity, with radius a t²/2
    for the largest acceleration a, and around the present place, with radius v t for the largest
    speed v, or that of the track if it is faster. Both are outer bounds.

    Attributes:
        straight_odom_m: (N, T, 2) places of constant velocity.
        turned_m: (T,) radius around them.
        position_odom_m: (N, 2) present places.
        walked_m: (N, T) radius around them.
    """

    straight_odom_m: FloatArray
    turned_m: FloatArray
    position_odom_m: FloatArray
    walked_m: FloatArray

    @property
    def free_m(self) -> FloatArray:
        """(N, T) radius of the disc around the place of constant velocity inside both discs."""
        step = self.straight_odom_m - self.position_odom_m[:, None]
        left = self.walked_m - np.hypot(step[..., 0], step[..., 1])
        return np.asarray(np.clip(left, 0.0, self.turned_m))

    def contains(self, places_odom_m: FloatArray, *, slack_m: float = 0.0) -> Any:
        """Return (N, T) whether places (N, T, 2) are reachable, give or take ``slack_m``."""
        off = places_odom_m - self.straight_odom_m
        way = places_odom_m - self.position_odom_m[:, None]
        turns = np.hypot(off[..., 0], off[..., 1]) <= self.turned_m + slack_m
        return turns & (np.hypot(way[..., 0], way[..., 1]) <= self.walked_m + slack_m)


def predict_ahead(
    tracks: PersonTrack | Sequence[PersonTrack],
    horizons_s: Any,
    model: PredictionModel = FITTED,
) -> PredictedPlaces:
    """Return where tracked people will be, with the covariance.

    Args:
        tracks: one track, or N.
        horizons_s: (T,) seconds after the stamp of each track, ≥ 0.
        model: of the prediction.

    Raises:
        TrackingError: for horizons that are not finite or negative.
    """
    people = (tracks,) if isinstance(tracks, PersonTrack) else tuple(tracks)
    states = np.array([[*track.position_odom_m, *track.velocity_odom_mps] for track in people])
    covariances = np.array([track.covariance_odom for track in people])
    return predict_states(states.reshape(-1, 4), covariances.reshape(-1, 4, 4), horizons_s, model)


def predict_states(
    states: FloatArray, covariances: FloatArray, horizons_s: Any, model: PredictionModel = FITTED
) -> PredictedPlaces:
    """Return the same for N states (N, 4), x, y, vx, vy, with covariances (N, 4, 4).

    Raises:
        TrackingError: for horizons that are not finite or negative.
    """
    times = _checked(horizons_s)
    envelope = _envelope(states, times, model)
    free_m = envelope.free_m
    # The unforeseen part, along the walking direction and across it.
    velocities = states[:, 2:]
    speeds = np.hypot(velocities[:, 0], velocities[:, 1])
    slow_mps = model.slow_change_mps * np.exp(-np.square(speeds / model.slow_below_mps))
    grown = np.outer(model.change_mps**2 + slow_mps**2, np.square(model.responses_s(times)))
    grown = grown + model.acceleration_density_m2ps3 * times**3 / 3.0
    swaying = grown + np.square(model.sway_s * speeds)[:, None]
    factors2 = np.square(model.factors_at(times))
    most = np.square(free_m / REGION_SIGMAS)
    along, across = np.minimum(factors2 * grown, most), np.minimum(factors2 * swaying, most)
    moving = speeds > _NO_DIRECTION_MPS
    safe = np.where(moving, speeds, 1.0)[:, None]
    ahead = np.where(moving[:, None], velocities / safe, [1.0, 0.0])
    outer = (ahead[:, :, None] * ahead[:, None, :])[:, None]
    motion = (along - across)[..., None, None] * outer + across[..., None, None] * np.eye(2)
    # The part of the track itself.
    rows, columns = np.triu_indices(4)
    upper = cast(Upper[FloatArray], tuple(covariances[:, rows, columns].T[..., None]))
    xx, xy, _, _, yy, *_ = drifted(upper, times)
    known = np.stack((xx, xy, xy, yy), axis=-1).reshape(*xx.shape, 2, 2)
    lags = np.minimum(model.lag_per_s2 * _memories_s2(covariances), _MOST_LAG)
    lags = 1.0 + np.outer(lags, -np.expm1(-times / _LAG_SHOWS_S))
    scale = lags[..., None, None] * factors2[:, None, None]
    return PredictedPlaces(envelope.straight_odom_m, scale * known + motion)


def envelope_of(
    tracks: PersonTrack | Sequence[PersonTrack],
    horizons_s: Any,
    model: PredictionModel = FITTED,
) -> Envelope:
    """Return the places that N people can reach, if their present state is that of their track.

    Raises:
        TrackingError: for horizons that are not finite or negative.
    """
    people = (tracks,) if isinstance(tracks, PersonTrack) else tuple(tracks)
    states = np.array([[*track.position_odom_m, *track.velocity_odom_mps] for track in people])
    return _envelope(states.reshape(-1, 4), _checked(horizons_s), model)


def _memories_s2(covariances: FloatArray) -> FloatArray:
    """Return the squares (N,) of the times over which the filters average."""
    places_m2 = covariances[:, 0, 0] + covariances[:, 1, 1]
    velocities_m2ps2 = covariances[:, 2, 2] + covariances[:, 3, 3]
    known = velocities_m2ps2 < _LEAST_VARIANCE
    return np.asarray(np.where(known, 0.0, places_m2 / np.where(known, 1.0, velocities_m2ps2)))


def _envelope(states: FloatArray, times: FloatArray, model: PredictionModel) -> Envelope:
    speeds = np.hypot(states[:, 2], states[:, 3])
    return Envelope(
        states[:, None, :2] + times[:, None] * states[:, None, 2:],
        0.5 * model.max_acceleration_mps2 * times**2,
        states[:, :2],
        np.maximum(speeds, model.max_speed_mps)[:, None] * times,
    )


def _checked(horizons_s: Any) -> FloatArray:
    times = finite_array("horizons_s", horizons_s, ("T",), TrackingError)
    if bool((times < 0.0).any()):
        raise TrackingError(f"horizons_s must not be negative, got {times.min():g} s")
    return times
