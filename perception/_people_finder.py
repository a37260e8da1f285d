"""The people of an image: boxes, keypoints and their owners; boxes carried between two looks."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from . import layouts as kp
from ._camera import Camera
from ._stages import (
    PersonDetection,
    PersonDetector,
    PersonKeypoints,
    PoseEstimator,
    check_count,
)
from .arrays import FloatArray, ImageRgb, finite_number
from .confirmation import KeypointConfirmation, keypoint_score
from .ownership import (
    FoundPerson,
    area,
    common_area,
    disowned_keypoints,
    extent,
    iou,
    without_disowned,
)

#: Longest permitted time between two looks of the detector.
MAX_DETECT_EVERY_S: Final = 0.2

# A box is carried with so many seen keypoints, and with this share of those that were seen when it
# was detected.
_FEWEST_SEEN: Final = 6
_STILL_SEEN: Final = 0.7
# Boxes of which one covers more than this share of another are detected anew.
_OVERLAP: Final = 0.1
# A detection continues a carried box if they overlap at least this much; it keeps the velocity.
_SAME_IOU: Final = 0.5
# Rounding of stamps.
_SLACK_S: Final = 1e-6

# The image is sampled at about this many pixels along its shorter side, and this many samples along
# each side make a cell.
_SAMPLES: Final = 60
_CELL_SAMPLES: Final = 5
# A cell has changed if it differs by more than so many grey levels, and so many times the median of
# all cells: noise and light change all of them. With a larger median the camera moves.
_LEAST_CHANGE: Final = 4.0
_TIMES_MEDIAN: Final = 3.0
_CAMERA_MOVES: Final = 6.0
# A change in so many cells is no noise. If more than this share of all cells changes by a lot, the
# scene is another one.
_FEWEST_CELLS: Final = 2
_LARGE_CHANGE: Final = 25.0
_SCENE_SHARE: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class _Carried:
    """A person as known from the last image, and from the last detection.

    Attributes:
        box_px: (4,) around the keypoints of the last image, as detections are.
        margins_px: (4,) from the extent of the seen keypoints to the box.
        points_px: (17, 2) keypoints of the last image.
        seen: (17,) which of them are seen.
        wanted: fewest keypoints that must be seen in the next image.
        velocity_px: (2,) pixels per second.
        score: of the detection.
    """

    box_px: FloatArray
    margins_px: FloatArray
    points_px: FloatArray
    seen: NDArray[np.bool_]
    wanted: int
    velocity_px: FloatArray
    score: float


class CarriedBoxes:
    """Detections of one image after another, of which the detector does not see every one.

    In between, a box moves with the keypoints that the pose network found in the last image. The
    detector looks if

    * the next image is expected later than ``every_s`` after its last look, or time has jumped,
    * something has changed outside the boxes, or the whole scene (:class:`SceneChanges`),
    * a box cannot be carried: too few keypoints are seen, or they are not the person's,
    * two boxes overlap, so that they might be exchanged.

    A carried box in which the pose network finds the person no more is refused by :meth:`follow`.
    The detector must then look at the same image.

    Args:
        detector: finds people.
        every_s: longest time between two looks, in (0, 0.2].
        min_score: keypoints with a lower score count as not seen.
    """

    def __init__(self, detector: PersonDetector, every_s: float, min_score: float) -> None:
        self._detector, self._every_s, self._min_score = detector, every_s, min_score
        self._changes = SceneChanges()
        # People of the last image; None if the next one needs the detector.
        self._people: list[_Carried] | None = None
        self._before: list[_Carried] = []
        self._looked_s = self._stamp_s = -np.inf
        self._gap_s = np.inf
        self._carrying = False

    def unused(self, detector: PersonDetector) -> CarriedBoxes:
        """Return carried boxes of a detector that have seen no image yet."""
        return CarriedBoxes(detector, self._every_s, self._min_score)

    def detections(self, image_rgb: ImageRgb, stamp_s: float) -> tuple[PersonDetection, ...]:
        """Return the boxes of the people in an image: carried, or detected."""
        self._gap_s, self._stamp_s = stamp_s - self._stamp_s, stamp_s
        # Where an image fails, the next one needs the detector.
        people, self._people = self._people, None
        if not 0.0 < self._gap_s <= self._every_s + _SLACK_S:
            self._before = []
            return self.detect(image_rgb)
        self._before = people or []
        # The second condition: the image after this one would be too late.
        if people is None or stamp_s + self._gap_s - self._looked_s > self._every_s + _SLACK_S:
            return self.detect(image_rgb)
        boxes = [_moved(person, self._gap_s, image_rgb.shape) for person in people]
        known = [*boxes, *(person.box_px for person in people)]
        if _overlap(boxes) or self._changes.found_in(image_rgb, known):
            return self.detect(image_rgb)
        self._carrying = True
        if not people:
            self._people = []
        return tuple(
            PersonDetection(box, person.score) for box, person in zip(boxes, people, strict=True)
        )

    def detect(self, image_rgb: ImageRgb) -> tuple[PersonDetection, ...]:
        """Return the boxes that the detector finds in the image of the last stamp."""
        detections = tuple(self._detector.detect(image_rgb))
        self._carrying, self._looked_s = False, self._stamp_s
        self._changes.refer_to(image_rgb)
        if not detections:
            self._people = []
        return detections

    @property
    def looked(self) -> bool:
        """True if the detector has looked at the last image."""
        return not self._carrying

    def follow(self, found: Sequence[FoundPerson]) -> bool:
        """Take the people in the boxes; return False if a carried one has lost its person.

        Args:
            found: of the boxes that :meth:`detections` or :meth:`detect` returned; scores of
                keypoints that are not the person's are 0.
        """
        before, self._people = self._before, None
        if any(one.disowned is not None for one in found):
            return not self._carrying
        carried = []
        for row, (detection, person, _) in enumerate(found):
            points = person.keypoints_px[kp.BODY]
            seen = person.scores[kp.BODY] >= self._min_score
            last = before[row] if self._carrying else _same(before, detection.box_xyxy_px)
            count = int(np.count_nonzero(seen))
            wanted = max(_FEWEST_SEEN, round(_STILL_SEEN * count))
            if self._carrying and last is not None:
                wanted = last.wanted
            if count < wanted:
                return not self._carrying
            around = extent(points, seen)
            margins = detection.box_xyxy_px - around
            if self._carrying and last is not None:
                margins = last.margins_px
            carried.append(
                _Carried(
                    around + margins,
                    margins,
                    points,
                    seen,
                    wanted,
                    _velocity(last, points, seen, self._gap_s),
                    detection.score,
                )
            )
        self._people = carried
        return True


class SceneChanges:
    """Compares images with a reference: is there something new outside known boxes?"""

    def __init__(self) -> None:
        self._reference: NDArray[np.uint8] | None = None
        self._step = 1

    def refer_to(self, image_rgb: ImageRgb) -> None:
        """Make this image (H, W, 3) the reference."""
        self._step = max(round(min(image_rgb.shape[:2]) / _SAMPLES), 1)
        self._reference = self._sampled(image_rgb)

    def found_in(self, image_rgb: ImageRgb, boxes_px: Sequence[FloatArray]) -> bool:
        """Return whether an image shows another scene, or something new outside the boxes (4,).

        Changes are compared with the median over the image. If that is large, because the camera
        moves or its noise is strong, only another scene counts.
        """
        changes = self.cells(image_rgb)
        if changes is None:
            return True
        if np.count_nonzero(changes > _LARGE_CHANGE) > _SCENE_SHARE * changes.size:
            return True
        median = float(np.median(changes))
        if median > _CAMERA_MOVES:
            return False
        changed = changes > max(_LEAST_CHANGE, _TIMES_MEDIAN * median)
        side = self._step * _CELL_SAMPLES
        for box in boxes_px:
            left, top, right, bottom = (box / side).tolist()
            # A cell more on each side: limbs and shadows reach beyond a box.
            rows = slice(max(math.floor(top) - 1, 0), math.ceil(bottom) + 1)
            changed[rows, max(math.floor(left) - 1, 0) : math.ceil(right) + 1] = False
        return int(np.count_nonzero(changed)) >= _FEWEST_CELLS

    def cells(self, image_rgb: ImageRgb) -> NDArray[np.float32] | None:
        """Return mean changes (rows, columns) of the cells in grey levels; None without reference.

        Only the green channel counts.
        """
        reference = self._reference
        if reference is None:
            return None
        sampled = self._sampled(image_rgb)
        difference = cv2.absdiff(sampled, reference).astype(np.float32)
        height, width = difference.shape
        size = max(round(width / _CELL_SAMPLES), 1), max(round(height / _CELL_SAMPLES), 1)
        return np.asarray(
            cv2.resize(difference, size, interpolation=cv2.INTER_AREA), dtype=np.float32
        )

    def _sampled(self, image_rgb: ImageRgb) -> NDArray[np.uint8]:
        first = self._step // 2
        return np.ascontiguousarray(image_rgb[first :: self._step, first :: self._step, 1])


def _velocity(
    last: _Carried | None, points: FloatArray, seen: NDArray[np.bool_], gap_s: float
) -> FloatArray:
    """Return the velocity (2,) of a person in the image, 0 if it is not known."""
    if last is None:
        return np.zeros(2)
    common = seen & last.seen
    if not common.any():
        return np.zeros(2)
    return np.asarray(np.median((points - last.points_px)[common], axis=0) / gap_s)


def _moved(person: _Carried, gap_s: float, shape: tuple[int, ...]) -> FloatArray:
    """Return the box (4,) of a person in the next image, clipped to it."""
    box = person.box_px + np.tile(gap_s * person.velocity_px, 2)
    height, width = shape[:2]
    return np.asarray(np.clip(box, 0.0, (width, height, width, height)))


def _same(people: Sequence[_Carried], box: FloatArray) -> _Carried | None:
    """Return the person whose box is that of a detection."""
    best = max(people, key=lambda person: iou(person.box_px, box), default=None)
    return best if best is not None and iou(best.box_px, box) >= _SAME_IOU else None


def _overlap(boxes: Sequence[FloatArray]) -> bool:
    """Return whether one of the boxes covers a part of another, or has no extent."""
    areas = [area(box) for box in boxes]
    return any(each <= 0.0 for each in areas) or any(
        common_area(box, boxes[other]) > _OVERLAP * min(areas[row], areas[other])
        for row, box in enumerate(boxes)
        for other in range(row)
    )


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

    def for_another_view(
        self, camera: Camera | None = None, detector: PersonDetector | None = None
    ) -> PeopleFinder:
        """Return a finder with the same settings that has seen no image yet.

        Camera and detector, and always the pose estimator, are the same ones where none is given.
        """
        other = copy.copy(self)
        other._camera = self._camera if camera is None else camera
        other._detector = self._detector if detector is None else detector
        if self._carrier is not None:
            other._carrier = self._carrier.unused(other._detector)
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
