"""The trackers of the benchmark: ours, one plain filter a person, and norfair."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from filterpy.kalman import KalmanFilter
from scipy.optimize import linear_sum_assignment

from perception import PersonObservation
from tracking import PersonTracker, TrackerConfig

from ._judges import TrackedFrame
from ._measurements import SimulatedRecording
from ._walkers import FloatArray

#: Time for which every tracker keeps an unseen person: slightly more than the longest spell out of
#: sight. Settings that the trackers do not share are tuned for each, on seeds that are not judged.
MAX_UNSEEN_S = 1.2
# Both peers: density of the white acceleration, and standard deviation of a new track's velocity.
_ACCELERATION_DENSITY_M2PS3 = 0.05
_VELOCITY_STD_MPS = 1.0
# Naive: largest Mahalanobis distance of a measurement, and measurements that confirm a track.
_GATE_SIGMA = 3.4
_CONFIRM_HITS = 4
# Norfair: largest distance of a measurement, and hits after the first that confirm a track.
_DISTANCE_M = 0.8
_INITIALIZATION_DELAY = 3

#: A camera 8 m up that looks straight down: its x is odom's x, its y is against odom's y.
T_ODOM_CAMERA = np.array(
    [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, 8.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
_CHEST_M = 1.2
_EYE = np.eye(3)


class Contender(Protocol):
    """A tracker under test, fed frame by frame.

    ``begin`` makes a fresh tracker. ``make`` converts the measurements of a frame into the
    tracker's own form, ``advance`` is the call of every frame: these two are timed. ``report``
    reads its result.
    """

    name: str

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording."""

    def make(self, frame: int) -> None:
        """Make the input of the next frame."""

    def advance(self, frame: int) -> Any:
        """Take the next frame."""

    def report(self, result: Any) -> TrackedFrame:
        """Return the confirmed people, seen in this frame or not."""


def run(contender: Contender, recording: SimulatedRecording) -> list[TrackedFrame]:
    """Return the tracks of every frame of a recording."""
    contender.begin(recording)
    tracked = []
    for frame in range(len(recording.stamps_s)):
        contender.make(frame)
        tracked.append(contender.report(contender.advance(frame)))
    return tracked


def observations(
    places_m: FloatArray, stamp_s: float, noise_std_m: float
) -> tuple[PersonObservation, ...]:
    """Return observations of people at (M, 2), x and y in odom, who look at the camera overhead."""
    return tuple(
        PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=np.array([x, -y, T_ODOM_CAMERA[2, 3] - _CHEST_M]),
            position_covariance_m2=noise_std_m**2 * _EYE,
            gaze_camera=np.array([0.0, 0.0, -1.0]),
            awareness=0.6,
            awareness_std=0.08,
            score=0.9,
        )
        for x, y in places_m
    )


