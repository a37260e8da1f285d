"""Where a person truly was, and how aware.

The truth beside tracks: who each track really was at each instant.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import linear_sum_assignment

from perception.arrays import FloatArray

from ..errors import AwarenavError
from ._history import TrackHistory
from ._recording import Recording


@dataclass(frozen=True, slots=True, eq=False)
class TruePerson:
    """The truth about one person, with a row for every frame that holds them.

    Attributes:
        id: of the person in the truth file.
        stamps_s: (N,) ascending.
        positions_odom_m: (N, 2).
        awareness: (N,) true α, NaN where the file does not say.
    """

    id: int
    stamps_s: FloatArray
    positions_odom_m: FloatArray
    awareness: FloatArray


# A track farther than this from a person is not that person's.
_SAME_PERSON_M: Final = 1.0
# The truth of another instant is no truth; half a frame at 20 Hz.
_SAME_TIME_S: Final = 0.026
#: Stamp, person and true α of the frames at which a track is near a person.
Matched = list[tuple[float, int, float]]
#: Where the truth is silent about a person for longer, a line through it is broken.
SILENT_S: Final = 0.5


@dataclass(frozen=True, slots=True)
class Truth:
    """The truth beside tracks: its people, and who each track was, by the track's id."""

    people: tuple[TruePerson, ...]
    matches: dict[int, Matched]


def matched_truth(histories: Sequence[TrackHistory], truth: Recording) -> Truth:
    """Read the people of a truth file and tell who each track was.

    Raises:
        AwarenavError: for people without ids.
    """
    people = true_people(truth)
    return Truth(people, match_truth(histories, people))


def true_people(truth: Recording) -> tuple[TruePerson, ...]:
    """The people of a truth file in the order of their ids.

    Raises:
        AwarenavError: for people without ids.
    """
    rows: dict[int, list[tuple[float, float, float, float]]] = {}
    for frame in sorted(truth.frames, key=lambda frame: frame.stamp_s):
        positions = frame.positions_odom_m()
        for id, seen, position in zip(frame.ids, frame.observations, positions, strict=True):
            if id is None:
                raise AwarenavError(
                    f"{truth.path}, frame {frame.name!r}: people of a truth file need an id"
                )
            alpha = math.nan if seen.awareness is None else seen.awareness
            rows.setdefault(id, []).append((frame.stamp_s, *position.tolist(), alpha))
    people = []
    for id in sorted(rows):
        table = np.array(rows[id])
        people.append(TruePerson(id, table[:, 0], table[:, 1:3], table[:, 3]))
    return tuple(people)


def match_truth(
    histories: Sequence[TrackHistory], people: Sequence[TruePerson]
) -> dict[int, Matched]:
    """Stamp, person and true α for every frame at which a track is near a person, by track id.

    One track is one person at a time, so that the distances sum to the least; within 1 m.
    """
    matches: dict[int, Matched] = {each.id: [] for each in histories}
    at: dict[float, list[tuple[int, FloatArray]]] = {}
    for history in histories:
        for sample in history.frames:
            at.setdefault(sample.stamp_s, []).append((history.id, sample.position_odom_m))
    for stamp_s in sorted(at):
        present = [
            (person, row) for person in people if (row := _row_at(person, stamp_s)) is not None
        ]
        if not present:
            continue
        places = np.array([person.positions_odom_m[row] for person, row in present])
        tracked = np.array([position for _, position in at[stamp_s]])
        distance = np.linalg.norm(tracked[:, None] - places[None], axis=2)
        # Beyond the gate all pairs are equally wrong, so they cannot pull a near pair apart.
        cost = np.minimum(distance, 10.0 * _SAME_PERSON_M)
        for row, column in zip(*linear_sum_assignment(cost), strict=True):
            if distance[row, column] <= _SAME_PERSON_M:
                person, truth_row = present[column]
                alpha = float(person.awareness[truth_row])
                matches[at[stamp_s][row][0]].append((stamp_s, person.id, alpha))
    return matches


def who(matched: Sequence[tuple[float, int, float]]) -> str:
    """The people that a track was, the most frequent first; a dash for nobody."""
    counts = Counter(person for _, person, _ in matched)
    return ", ".join(str(person) for person, _ in counts.most_common()) or "–"


def _row_at(person: TruePerson, stamp_s: float) -> int | None:
    """The row of a person that is of this instant."""
    row = int(np.searchsorted(person.stamps_s, stamp_s))
    near = [index for index in (row - 1, row) if 0 <= index < len(person.stamps_s)]
    best = min(near, key=lambda index: abs(person.stamps_s[index] - stamp_s))
    return best if abs(person.stamps_s[best] - stamp_s) <= _SAME_TIME_S else None
