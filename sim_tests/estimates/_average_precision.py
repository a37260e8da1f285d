"""Average precision of a detector at IoU ≥ 0.5, as COCO computes it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from ._matching import SAME, affinity, box_cover
from ._person_record import JudgedPerson

_RECALLS: Final = np.linspace(0.0, 1.0, 101)

#: Truth, whether each had to be found, and estimates of one frame.
DetectionFrame = tuple[Sequence[JudgedPerson], Sequence[bool], Sequence[JudgedPerson]]


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
    truth: Sequence[JudgedPerson],
    wanted: Sequence[bool],
    estimate: JudgedPerson,
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
