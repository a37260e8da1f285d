"""Boxes of people between two looks of the detector, carried by their keypoints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from . import layouts as kp
from ._boxes import area, common_area, extent, iou
from ._detection import PersonDetection
from ._keypoints import PersonKeypoints
from ._protocols import PersonDetector
from ._scene_changes import SceneChanges
from .arrays import FloatArray, ImageRgb
from .evidence import AwarenessReason

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
        detectors: find people, with smaller and smaller inputs; :attr:`size` is the number of the
            one in use.
        every_s: longest time between two looks, in [0, 0.2]; it may be set anew.
        min_score: keypoints with a lower score count as not seen.
    """

    def __init__(
        self, detectors: Sequence[PersonDetector], every_s: float, min_score: float
    ) -> None:
        self._detectors = tuple(detectors)
        self._first_every_s = every_s
        self.every_s, self.size = every_s, 0
        self._min_score = min_score
        self._changes = SceneChanges()
        # People of the last image; None if the next one needs the detector.
        self._people: list[_Carried] | None = None
        self._before: list[_Carried] = []
        self._looked_s = self._stamp_s = -np.inf
        self._gap_s = np.inf
        self._carrying = False

    def unused(self) -> CarriedBoxes:
        """Return carried boxes of the same detectors that have seen no image yet."""
        return CarriedBoxes(self._detectors, self._first_every_s, self._min_score)

    def detections(self, image_rgb: ImageRgb, stamp_s: float) -> tuple[PersonDetection, ...]:
        """Return the boxes of the people in an image: carried, or detected."""
        self._gap_s, self._stamp_s = stamp_s - self._stamp_s, stamp_s
        # Where an image fails, the next one needs the detector.
        people, self._people = self._people, None
        if not 0.0 < self._gap_s <= self.every_s + _SLACK_S:
            self._before = []
            return self.detect(image_rgb)
        self._before = people or []
        # The second condition: the image after this one would be too late.
        if people is None or stamp_s + self._gap_s - self._looked_s > self.every_s + _SLACK_S:
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
        detections = tuple(self._detectors[self.size].detect(image_rgb))
        self._carrying, self._looked_s = False, self._stamp_s
        self._changes.refer_to(image_rgb)
        if not detections:
            self._people = []
        return detections

    @property
    def looked(self) -> bool:
        """True if the detector has looked at the last image."""
        return not self._carrying

    def follow(
        self,
        detections: Sequence[PersonDetection],
        people: Sequence[PersonKeypoints],
        reasons: Sequence[AwarenessReason | None],
    ) -> bool:
        """Take the keypoints of the boxes; return False if a carried one has lost its person.

        Args:
            detections: as :meth:`detections` or :meth:`detect` returned them.
            people: their keypoints, with scores of 0 where they are not the person's.
            reasons: why they are not.
        """
        before, self._people = self._before, None
        if any(reason is not None for reason in reasons):
            return not self._carrying
        carried = []
        for row, (detection, person) in enumerate(zip(detections, people, strict=True)):
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
