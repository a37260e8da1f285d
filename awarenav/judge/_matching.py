"""Matches estimates to people by box or position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import linear_sum_assignment

from perception.arrays import FloatArray

from ..records import PersonRecord

#: An estimate and a person with this affinity or more can match: the IoU of their boxes.
MIN_AFFINITY: Final = 0.5
# Without boxes, positions at this distance have the affinity MIN_AFFINITY.
_MAX_DISTANCE_M: Final = 0.5
# A match with a person who had to be found counts more than any number of others.
_REQUIRED_BONUS: Final = 10.0


def box_iou(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the intersection over union (N, M) of boxes (N, 4) and (M, 4); 0 without area."""
    shared, area_1, area_2 = _overlap(first, second)
    union = area_1[:, None] + area_2[None] - shared
    return np.divide(shared, union, out=np.zeros_like(shared), where=union > 0.0)


def box_cover(first: FloatArray, second: FloatArray) -> FloatArray:
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


def affinity(truth: Sequence[PersonRecord], estimates: Sequence[PersonRecord]) -> FloatArray:
    """Return (T, E): the IoU if both have boxes, else 1 − distance / 1 m, and 0 beyond 1 m."""
    values = np.zeros((len(truth), len(estimates)))
    for row, person in enumerate(truth):
        for column, estimate in enumerate(estimates):
            one, other = person.box_xyxy_px, estimate.box_xyxy_px
            here, there = person.position_camera_m, estimate.position_camera_m
            if one is not None and other is not None:
                values[row, column] = box_iou(one[None], other[None])[0, 0]
            elif here is not None and there is not None:
                distance = float(np.linalg.norm(here - there))
                values[row, column] = max(1.0 - 0.5 * distance / _MAX_DISTANCE_M, 0.0)
    return values


@dataclass(frozen=True, slots=True)
class FrameMatch:
    """The matches in a frame, by index.

    Attributes:
        pairs: (truth, estimate) of everybody who was found.
        missed: people who had to be found and were not.
        false_positives: estimates of nobody; also a second estimate of a person.
    """

    pairs: tuple[tuple[int, int], ...]
    missed: tuple[int, ...]
    false_positives: tuple[int, ...]


def match_frame(
    truth: Sequence[PersonRecord], required: Sequence[bool], estimates: Sequence[PersonRecord]
) -> FrameMatch:
    """Match one to one by the largest sum of affinities, people who had to be found first.

    An estimate is no false positive if at least half of its box lies on a person who did not have
    to be found, as with COCO's ignored regions.

    Args:
        truth: the people in the frame.
        required: for each of them, whether they had to be found.
        estimates: the estimated people.
    """
    values = affinity(truth, estimates)
    bonus = np.where(np.asarray(required, dtype=bool), _REQUIRED_BONUS, 0.0)[:, None]
    good = values >= MIN_AFFINITY
    rows, columns = linear_sum_assignment(np.where(good, values + bonus, 0.0), maximize=True)
    pairs = [
        (int(row), int(column))
        for row, column in zip(rows, columns, strict=True)
        if good[row, column]
    ]
    found, used = {row for row, _ in pairs}, {column for _, column in pairs}
    false_positives = [
        column
        for column in range(len(estimates))
        if column not in used and not covers_ignored(estimates[column], truth, required)
    ]
    missed = [row for row in range(len(truth)) if required[row] and row not in found]
    return FrameMatch(tuple(pairs), tuple(missed), tuple(false_positives))


def covers_ignored(
    estimate: PersonRecord, truth: Sequence[PersonRecord], required: Sequence[bool]
) -> bool:
    """Return whether half of an estimate's box lies on a person who did not have to be found."""
    box = estimate.box_xyxy_px
    return box is not None and any(
        float(box_cover(box[None], person.box_xyxy_px[None])[0, 0]) >= MIN_AFFINITY
        for person, needed in zip(truth, required, strict=True)
        if not needed and person.box_xyxy_px is not None
    )
