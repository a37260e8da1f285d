"""Which estimate shows which person: boxes by their overlap, positions by their distance.

Average precision of a detector at IoU ≥ 0.5, as COCO computes it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import linear_sum_assignment

from perception.arrays import FloatArray

from ..records import PersonRecord

#: Two people are the same at this affinity and above: IoU for boxes.
SAME: Final = 0.5
#: Without boxes, positions this far apart have the affinity :data:`SAME`.
SAME_WITHIN_M: Final = 0.5
# A match with someone who had to be found is worth more than any number of others.
_WANTED_BONUS: Final = 10.0


def box_iou(first: FloatArray, second: FloatArray) -> FloatArray:
    """Intersection over union (N, M) of boxes (N, 4) and (M, 4); 0 for boxes without area."""
    shared, area_1, area_2 = _overlap(first, second)
    union = area_1[:, None] + area_2[None] - shared
    return np.divide(shared, union, out=np.zeros_like(shared), where=union > 0.0)


def box_cover(first: FloatArray, second: FloatArray) -> FloatArray:
    """Share (N, M) of each box of ``first`` that lies in each box of ``second``."""
    shared, area, _ = _overlap(first, second)
    return np.divide(shared, area[:, None], out=np.zeros_like(shared), where=area[:, None] > 0.0)


def _overlap(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    low = np.maximum(first[:, None, :2], second[None, :, :2])
    high = np.minimum(first[:, None, 2:], second[None, :, 2:])
    shared = np.prod(np.clip(high - low, 0.0, None), axis=2)
    areas = [
        np.prod(np.clip(boxes[:, 2:] - boxes[:, :2], 0.0, None), axis=1)
        for boxes in (first, second)
    ]
    return shared, areas[0], areas[1]


def affinity(truth: Sequence[PersonRecord], estimates: Sequence[PersonRecord]) -> FloatArray:
    """(T, E): IoU where both have boxes, else 1 − distance / (2 · :data:`SAME_WITHIN_M`)."""
    values = np.zeros((len(truth), len(estimates)))
    for row, person in enumerate(truth):
        for column, estimate in enumerate(estimates):
            one, other = person.box_xyxy_px, estimate.box_xyxy_px
            here, there = person.position_camera_m, estimate.position_camera_m
            if one is not None and other is not None:
                values[row, column] = box_iou(one[None], other[None])[0, 0]
            elif here is not None and there is not None:
                distance = float(np.linalg.norm(here - there))
                values[row, column] = max(1.0 - 0.5 * distance / SAME_WITHIN_M, 0.0)
    return values


@dataclass(frozen=True, slots=True)
class FrameMatch:
    """Who is who in one frame, by index.

    Attributes:
        pairs: (truth, estimate) of everybody who was found.
        missed: of the truth, those who had to be found and were not.
        surplus: estimates that show nobody, a person twice included.
    """

    pairs: tuple[tuple[int, int], ...]
    missed: tuple[int, ...]
    surplus: tuple[int, ...]


def match_frame(
    truth: Sequence[PersonRecord], wanted: Sequence[bool], estimates: Sequence[PersonRecord]
) -> FrameMatch:
    """Match one to one by the largest total affinity, people who had to be found first.

    An estimate that lies on somebody who did not have to be found (by half of its own box) is no
    surplus, as in COCO's treatment of ignored regions.

    Args:
        truth: the people who are there.
        wanted: for each, whether they had to be found.
        estimates: the people who were reported.
    """
    values = affinity(truth, estimates)
    bonus = np.where(np.asarray(wanted, dtype=bool), _WANTED_BONUS, 0.0)[:, None]
    good = values >= SAME
    rows, columns = linear_sum_assignment(np.where(good, values + bonus, 0.0), maximize=True)
    pairs = [
        (int(row), int(column))
        for row, column in zip(rows, columns, strict=True)
        if good[row, column]
    ]
    found, used = {row for row, _ in pairs}, {column for _, column in pairs}
    surplus = [
        column
        for column in range(len(estimates))
        if column not in used and not _on_ignored(estimates[column], truth, wanted)
    ]
    missed = [row for row in range(len(truth)) if wanted[row] and row not in found]
    return FrameMatch(tuple(pairs), tuple(missed), tuple(surplus))


def _on_ignored(
    estimate: PersonRecord, truth: Sequence[PersonRecord], wanted: Sequence[bool]
) -> bool:
    box = estimate.box_xyxy_px
    return box is not None and any(
        float(box_cover(box[None], person.box_xyxy_px[None])[0, 0]) >= SAME
        for person, needed in zip(truth, wanted, strict=True)
        if not needed and person.box_xyxy_px is not None
    )


_RECALLS: Final = np.linspace(0.0, 1.0, 101)

#: Truth, whether each had to be found, and estimates of one frame.
DetectionFrame = tuple[Sequence[PersonRecord], Sequence[bool], Sequence[PersonRecord]]


def average_precision(frames: Iterable[DetectionFrame]) -> float | None:
    """AP50 after COCO: precision, made monotone, averaged over 101 recalls from 0 to 1.

    In the order of their scores, estimates take the person with whom they overlap most, each
    person once. Those that only lie on somebody who did not have to be found count neither way.
    (pycocotools ``COCOeval``; at most all estimates of a frame instead of the best hundred.)

    Returns:
        AP in [0, 1], or None when nobody had to be found.
    """
    scores: list[float] = []
    hits: list[bool] = []
    wanted_count = 0
    for truth, wanted, estimates in frames:
        wanted_count += sum(wanted)
        values = affinity(truth, estimates)
        taken: set[int] = set()
        order = sorted(range(len(estimates)), key=lambda index: -estimates[index].score)
        for column in order:
            free = [
                row
                for row in range(len(truth))
                if wanted[row] and row not in taken and values[row, column] >= SAME
            ]
            if free:
                taken.add(max(free, key=lambda row: values[row, column]))
            elif _ignored(truth, wanted, estimates[column], values[:, column]):
                continue
            scores.append(estimates[column].score)
            hits.append(bool(free))
    if wanted_count == 0:
        return None
    if not scores:
        return 0.0
    # A stable sort, so that equal scores keep the order of their frames.
    ranked = np.asarray(hits)[np.argsort(-np.asarray(scores), kind="stable")]
    true = np.cumsum(ranked)
    recall = true / wanted_count
    precision = true / np.arange(1, len(ranked) + 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1]
    # A recall such as 57/100 must reach the step 0.57 whatever binary fractions say.
    place = np.searchsorted(recall, _RECALLS - 1.0e-9, side="left")
    reached = np.append(envelope, 0.0)[place]
    return float(reached.mean())


def _ignored(
    truth: Sequence[PersonRecord],
    wanted: Sequence[bool],
    estimate: PersonRecord,
    values: np.ndarray,
) -> bool:
    for row, person in enumerate(truth):
        if wanted[row]:
            continue
        if values[row] >= SAME:
            return True
        box, region = estimate.box_xyxy_px, person.box_xyxy_px
        if (
            box is not None
            and region is not None
            and box_cover(box[None], region[None])[0, 0] >= SAME
        ):
            return True
    return False
