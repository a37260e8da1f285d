"""The interface of eyes, and eyes made of others: several views, and a camera's timing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np

from perception import PersonObservation
from perception.arrays import FloatArray
from perception.laser import ScannerSight
from perception.surround import FlatView, merge_views
from tracking import View

from ...world.camera import CameraTiming, FrameClock, FrameQueue
from .._stage import TrueView

#: Index of an observation that shows none of the workers.
NOBODY: Final = -1

#: Observations, each with the index of the worker that it shows, or :data:`NOBODY`.
WorkerObservations = tuple[tuple[PersonObservation, int], ...]


class Eyes(Protocol):
    """Perception in a crossing: makes the observations of one frame."""

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> WorkerObservations | None:
        """Return the observations of people in the image taken now; None if it shows nothing.

        An image that shows nothing is no view of nobody. It does not arrive at the tracker.

        Args:
            stamp_s: time of the image.
            T_odom_camera: (4, 4) true pose of the camera.
            truth: the truth about each person.
        """
        ...


class SurroundEyes:
    """The eyes of a camera with several flat views, whose observations are merged as on a robot.

    Args:
        views: views of the camera, the first one straight ahead.
        eyes: eyes of each view.
    """

    def __init__(self, views: Sequence[FlatView], eyes: Sequence[Eyes]) -> None:
        self._views = tuple(views)
        self._eyes = tuple(eyes)

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> WorkerObservations | None:
        """Return the merged observations; only those of the first view keep their boxes.

        The views are cut from one image, which shows nothing only if none of them does.
        """
        seen = [
            eyes.observe(
                stamp_s,
                T_odom_camera @ view.T_camera_view,
                tuple(_in_view(each, view) for each in truth),
            )
            for view, eyes in zip(self._views, self._eyes, strict=True)
        ]
        if all(each is None for each in seen):
            return None
        observed = [each or () for each in seen]
        merged = merge_views(self._views, [[each for each, _ in rows] for rows in observed])
        return tuple(
            (
                each.observation if each.view == 0 else replace(each.observation, box_xyxy_px=None),
                observed[each.view][each.row][1],
            )
            for each in merged
        )


def _in_view(truth: TrueView, view: FlatView) -> TrueView:
    """Return the truth about a person in the frame of a view."""
    rotation = view.rotation_camera_view
    return replace(
        truth,
        position_camera_m=truth.position_camera_m @ rotation,
        gaze_camera=truth.gaze_camera @ rotation,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """The observations of one image or scan, as they arrive at the robot.

    Attributes:
        stamp_s: time of the image or scan.
        T_odom_camera: (4, 4) pose of the camera or scanner then, as the robot knows it.
        observations: observations of people, each with the index of its worker.
        sensor: the tracker's name of the sensor.
        points_odom_m: (N, 2) points of a scan; None for an image.
        view: where a scan could have shown people; None for an image.
        sight: where a scan shows what is there; None for an image.
    """

    stamp_s: float
    T_odom_camera: FloatArray
    observations: WorkerObservations
    sensor: str = "camera"
    points_odom_m: FloatArray | None = None
    view: View | None = None
    sight: ScannerSight | None = None


class TimedEyes:
    """Eyes with the frame rate, losses and delays of a camera.

    Args:
        eyes: observe an image that is taken.
        timing: timing of the camera.
        rng: random generator of losses and delays.
    """

    def __init__(self, eyes: Eyes, timing: CameraTiming, rng: np.random.Generator) -> None:
        self._eyes = eyes
        #: An image arrives at most this long after it was taken.
        self.longest_delay_s = timing.latency_s + timing.latency_jitter_s
        self._clock = FrameClock(timing, rng)
        self._queue: FrameQueue[Sighting] = FrameQueue()

    def look(
        self, now_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> tuple[Sighting, ...]:
        """Take an image if one is due; return what has arrived by now, in order of arrival."""
        due, delivery_s = self._clock.tick(now_s)
        if due and delivery_s is not None:
            observations = self._eyes.observe(now_s, T_odom_camera, truth)
            if observations is not None:
                self._queue.put(now_s, delivery_s, Sighting(now_s, T_odom_camera, observations))
        return self._queue.take(now_s)
