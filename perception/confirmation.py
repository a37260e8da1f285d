"""Keypoints that confirm or refute what a detector found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from . import layouts as kp
from ._stages import DEFAULT_SCORE_THRESHOLD, PersonDetection, PersonKeypoints
from .arrays import finite_number, set_fields
from .evidence import AwarenessReason
from .ownership import FoundPerson, area, common_area, extent

# Detector's score from which on a detection is a candidate, or the threshold if that is lower.
_CANDIDATE_SCORE: Final = 0.05
# Detector's score from which on a person is kept whatever the keypoints say: of somebody half
# hidden few are seen.
_CERTAIN_SCORE: Final = 0.4
# Weight of the keypoints' odds.
_WEIGHT: Final = 3.0
# Candidates below the threshold that are looked at, the best first; each costs a run of the pose
# network.
_MOST: Final = 8
# Logarithm of the odds below which the other end counts: scores of 0 and 1 have none.
_LEAST_PROBABILITY: Final = 1e-4
# A box of which more lies within another shows a part of that person.
_MOSTLY: Final = 0.6
# A box that the detector is less sure of than this often shows a part of a person. It grows to the
# keypoints with a margin (a share of their larger extent), if so many are seen and it grows by more
# than this share of a side.
_WHOLE_SCORE: Final = 0.6
_MARGIN: Final = 0.06
_FEWEST_SEEN: Final = 6
_LEAST_GROWTH: Final = 0.1
_OUTWARDS: Final = np.array([-1.0, -1.0, 1.0, 1.0])
_ANOTHERS: Final[tuple[AwarenessReason, ...]] = (
    "skeleton of another person",
    "head of another person",
)


@dataclass(frozen=True, slots=True)
class KeypointConfirmation:
    """The rule by which the keypoints' scores change the score of a detection.

    A detector that has learned from few kinds of pictures is unsure on others. Its pose network
    then still tells a body from a chair: the peaks of its keypoints are high and narrow. So weak
    detections become candidates, and the odds of each one are multiplied by those of its keypoints:

        logit(score) = logit(detector's score) + weight (logit(keypoints) - logit(neutral))

    where ``keypoints`` is the mean of the thirteen best scores of the seventeen of the body. Four
    may be hidden. Nobody is found twice: a candidate that the detector alone would not report must
    have a skeleton of its own (:func:`~perception.ownership.disowned_keypoints`) and may not lie
    within a better one, of which it then shows a part; one that is not certain may not lie within
    a better one whose skeleton or head it shares.

    It works with any pose network whose ``neutral`` is known: run the network in boxes of people
    and in false boxes of your pictures, and take the mean score that separates them best. On 28
    photographs that is 0.85 for BlazePose, and 0.38 and 0.22 for MoveNet Thunder and Lightning.
    It helps a detector that sees other pictures than it has learned from. One that knows them does
    as well with its own threshold. The other numbers are those of the shipped detector.

    Attributes:
        score_threshold: people with a lower score are dropped.
        neutral: mean of the keypoints' scores that leaves a score as it is; default that of the
            shipped pose network.

    Raises:
        PerceptionError: for a value outside [0, 1].
    """

    score_threshold: float = DEFAULT_SCORE_THRESHOLD
    neutral: float = 0.4

    def __post_init__(self) -> None:
        values = {
            name: finite_number(name, getattr(self, name), minimum=0.0, maximum=1.0)
            for name in ("score_threshold", "neutral")
        }
        set_fields(self, **values)

    @property
    def detector_threshold(self) -> float:
        """The score threshold that the detector must have, so that candidates are found."""
        return min(_CANDIDATE_SCORE, self.score_threshold)

    def candidates(self, detections: Sequence[PersonDetection]) -> tuple[PersonDetection, ...]:
        """Return the detections whose keypoints are worth a look, in their order."""
        weak = [each.score for each in detections if each.score < self.score_threshold]
        if len(weak) <= _MOST:
            return tuple(detections)
        least = sorted(weak, reverse=True)[_MOST - 1]
        return tuple(each for each in detections if each.score >= least)

    def score(self, detection: PersonDetection, person: PersonKeypoints) -> float:
        """Return the score of a detection with its keypoints, in [0, 1]."""
        odds = _logit(keypoint_score(person)) - _logit(self.neutral)
        score = 1.0 / (1.0 + math.exp(-_logit(detection.score) - _WEIGHT * odds))
        if detection.score >= _CERTAIN_SCORE:
            score = max(score, min(detection.score, self.score_threshold))
        return score

    def grown(
        self,
        detection: PersonDetection,
        person: PersonKeypoints,
        size_wh_px: tuple[int, int],
        min_score: float,
    ) -> PersonDetection | None:
        """Return the box with the keypoints that lie outside it; None if it is large enough.

        Args:
            detection: of the detector.
            person: its keypoints, which are searched beyond the box too.
            size_wh_px: width and height of the image.
            min_score: keypoints with a lower score count as not seen.
        """
        if detection.score >= _WHOLE_SCORE:
            return None
        seen = person.scores[kp.BODY] >= min_score
        if np.count_nonzero(seen) < _FEWEST_SEEN:
            return None
        around = extent(person.keypoints_px[kp.BODY], seen)
        margin = _MARGIN * float((around[2:] - around[:2]).max())
        around = np.clip(around + margin * _OUTWARDS, 0.0, np.tile(size_wh_px, 2))
        box = detection.box_xyxy_px
        grown = np.concatenate([np.minimum(box[:2], around[:2]), np.maximum(box[2:], around[2:])])
        sides = np.tile(np.maximum(box[2:] - box[:2], 1e-9), 2)
        if (np.abs(grown - box) / sides).max() <= _LEAST_GROWTH:
            return None
        return PersonDetection(grown, detection.score)

    def confirmed(self, found: Sequence[FoundPerson]) -> list[FoundPerson]:
        """Return those of the detections that are people, in their order, with their new scores."""
        scores = [self.score(one.detection, one.keypoints) for one in found]
        kept: list[int] = []
        for row in sorted(range(len(scores)), key=lambda each: -scores[each]):
            if scores[row] < self.score_threshold:
                break
            detection, _, disowned = found[row]
            box = detection.box_xyxy_px
            better = (found[each].detection.box_xyxy_px for each in kept)
            within = max((common_area(box, other) for other in better), default=0.0)
            is_part = within > _MOSTLY * area(box)
            if detection.score < self.score_threshold:
                drop = is_part or disowned is not None
            elif detection.score < _CERTAIN_SCORE:
                drop = is_part and disowned in _ANOTHERS
            else:
                drop = False
            if not drop:
                kept.append(row)
        return [
            found[row]._replace(
                detection=PersonDetection(found[row].detection.box_xyxy_px, scores[row])
            )
            for row in sorted(kept)
        ]


def keypoint_score(person: PersonKeypoints) -> float:
    """Return the mean of the thirteen best scores of the body's seventeen keypoints."""
    return float(np.sort(person.scores[kp.BODY])[4:].mean())


def _logit(probability: float) -> float:
    """Return the logarithm of the odds, finite for 0 and 1 too."""
    within = min(max(probability, _LEAST_PROBABILITY), 1.0 - _LEAST_PROBABILITY)
    return math.log(within / (1.0 - within))
