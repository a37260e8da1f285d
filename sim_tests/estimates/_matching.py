"""Which estimate shows which person: boxes by their overlap, positions by their distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import linear_sum_assignment

from perception.arrays import FloatArray

from ._person_record import JudgedPerson

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


def affinity(truth: Sequence[JudgedPerson], estimates: Sequence[JudgedPerson]) -> FloatArray:
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
    truth: Sequence[JudgedPerson], wanted: Sequence[bool], estimates: Sequence[JudgedPerson]
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
    estimate: JudgedPerson, truth: Sequence[JudgedPerson], wanted: Sequence[bool]
) -> bool:
    box = estimate.box_xyxy_px
    return box is not None and any(
        float(box_cover(box[None], person.box_xyxy_px[None])[0, 0]) >= SAME
        for person, needed in zip(truth, wanted, strict=True)
        if not needed and person.box_xyxy_px is not None
    )
