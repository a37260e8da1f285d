"""Scores of awareness over time against simulated truth.

A person is aware at a true α of at least 0.5 and unaware below 0.2. In between, neither answer
counts as a mistake.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ._attention import BoolArray, FloatArray

AWARE, UNAWARE = 0.5, 0.2
FALSE_SHARE: Final = 0.01
UNSEEN_S: Final = 0.3
#: A person looks away when α passes from aware to unaware within this time.
TURN_AWAY_S: Final = 0.4


@dataclass(frozen=True, slots=True)
class AwarenessScores:
    """Figures of one filter; shares in [0, 1].

    Attributes:
        coverage: of frames with evidence, share whose true α is at least the lower bound.
        coverage_partial: the same where 0 < true α.
        false_share: of frames with an unaware person, share above the threshold.
        false_unseen: of frames with an unaware person unseen for more than 0.3 s, share above the
            threshold.
        above_unseen: the same for aware and unaware people.
        recall: of frames that show an aware person, share above the threshold.
        onset_s: median time from the beginning of awareness, in sight, to the threshold; spells
            that end unrecognised count as infinite.
        onset_found: share of those spells that are recognised.
        release_s: 95th percentile of the time until the bound falls to the threshold, after a
            person above it turns away or goes out of sight.
    """

    coverage: float
    coverage_partial: float
    false_share: float
    false_unseen: float
    above_unseen: float
    recall: float
    onset_s: float
    onset_found: float
    release_s: float


def threshold_for(lower: FloatArray, truth: FloatArray, false_share: float = FALSE_SHARE) -> float:
    """Return the threshold that ``false_share`` of the frames with an unaware person exceed."""
    return float(np.quantile(lower[truth < UNAWARE], 1.0 - false_share))


def score(
    stamps_s: FloatArray,
    truth: FloatArray,
    seen: BoolArray,
    evident: BoolArray,
    lower: FloatArray,
    threshold: float,
    in_sight: BoolArray | None = None,
) -> AwarenessScores:
    """Return the scores of a lower bound; stamps (T,), everything else (T, N).

    Recall and onset are about the frames ``in_sight``: by default those that show the person, so
    that a missed frame does not count.
    """
    in_sight = seen if in_sight is None else in_sight
    above = lower > threshold
    long_unseen = time_unseen_s(stamps_s, seen) > UNSEEN_S
    covered = truth >= lower
    onsets = onset_times_s(stamps_s, truth, in_sight, above)
    releases = release_times_s(stamps_s, truth, seen, above)
    return AwarenessScores(
        coverage=_share(covered, evident),
        coverage_partial=_share(covered, evident & (truth > 0.0)),
        false_share=_share(above, truth < UNAWARE),
        false_unseen=_share(above, long_unseen & (truth < UNAWARE)),
        above_unseen=_share(above, long_unseen),
        recall=_share(above, in_sight & (truth >= AWARE)),
        onset_s=float(np.percentile(onsets, 50, method="higher")) if len(onsets) else math.nan,
        onset_found=float(np.isfinite(onsets).mean()) if len(onsets) else math.nan,
        release_s=float(np.percentile(releases, 95)) if len(releases) else math.nan,
    )


def time_unseen_s(stamps_s: FloatArray, seen: BoolArray) -> FloatArray:
    """Return the time (T, N) since each person was last seen; infinite before the first time."""
    last = np.where(seen, stamps_s[:, None], -math.inf)
    return stamps_s[:, None] - np.maximum.accumulate(last, axis=0)


def onset_times_s(
    stamps_s: FloatArray, truth: FloatArray, seen: BoolArray, above: BoolArray
) -> FloatArray:
    """Return times from the last frame before awareness to the first above the threshold.

    Spells that begin in sight and below the threshold count. The time is infinite for a spell that
    ends before it is recognised.
    """
    times = []
    aware = truth >= AWARE
    begins = aware[1:] & ~aware[:-1] & seen[1:] & ~above[:-1]
    for row, person in zip(*np.nonzero(begins), strict=True):
        first = row + 1
        ends = _first(~aware[first:, person])
        reached = _first(above[first:, person])
        if reached < ends:
            times.append(stamps_s[first + reached] - stamps_s[row])
        elif first + ends < len(stamps_s):
            times.append(math.inf)
    return np.array(times)


def release_times_s(
    stamps_s: FloatArray, truth: FloatArray, seen: BoolArray, above: BoolArray
) -> FloatArray:
    """Return times from the end of awareness, or of sight, to the first frame not above threshold.

    Awareness ends when true α falls from ``AWARE`` to below ``UNAWARE`` within ``TURN_AWAY_S``.
    Sight ends when the person is unseen for longer than ``UNSEEN_S``. Only frames above the
    threshold at that instant count.
    """
    times = []
    turning = math.ceil(TURN_AWAY_S / (stamps_s[1] - stamps_s[0]))
    hidden = math.ceil(UNSEEN_S / (stamps_s[1] - stamps_s[0])) + 1
    aware, unaware = truth >= AWARE, truth < UNAWARE
    for row, person in zip(*np.nonzero(above), strict=True):
        ahead = slice(row + 1, row + 1 + turning)
        turns = (aware[row, person] and not aware[row + 1 :, person][:1].any()) and unaware[
            ahead, person
        ].any()
        after = seen[row + 1 : row + 1 + hidden, person]
        leaves = seen[row, person] and len(after) == hidden and not after.any()
        if (turns or leaves) and row + 1 < len(stamps_s):
            falls = _first(~above[row + 1 :, person])
            back = _first(aware[row + 1 :, person]) if turns else math.inf
            if turns and back < falls:
                continue  # the person looks again: nothing to release
            if row + 1 + falls < len(stamps_s):
                times.append(stamps_s[row + 1 + falls] - stamps_s[row])
    return np.array(times)


def _first(flags: BoolArray) -> int:
    """Return the index of the first True, or the length."""
    return int(np.argmax(flags)) if flags.any() else len(flags)


def _share(flags: BoolArray, among: BoolArray) -> float:
    return float(flags[among].mean()) if among.any() else math.nan
