"""The peer norfair with its own constant-velocity filter, in units of the benchmark."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._contender import MAX_UNSEEN_S
from ._judges import TrackedFrame
from ._measurements import SimulatedRecording


@dataclass(frozen=True, slots=True)
class NorfairSettings:
    """Settings, tuned for this benchmark on seeds that are not judged (ranges in README.md).

    Attributes:
        distance_threshold_m: largest distance between a measurement and its track.
        max_unseen_s: time after which an unseen track is dropped (norfair's hit counter).
        initialization_delay: hits after the first that confirm a track.
        acceleration_density_m2ps3: of the white acceleration; norfair adds it to the velocity.
        velocity_std_mps: of a new track.
    """

    distance_threshold_m: float = 0.8
    max_unseen_s: float = MAX_UNSEEN_S
    initialization_delay: int = 3
    acceleration_density_m2ps3: float = 0.05
    velocity_std_mps: float = 1.0


class Norfair:
    """:class:`norfair.Tracker`: Euclidean distance, matched from the least distance on."""

    name = "norfair"

    def __init__(self, settings: NorfairSettings | None = None) -> None:
        self._settings = settings or NorfairSettings()

    def begin(self, recording: SimulatedRecording) -> None:
        """Start over, on this recording; norfair counts frames, not seconds."""
        from norfair import Detection, Tracker  # noqa: PLC0415 - an optional peer
        from norfair.filter import OptimizedKalmanFilterFactory  # noqa: PLC0415

        settings, dt_s = self._settings, float(np.diff(recording.stamps_s).mean())
        self._tracker = Tracker(
            "euclidean",
            distance_threshold=settings.distance_threshold_m,
            # norfair wants a counter above the delay, also for a slow camera.
            hit_counter_max=max(
                round(settings.max_unseen_s / dt_s), settings.initialization_delay + 1
            ),
            initialization_delay=settings.initialization_delay,
            past_detections_length=0,
            filter_factory=OptimizedKalmanFilterFactory(
                R=recording.noise_std_m**2,
                Q=settings.acceleration_density_m2ps3 * dt_s * dt_s**2,
                pos_variance=recording.noise_std_m**2,
                vel_variance=(settings.velocity_std_mps * dt_s) ** 2,
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