class Ours:
    """:class:`~tracking.PersonTracker`, with evidence of awareness in every observation."""

    name = "ours"

    def __init__(self) -> None:
        self._tracker = PersonTracker()
        self._stamps_s: list[float] = []
        self._recording: SimulatedRecording | None = None
        self._seen: tuple[PersonObservation, ...] = ()

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording."""
        # Half an interval more, since the others round the time to frames. Without a view: people
        # are unseen by chance here, so no track should be dropped sooner.
        kept_s = MAX_UNSEEN_S + 0.5 * float(np.diff(recording.stamps_s).mean())
        self._tracker = PersonTracker(TrackerConfig(max_coast_s=kept_s))
        self._stamps_s = recording.stamps_s.tolist()
        self._recording = recording

    def make(self, frame: int) -> None:
        """Make the observations of the next frame."""
        assert self._recording is not None
        self._seen = observations(
            self._recording.measured_m[frame], self._stamps_s[frame], self._recording.noise_std_m
        )

    def advance(self, frame: int) -> Any:
        """Take the next frame."""
        return self._tracker.update(self._seen, self._stamps_s[frame], T_ODOM_CAMERA)

    def report(self, result: Any) -> TrackedFrame:
        """Return confirmed and coasting tracks."""
        tracks = [track for track in result if track.status != "tentative"]
        return TrackedFrame(
            np.array([track.id for track in tracks], dtype=np.int64),
            np.array([track.position_odom_m for track in tracks]).reshape(-1, 2),
        )


class _Track:
    def __init__(self, number: int, kalman: KalmanFilter) -> None:
        self.number, self.kalman, self.hits, self.unseen = number, kalman, 1, 0


class Naive:
    """A tracker with constant velocity, the Mahalanobis distance and one gate."""

    name = "naive"

    def __init__(self) -> None:
        self._tracks: list[_Track] = []
        self._next = 1
        self._recording: SimulatedRecording | None = None

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording."""
        self._tracks, self._next, self._recording = [], 1, recording
        dt = float(np.diff(recording.stamps_s).mean())
        self._dt_s = dt
        self._F = np.eye(4)
        self._F[0, 2] = self._F[1, 3] = dt
        block = _ACCELERATION_DENSITY_M2PS3 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        self._Q = np.kron(block, np.eye(2))
        self._R = recording.noise_std_m**2 * np.eye(2)

    def make(self, frame: int) -> None:
        """Do nothing: the measurements are taken as they are, or were converted at the start."""

    def advance(self, frame: int) -> Any:
        """Take the next frame."""
        assert self._recording is not None
        measured = self._recording.measured_m[frame]
        for track in self._tracks:
            track.kalman.predict()
            track.unseen += 1
        free = list(range(len(measured)))
        for confirmed in (True, False):
            tracks = [t for t in self._tracks if (t.hits >= _CONFIRM_HITS) == confirmed]
            if tracks and free:
                self._match(tracks, measured, free)
        # A new track is dropped after one frame.
        limit = round(MAX_UNSEEN_S / self._dt_s)
        self._tracks = [
            track
            for track in self._tracks
            if track.unseen <= (limit if track.hits >= _CONFIRM_HITS else 1)
        ]
        for column in free:
            self._tracks.append(_Track(self._next, self._filter(measured[column])))
            self._next += 1
        return [track for track in self._tracks if track.hits >= _CONFIRM_HITS]

    def report(self, result: Any) -> TrackedFrame:
        """Return the confirmed tracks."""
        return TrackedFrame(
            np.array([track.number for track in result], dtype=np.int64),
            np.array([track.kalman.x[:2] for track in result]).reshape(-1, 2),
        )

    def _match(self, tracks: list[_Track], measured_m: Any, free: list[int]) -> None:
        """Assign measurements to tracks and remove them from the free ones."""
        columns = list(free)
        distance = np.array([self._distances(t.kalman, measured_m[columns]) for t in tracks])
        for row, column in zip(
            *linear_sum_assignment(np.minimum(distance, 2.0 * _GATE_SIGMA)), strict=True
        ):
            if distance[row, column] <= _GATE_SIGMA:
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
        kalman.P = np.diag([self._R[0, 0], self._R[1, 1], *[_VELOCITY_STD_MPS**2] * 2])
        kalman.F, kalman.Q, kalman.H, kalman.R = self._F, self._Q, np.eye(2, 4), self._R
        return kalman


class Norfair:
    """:class:`norfair.Tracker`: Euclidean distance, matched from the least distance on."""

    name = "norfair"

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording; norfair counts frames, not seconds."""
        from norfair import Detection, Tracker  # noqa: PLC0415 - an optional peer
        from norfair.filter import OptimizedKalmanFilterFactory  # noqa: PLC0415

        dt_s = float(np.diff(recording.stamps_s).mean())
        self._tracker = Tracker(
            "euclidean",
            distance_threshold=_DISTANCE_M,
            # norfair wants a counter above the delay, also for a slow camera.
            hit_counter_max=max(round(MAX_UNSEEN_S / dt_s), _INITIALIZATION_DELAY + 1),
            initialization_delay=_INITIALIZATION_DELAY,
            past_detections_length=0,
            filter_factory=OptimizedKalmanFilterFactory(
                R=recording.noise_std_m**2,
                Q=_ACCELERATION_DENSITY_M2PS3 * dt_s * dt_s**2,
                pos_variance=recording.noise_std_m**2,
                vel_variance=(_VELOCITY_STD_MPS * dt_s) ** 2,
            ),
        )
        self._detection, self._measured_m = Detection, recording.measured_m

    def make(self, frame: int) -> None:
        """Make the detections of the next frame."""
        self._detections = [self._detection(points=p[None]) for p in self._measured_m[frame]]

    def advance(self, frame: int) -> Any:
        """Take the next frame."""
        return self._tracker.update(self._detections)

    def report(self, result: Any) -> TrackedFrame:
        """Return the active objects."""
        return TrackedFrame(
            np.array([person.id for person in result], dtype=np.int64),
            np.array([person.estimate[0] for person in result]).reshape(-1, 2),
        )
