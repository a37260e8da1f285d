"""A tracker of an afternoon: one filterpy filter per person, and the Hungarian method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from filterpy.kalman import KalmanFilter
from scipy.optimize import linear_sum_assignment

from ._contender import MAX_UNSEEN_S
from ._judges import TrackedFrame
from ._measurements import SimulatedRecording


@dataclass(frozen=True, slots=True)
class NaiveSettings:
    """Settings, chosen on the tuning seeds like those of the other trackers.

    Attributes:
        gate_sigma: largest Mahalanobis distance between a measurement and its track.
        acceleration_density_m2ps3: of the white acceleration.
        velocity_std_mps: of a new track.
        confirm_hits: measurements that confirm a track.
        max_unseen_s: time after which an unseen track is dropped; a new one is dropped after one
            frame.
    """

    gate_sigma: float = 3.4
    acceleration_density_m2ps3: float = 0.05
    velocity_std_mps: float = 1.0
    confirm_hits: int = 4
    max_unseen_s: float = MAX_UNSEEN_S


class _Track:
    def __init__(self, number: int, kalman: KalmanFilter) -> None:
        self.number, self.kalman, self.hits, self.unseen = number, kalman, 1, 0


class Naive:
    """A tracker with constant velocity, the Mahalanobis distance and one gate."""

    name = "naive"

    def __init__(self, settings: NaiveSettings | None = None) -> None:
        self._settings = settings or NaiveSettings()
        self._tracks: list[_Track] = []
        self._next = 1
        self._recording: SimulatedRecording | None = None

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording."""
        self._tracks, self._next, self._recording = [], 1, recording
        dt, q = float(np.diff(recording.stamps_s).mean()), self._settings.acceleration_density_m2ps3
        self._dt_s = dt
        self._F = np.eye(4)
        self._F[0, 2] = self._F[1, 3] = dt
        block = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        self._Q = np.kron(block, np.eye(2))
        self._R = recording.noise_std_m**2 * np.eye(2)

    def make(self, frame: int) -> None:
        """Do nothing: the measurements are taken as they are, or were converted at the start."""

    def advance(self, frame: int) -> Any:
        """Take the next frame."""
        assert self._recording is not None
        settings, measured = self._settings, self._recording.measured_m[frame]
        for track in self._tracks:
            track.kalman.predict()
            track.unseen += 1
        free = list(range(len(measured)))
        for confirmed in (True, False):
            tracks = [t for t in self._tracks if (t.hits >= settings.confirm_hits) == confirmed]
            if tracks and free:
                self._match(tracks, measured, free)
        limit = round(settings.max_unseen_s / self._dt_s)
        self._tracks = [
            track
            for track in self._tracks
            if track.unseen <= (limit if track.hits >= settings.confirm_hits else 1)
        ]
        for column in free:
            self._tracks.append(_Track(self._next, self._filter(measured[column])))
            self._next += 1
        return [track for track in self._tracks if track.hits >= settings.confirm_hits]

    def report(self, result: Any) -> TrackedFrame:
        """Return the confirmed tracks."""
        return TrackedFrame(
            np.array([track.number for track in result], dtype=np.int64),
            np.array([track.kalman.x[:2] for track in result]).reshape(-1, 2),
        )

    def _match(self, tracks: list[_Track], measured_m: Any, free: list[int]) -> None:
        """Assign measurements to tracks and remove them from the free ones."""
        gate = self._settings.gate_sigma
        columns = list(free)
        distance = np.array([self._distances(t.kalman, measured_m[columns]) for t in tracks])
        for row, column in zip(
            *linear_sum_assignment(np.minimum(distance, 2.0 * gate)), strict=True
        ):
            if distance[row, column] <= gate:
                track = tracks[row]
                track.kalman.update(measured_m[columns[column]])
                track.hits, track.unseen = track.hits + 1, 0
                free.remove(columns[column])

    def _distances(self, kalman: KalmanFilter, measured_m: Any) -> Any:
        """Return the Mahalanobis distances (M,) of measurements from a track."""
        delta = measured_m - kalman.x[:2]
        S = kalman.P[:2, :2] + self._R
        return np.sqrt((delta @ np.linalg.inv(S) * delta).sum(axis=1))

    def _filter(self, position_m: Any) -> KalmanFilter:
        kalman = KalmanFilter(dim_x=4, dim_z=2)
        kalman.x = np.array([*position_m, 0.0, 0.0])
        kalman.P = np.diag(
            [self._R[0, 0], self._R[1, 1], *[self._settings.velocity_std_mps**2] * 2]
        )
        kalman.F, kalman.Q, kalman.H, kalman.R = self._F, self._Q, np.eye(2, 4), self._R
        return kalman
