"""Our tracker, fed as on a robot: observations in the frame of a camera overhead."""

from __future__ import annotations

from typing import Any

import numpy as np

from perception import PersonObservation
from tracking import PersonTracker, TrackerConfig

from ._contender import MAX_UNSEEN_S
from ._judges import TrackedFrame
from ._measurements import SimulatedRecording
from ._walkers import FloatArray

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
_TO_CAMERA = np.array([0.0, 0.0, -1.0])


def observations(
    places_m: FloatArray, stamp_s: float, noise_std_m: float
) -> tuple[PersonObservation, ...]:
    """Return observations of people at (M, 2), x and y in odom, who look at the camera overhead."""
    depth_m = T_ODOM_CAMERA[2, 3] - _CHEST_M
    covariance = noise_std_m**2 * np.eye(3)
    return tuple(
        PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=np.array([x, -y, depth_m]),
            position_covariance_m2=covariance,
            gaze_camera=_TO_CAMERA,
            awareness=0.6,
            awareness_std=0.08,
            score=0.9,
        )
        for x, y in places_m.tolist()
    )


class Ours:
    """:class:`~tracking.PersonTracker`, with evidence of awareness in every observation."""

    name = "ours"

    def __init__(self, config: TrackerConfig | None = None) -> None:
        # Without a view: people are unseen by chance here, so no track should be dropped sooner.
        self._config = config or TrackerConfig()
        self._tracker = PersonTracker(self._config)
        self._stamps_s: list[float] = []
        self._recording: SimulatedRecording | None = None
        self._seen: tuple[PersonObservation, ...] = ()

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording."""
        # Half an interval more, since the others round the time to frames.
        kept_s = MAX_UNSEEN_S + 0.5 * float(np.diff(recording.stamps_s).mean())
        self._tracker = PersonTracker(self._config.model_copy(update={"max_coast_s": kept_s}))
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
