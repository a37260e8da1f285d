"""Our tracker, fed as on a robot: observations in the frame of a camera overhead."""

from __future__ import annotations

from typing import Any

import numpy as np

from perception import PersonObservation
from tracking import PersonTracker, TrackerConfig

from ._contender import MAX_UNSEEN_S
from ._judges import TrackedFrame
from ._measurements import SimulatedRecording

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


def observation(place_m: Any, stamp_s: float, noise_std_m: float) -> PersonObservation:
    """Return the observation of a person at x, y (odom, m) who looks at the camera overhead."""
    x, y = place_m
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=np.array([x, -y, T_ODOM_CAMERA[2, 3] - _CHEST_M]),
        position_covariance_m2=noise_std_m**2 * np.eye(3),
        gaze_camera=np.array([0.0, 0.0, -1.0]),
        awareness=0.6,
        awareness_std=0.08,
        score=0.9,
    )


class Ours:
    """:class:`~tracking.PersonTracker`, with evidence of awareness in every observation."""

    name = "ours"

    def __init__(self, config: TrackerConfig | None = None) -> None:
        # Without a view: people are unseen by chance here, so no track should be dropped sooner.
        self._config = config or TrackerConfig()
        self._tracker = PersonTracker(self._config)
        self._stamps_s: list[float] = []
        self._frames: list[tuple[PersonObservation, ...]] = []

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording."""
        # Half an interval more, since the others round the time to frames.
        kept_s = MAX_UNSEEN_S + 0.5 * float(np.diff(recording.stamps_s).mean())
        self._tracker = PersonTracker(self._config.model_copy(update={"max_coast_s": kept_s}))
        self._stamps_s = recording.stamps_s.tolist()
        self._frames = [
            tuple(observation(place, stamp_s, recording.noise_std_m) for place in measured)
            for stamp_s, measured in zip(self._stamps_s, recording.measured_m, strict=True)
        ]

    def advance(self, frame: int) -> Any:
        """Take the next frame."""
        return self._tracker.update(self._frames[frame], self._stamps_s[frame], T_ODOM_CAMERA)

    def report(self, result: Any) -> TrackedFrame:
        """Return confirmed and coasting tracks."""
        tracks = [track for track in result if track.status != "tentative"]
        return TrackedFrame(
            np.array([track.id for track in tracks], dtype=np.int64),
            np.array([track.position_odom_m for track in tracks]).reshape(-1, 2),
        )
