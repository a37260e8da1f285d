"""The people of an image: boxes, keypoints, and whether these are their own."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import NamedTuple

from ._camera import Camera
from ._carried_boxes import MAX_DETECT_EVERY_S, CarriedBoxes
from ._detection import PersonDetection
from ._frame_time import FrameBudget, StageClock, StageTimings
from ._keypoints import PersonKeypoints
from ._protocols import PersonDetector, PoseEstimator, ResizableDetector
from .arrays import ImageRgb, finite_number
from .confirmation import KeypointConfirmation, keypoint_score
from .errors import PerceptionError
from .evidence import AwarenessReason
from .ownership import disowned_keypoints, without_disowned


class FoundPeople(NamedTuple):
    """The people of an image, row by row.

    Attributes:
        detections: their boxes.
        keypoints: their keypoints, with scores of 0 where they are not the person's.
        disowned: why they are not, or None.
    """

    detections: tuple[PersonDetection, ...]
    keypoints: tuple[PersonKeypoints, ...]
    disowned: list[AwarenessReason | None]


class PeopleFinder:
    """Detector and pose estimator, of which the detector need not look at every image.

    Args:
        camera: of the images.
        detector: finds people.
        pose_estimator: finds their keypoints.
        min_score: keypoints with a lower score count as not seen.
        confirmation: lets the keypoints confirm what the detector found; None takes it as it is.
        detect_every_s: see :class:`~perception.AwarenessPipeline`.
        frame_budget_s: the same.

    Raises:
        PerceptionError: for an invalid time, and for both times.
    """

    def __init__(
        self,
        camera: Camera,
        detector: PersonDetector,
        pose_estimator: PoseEstimator,
        min_score: float,
        confirmation: KeypointConfirmation | None,
        detect_every_s: float,
        frame_budget_s: float | None,
    ) -> None:
        self._camera, self._detector, self._pose = camera, detector, pose_estimator
        self._min_score, self._confirmation = min_score, confirmation
        detect_every_s = finite_number(
            "detect_every_s", detect_every_s, minimum=0.0, maximum=MAX_DETECT_EVERY_S
        )
        self._budget: FrameBudget | None = None
        self._carrier: CarriedBoxes | None = None
        if frame_budget_s is not None:
            if detect_every_s > 0.0:
                raise PerceptionError("give detect_every_s or frame_budget_s, got both")
            finite_number("frame_budget_s", frame_budget_s, minimum=0.0, exclusive_minimum=True)
            smaller = detector.smaller() if isinstance(detector, ResizableDetector) else ()
            self._budget = FrameBudget(frame_budget_s, (1.0, *(share for _, share in smaller)))
            self._carrier = CarriedBoxes((detector, *(d for d, _ in smaller)), 0.0, min_score)
        elif detect_every_s > 0.0:
            self._carrier = CarriedBoxes((detector,), detect_every_s, min_score)

    def for_another_view(self) -> PeopleFinder:
        """Return a finder with the same networks and settings that has seen no image yet."""
        other = copy.copy(self)
        if self._carrier is not None:
            other._carrier = self._carrier.unused()
        if self._budget is not None:
            other._budget = self._budget.unused()
        return other

    def find(self, image_rgb: ImageRgb, stamp_s: float, clock: StageClock) -> FoundPeople:
        """Return the people of an image; the clock counts detector and pose."""
        carrier = self._carrier
        if carrier is None:
            detections = tuple(self._detector.detect(image_rgb))
            looked = True
        else:
            detections = carrier.detections(image_rgb, stamp_s)
            looked = carrier.looked
        clock.count("detector")
        found = self._with_keypoints(image_rgb, detections, looked=looked)
        if carrier is not None and not carrier.follow(*found):
            # A carried box has lost its person: look at once.
            clock.count("pose")
            detections = carrier.detect(image_rgb)
            clock.count("detector")
            found = self._with_keypoints(image_rgb, detections, looked=True)
            carrier.follow(*found)
        clock.count("pose")
        return found

    def note(self, timings: StageTimings) -> StageTimings:
        """Choose when the detector looks next; return the times of a frame with its input's."""
        if self._budget is None or self._carrier is None:
            return timings
        noted = replace(timings, detector_share=self._budget.share)
        looked = timings.detector_s if self._carrier.looked else None
        self._budget.record(looked, timings.total_s - timings.detector_s)
        self._carrier.every_s, self._carrier.size = self._budget.every_s, self._budget.size
        return noted

    def _with_keypoints(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...], *, looked: bool
    ) -> FoundPeople:
        """Return the people among the detections, which the detector found or which were carried.

        A carried box is that of a person whom keypoints have confirmed.
        """
        confirmation = self._confirmation if looked else None
        if confirmation is not None:
            detections = confirmation.candidates(detections)
        if not detections:
            return FoundPeople((), (), [])
        people = self._keypoints(image_rgb, detections)
        disowned = disowned_keypoints(self._camera, detections, people, self._min_score)
        if confirmation is not None:
            detections, people, disowned = self._grown(
                image_rgb, FoundPeople(detections, people, disowned), confirmation
            )
            rows, detections = confirmation.confirmed(detections, people, disowned)
            people = tuple(people[row] for row in rows)
            disowned = [disowned[row] for row in rows]
        return FoundPeople(detections, tuple(map(without_disowned, people, disowned)), disowned)

    def _grown(
        self, image_rgb: ImageRgb, found: FoundPeople, confirmation: KeypointConfirmation
    ) -> FoundPeople:
        """Return the people with boxes that have grown to their keypoints, where that is better.

        It is better if the keypoints in the new box have a higher score, and if the person does
        not lose them to another one.
        """
        height, width = image_rgb.shape[:2]
        grown = {
            row: larger
            for row, pair in enumerate(zip(found.detections, found.keypoints, strict=True))
            if (larger := confirmation.grown(*pair, (width, height), self._min_score)) is not None
        }
        if not grown:
            return found
        again = self._keypoints(image_rgb, tuple(grown.values()))
        better = {
            row: (larger, person)
            for (row, larger), person in zip(grown.items(), again, strict=True)
            if keypoint_score(person) >= keypoint_score(found.keypoints[row])
        }
        if not better:
            return found
        detections, people = list(found.detections), list(found.keypoints)
        for row, pair in better.items():
            detections[row], people[row] = pair
        disowned = disowned_keypoints(self._camera, detections, people, self._min_score)
        lost = [row for row in better if disowned[row] is not None and found.disowned[row] is None]
        if lost:
            for row in lost:
                detections[row], people[row] = found.detections[row], found.keypoints[row]
            disowned = disowned_keypoints(self._camera, detections, people, self._min_score)
        return FoundPeople(tuple(detections), tuple(people), disowned)

    def _keypoints(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        people = tuple(self._pose.estimate(image_rgb, detections))
        check_count("pose_estimator", len(people), len(detections))
        return people


def check_count(name: str, got: int, wanted: int) -> None:
    """Raise PerceptionError unless an estimator returned one result per person."""
    if got != wanted:
        raise PerceptionError(f"{name} must return one result per person ({wanted}), got {got}")
