"""One tracker for the threads of camera and scanners."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from typing import Any, Final

import numpy as np

from perception import Camera, PersonObservation
from perception.arrays import FloatArray
from tracking import (
    CameraView,
    PersonTrack,
    PersonTracker,
    ScannerView,
    SensorConfig,
    TrackerConfig,
    View,
)

from ._poses import PoseSpread

# Networks may take so long for an image; the scans of that time are computed again.
_MAX_LAG_S: Final = 1.0


class LaterView:
    """A view of a camera that becomes known with its first message; nobody is in it before.

    Attributes:
        view: None until it is known.
    """

    def __init__(self) -> None:
        self.view: View | None = None

    def visibility(self, positions_odom_m: Any, T_odom_camera: Any) -> FloatArray:
        """Return (N,) in [0, 1], as the view does."""
        if self.view is None:
            return np.zeros(len(positions_odom_m))
        return self.view.visibility(positions_odom_m, T_odom_camera)


class SharedTracker:
    """A tracker for several threads: one at a time updates it, and none waits for the tracks.

    Args:
        config: of the tracker; with scanners it takes frames that are up to 1 s late.
        scanners: number of scanners beside the camera. Each is a sensor of its own.
    """

    def __init__(self, config: TrackerConfig, scanners: int = 0) -> None:
        self._camera_view = LaterView()
        self._names = tuple(f"laser_{number + 1}" for number in range(scanners))
        if scanners:
            lag_s = max(config.max_lag_s, _MAX_LAG_S)
            config = config.model_copy(update={"max_lag_s": lag_s})
        self._tracker = PersonTracker(
            config,
            view=self._camera_view,
            # Each scan brings a view of its own.
            sensors={name: SensorConfig(view=ScannerView()) for name in self._names},
        )
        self._busy = threading.Lock()
        self._latest: tuple[PersonTrack, ...] = ()
        self._reset_wanted = False
        # For the two above; held for a moment only.
        self._handing_over = threading.Lock()

    @property
    def tracks(self) -> tuple[PersonTrack, ...]:
        """The tracks after the latest frame of any sensor."""
        return self._latest

    @property
    def refused_frames(self) -> int:
        """Number of frames that were refused for their stamps: too late, or far ahead."""
        return self._tracker.refused_late_frames + self._tracker.refused_early_frames

    def use_camera(self, camera: Camera) -> None:
        """Set the camera, before its first frame."""
        self._camera_view.view = CameraView(camera)

    def forget(self) -> None:
        """Delete all tracks before the next frame; from any thread, without waiting."""
        with self._handing_over:
            self._reset_wanted = True
            self._latest = ()

    def update(
        self,
        observations: Iterable[PersonObservation],
        stamp_s: float,
        T_odom_sensor: FloatArray,
        is_current: Callable[[], bool],
        spread: PoseSpread,
        *,
        scanner: int | None = None,
        view: ScannerView | None = None,
    ) -> tuple[PersonTrack, ...] | None:
        """Return the tracks after a frame, or None if ``is_current`` says that it came too late.

        It is asked once the tracker is free, and reset if that was wanted. The spread of the
        robot's pose is in the places of all people. ``scanner`` is None for the camera.

        Raises:
            TrackingError: for a frame that the tracker refuses.
        """
        with self._busy:
            # The tracker is reset before the question: tracks that another thread wants deleted
            # from here on are deleted before the next frame.
            with self._handing_over:
                reset, self._reset_wanted = self._reset_wanted, False
            if reset:
                self._tracker.reset()
            if not is_current():
                return None
            named: dict[str, Any] = {}
            if scanner is not None:
                named = {"sensor": self._names[scanner], "view": view}
            widened = spread.widened(observations, T_odom_sensor)
            tracks = self._tracker.update(widened, stamp_s, T_odom_sensor, **named)
            with self._handing_over:
                if not self._reset_wanted:
                    self._latest = tracks
            return tracks
