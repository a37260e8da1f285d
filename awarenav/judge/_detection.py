"""Matches estimates to people, and COCO's average precision with its interval over frames."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from perception.arrays import FloatArray

from ..intervals import MIN_RESAMPLED, Ends, bootstrap_ends, share_interval
from ..records import PersonRecord

# An estimate and a person with this affinity or more can match: the IoU of their boxes.
_MIN_AFFINITY: Final = 0.5
# Without boxes, positions at this distance have the affinity _MIN_AFFINITY.
_MAX_DISTANCE_M: Final = 0.5
# A match with a person who had to be found counts more than any number of others.
_REQUIRED_BONUS: Final = 10.0
_RECALLS: Final = np.linspace(0.0, 1.0, 101)
# One resample of ten thousand estimates takes a millisecond.
_RESAMPLES: Final = 1000

#: Truth, whether each person had to be found, and estimates of a frame.
DetectionFrame = tuple[Sequence[PersonRecord], Sequence[bool], Sequence[PersonRecord]]


def _iou(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the intersection over union (N, M) of boxes (N, 4) and (M, 4); 0 without area."""
    shared, area_1, area_2 = _overlap(first, second)
    union = area_1[:, None] + area_2[None] - shared
    return np.divide(shared, union, out=np.zeros_like(shared), where=union > 0.0)


