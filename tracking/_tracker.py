"""The tracker: person observations of one frame after another become tracks in the odom frame."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.stats import chi2

from perception import PersonObservation
from perception.arrays import FloatArray, finite_number, rigid_transform

from ._association import Gates, Match, associate
from ._config import TrackerConfig
from ._errors import TrackingError
from ._measurement import Measurement, measurement_of
from ._motion import process_noise, transition
from ._person_filter import PersonFilter
from ._track import PersonTrack


class PersonTracker:
    """Follow people through frames that come at any rate from a camera that moves.

    Each person is a constant-velocity Kalman filter on the floor plane (odom x and y) and a filter
    of awareness in logit(α). A person is tentative until ``confirm_hits`` frames have shown them,
    coasting while the latest frame does not, and dropped after ``max_coast_s`` out of sight. Ids
    are never used again. Tentative tracks are returned too, with ``awareness_lower`` 0: navigation
    must reckon with a person who may not be there, as with one who has not seen the robot.

    A refused input raises :class:`~tracking.TrackingError` and leaves the tracker as it was.
    """

    def __init__(self, config: TrackerConfig | None = None) -> None:
        if config is None:
            config = TrackerConfig()
        if not isinstance(config, TrackerConfig):
            raise TrackingError(f"config must be a TrackerConfig, got {type(config).__name__}")
        self._config = config
        self._gates = Gates(
            mahalanobis2=float(chi2.ppf(config.gate_probability, df=2)),
            distance_m=config.gate_distance_m,
            ambiguity_margin=config.ambiguity_margin,
            ambiguity_distance_m=config.ambiguity_distance_m,
        )
        # All that a frame changes is below; every filter stands at _stamp_s.
        self._people: list[PersonFilter] = []
        self._next_id = 1
        self._stamp_s: float | None = None
        self._interval_s = math.inf

    @property
    def config(self) -> TrackerConfig:
        """The settings."""
        return self._config

    @property
    def last_stamp_s(self) -> float | None:
        """Stamp of the latest frame, or None before the first.

        No tracks may mean that nobody is there or that the camera has stopped; this tells which.
        """
        return self._stamp_s

    def update(
        self,
        observations: Iterable[PersonObservation],
        stamp_s: float,
        T_odom_camera: Any,
    ) -> tuple[PersonTrack, ...]:
        """Take one frame and return every track at its stamp, in the order of their ids.

        Args:
            observations: of this frame; none when it shows nobody.
            stamp_s: time of the frame. Not before the last one; the same stamp again is a second
                set of measurements of that instant.
            T_odom_camera: (4, 4) where the camera was at ``stamp_s``.

        Raises:
            TrackingError: for a stamp that is not finite, lies before the last frame's or differs
                from that of an observation by more than ``stamp_tolerance_s``, for a
                ``T_odom_camera`` that is no rigid transform, and for anything in ``observations``
                that is no :class:`~perception.PersonObservation` or lies out of this world.
        """
        stamp = self._checked_stamp(stamp_s, "update")
        T = rigid_transform("T_odom_camera", T_odom_camera, TrackingError)
        measurements = self._measurements(observations, stamp, T)

        previous = stamp if self._stamp_s is None else self._stamp_s
        dt_s = stamp - previous
        if dt_s > 0.0:
            self._interval_s = dt_s
        self._stamp_s = stamp
        self._move(stamp, dt_s)

        people = self._people
        taken: set[int] = set()
        seen: set[int] = set()
        for match in self._associate(measurements):
            person, measurement = people[match.track], measurements[match.measurement]
            person.see(stamp, measurement.position_odom_m, measurement.noise_m2)
            if match.ambiguous:
                person.forget_attention(dt_s)
            else:
                person.attend(previous, stamp, self._interval_s, measurement.evidence)
            seen.add(match.track)
            taken.add(match.measurement)
        for index, person in enumerate(people):
            if index not in seen:
                person.lose_attention(dt_s)
        self._people = [
            person
            for index, person in enumerate(people)
            if index in seen or not person.has_expired(stamp)
        ]
        for index, measurement in enumerate(measurements):
            if index not in taken:
                self._begin(stamp, measurement)
        return tuple(person.snapshot(stamp, stamp) for person in self._people)

    def predict(self, stamp_s: float) -> tuple[PersonTrack, ...]:
        """Return the tracks at a later (or the same) instant; the tracker stays as it was.

        They are what :meth:`update` would return for a frame at ``stamp_s`` that shows nobody, save
        that a person whom the latest frame showed is still called confirmed: position uncertainty
        grows, awareness falls, and a track whose time is up is absent.

        Raises:
            TrackingError: for a stamp that is not finite or lies before the last frame's.
        """
        stamp = self._checked_stamp(stamp_s, "predict")
        if self._stamp_s is None:
            return ()
        return tuple(
            person.snapshot(self._stamp_s, stamp)
            for person in self._people
            if not person.has_expired(stamp)
        )

    def _checked_stamp(self, stamp_s: float, action: str) -> float:
        stamp = finite_number("stamp_s", stamp_s, TrackingError)
        if self._stamp_s is not None and stamp < self._stamp_s:
            raise TrackingError(
                f"cannot {action} at stamp_s = {stamp!r} s: the last frame was at "
                f"{self._stamp_s!r} s, and stamps must not go back"
            )
        return stamp

    def _measurements(
        self, observations: Iterable[PersonObservation], stamp_s: float, T: FloatArray
    ) -> list[Measurement]:
        """Check every observation and carry it to the odom frame."""
        try:
            given = tuple(observations)
        except TypeError as cause:
            raise TrackingError(
                "observations must be an iterable of PersonObservation, got "
                f"{type(observations).__name__}"
            ) from cause
        return [
            measurement_of(observation, f"observations[{index}]", stamp_s, T, self._config)
            for index, observation in enumerate(given)
        ]

    def _move(self, stamp_s: float, dt_s: float) -> None:
        """Drop who cannot be found again and carry the others to the frame's stamp."""
        if dt_s <= 0.0:
            return
        # A tentative track gets its chance in this frame, however long the frame took.
        limit_s = self._config.max_coast_s
        self._people = [p for p in self._people if stamp_s - p.last_seen_s <= limit_s]
        F, Q = transition(dt_s), process_noise(dt_s, self._config.acceleration_density_m2ps3)
        for person in self._people:
            person.move(F, Q)

    def _associate(self, measurements: list[Measurement]) -> tuple[Match, ...]:
        if not self._people or not measurements:
            return ()
        return associate(
            np.array([person.position_odom_m for person in self._people]),
            np.array([person.position_covariance_m2 for person in self._people]),
            np.array([person.is_confirmed for person in self._people]),
            np.array([measurement.position_odom_m for measurement in measurements]),
            np.array([measurement.noise_m2 for measurement in measurements]),
            self._gates,
        )

    def _begin(self, stamp_s: float, measurement: Measurement) -> None:
        """Start a track at an unclaimed measurement."""
        person = PersonFilter(
            self._next_id,
            stamp_s,
            measurement.position_odom_m,
            measurement.noise_m2,
            self._config,
        )
        person.attend(stamp_s, stamp_s, self._interval_s, measurement.evidence)
        self._people.append(person)
        self._next_id += 1
