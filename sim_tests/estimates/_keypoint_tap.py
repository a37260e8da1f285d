"""Listens to a pose estimator, so that its keypoints can be drawn and written."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from perception import PersonDetection, PersonKeypoints, PersonObservation, PoseEstimator


class KeypointTap:
    """A :class:`~perception.PoseEstimator` that passes another's answers on and remembers them.

    Args:
        estimator: the one that works.
    """

    def __init__(self, estimator: PoseEstimator) -> None:
        self._estimator = estimator
        self._last: dict[bytes, PersonKeypoints] = {}

    def estimate(
        self, image_rgb: NDArray[np.uint8], detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return what the other estimator returns."""
        people = tuple(self._estimator.estimate(image_rgb, detections))
        self._last = {
            detection.box_xyxy_px.tobytes(): person
            for detection, person in zip(detections, people, strict=False)
        }
        return people

    def forget(self) -> None:
        """Forget the last picture; without a detection the estimator is not even asked."""
        self._last = {}

    def keypoints_of(self, observation: PersonObservation) -> PersonKeypoints | None:
        """The keypoints behind an observation of the last picture, known by its box."""
        box = observation.box_xyxy_px
        return None if box is None else self._last.get(box.tobytes())