def _cover(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the share (N, M) of each box of ``first`` that lies in each box of ``second``."""
    shared, area, _ = _overlap(first, second)
    return np.divide(shared, area[:, None], out=np.zeros_like(shared), where=area[:, None] > 0.0)


def _overlap(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the areas that the boxes share (N, M), and their own areas (N,) and (M,)."""
    low = np.maximum(first[:, None, :2], second[None, :, :2])
    high = np.minimum(first[:, None, 2:], second[None, :, 2:])
    shared = np.prod(np.clip(high - low, 0.0, None), axis=2)
    areas = [
        np.prod(np.clip(boxes[:, 2:] - boxes[:, :2], 0.0, None), axis=1)
        for boxes in (first, second)
    ]
    return shared, areas[0], areas[1]


def _affinity(truth: Sequence[PersonRecord], estimates: Sequence[PersonRecord]) -> FloatArray:
    """Return (T, E): the IoU if both have boxes, else 1 − distance / 1 m, and 0 beyond 1 m."""
    values = np.zeros((len(truth), len(estimates)))
    for row, person in enumerate(truth):
        for column, estimate in enumerate(estimates):
            one, other = person.box_xyxy_px, estimate.box_xyxy_px
            here, there = person.position_camera_m, estimate.position_camera_m
            if one is not None and other is not None:
                values[row, column] = _iou(one[None], other[None])[0, 0]
            elif here is not None and there is not None:
                distance = float(np.linalg.norm(here - there))
                values[row, column] = max(1.0 - 0.5 * distance / _MAX_DISTANCE_M, 0.0)
    return values


def match_frame(
    truth: Sequence[PersonRecord], required: Sequence[bool], estimates: Sequence[PersonRecord]
) -> tuple[dict[int, int], int]:
    """Match one to one by the largest sum of affinities, people who had to be found first.

    An estimate is no false positive if at least half of its box lies on a person who did not have
    to be found, as with COCO's ignored regions.

    Args:
        truth: the people in the frame.
        required: for each of them, whether they had to be found.
        estimates: the estimated people.

    Returns:
        The index of the estimate of everybody who was found, by that of the person; and the number
        of estimates of nobody, to which a second estimate of a person belongs.
    """
    values = _affinity(truth, estimates)
    bonus = np.where(np.asarray(required, dtype=bool), _REQUIRED_BONUS, 0.0)[:, None]
    good = values >= _MIN_AFFINITY
    rows, columns = linear_sum_assignment(np.where(good, values + bonus, 0.0), maximize=True)
    found = {
        int(row): int(column)
        for row, column in zip(rows, columns, strict=True)
        if good[row, column]
    }
    false_positives = sum(
        column not in found.values() and not _covers_ignored(estimate, truth, required)
        for column, estimate in enumerate(estimates)
    )
    return found, false_positives


def _covers_ignored(
    estimate: PersonRecord, truth: Sequence[PersonRecord], required: Sequence[bool]
) -> bool:
    """Return whether half of an estimate's box lies on a person who did not have to be found."""
    box = estimate.box_xyxy_px
    return box is not None and any(
        float(_cover(box[None], person.box_xyxy_px[None])[0, 0]) >= _MIN_AFFINITY
        for person, needed in zip(truth, required, strict=True)
        if not needed and person.box_xyxy_px is not None
    )


def precision_with_interval(frames: Iterable[DetectionFrame]) -> tuple[float | None, Ends]:
    """Return COCO's AP50 and its bootstrap interval.

    It is the monotone precision, averaged over 101 recalls from 0 to 1; None if nobody had to be
    found. In the order of their scores, estimates match the person with whom they overlap most,
    each person once. An estimate that only lies on people who did not have to be found is left out
    (pycocotools ``COCOeval``, but with all estimates of a frame instead of the best hundred).

    Frames are resampled whole. Fewer than ten frames bound nothing but 0 and 1. If all resamples
    give the same precision, as for a perfect detector, the interval is that of the recall.
    """
    ranked = _Ranked.of(frames)
    value = ranked.precision(np.ones(len(ranked.required)))
    n = len(ranked.required)
    if value is None or n < MIN_RESAMPLED:
        return value, (0.0, 1.0)
    rng = np.random.default_rng(0)
    drawn = (
        ranked.precision(np.bincount(rng.integers(0, n, n), minlength=n).astype(np.float64))
        for _ in range(_RESAMPLES)
    )
    resampled = np.array([each for each in drawn if each is not None])
    if float(np.ptp(resampled)) < 1.0e-9:
        return value, share_interval(int(ranked.hits.sum()), int(ranked.required.sum()))
    return value, bootstrap_ends(value, resampled)


@dataclass(frozen=True, slots=True, eq=False)
class _Ranked:
    """The estimates of all frames that count, the surest first, and the people to be found.

    Attributes:
        frames: (M,) number of the frame of each estimate.
        hits: (M,) whether the estimate found a person who had to be found.
        required: (F,) number of people in each frame who had to be found.
    """

    frames: NDArray[np.intp]
    hits: NDArray[np.bool_]
    required: FloatArray

    @classmethod
    def of(cls, frames: Iterable[DetectionFrame]) -> _Ranked:
        scores: list[float] = []
        hits: list[bool] = []
        numbers: list[int] = []
        counts: list[int] = []
        for number, (truth, required, estimates) in enumerate(frames):
            counts.append(sum(required))
            for score, hit in _hits(truth, required, estimates):
                scores.append(score)
                hits.append(hit)
                numbers.append(number)
        # Stable, so that equal scores keep the order of their frames.
        order = np.argsort(-np.asarray(scores, dtype=np.float64), kind="stable")
        return cls(
            np.asarray(numbers, dtype=np.intp)[order],
            np.asarray(hits, dtype=np.bool_)[order],
            np.asarray(counts, dtype=np.float64),
        )

    def precision(self, weights: FloatArray) -> float | None:
        """Return the average precision with each frame counted ``weights`` (F,) times."""
        wanted = float(weights @ self.required)
        if wanted == 0.0:
            return None
        if not len(self.hits):
            return 0.0
        counts = weights[self.frames]
        true, everything = np.cumsum(counts * self.hits), np.cumsum(counts)
        recall = true / wanted
        precision = np.divide(true, everything, out=np.zeros_like(true), where=everything > 0.0)
        envelope = np.maximum.accumulate(precision[::-1])[::-1]
        # A recall such as 57/100 must reach the step 0.57 despite rounding.
        place = np.searchsorted(recall, _RECALLS - 1.0e-9, side="left")
        reached = np.append(envelope, 0.0)[place]
        return float(reached.mean())


def _hits(
    truth: Sequence[PersonRecord], required: Sequence[bool], estimates: Sequence[PersonRecord]
) -> list[tuple[float, bool]]:
    """Return score and success of the estimates of a frame that count, the surest first."""
    values = _affinity(truth, estimates)
    taken: set[int] = set()
    found = []
    for column in sorted(range(len(estimates)), key=lambda index: -estimates[index].score):
        free = [
            row
            for row in range(len(truth))
            if required[row] and row not in taken and values[row, column] >= _MIN_AFFINITY
        ]
        if free:
            taken.add(max(free, key=lambda row: values[row, column]))
        elif _matches_ignored(truth, required, estimates[column], values[:, column]):
            continue
        found.append((estimates[column].score, bool(free)))
    return found


def _matches_ignored(
    truth: Sequence[PersonRecord],
    required: Sequence[bool],
    estimate: PersonRecord,
    values: FloatArray,
) -> bool:
    """Return whether an estimate matches, or lies on, someone who did not have to be found."""
    return _covers_ignored(estimate, truth, required) or any(
        value >= _MIN_AFFINITY for value, needed in zip(values, required, strict=True) if not needed
    )
