"""Keypoints of the latest image stay known, for overlays and files."""

from __future__ import annotations

import numpy as np
import pytest

from awarenav.estimate import RecordingPoseEstimator
from perception import PersonDetection, PersonKeypoints, PersonObservation


def test_keypoints_of_boxes_that_were_looked_at_again_are_found_beside_the_others():
    """A pipeline runs the pose network on grown boxes once more, and keeps the other boxes."""

    class Numbered:
        calls = 0

        def estimate(self, image_rgb, detections):
            self.calls += 1
            scores = np.full(17, 0.1 * self.calls)
            return tuple(
                PersonKeypoints(np.zeros((17, 2)), np.zeros((17, 3)), scores, "coco")
                for _ in detections
            )

    def seen(box):
        return PersonObservation(
            0.0, np.array([0, 0, 3.0]), np.eye(3), None, None, None, 0.5, box_xyxy_px=box
        )

    recording = RecordingPoseEstimator(Numbered())
    first, second, grown = (np.array([0.0, 0.0, 10.0, height]) for height in (20.0, 30.0, 40.0))
    image = np.zeros((480, 640, 3), np.uint8)
    recording.estimate(image, (PersonDetection(first, 0.9), PersonDetection(second, 0.3)))
    recording.estimate(image, (PersonDetection(grown, 0.3),))
    assert recording.keypoints_of(seen(first)).scores[0] == pytest.approx(0.1)
    assert recording.keypoints_of(seen(grown)).scores[0] == pytest.approx(0.2)
    recording.forget()
    assert recording.keypoints_of(seen(first)) is None
