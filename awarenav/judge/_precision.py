"""COCO's average precision of detection, and its interval over frames."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..records import PersonRecord
from ._intervals import MIN_RESAMPLED, Ends, bootstrap_ends, share_interval
from ._matching import MIN_AFFINITY, affinity, covers_ignored

_RECALLS: Final = np.linspace(0.0, 1.0, 101)
# One resample of ten thousand estimates takes a millisecond.
_RESAMPLES: Final = 1000

#: Truth, whether each person had to be found, and estimates of a frame.
DetectionFrame = tuple[Sequence[PersonRecord], Sequence[bool], Sequence[PersonRecord]]


def average_precision(frames: Iterable[DetectionFrame]) -> float | None:
    """Return COCO's AP50: the monotone precision, averaged over 101 recalls from 0 to 1.

    In the order of their scores, estimates match the person with whom they overlap most, each
    person once. An estimate that only lies on people who did not have to be found is left out
    (pycocotools ``COCOeval``, but with all estimates of a frame instead of the best hundred).

    Returns:
        AP in [0, 1], or None if nobody had to be found.
    """
    return precision_with_interval(frames, intervals=False)[0]


def precision_with_interval(
    frames: Iterable[DetectionFrame], *, intervals: bool = True
) -> tuple[float | None, Ends]:
    """Return :func:`average_precision` and its bootstrap interval.

    Frames are resampled whole. Fewer than ten frames bound nothing but 0 and 1. If all resamples
    give the same precision, as for a perfect detector, the interval is that of the recall.

    Args:
        frames: truth and estimates.
        intervals: False leaves the interval from 0 to 1.
    """
    ranked = _Ranked.of(frames)
    value = ranked.precision(np.ones(len(ranked.required)))
    n = len(ranked.required)
    if value is None or not intervals or n < MIN_RESAMPLED:
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
    values = affinity(truth, estimates)
    taken: set[int] = set()
    found = []
    for column in sorted(range(len(estimates)), key=lambda index: -estimates[index].score):
        free = [
            row
            for row in range(len(truth))
            if required[row] and row not in taken and values[row, column] >= MIN_AFFINITY
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
    return covers_ignored(estimate, truth, required) or any(
        value >= MIN_AFFINITY for value, needed in zip(values, required, strict=True) if not needed
    )
