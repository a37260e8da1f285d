"""The live state behind one track: where the person is, and what is believed of their awareness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from filterpy.kalman import KalmanFilter

from perception.arrays import FloatArray

from . import _awareness_filter as awareness_filter
from ._config import TrackerConfig
from ._motion import process_noise, transition
from ._track import PersonTrack, TrackStatus

_H = np.eye(2, 4)


class PersonFilter:
    """One person: a filterpy Kalman filter, an awareness belief and the stamps of their life.

    The tracker owns these and drives them in step; the world sees frozen
    :class:`~tracking.PersonTrack` snapshots only. Input is trusted here.

    Attributes:
        id: the track's id.
        last_seen_s: stamp of the latest frame that showed this person.
        is_confirmed: whether enough frames have shown them.
    """

    __slots__ = (
        "_belief",
        "_config",
        "_evidence_stamp_s",
        "_hits",
        "_kalman",
        "id",
        "is_confirmed",
        "last_seen_s",
    )

    def __init__(
        self,
        track_id: int,
        stamp_s: float,
        position_odom_m: FloatArray,
        noise_m2: FloatArray,
        config: TrackerConfig,
    ) -> None:
        kalman = KalmanFilter(dim_x=4, dim_z=2)
        kalman.x = np.concatenate((position_odom_m, (0.0, 0.0)))
        kalman.P = np.zeros((4, 4))
        kalman.P[:2, :2] = noise_m2
        kalman.P[2, 2] = kalman.P[3, 3] = config.initial_velocity_std_mps**2
        kalman.H = _H
        kalman.inv = _inverse_2x2
        self._kalman = kalman
        self._config = config
        self._belief = awareness_filter.prior(config.awareness)
        self._evidence_stamp_s: float | None = None
        self._hits = 1
        self.id = track_id
        self.last_seen_s = stamp_s
        self.is_confirmed = config.confirm_hits <= 1

    @property
    def position_odom_m(self) -> FloatArray:
        """(2,) at the stamp that the filter stands at."""
        return np.asarray(self._kalman.x[:2])

    @property
    def position_covariance_m2(self) -> FloatArray:
        """(2, 2) of :attr:`position_odom_m`."""
        return np.asarray(self._kalman.P[:2, :2])

    def has_expired(self, stamp_s: float) -> bool:
        """Say whether the person has been out of sight for too long at ``stamp_s``."""
        config = self._config
        limit_s = config.max_coast_s if self.is_confirmed else config.max_tentative_gap_s
        return stamp_s - self.last_seen_s > limit_s

    def move(self, F: FloatArray, Q: FloatArray) -> None:
        """Carry position and velocity over one step of time."""
        self._kalman.predict(F=F, Q=Q)

    def see(self, stamp_s: float, position_odom_m: FloatArray, noise_m2: FloatArray) -> None:
        """Take a measured position at the stamp that the filter stands at."""
        kalman = self._kalman
        kalman.update(position_odom_m, R=noise_m2)
        # filterpy updates in Joseph form, which keeps P positive definite; rounding leaves it
        # asymmetric in the last digit.
        kalman.P = 0.5 * (kalman.P + kalman.P.T)
        if stamp_s > self.last_seen_s:
            # A second set of measurements of one instant is no second sighting.
            self.last_seen_s = stamp_s
            self._hits += 1
            self.is_confirmed = self.is_confirmed or self._hits >= self._config.confirm_hits

    def attend(
        self,
        previous_stamp_s: float,
        stamp_s: float,
        interval_s: float,
        evidence: tuple[float, float] | None,
    ) -> None:
        """Take what a frame that shows this person says about their awareness.

        Args:
            previous_stamp_s: where the belief stands.
            stamp_s: of the frame.
            interval_s: time that the frame stands for.
            evidence: mean and variance of logit(α), or None without a usable face.
        """
        config = self._config.awareness
        dt_s = stamp_s - previous_stamp_s
        if evidence is None:
            time_constant_s = config.no_face_time_constant_s
        elif self._evidence_stamp_s == previous_stamp_s and dt_s <= config.max_evidence_gap_s:
            time_constant_s = config.evidence_time_constant_s
        else:
            time_constant_s = config.unseen_time_constant_s
        belief = awareness_filter.drift(self._belief, dt_s, time_constant_s, config)
        if evidence is not None:
            measured = awareness_filter.measure(belief, *evidence, interval_s, config)
            if not self.is_confirmed:
                # Nothing that a possible ghost shows may shrink an obstacle, now or later.
                measured = replace(measured, bound=belief.bound)
            if self._evidence_stamp_s != stamp_s or measured.bound < belief.bound:
                # A second opinion of one instant adds no time: it may only lower the bound.
                belief = measured
            self._evidence_stamp_s = stamp_s
        self._belief = belief

    def lose_attention(self, dt_s: float) -> None:
        """Let the belief fall over a step of time in which nothing showed this person."""
        config = self._config.awareness
        self._belief = awareness_filter.drift(
            self._belief, dt_s, config.unseen_time_constant_s, config
        )

    def forget_attention(self, dt_s: float) -> None:
        """Go back to the prior after a step of time: whose awareness it was is in doubt."""
        self.lose_attention(dt_s)
        self._belief = awareness_filter.forget(self._belief, self._config.awareness)
        self._evidence_stamp_s = None

    def snapshot(self, filter_stamp_s: float, stamp_s: float) -> PersonTrack:
        """Return the track at ``stamp_s``, not before ``filter_stamp_s`` where the filter stands.

        The filter itself stays as it is; the time in between counts as unseen.
        """
        config = self._config
        mean, covariance, belief = self._kalman.x, self._kalman.P, self._belief
        dt_s = stamp_s - filter_stamp_s
        if dt_s > 0.0:
            F = transition(dt_s)
            mean = F @ mean
            covariance = F @ covariance @ F.T + process_noise(
                dt_s, config.acceleration_density_m2ps3
            )
            belief = awareness_filter.drift(
                belief, dt_s, config.awareness.unseen_time_constant_s, config.awareness
            )
        status: TrackStatus = "tentative"
        if self.is_confirmed:
            status = "confirmed" if self.last_seen_s == filter_stamp_s else "coasting"
        estimate = awareness_filter.estimate(belief)
        return PersonTrack(
            id=self.id,
            stamp_s=stamp_s,
            status=status,
            position_odom_m=mean[:2],
            velocity_odom_mps=mean[2:],
            covariance_odom=covariance,
            awareness=estimate.awareness,
            awareness_std=estimate.awareness_std,
            awareness_lower=estimate.awareness_lower,
            height_m=config.stature_m,
            time_since_seen_s=stamp_s - self.last_seen_s,
        )


def _inverse_2x2(matrix: FloatArray) -> FloatArray:
    """Invert the innovation covariance in closed form, a quarter of a general solver's time."""
    (a, b), (c, d) = matrix.tolist()
    scale = 1.0 / (a * d - b * c)
    return np.array(((d * scale, -b * scale), (-c * scale, a * scale)))
