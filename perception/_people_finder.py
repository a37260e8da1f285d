"""The people of an image: boxes, keypoints, and whether these are their own."""

from __future__ import annotations

import copy
from collections.abc import Sequence

from ._camera import Camera
from ._carried_boxes import MAX_DETECT_EVERY_S, CarriedBoxes
from ._stages import PersonDetection, PersonDetector, PersonKeypoints, PoseEstimator
from .arrays import ImageRgb, finite_number
from .confirmation import KeypointConfirmation, keypoint_score
from .errors import PerceptionError
from .ownership import FoundPerson, disowned_keypoints, without_disowned


class PeopleFinder:
    """Detector and pose estimator, of which the detector need not look at every image.

    Args:
        camera: of the images.
        detector: finds people.
        pose_estimator: finds their keypoints.
        min_score: keypoints with a lower score count as not seen.
        confirmation: lets the keypoints confirm what the detector found; None takes it as it is.
        detect_every_s: see :class:`~perception.AwarenessPipeline`.

    Raises:
        PerceptionError: for an invalid time.
    """

    def __init__(
        self,
        camera: Camera,
        detector: PersonDetector,
        pose_estimator: PoseEstimator,
        min_score: float,
        confirmation: KeypointConfirmation | None,
        detect_every_s: float,
    ) -> None:
        self._camera, self._detector, self._pose = camera, detector, pose_estimator
        self._min_score, self._confirmation = min_score, confirmation
        detect_every_s = finite_number(
            "detect_every_s", detect_every_s, minimum=0.0, maximum=MAX_DETECT_EVERY_S
        )
        self._carrier: CarriedBoxes | None = None
        if detect_every_s > 0.0:
            self._carrier = CarriedBoxes(detector, detect_every_s, min_score)

    def for_another_view(self) -> PeopleFinder:
        """Return a finder with the same networks and settings that has seen no image yet."""
        other = copy.copy(self)
        if self._carrier is not None:
            other._carrier = self._carrier.unused()
        return other

    def find(self, image_rgb: ImageRgb, stamp_s: float) -> tuple[FoundPerson, ...]:
        """Return the people of an image."""
        carrier = self._carrier
        if carrier is None:
            detections = tuple(self._detector.detect(image_rgb))
            looked = True
        else:
            detections = carrier.detections(image_rgb, stamp_s)
            looked = carrier.looked
        found = self._with_keypoints(image_rgb, detections, looked=looked)
        if carrier is not None and not carrier.follow(found):
            # A carried box has lost its person: look at once.
            detections = carrier.detect(image_rgb)
            found = self._with_keypoints(image_rgb, detections, looked=True)
            carrier.follow(found)
        return found

    def _with_keypoints(
        self, image_rgb: ImageRgb, detections: tuple[PersonDetection, ...], *, looked: bool
    ) -> tuple[FoundPerson, ...]:
        """Return the people among the detections, which the detector found or which were carried.

        A carried box is that of a person whom keypoints have confirmed.
        """
        confirmation = self._confirmation if looked else None
        if confirmation is not None:
            detections = confirmation.candidates(detections)
        if not detections:
            return ()
        people = self._keypoints(image_rgb, detections)
        found = self._with_owners(list(zip(detections, people, strict=True)))
        if confirmation is not None:
            found = confirmation.confirmed(self._grown(image_rgb, found, confirmation))
        return tuple(
            one._replace(keypoints=without_disowned(one.keypoints, one.disowned)) for one in found
        )

    def _grown(
        self, image_rgb: ImageRgb, found: list[FoundPerson], confirmation: KeypointConfirmation
    ) -> list[FoundPerson]:
        """Return the people with boxes that have grown to their keypoints, where that is better.

        It is better if the keypoints in the new box have a higher score, and if the person does
        not lose them to another one.
        """
        height, width = image_rgb.shape[:2]
        grown = {
            row: larger
            for row, one in enumerate(found)
            if (larger := confirmation.grown(*one[:2], (width, height), self._min_score))
            is not None
        }
        if not grown:
            return found
        again = self._keypoints(image_rgb, tuple(grown.values()))
        better = {
            row: (larger, person)
            for (row, larger), person in zip(grown.items(), again, strict=True)
            if keypoint_score(person) >= keypoint_score(found[row].keypoints)
        }
        if not better:
            return found
        pairs = [better.get(row, one[:2]) for row, one in enumerate(found)]
        changed = self._with_owners(pairs)
        lost = {
            row
            for row in better
            if changed[row].disowned is not None and found[row].disowned is None
        }
        if not lost:
            return changed
        return self._with_owners(
            [found[row][:2] if row in lost else pair for row, pair in enumerate(pairs)]
        )

    def _with_owners(
        self, pairs: Sequence[tuple[PersonDetection, PersonKeypoints]]
    ) -> list[FoundPerson]:
        """Return detections and their keypoints with why these are not the person's."""
        detections, people = zip(*pairs, strict=True)
        reasons = disowned_keypoints(self._camera, detections, people, self._min_score)
        return [FoundPerson(*pair, reason) for pair, reason in zip(pairs, reasons, strict=True)]

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
