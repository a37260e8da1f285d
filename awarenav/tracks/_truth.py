"""The truth about people, and the person that each track follows."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from perception.arrays import FloatArray

from ..errors import AwarenavError
from ._history import TrackHistory
from ._recording import Recording

#: A line through the truth is broken where a person is missing for longer.
MAX_TRUTH_GAP_S: Final = 0.5
# A track farther than this from a person does not follow the person.
_SAME_PERSON_M: Final = 1.0
# A true position belongs to a frame if their stamps differ by at most half a period of 20 Hz.
_SAME_TIME_S: Final = 0.026


@dataclass(frozen=True, slots=True, eq=False)
class TruePerson:
    """The truth about a person, with a row for every frame of the person.

    Attributes:
        id: of the person in the truth file.
        stamps_s: (N,) ascending.
        positions_odom_m: (N, 2).
        awareness: (N,) true α, NaN where the file has none.
    """

    id: int
    stamps_s: FloatArray
    positions_odom_m: FloatArray
    awareness: FloatArray


class TruthMatch(NamedTuple):
    """The person that a track is near in a frame, and the person's true α."""

    stamp_s: float
    person_id: int
    awareness: float


@dataclass(frozen=True, slots=True)
class Truth:
    """The people of a truth file, and the matches of each track, by the track's id."""

    people: tuple[TruePerson, ...]
    matches: dict[int, list[TruthMatch]]


def true_people(truth: Recording) -> tuple[TruePerson, ...]:
    """Return the people of a truth file in the order of their ids.

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
) -> dict[int, list[TruthMatch]]:
    """Match tracks to people in every frame; return the matches by the track's id.

    The matches of a frame are one to one, within 1 m, with the least sum of distances.
    """
    matches: dict[int, list[TruthMatch]] = {each.id: [] for each in histories}
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
        true = np.array([person.positions_odom_m[row] for person, row in present])
        tracked = np.array([position for _, position in at[stamp_s]])
        distance = np.linalg.norm(tracked[:, None] - true[None], axis=2)
        # Far pairs all cost the same, so that they cannot prevent the match of a near pair.
        cost = np.minimum(distance, 10.0 * _SAME_PERSON_M)
        for row, column in zip(*linear_sum_assignment(cost), strict=True):
            if distance[row, column] <= _SAME_PERSON_M:
                person, truth_row = present[column]
                alpha = float(person.awareness[truth_row])
                matches[at[stamp_s][row][0]].append(TruthMatch(stamp_s, person.id, alpha))
    return matches


def person_ids_text(matches: Sequence[TruthMatch]) -> str:
    """Return the ids of the people that a track has followed, most frequent first; else a dash."""
    counts = Counter(match.person_id for match in matches)
    return ", ".join(str(person) for person, _ in counts.most_common()) or "–"


def _row_at(person: TruePerson, stamp_s: float) -> int | None:
    """Return the row of a person at this stamp; None if there is none."""
    row = int(np.searchsorted(person.stamps_s, stamp_s))
    near = [index for index in (row - 1, row) if 0 <= index < len(person.stamps_s)]
    best = min(near, key=lambda index: abs(person.stamps_s[index] - stamp_s))
    return best if abs(person.stamps_s[best] - stamp_s) <= _SAME_TIME_S else None
